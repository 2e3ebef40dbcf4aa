//! Why a mesh cannot be decimated.

use isospline_geometry::Vec3;
use isospline_geometry::triangle_mesh::Defect;
use isospline_stage::{Diagnosis, Stopped};

/// Why a mesh cannot be decimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DecimateError {
    /// No collapse is left that keeps topology and orientation.
    #[error("{wanted} faces are too few for the topology; {least} is the least that works")]
    TooFewFaces {
        /// Faces asked for.
        wanted: u32,
        /// Faces at which the last collapse was possible.
        least: u32,
    },
    /// The input is not an oriented manifold.
    #[error("the mesh is not an oriented manifold: {0:?}")]
    NotManifold(Defect),
    /// A vertex has a coordinate that is not a finite number.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: u32,
    },
    /// The run was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<Defect> for DecimateError {
    fn from(defect: Defect) -> Self {
        Self::NotManifold(defect)
    }
}

impl Diagnosis for DecimateError {
    fn code(&self) -> &'static str {
        match self {
            Self::TooFewFaces { .. } => "too-few-faces",
            Self::NotManifold(_) => "not-manifold",
            Self::NotFinite { .. } => "not-finite",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        None
    }

    fn help(&self) -> Option<String> {
        match self {
            Self::TooFewFaces { least, .. } => Some(format!("set target.faces to {least} or more")),
            _ => None,
        }
    }
}
