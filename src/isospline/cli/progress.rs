//! What a run tells while it goes on: a bar on a terminal, lines elsewhere, JSON if asked.

use crate::cli::output::{duration, note, say};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use isospline_pipeline::Event;
use isospline_stage::Counters;
use std::io::IsTerminal;

/// Shows events.
#[derive(Debug)]
pub(crate) struct Progress {
    json: bool,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Shows events as JSON lines on standard output, or for people on standard error.
    pub(crate) fn new(json: bool) -> Self {
        let bar = (!json && std::io::stderr().is_terminal()).then(new_bar);
        Self { json, bar }
    }

    /// Shows one event.
    pub(crate) fn show(&self, event: &Event) {
        if self.json {
            let line = serde_json::to_string(event).expect("invariant: events are plain data");
            // A full disk under a redirected log must not end the run.
            let _ = say(&line);
            return;
        }
        match event {
            Event::StageStarted { stage, .. } => self.begin(stage),
            Event::Progress { done, of, .. } => self.advance(*done, *of),
            Event::StageFinished { stage, seconds, counters, .. } => {
                self.line(&format!("{stage:<15}{:>9}{}", duration(*seconds), remarks(counters)));
            }
            Event::Damaged { stage, reason, .. } => {
                self.line(&format!("{stage:<15}is made again: {reason}"));
            }
            Event::Resumed { stage, done, of, .. } => {
                self.line(&format!("{stage:<15}goes on: {done} of {of} tasks are there"));
            }
            Event::Discarded { stage, reason, .. } => {
                self.line(&format!("{stage:<15}what was begun is not used: {reason}"));
            }
            Event::Fresh { .. } | Event::Stored { .. } => {}
        }
    }

    /// Takes the bar away.
    pub(crate) fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }

    fn begin(&self, stage: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(stage.to_owned());
            bar.set_position(0);
        }
    }

    fn advance(&self, done: u64, of: u64) {
        if let Some(bar) = &self.bar {
            bar.set_length(of);
            bar.set_position(done);
        }
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| note(text)),
            None => note(text),
        }
    }
}

fn new_bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr_with_hz(15));
    let style = ProgressStyle::with_template("{msg:<15} {wide_bar} {percent:>3} %")
        .expect("invariant: a fixed template");
    bar.set_style(style);
    bar
}

fn remarks(counters: &Counters) -> String {
    let repairs: Vec<String> = counters
        .repairs
        .iter()
        .map(|(name, n)| format!("{n} {}", name.replace('_', " ")))
        .collect();
    match repairs.len() {
        0 => String::new(),
        _ => format!("   repairs: {}", repairs.join(", ")),
    }
}
