//! Why a run may end early.

use isospline_artifact::{RowsError, StoreError};
use isospline_stage::Diagnosis;
use std::error::Error;
use std::fmt;

/// A graph that cannot run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraphError {
    /// No stage has this name.
    #[error("no stage is called {stage:?}")]
    UnknownStage {
        /// The name.
        stage: String,
    },
    /// Two nodes have the same stage and round.
    #[error("{stage} stands twice in the graph")]
    Twice {
        /// The node.
        stage: String,
    },
    /// A node reads itself or a later one.
    #[error("{stage} reads node {input}, which does not come before it")]
    Order {
        /// The node.
        stage: String,
        /// What it reads.
        input: usize,
    },
    /// A kind that a stage reads is not there, or more than once.
    #[error("{stage} reads one artifact of kind {kind:?}, {found} are given")]
    Input {
        /// The node.
        stage: String,
        /// The kind.
        kind: &'static str,
        /// How many there are.
        found: usize,
    },
}

/// Parameters that a stage does not take.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParamsError {
    /// An unknown key or a value of the wrong type.
    #[error("{message}")]
    Shape {
        /// What serde says; it names the key.
        message: String,
    },
    /// A value out of its range.
    #[error("{key}: {message}")]
    Range {
        /// The key.
        key: &'static str,
        /// What is wrong, with the range.
        message: String,
    },
    /// Values that their canonical text does not give back, such as a number that is not finite.
    #[error("the parameters hold a value that cannot be written down, such as nan or inf")]
    RoundTrip,
}

/// A stage's own error; code, place and help are those of [`Diagnosis`].
#[derive(Debug)]
pub struct StageFailure(pub Box<dyn Diagnosis>);

impl fmt::Display for StageFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

impl Error for StageFailure {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.0.source()
    }
}

/// Why a run ended early; what was finished before is kept in the store.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A stage cannot do its work.
    #[error("{stage}: {source}")]
    Stage {
        /// The node.
        stage: String,
        /// Its error.
        source: StageFailure,
    },
    /// A stage has a bug.
    #[error("{stage}: task {task} panicked: {message}")]
    Panicked {
        /// The node.
        stage: String,
        /// Number of the task.
        task: usize,
        /// The panic's message.
        message: String,
    },
    /// A stage has a bug: its tasks do not make every row once.
    #[error("{stage}: the tasks make row {row} of section {section:?} {times} times")]
    Tiling {
        /// The node.
        stage: String,
        /// The section.
        section: &'static str,
        /// A row that is not made exactly once.
        row: usize,
        /// How often it is made.
        times: usize,
    },
    /// A stage has a bug: a task made other rows than it promised.
    #[error("{stage}: task {task} made {found} rows of section {section:?}, not {expected}")]
    PieceSize {
        /// The node.
        stage: String,
        /// Number of the task.
        task: usize,
        /// The section.
        section: &'static str,
        /// Rows made.
        found: usize,
        /// Rows promised.
        expected: usize,
    },
    /// Parameters that the stage does not take.
    #[error("{stage}: {source}")]
    Params {
        /// The node.
        stage: String,
        /// What is wrong.
        source: ParamsError,
    },
    /// An input does not have the rows of its kind.
    #[error("{stage}: {source}")]
    Rows {
        /// The node that reads it.
        stage: String,
        /// What is wrong.
        source: RowsError,
    },
    /// The graph cannot run.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// One stage alone was asked for, but what it reads is not there or stale.
    #[error("{stage} cannot run alone: {reason}")]
    NotReady {
        /// The node.
        stage: String,
        /// State of the input.
        reason: String,
    },
    /// `from` or `only` name a stage that is not in the graph.
    #[error("the model has no stage {stage:?}; it has {known}")]
    NoSuchStage {
        /// The name.
        stage: String,
        /// The names there are.
        known: String,
    },
    /// The store cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The stop flag was raised.
    #[error("stopped in {stage}; what was finished is kept{}", told(kept))]
    Stopped {
        /// The first node that was not finished.
        stage: String,
        /// What is kept of unfinished nodes; the next run goes on from there.
        kept: Vec<Kept>,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads")]
    Threads {
        /// How many.
        threads: usize,
    },
}

/// What is kept of a node that was not finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The node.
    pub stage: String,
    /// Tasks whose rows are kept.
    pub done: usize,
    /// All its tasks.
    pub of: usize,
}

impl fmt::Display for Kept {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} tasks of {}", self.done, self.of, self.stage)
    }
}

fn told(kept: &[Kept]) -> String {
    let list: Vec<String> = kept.iter().map(ToString::to_string).collect();
    if list.is_empty() { String::new() } else { format!(", and {}", list.join(", ")) }
}

impl RunError {
    /// The node that failed, if one did.
    pub fn stage(&self) -> Option<&str> {
        match self {
            Self::Stage { stage, .. }
            | Self::Panicked { stage, .. }
            | Self::Tiling { stage, .. }
            | Self::PieceSize { stage, .. }
            | Self::Params { stage, .. }
            | Self::Rows { stage, .. }
            | Self::NotReady { stage, .. }
            | Self::Stopped { stage, .. } => Some(stage),
            Self::Graph(_) | Self::NoSuchStage { .. } | Self::Store(_) | Self::Threads { .. } => {
                None
            }
        }
    }

    /// Code, place and help of a stage's own error.
    pub fn diagnosis(&self) -> Option<&dyn Diagnosis> {
        match self {
            Self::Stage { source, .. } => Some(&*source.0),
            _ => None,
        }
    }
}
