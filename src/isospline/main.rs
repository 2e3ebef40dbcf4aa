//! The command line.

mod cli;

use clap::Parser;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// Raised by Ctrl-C: the run ends after the tasks in hand.
static STOP: AtomicBool = AtomicBool::new(false);

fn main() -> ExitCode {
    let args = cli::args::Cli::parse();
    // Without the handler Ctrl-C ends the process at once: no file is left half-written then
    // either, so a system that refuses it is no error.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(cli::failure::STOPPED));
        }
    });
    ExitCode::from(cli::dispatch(&args, &STOP))
}
