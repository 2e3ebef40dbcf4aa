//! Ctrl-C: stages stop after the tasks in hand, all else ends at once.

use crate::cli::failure::STOPPED;
use crate::cli::output::note;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user asked to stop, and whether anything listens.
#[derive(Debug)]
pub(crate) struct Interrupt {
    raised: AtomicBool,
    heard: AtomicBool,
}

impl Interrupt {
    pub(crate) const fn new() -> Self {
        Self { raised: AtomicBool::new(false), heard: AtomicBool::new(false) }
    }

    /// Asks the stages to stop; ends the process where none run, or if asked twice.
    ///
    /// Files are put in their places whole, so an end at any moment leaves none half-written.
    pub(crate) fn raise(&self) {
        if self.raised.swap(true, Ordering::SeqCst) || !self.heard.load(Ordering::SeqCst) {
            note("stopped");
            std::process::exit(i32::from(STOPPED));
        }
        note("stopping after the work in hand; Ctrl-C again ends at once");
    }

    /// Does work that looks at the flag itself.
    pub(crate) fn heard_by<T>(&self, work: impl FnOnce(&AtomicBool) -> T) -> T {
        self.heard.store(true, Ordering::SeqCst);
        let done = work(&self.raised);
        self.heard.store(false, Ordering::SeqCst);
        done
    }
}
