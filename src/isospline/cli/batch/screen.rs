//! What a batch shows: a table that moves on a terminal, a line a model elsewhere.

use super::running::Running;
use crate::cli::failure::Failure;
use crate::cli::output::{duration, note, say};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use isospline::batch::{Outcome, Record};
use std::io::IsTerminal;

/// Ticks between two looks at what runs say.
const EVERY: u32 = 20;

/// Shows a batch.
#[derive(Debug)]
pub(super) struct Screen {
    json: bool,
    n_models: usize,
    n_done: usize,
    n_ticks: u32,
    table: Option<Table>,
}

/// A line a run at work, and a bar of the whole.
#[derive(Debug)]
struct Table {
    all: MultiProgress,
    whole: ProgressBar,
    rows: Vec<ProgressBar>,
}

impl Screen {
    /// For so many models, of which some are done.
    pub(super) fn new(json: bool, n_models: usize, n_done: usize) -> Self {
        let table =
            (!json && std::io::stderr().is_terminal()).then(|| Table::new(n_models, n_done));
        let screen = Self { json, n_models, n_done, n_ticks: 0, table };
        if n_done > 0 && !json {
            screen.line(&format!("{n_done} of {n_models} models are done already"));
        }
        screen
    }

    /// Tells what became of a model.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub(super) fn tell(&mut self, record: &Record) -> Result<(), Failure> {
        self.n_done += 1;
        if self.json {
            let text = serde_json::to_string(record).expect("invariant: a record is plain data");
            return say(&text);
        }
        let (n, of, word, model) =
            (self.n_done, self.n_models, record.outcome.word(), &record.model);
        let end = match record.outcome {
            Outcome::Converted => figures(record),
            _ => format!("{}: {}", record.reason, record.sentence),
        };
        let width = of.to_string().len();
        self.line(&format!("[{n:>width$}/{of}] {word:<11}{model}  {end}"));
        if let Some(table) = &self.table {
            table.whole.set_position(n as u64);
        }
        Ok(())
    }

    /// Shows what is at work.
    pub(super) fn show(&mut self, running: &mut [Running]) {
        self.n_ticks += 1;
        if let Some(table) = &mut self.table
            && self.n_ticks % EVERY == 1
        {
            table.show(running);
        }
    }

    /// Takes the table away.
    pub(super) fn end(&mut self) {
        if let Some(table) = self.table.take() {
            table.rows.iter().chain([&table.whole]).for_each(ProgressBar::finish_and_clear);
        }
    }

    fn line(&self, text: &str) {
        match &self.table {
            Some(table) => table.all.suspend(|| note(text)),
            None => note(text),
        }
    }
}

fn figures(record: &Record) -> String {
    let count = |n: Option<u64>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
    let error = record.error_max_rel.map_or_else(|| "-".to_owned(), |e| format!("{e:.1e}"));
    let genus = record.genus.map_or_else(|| "-".to_owned(), |n| n.to_string());
    let (faces, components, time) =
        (count(record.faces), count(record.components), duration(record.seconds));
    format!("{faces} faces, {components} components, genus {genus}, error {error}, {time}")
}

impl Table {
    fn new(n_models: usize, n_done: usize) -> Self {
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
        let whole =
            ProgressBar::with_draw_target(Some(n_models as u64), ProgressDrawTarget::hidden());
        let whole = all.add(whole);
        let style = ProgressStyle::with_template("{wide_bar} {pos}/{len}  {elapsed}, {eta} left");
        whole.set_style(style.expect("invariant: a fixed template"));
        whole.set_position(n_done as u64);
        // What an earlier batch did says nothing of how fast this one is.
        whole.reset_eta();
        Self { all, whole, rows: Vec::new() }
    }

    fn show(&mut self, running: &mut [Running]) {
        while self.rows.len() < running.len() {
            let row = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
            let row = self.all.insert_before(&self.whole, row);
            let style = ProgressStyle::with_template("  {wide_msg}");
            row.set_style(style.expect("invariant: a fixed template"));
            self.rows.push(row);
        }
        for (k, row) in self.rows.iter().enumerate() {
            let text = running.get_mut(k).map_or_else(String::new, |run| {
                let (model, time) = (run.model.name.clone(), duration(run.seconds()));
                format!("{model:<40} {:<15} {time:>9}", run.stage())
            });
            row.set_message(text);
        }
        self.whole.tick();
    }
}
