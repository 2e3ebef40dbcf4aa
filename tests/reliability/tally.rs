//! What a row counted, and its line on the board.

use std::fmt::Display;

/// Failures that are told one by one; the rest are counted.
const TOLD: usize = 60;

/// Cases, failures, skips and figures of one row.
#[derive(Clone, Debug)]
pub struct Tally {
    id: &'static str,
    cases: usize,
    failures: Vec<String>,
    skips: Vec<String>,
    figures: Vec<String>,
}

impl Tally {
    pub(crate) fn new(id: &'static str) -> Self {
        Self { id, cases: 0, failures: Vec::new(), skips: Vec::new(), figures: Vec::new() }
    }

    /// Counts a case; what went wrong is told at once, for a row may take long.
    pub(crate) fn case(&mut self, name: impl Display, outcome: Result<(), String>) {
        self.cases += 1;
        if let Err(reason) = outcome {
            let told = format!("{} {name}: {reason}", self.id);
            if self.failures.len() < TOLD {
                tell(&told);
            }
            self.failures.push(told);
        }
    }

    /// Counts cases that passed, where there are too many to name.
    pub(crate) fn passed(&mut self, cases: usize) {
        self.cases += cases;
    }

    /// Notes that something could not be tried here, and why: "not root".
    pub(crate) fn skip(&mut self, what: &str, why: &str) {
        self.skips.push(format!("{what} skipped: {why}"));
    }

    /// Adds a figure to the line.
    pub(crate) fn figure(&mut self, figure: impl Into<String>) {
        self.figures.push(figure.into());
    }

    /// What failed, with its reasons.
    pub fn failures(&self) -> &[String] {
        &self.failures
    }

    /// What could not be tried, with its reasons.
    pub fn skips(&self) -> &[String] {
        &self.skips
    }

    /// The line of the board.
    pub fn line(&self, property: &str) -> String {
        let passed = self.cases - self.failures.len();
        let verdict = match (self.failures.is_empty(), self.cases, self.skips.is_empty()) {
            (false, ..) => "FAIL",
            (true, 0, _) => "skipped",
            (true, _, false) => "pass*",
            (true, _, true) => "pass",
        };
        let notes: Vec<&str> = self.figures.iter().chain(&self.skips).map(String::as_str).collect();
        let (id, cases) = (self.id, self.cases);
        format!("{id:<4} {property:<14} {cases:>8} {passed:>8}  {verdict:<8} {}", notes.join("; "))
    }
}

/// The head of the board.
pub const HEAD: &str = "row  property          cases   passed  verdict  figures";

#[expect(clippy::print_stderr, reason = "a failing case is told while the row goes on")]
fn tell(text: &str) {
    eprintln!("{text}");
}
