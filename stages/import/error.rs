//! Why a mesh cannot be imported.

use isospline_geometry::triangle_mesh::Defect;
use isospline_geometry::{HalfEdge, TriangleMesh, Vec3};
use isospline_stage::{Diagnosis, Stopped};

/// Errors of the stage.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// No faces.
    #[error("the base mesh has no faces")]
    Empty,
    /// The faces are not an oriented manifold.
    #[error("the base mesh is not an oriented manifold: {defect:?} (numbered from 0)")]
    NotManifold {
        /// The first defect.
        defect: Defect,
        /// Where it is.
        place: Option<Vec3>,
    },
    /// The mesh has a border.
    #[error("the base mesh is open: a border runs at the edge from vertex {from} to {to}")]
    Open {
        /// Vertex of the border, numbered from 0.
        from: u32,
        /// The next vertex of the border.
        to: u32,
        /// Position of the first.
        place: Vec3,
    },
    /// The run was asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl ImportError {
    pub(crate) fn not_manifold(mesh: &TriangleMesh, defect: Defect) -> Self {
        let vertex = match defect {
            Defect::DoubledHalfEdge { from, .. } => Some(from),
            Defect::PinchedVertex { vertex } | Defect::LooseVertex { vertex } => Some(vertex),
            Defect::RepeatedCorner { face } => Some(mesh.faces[face as usize][0]),
            Defect::MissingVertex { .. } => None,
        };
        Self::NotManifold { defect, place: vertex.map(|v| mesh.positions[v as usize]) }
    }

    pub(crate) fn open(mesh: &TriangleMesh, border: u32) -> Self {
        let h = HalfEdge(border);
        let (from, to) = (mesh.origin(h), mesh.origin(h.next()));
        Self::Open { from, to, place: mesh.positions[from as usize] }
    }
}

impl Diagnosis for ImportError {
    fn code(&self) -> &'static str {
        match self {
            Self::Empty => "mesh-empty",
            Self::NotManifold { .. } => "mesh-not-manifold",
            Self::Open { .. } => "mesh-open",
            Self::Stopped(_) => "stopped",
        }
    }

    fn place(&self) -> Option<Vec3> {
        match self {
            Self::NotManifold { place, .. } => *place,
            Self::Open { place, .. } => Some(*place),
            Self::Empty | Self::Stopped(_) => None,
        }
    }

    fn help(&self) -> Option<String> {
        let text = match self {
            Self::Empty => "give an OBJ with triangles, or leave model.base_mesh out",
            Self::NotManifold { .. } => "repair the mesh: each edge needs exactly two faces",
            Self::Open { .. } => "close the hole: only closed surfaces can be converted",
            Self::Stopped(_) => return None,
        };
        Some(text.to_owned())
    }
}
