//! The kinds of artifact and their rows.
//!
//! V vertices, E edges, F faces, H = 3F half-edges, S sectors. Positions are in model units.

mod base_mesh;
mod mesh;
mod patches;
mod stages;

pub use base_mesh::{BaseMesh, BaseMeshView, Bounds, EdgeKind, Fan, Frame};
pub use mesh::{Mesh, MeshView, Topology, TopologyProof};
pub use patches::{PatchMeta, Patches, PatchesView, Scheme};
pub use stages::{
    Curvature, CurvatureView, CurveFit, CurveStatus, EdgeSystems, EdgeSystemsView, EdgeWeights,
    FaceFit, G0Fit, G0FitView, Network, NetworkView, VertexSystems, VertexSystemsView,
};
