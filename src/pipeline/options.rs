//! How a run is to be done; nothing here changes a byte of the output.

use crate::Trace;
use isospline_geometry::Aabb;
use isospline_implicit::Field;
use std::fmt;
use std::sync::atomic::AtomicBool;

/// What the stages see beside their inputs.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// The field, level at zero, `f < 0` inside.
    pub field: &'a dyn Field,
    /// The box that holds the surface.
    pub domain: Aabb,
}

impl fmt::Debug for Scene<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Scene").field("domain", &self.domain).finish_non_exhaustive()
    }
}

/// Threads, task size, and which stages to run.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions<'a> {
    /// Working threads, at least 1; default: the processors.
    pub threads: usize,
    /// Rows a task, about; default 512: a task then takes 0.2 to 5 ms, long against the 5 us
    /// that handing it over costs, short against a second's notice to stop.
    ///
    /// An artifact that was left unfinished is begun anew with another size.
    pub rows_per_task: usize,
    /// This stage and all that follow are run even if they are fresh.
    pub from: Option<&'a str>,
    /// This stage alone is run; what it reads must be fresh.
    pub only: Option<&'a str>,
    /// Whether the rows of fresh artifacts are verified too, and damaged ones made again.
    pub verify: bool,
    /// Whether a stage begins with the rows that are there of stages still at work; otherwise the
    /// stages run one after another, which is of use to measure them.
    pub streaming: bool,
    /// Where to note who did what when.
    pub trace: Option<&'a Trace>,
    /// Raised from outside, it ends the run soon.
    pub stop: &'a AtomicBool,
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl Default for RunOptions<'_> {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            threads,
            rows_per_task: 512,
            from: None,
            only: None,
            verify: false,
            streaming: true,
            trace: None,
            stop: &NEVER,
        }
    }
}
