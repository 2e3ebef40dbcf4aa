//! Why there is no curvature.

use isospline_geometry::Vec3;
use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CurvatureError {
    /// The second derivatives are not finite at a vertex.
    #[error("the second derivatives of the field are not finite at a vertex")]
    NotFinite {
        /// The vertex.
        place: Vec3,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Diagnosis for CurvatureError {
    fn code(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "no-curvature",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::NotFinite { place } => Some(*place),
            Self::Stopped(_) => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = "the surface needs two continuous derivatives: replace roots, absolute values \
                    and min/max on the surface by smooth forms (smin, smax)";
        matches!(self, Self::NotFinite { .. }).then(|| text.to_owned())
    }
}
