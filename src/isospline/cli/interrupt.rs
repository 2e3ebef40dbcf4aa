//! Ctrl-C: stages stop after the tasks in hand, all else ends at once.

use crate::cli::failure::STOPPED;
use crate::cli::output::{note, say};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user asked to stop, and whether anything listens.
#[derive(Debug)]
pub(crate) struct Interrupt {
    raised: AtomicBool,
    heard: AtomicBool,
    json: AtomicBool,
}

impl Interrupt {
    pub(crate) const fn new() -> Self {
        Self {
            raised: AtomicBool::new(false),
            heard: AtomicBool::new(false),
            json: AtomicBool::new(false),
        }
    }

    /// Asks the stages to stop; ends the process where none run, or if asked twice.
    ///
    /// Files are put in their places whole, and what is begun has a journal of what is done, so
    /// an end at any moment loses the tasks in hand alone.
    pub(crate) fn raise(&self) {
        if self.raised.swap(true, Ordering::SeqCst) || !self.heard.load(Ordering::SeqCst) {
            let told = "stopped; run the same command to go on";
            if self.is_json() {
                let exit = STOPPED;
                let error = serde_json::json!({
                    "event": "error", "code": "stopped", "exit": exit, "message": told,
                });
                // A closed pipe cannot be told anything.
                drop(say(&error.to_string()));
            }
            note(told);
            std::process::exit(i32::from(STOPPED));
        }
        if std::io::stderr().is_terminal() {
            // Below the bars.
            note("");
        }
        note("stopping after the work in hand; Ctrl-C again ends at once");
    }

    /// Lets an end at once be told as a line of JSON too.
    pub(crate) fn tells_json(&self, json: bool) {
        self.json.store(json, Ordering::SeqCst);
    }

    /// Whether it is.
    pub(crate) fn is_json(&self) -> bool {
        self.json.load(Ordering::SeqCst)
    }

    /// Does work that looks at the flag itself.
    pub(crate) fn heard_by<T>(&self, work: impl FnOnce(&AtomicBool) -> T) -> T {
        self.heard.store(true, Ordering::SeqCst);
        let done = work(&self.raised);
        self.heard.store(false, Ordering::SeqCst);
        done
    }
}
