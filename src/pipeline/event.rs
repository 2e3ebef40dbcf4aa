//! What a run tells while it goes on.

use isospline_stage::Counters;

/// Something happened to a node; `node` is its place in the graph, `stage` its label.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The artifact is there and need not be made again.
    Fresh {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
    },
    /// The artifact is there, but its bytes are not those that were written; it is made again.
    Damaged {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// What is wrong with the file.
        reason: String,
    },
    /// An earlier run left part of the artifact, which is not made again.
    Resumed {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Tasks whose rows are taken.
        done: u64,
        /// All tasks.
        of: u64,
    },
    /// What an earlier run left of the artifact, or some of it, is of no use.
    Discarded {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Why, or what.
        reason: String,
    },
    /// Work begins.
    StageStarted {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Why: `samples 17 -> 24`, `missing`, `asked for`.
        reasons: Vec<String>,
    },
    /// Work goes on; from any thread.
    Progress {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Units done, as the stage counts them.
        done: u64,
        /// All units.
        of: u64,
    },
    /// All rows are computed.
    StageFinished {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Wall time from the start of the stage.
        seconds: f64,
        /// Figures and repairs.
        counters: Counters,
        /// Size of the artifact.
        bytes: u64,
    },
    /// The artifact has its name in the store, and survives what the store's durability promises.
    Stored {
        /// The node.
        node: usize,
        /// Its label.
        stage: String,
        /// Name of the artifact.
        artifact: String,
    },
}
