//! The data of one vertex: its spokes with curves, weights and start twists.

use crate::edge_end::{ccw, end_weights, outgoing_curve, weights_at_origin};
use crate::shape::apply;
use isospline_artifact::kinds::{BaseMeshView, CurvatureView, NetworkView};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_implicit::SymMat3;

/// One outgoing edge; vectors are relative to the vertex and divided by `Star::scale`.
#[derive(Clone, Copy, Debug)]
pub struct Spoke {
    /// `q1 - o`.
    pub q1: Vec3,
    /// `q2 - o`.
    pub q2: Vec3,
    /// Elevated first point, `c - o = 4/7 (q1 - o)`.
    pub c: Vec3,
    /// Start twist of the face left of the edge.
    pub twist: Vec3,
    /// `lambda` at this end.
    pub lambda0: f64,
    /// `mu` at this end.
    pub mu0: f64,
    /// `lambda` at the far end.
    pub lambda1: f64,
}

/// A vertex and its spokes, counter-clockwise.
#[derive(Clone, Debug)]
pub struct Star {
    /// The vertex.
    pub origin: Vec3,
    /// Mean tangent length: slivers would otherwise cost digits.
    pub scale: f64,
    /// Tangent plane and normal.
    pub frame: Frame,
    /// Second fundamental form times `scale`.
    pub shape: SymMat3,
    /// Counter-clockwise.
    pub spokes: Vec<Spoke>,
}

impl Star {
    /// The star of `vertex`; `twist` is the start of the face left of an outgoing half-edge, in
    /// model units.
    pub fn new(
        mesh: &BaseMeshView<'_>,
        curvature: &CurvatureView<'_>,
        network: &NetworkView<'_>,
        twist: impl Fn(HalfEdge) -> Vec3,
        vertex: usize,
    ) -> Self {
        let origin = Vec3::from(mesh.position[vertex]);
        let halves: Vec<HalfEdge> = spokes(mesh, vertex).collect();
        let curves: Vec<[Vec3; 5]> =
            halves.iter().map(|&h| outgoing_curve(mesh, network, h)).collect();
        let lengths = curves.iter().map(|q| (q[1] - origin).norm());
        let scale = lengths.sum::<f64>() / curves.len() as f64;
        let sector = mesh.sector[halves[0].row()] as usize;
        let frame = Frame::about(Vec3::from(mesh.frame[sector].normal));
        let local = |p: Vec3| (p - origin) / scale;
        let tangents: Vec<Vec3> = curves.iter().map(|q| local(q[1])).collect();
        let reversed = |h: HalfEdge| HalfEdge(mesh.opposite[h.row()]);
        let n = halves.len();
        let spoke = |i: usize| {
            let (next, previous) = (tangents[(i + 1) % n], tangents[(i + n - 1) % n]);
            let here = end_weights(&tangents[i], &next, &previous, &frame.normal);
            Spoke {
                q1: tangents[i],
                q2: local(curves[i][2]),
                c: tangents[i] * (4.0 / 7.0),
                twist: local(twist(halves[i])),
                lambda0: here.lambda0,
                mu0: here.mu0,
                lambda1: 1.0 - weights_at_origin(mesh, network, reversed(halves[i])).lambda0,
            }
        };
        let shape = curvature.shape[sector].map(|m| m * scale);
        let spokes = (0..n).map(spoke).collect();
        Self { origin, scale, frame, shape, spokes }
    }

    /// Normal component of the twist between spokes `i` and `i + 1`:
    /// `7/6 (c_i - o)^T M (c_{i+1} - o)` [derived; TK, App. C prints 2/3, which holds for q1].
    pub fn twist_height(&self, i: usize) -> f64 {
        let next = &self.spokes[(i + 1) % self.spokes.len()];
        7.0 / 6.0 * apply(&self.shape, &self.spokes[i].c, &next.c)
    }

    /// Right-hand side of the row k = 1 of spoke `i`, relative to the vertex [TK, Eq. (16)].
    pub fn right_side(&self, i: usize) -> Vec3 {
        let n = self.spokes.len();
        let (s, next) = (&self.spokes[i], &self.spokes[(i + 1) % n]);
        let previous = &self.spokes[(i + n - 1) % n];
        3.0 * ((1.0 - s.mu0) * s.q1 + s.mu0 * s.q2)
            - ((1.0 - s.lambda1) * next.c + s.lambda1 * previous.c)
    }

    /// Largest residual of the rows k = 1, divided by the mean tangent length; `twists` are
    /// relative to the vertex, in model units.
    pub fn residual(&self, twists: &[Vec3], mu1: &[f64]) -> f64 {
        let n = self.spokes.len();
        let row = |i: usize| {
            let s = &self.spokes[i];
            let mixed = (1.0 - s.lambda0) * twists[i] + s.lambda0 * twists[(i + n - 1) % n];
            (6.0 * mixed / self.scale - 4.0 * mu1[i] * s.q1 - self.right_side(i)).norm()
        };
        (0..n).map(row).fold(0.0, f64::max)
    }
}

/// Outgoing half-edges of a vertex, counter-clockwise.
fn spokes(mesh: &BaseMeshView<'_>, vertex: usize) -> impl Iterator<Item = HalfEdge> {
    let rows = mesh.star_first[vertex] as usize..mesh.star_first[vertex + 1] as usize;
    let halves = mesh.star[rows].to_vec();
    debug_assert!(halves.windows(2).all(|h| ccw(mesh, HalfEdge(h[0])).0 == h[1]));
    halves.into_iter().map(HalfEdge)
}

/// The tangential and the normal part of a vector in a plane frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Two orthonormal tangents.
    pub axes: [Vec3; 2],
    /// Unit normal.
    pub normal: Vec3,
}

impl Frame {
    /// A frame about a unit normal.
    pub fn about(normal: Vec3) -> Self {
        // The axis least along the normal keeps the cross product well away from zero.
        let k = normal.iamin();
        let e1 = normal.cross(&Vec3::ith(k, 1.0)).normalize();
        Self { axes: [e1, normal.cross(&e1)], normal }
    }

    /// Tangential components.
    pub fn flatten(&self, v: &Vec3) -> [f64; 2] {
        self.axes.map(|a| a.dot(v))
    }

    /// The vector with these tangential components and this height.
    pub fn lift(&self, [x, y]: [f64; 2], height: f64) -> Vec3 {
        x * self.axes[0] + y * self.axes[1] + height * self.normal
    }
}
