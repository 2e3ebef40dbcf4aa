//! Why a mesh cannot become a base mesh.

use crate::freeze::FreezeError;
use isospline_geometry::Vec3;
use isospline_geometry::triangle_mesh::Defect;
use isospline_stage::{Diagnosis, Stopped};

/// Why a mesh cannot become a base mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AdaptError {
    /// Repair has not made all faces fit.
    #[error(
        "{unfit_faces} faces cannot be made fit; the worst edge, at ({}, {}, {}), turns by \
         {turning_deg:.1} degrees and slopes by {slope:.2}",
        place.x, place.y, place.z
    )]
    Unfit {
        /// Faces still unfit after the last round.
        unfit_faces: u32,
        /// Middle of the worst edge.
        place: Vec3,
        /// Angle between the normals at its ends, degrees.
        turning_deg: f64,
        /// Part of its chord along a normal.
        slope: f64,
    },
    /// The gradient vanishes or is not finite at a vertex.
    #[error("the surface has no normal at ({}, {}, {})", place.x, place.y, place.z)]
    SingularPoint {
        /// The vertex position.
        place: Vec3,
    },
    /// The input is not an oriented manifold.
    #[error("the mesh is not an oriented manifold: {0:?}")]
    NotManifold(Defect),
    /// The mesh cannot be frozen.
    #[error(transparent)]
    Freeze(#[from] FreezeError),
    /// The run was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<Defect> for AdaptError {
    fn from(defect: Defect) -> Self {
        Self::NotManifold(defect)
    }
}

impl Diagnosis for AdaptError {
    fn code(&self) -> &'static str {
        match self {
            Self::Unfit { .. } => "base-mesh-unfit",
            Self::SingularPoint { .. } | Self::Freeze(FreezeError::NoNormal { .. }) => {
                "singular-point"
            }
            Self::Freeze(FreezeError::Open { .. }) => "open-mesh",
            Self::NotManifold(_) | Self::Freeze(FreezeError::NotManifold(_)) => "not-manifold",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::Unfit { place, .. }
            | Self::SingularPoint { place }
            | Self::Freeze(FreezeError::NoNormal { place, .. }) => Some(*place),
            Self::Freeze(FreezeError::Open { from, .. }) => Some(*from),
            _ => None,
        }
    }

    fn help(&self) -> Option<String> {
        match self {
            Self::Unfit { .. } => Some(
                "if the surface has a sharp edge there (min, max, abs), round it off with smin or \
                 smax; if not, raise target.faces"
                    .to_owned(),
            ),
            _ => None,
        }
    }
}
