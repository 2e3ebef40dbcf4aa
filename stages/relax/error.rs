//! Why the stage may end without a result.

use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage: it has a result for every input that its predecessors let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RelaxError {
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Diagnosis for RelaxError {
    fn code(&self) -> &'static str {
        "stopped"
    }
}
