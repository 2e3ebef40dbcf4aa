//! The end of a process whose memory has run out.
//!
//! What is finished has its name in the store and what is begun its journal, so nothing is to be
//! saved. Words are put together in place and written past the locks of the standard streams:
//! another thread may hold them and wait for memory too.

use crate::cli::failure::{MORE_MEMORY, NO_MEMORY};
use std::fs::File;
use std::io::{Cursor, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Whether a thread is at it.
static ENDS: AtomicBool = AtomicBool::new(false);

/// Room for a message.
const LONGEST: usize = 512;

/// Tells of it on standard error, as the last line of `--json` too, and ends the process.
pub(crate) fn end(bytes: usize, json: bool) -> ! {
    while ENDS.swap(true, Ordering::SeqCst) {
        // One message is enough; that thread ends this one.
        std::thread::sleep(Duration::from_secs(1));
    }
    let exit = NO_MEMORY;
    if json {
        write_to(Stream::Out, |line| {
            writeln!(
                line,
                "{{\"event\":\"error\",\"code\":\"no-memory\",\"exit\":{exit},\"message\":\
                 \"no memory for {bytes} bytes more\",\"place\":null,\"help\":\"{MORE_MEMORY}\"}}"
            )
        });
    }
    write_to(Stream::Error, |line| {
        writeln!(line, "no-memory\n\n  × no memory for {bytes} bytes more\n  help: {MORE_MEMORY}\n")
    });
    std::process::exit(i32::from(exit))
}

/// A standard stream.
#[derive(Clone, Copy)]
enum Stream {
    Out,
    Error,
}

/// Writes a message as far as that can be done.
fn write_to(stream: Stream, message: impl FnOnce(&mut Cursor<&mut [u8]>) -> std::io::Result<()>) {
    let mut room = [0; LONGEST];
    let mut line = Cursor::new(&mut room[..]);
    // What does not fit is cut off.
    drop(message(&mut line));
    let length = line.position() as usize;
    if let Some(mut file) = unlocked(stream) {
        // A closed pipe cannot be told anything.
        drop(file.write_all(&room[..length]));
    }
}

/// A handle of its own.
#[cfg(unix)]
fn unlocked(stream: Stream) -> Option<File> {
    use std::os::fd::AsFd;
    let handle = match stream {
        Stream::Out => std::io::stdout().as_fd().try_clone_to_owned(),
        Stream::Error => std::io::stderr().as_fd().try_clone_to_owned(),
    };
    handle.ok().map(File::from)
}

/// A handle of its own.
#[cfg(windows)]
fn unlocked(stream: Stream) -> Option<File> {
    use std::os::windows::io::AsHandle;
    let handle = match stream {
        Stream::Out => std::io::stdout().as_handle().try_clone_to_owned(),
        Stream::Error => std::io::stderr().as_handle().try_clone_to_owned(),
    };
    handle.ok().map(File::from)
}
