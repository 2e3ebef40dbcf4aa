//! Numbers of the entities of vertices, edges and faces: a fixed stride each.

use super::StepOptions;

/// First numbers and strides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    options: StepOptions,
    /// Inner control points of a border curve.
    pub(super) inner: u64,
    vertices: u64,
    edges: u64,
    faces: u64,
}

/// Numbers of a curve between two points: its inner points, itself, its edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurveNumbers {
    pub(super) inner: u64,
    pub(super) edge: u64,
}

impl Layout {
    pub(super) fn new(
        options: StepOptions,
        degree: usize,
        first: u64,
        n_vertices: usize,
        n_edges: usize,
    ) -> Self {
        let edges = first + 2 * n_vertices as u64;
        let inner = degree as u64 - 1;
        let mut layout = Self { options, inner, vertices: first, edges, faces: 0 };
        layout.faces = edges + layout.edge_stride() * n_edges as u64;
        layout
    }

    /// The point of vertex `v`; its vertex follows.
    pub(super) fn point(&self, v: usize) -> u64 {
        self.vertices + 2 * v as u64
    }

    /// First number of edge `e`: inner points and, but in the compact form, the middle.
    pub(super) fn edge(&self, e: usize) -> u64 {
        self.edges + self.edge_stride() * e as u64
    }

    /// Numbers of the whole curve of edge `e`, in the compact form.
    pub(super) fn whole(&self, e: usize) -> CurveNumbers {
        let inner = self.edge(e);
        CurveNumbers { inner, edge: inner + self.inner + self.per_curve() - 1 }
    }

    /// The middle of edge `e`; its vertex follows.
    pub(super) fn middle(&self, e: usize) -> u64 {
        self.edge(e) + 2 * self.inner
    }

    /// Numbers of half 0 (from the lower vertex) or 1 of edge `e`.
    pub(super) fn half(&self, e: usize, half: u64) -> CurveNumbers {
        let curves = self.middle(e) + 2;
        CurveNumbers {
            inner: self.edge(e) + self.inner * half,
            edge: curves + self.per_curve() * (half + 1) - 1,
        }
    }

    /// The centre of face `f`; its vertex follows.
    pub(super) fn centre(&self, f: usize) -> u64 {
        self.faces + self.face_stride() * f as u64
    }

    /// Numbers of the curve from the middle of the edge after `corner` to the centre of face `f`.
    pub(super) fn spoke(&self, f: usize, corner: u64) -> CurveNumbers {
        let inner = self.centre(f) + 2 + self.inner * corner;
        let curves = self.centre(f) + 2 + 3 * self.inner;
        CurveNumbers { inner, edge: curves + self.per_curve() * (corner + 1) - 1 }
    }

    /// First number of quad `quad` of face `f`; it starts with its inner points.
    pub(super) fn quad(&self, f: usize, quad: u64) -> u64 {
        let before = if self.options.compact { 0 } else { 2 + 3 * (self.inner + self.per_curve()) };
        self.faces + self.face_stride() * f as u64 + before + self.quad_stride() * quad
    }

    pub(super) fn surface(&self, f: usize, quad: u64) -> u64 {
        self.quad(f, quad) + self.inner * self.inner
    }

    /// The curve of a side in the parameters of its quad.
    pub(super) fn pcurve(&self, f: usize, quad: u64, side: u64) -> u64 {
        self.surface(f, quad) + 1 + side
    }

    /// The face of a quad: the last of its entities.
    pub(super) fn face(&self, f: usize, quad: u64) -> u64 {
        self.quad(f, quad) + self.quad_stride() - 1
    }

    /// Faces that a triangle becomes.
    pub(super) fn quads(&self) -> u64 {
        if self.options.compact { 1 } else { 3 }
    }

    pub(super) fn sides(&self) -> u64 {
        if self.options.compact { 3 } else { 4 }
    }

    /// Curve, curve with its parameter curves, edge.
    fn per_curve(&self) -> u64 {
        if self.options.pcurves { 3 } else { 2 }
    }

    fn edge_stride(&self) -> u64 {
        if self.options.compact {
            self.inner + self.per_curve()
        } else {
            2 * self.inner + 2 + 2 * self.per_curve()
        }
    }

    /// Inner points, surface, parameter curves, oriented edges, loop, bound, face.
    fn quad_stride(&self) -> u64 {
        let pcurves = if self.options.pcurves { self.sides() } else { 0 };
        self.inner * self.inner + 1 + pcurves + self.sides() + 3
    }

    fn face_stride(&self) -> u64 {
        let spokes = if self.options.compact { 0 } else { 2 + 3 * (self.inner + self.per_curve()) };
        spokes + self.quads() * self.quad_stride()
    }
}
