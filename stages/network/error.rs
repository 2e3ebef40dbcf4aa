//! Why the network cannot be built.

use isospline_geometry::Vec3;
use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NetworkError {
    /// No quartic meets the normals and curvatures at both ends [TK, Fig. 8].
    #[error("edge {edge} has no quartic curve with the normals and curvatures of its ends")]
    NoCurve {
        /// Edge of the base mesh.
        edge: u32,
        /// Middle of its chord.
        place: Vec3,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Diagnosis for NetworkError {
    fn code(&self) -> &'static str {
        match self {
            Self::NoCurve { .. } => "no-boundary-curve",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::NoCurve { place, .. } => Some(*place),
            Self::Stopped(_) => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = "another number of faces (target.faces) moves the edge";
        matches!(self, Self::NoCurve { .. }).then(|| text.to_owned())
    }
}
