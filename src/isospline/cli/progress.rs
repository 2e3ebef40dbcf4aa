//! What a run tells while it goes on: a bar a stage on a terminal, lines elsewhere, JSON if asked.

use crate::cli::output::{duration, note, say};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use isospline_pipeline::Event;
use isospline_stage::Counters;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Shows events.
#[derive(Debug)]
pub(crate) struct Progress {
    json: bool,
    bars: Option<Bars>,
}

/// A bar for every stage that is running, in the order of the graph.
#[derive(Debug)]
struct Bars {
    all: MultiProgress,
    running: Mutex<BTreeMap<usize, ProgressBar>>,
}

impl Progress {
    /// Shows events as JSON lines on standard output, or for people on standard error.
    pub(crate) fn new(json: bool) -> Self {
        let bars = (!json && std::io::stderr().is_terminal()).then(Bars::new);
        Self { json, bars }
    }

    /// Shows one event.
    pub(crate) fn show(&self, event: &Event) {
        if self.json {
            let line = serde_json::to_string(event).expect("invariant: events are plain data");
            // A full disk under a redirected log must not end the run.
            let _ = say(&line);
            return;
        }
        if let Some(bars) = &self.bars {
            bars.show(event);
        }
        match event {
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
            _ => {}
        }
    }

    /// Takes the bars away.
    pub(crate) fn end(&self) {
        if let Some(bars) = &self.bars {
            for bar in std::mem::take(&mut *bars.running()).values() {
                bar.finish_and_clear();
            }
        }
    }

    fn line(&self, text: &str) {
        match &self.bars {
            Some(bars) => bars.all.suspend(|| note(text)),
            None => note(text),
        }
    }
}

impl Bars {
    fn new() -> Self {
        let target = ProgressDrawTarget::stderr_with_hz(15);
        Self { all: MultiProgress::with_draw_target(target), running: Mutex::default() }
    }

    fn show(&self, event: &Event) {
        match event {
            Event::StageStarted { node, stage, .. } => self.begin(*node, stage),
            Event::Resumed { node, done, of, .. } => {
                self.advance(*node, *done, *of);
                // What an earlier run did says nothing of how fast this one is.
                self.with(*node, ProgressBar::reset_eta);
            }
            Event::Progress { node, done, of, .. } => self.advance(*node, *done, *of),
            Event::StageFinished { node, .. } => {
                let bar = self.running().remove(node);
                if let Some(bar) = bar {
                    bar.finish_and_clear();
                    self.all.remove(&bar);
                }
            }
            _ => {}
        }
    }

    fn begin(&self, node: usize, stage: &str) {
        // Drawn by all bars together only: a bar of its own would leave lines behind.
        let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::hidden());
        let mut running = self.running();
        let bar = self.all.insert(running.range(..node).count(), bar);
        bar.set_style(style(false));
        bar.set_message(stage.to_owned());
        running.insert(node, bar);
    }

    fn advance(&self, node: usize, done: u64, of: u64) {
        self.with(node, |bar| {
            if bar.length() != Some(of) {
                bar.set_length(of);
                bar.set_style(style(of > 1));
            }
            bar.set_position(done);
        });
    }

    fn with(&self, node: usize, change: impl FnOnce(&ProgressBar)) {
        if let Some(bar) = self.running().get(&node) {
            change(bar);
        }
    }

    fn running(&self) -> MutexGuard<'_, BTreeMap<usize, ProgressBar>> {
        // Every change is one insertion or removal.
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Rate and time left mean something where there are several steps.
fn style(in_steps: bool) -> ProgressStyle {
    let template = if in_steps {
        "{msg:<15} {wide_bar} {percent:>3} % {rate:>10} {eta:>4} left"
    } else {
        "{msg:<15} {wide_bar} {percent:>3} %"
    };
    let rate = |state: &ProgressState, out: &mut dyn Write| {
        // Nobody can be told of a failure here.
        let _ = write!(out, "{:.0}/s", state.per_sec());
    };
    let style = ProgressStyle::with_template(template).expect("invariant: a fixed template");
    style.with_key("rate", rate)
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
