//! Why a vertex has no twist points.

use isospline_geometry::Vec3;
use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum VertexSystemsError {
    /// Neighbouring curves leave the vertex in the same direction.
    #[error("vertex {vertex} has two neighbouring curves with the same tangent")]
    Degenerate {
        /// Vertex of the base mesh.
        vertex: u32,
        /// Its position.
        place: Vec3,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Diagnosis for VertexSystemsError {
    fn code(&self) -> &'static str {
        match self {
            Self::Degenerate { .. } => "degenerate-vertex",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::Degenerate { place, .. } => Some(*place),
            Self::Stopped(_) => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = "the base mesh folds there: raise target.faces, or repair the imported mesh";
        matches!(self, Self::Degenerate { .. }).then(|| text.to_owned())
    }
}
