//! Kinds of the stages between the base mesh and the patches.

use crate::artifact;

artifact! {
    /// Second fundamental form at each sector (curvature).
    pub struct Curvature / CurvatureView = "curvature", schema 1 {
        /// `M = -P H P / |grad f|` as `[xx, xy, xz, yy, yz, zz]`, 1/length; -1/r on a sphere.
        shape: [f64; 6], Sectors;
    }
}

/// How an edge's curve was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveStatus {
    /// The iteration converged with lengths in range.
    Converged,
    /// The iteration found no sound curve: tangent lengths are from a table, `q2` refitted.
    Clamped,
}

impl CurveStatus {
    /// The stored code.
    pub fn code(self) -> u32 {
        match self {
            Self::Converged => 0,
            Self::Clamped => 1,
        }
    }
}

/// One row an edge: how well its curve fits.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct CurveFit {
    /// Largest scaled residual of the curvature conditions [TK, Eq. (9b)].
    pub residual: f64,
    /// Largest distance to the surface at the samples, in model units.
    pub error: f64,
    /// Newton-Lagrange iterations.
    pub iterations: u32,
    /// Code of the [`CurveStatus`].
    pub status: u32,
}

artifact! {
    /// Quartic boundary curves (network).
    pub struct Network / NetworkView = "network", schema 1 {
        /// Control points q1, q2, q3, from the lower to the higher vertex.
        control: [f64; 9], Edges;
        /// Tangent lengths `[lambda, mu]`, in model units.
        tangent: [f64; 2], Edges;
        /// Fit figures.
        fit: CurveFit, Edges;
    }
}

/// One row a face: distance of the fitted patch to its targets, in model units.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct FaceFit {
    /// Largest distance.
    pub max: f64,
    /// Root mean square distance.
    pub rms: f64,
}

artifact! {
    /// Interior control points of the G0 surface (`g0_fit`).
    pub struct G0Fit / G0FitView = "g0_fit", schema 1 {
        /// The 15 interior control points in storage order.
        interior: [f64; 45], Faces;
        /// Fit figures.
        fit: FaceFit, Faces;
    }
}

artifact! {
    /// Twist points and edge-end weights (`vertex_systems`); rows in star order.
    pub struct VertexSystems / VertexSystemsView = "vertex_systems", schema 1 {
        /// Twist point of the face left of each outgoing half-edge.
        twist: [f64; 3], HalfEdges;
        /// `[lambda0, mu0, mu1]` at the origin of each outgoing half-edge.
        weights: [f64; 3], HalfEdges;
        /// 0 solved, 1 repaired.
        status: u8, Vertices;
    }
}

/// One row an edge: the free scalars of its system.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct EdgeWeights {
    /// The free scalar of the uniformly regular form.
    pub nu: f64,
    /// `mu2`.
    pub mu2: f64,
    /// Largest residual of the eight rows, divided by the chord.
    pub residual: f64,
}

artifact! {
    /// First inner rows (`edge_systems`).
    pub struct EdgeSystems / EdgeSystemsView = "edge_systems", schema 1 {
        /// p2, p3, p4 of the face of half-edge a -> b.
        left: [f64; 9], Edges;
        /// r2, r3, r4 of the face of half-edge b -> a, indexed along a -> b.
        right: [f64; 9], Edges;
        /// Weights and residual.
        weights: EdgeWeights, Edges;
    }
}
