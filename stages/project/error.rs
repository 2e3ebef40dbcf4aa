//! Why a mesh cannot be projected.

use isospline_geometry::Vec3;
use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProjectError {
    /// Newton's steps did not reach the surface.
    #[error("a vertex could not be projected: it stays {distance:.1e} of the diagonal away")]
    NotReached {
        /// Where the steps ended.
        place: Vec3,
        /// Distance estimate `|f| / |grad f|`, relative to the diagonal.
        distance: f64,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Diagnosis for ProjectError {
    fn code(&self) -> &'static str {
        match self {
            Self::NotReached { .. } => "projection-failed",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::NotReached { place, .. } => Some(*place),
            Self::Stopped(_) => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = "look for a singular point or a jump of the formula there; \
                    if the mesh was imported, check that it lies near the surface";
        matches!(self, Self::NotReached { .. }).then(|| text.to_owned())
    }
}
