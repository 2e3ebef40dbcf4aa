//! The command line.

mod cli;

use clap::Parser;
use isospline_artifact::Telling;
use std::panic::{PanicHookInfo, catch_unwind, set_hook};
use std::process::ExitCode;

/// Raised by Ctrl-C.
static INTERRUPT: cli::interrupt::Interrupt = cli::interrupt::Interrupt::new();

/// The allocator of all but the library's users, who choose their own.
#[global_allocator]
static ALLOCATOR: Telling = Telling::new(|bytes| cli::exhausted::end(bytes, INTERRUPT.is_json()));

fn main() -> ExitCode {
    let args = cli::args::Cli::parse();
    // Without the handler Ctrl-C ends the process at once: no file is left half-written then
    // either, so a system that refuses it is no error.
    let _ = ctrlc::set_handler(|| INTERRUPT.raise());
    outlive_the_limit_of_file_sizes();
    set_hook(Box::new(tell_panic));
    let done = catch_unwind(move || cli::dispatch(&args, &INTERRUPT));
    ExitCode::from(done.unwrap_or(cli::failure::BUG))
}

/// Lets a write beyond `ulimit -f` be an error, with the file's name, in place of a kill.
fn outlive_the_limit_of_file_sizes() {
    #[cfg(unix)]
    {
        use signal_hook::consts::SIGXFSZ;
        use std::sync::{Arc, atomic::AtomicBool};
        // Whoever does not listen is killed; the write that fails tells the rest. A system that
        // refuses the listener leaves things as they are.
        drop(signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))));
    }
}

/// A panic is a bug; one line is enough to find it.
fn tell_panic(info: &PanicHookInfo<'_>) {
    let message = info.payload_as_str().unwrap_or("no message").replace('\n', " ");
    let place = info.location().map(|at| format!(" at {}:{}", at.file(), at.line()));
    cli::output::note(&format!("bug of isospline: {message}{}", place.unwrap_or_default()));
}
