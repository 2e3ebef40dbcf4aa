//! Many models in one go: which there are, what became of each, and the tables that tell it.

mod csv;
mod discovery;
mod record;
mod script;
mod summary;

pub use csv::csv;
pub use discovery::{BatchModel, find};
pub use record::{Ending, Outcome, Part, Record};
pub use script::{Plan, Scheduler, script};
pub use summary::{Summary, record_key, write_part};

use isospline_artifact::StoreError;
use std::path::PathBuf;

/// Why a batch cannot go on; what becomes of a model is a [`Record`], not an error.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// A file or folder of models cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Source {
        /// It.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Nothing to do.
    #[error("no model: {} holds no file *.toml, *.jsurf or *.vm", path.display())]
    NoModels {
        /// The first place that was looked at.
        path: PathBuf,
    },
    /// A model was asked for that is not among those given.
    #[error("`{name}` is none of the models of this batch")]
    NoSuchModel {
        /// What was asked for.
        name: String,
    },
    /// A file of the batch cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
}
