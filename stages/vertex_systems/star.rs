//! The data of one vertex: its spokes with curves, weights and start twists.

use crate::{Frame, spokes};
use isospline_artifact::kinds::{BaseMeshView, CurvatureView, G0FitView, NetworkView};
use isospline_fitting::edge_end::{end_weights, outgoing_curve, weights_at_origin};
use isospline_fitting::net::point;
use isospline_fitting::shape::apply;
use isospline_geometry::bezier_triangle::first_inner_slot;
use isospline_geometry::{HalfEdge, Vec3};
use isospline_implicit::SymMat3;

/// One outgoing edge; vectors are relative to the vertex and divided by `Star::scale`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spoke {
    /// `q1 - o`.
    pub(crate) q1: Vec3,
    /// `q2 - o`.
    pub(crate) q2: Vec3,
    /// Elevated first point, `c - o = 4/7 (q1 - o)`.
    pub(crate) c: Vec3,
    /// Start twist of the face left of the edge, from the G0 fit.
    pub(crate) twist: Vec3,
    /// Weights of this end, and `lambda` at the far end.
    pub(crate) lambda0: f64,
    pub(crate) mu0: f64,
    pub(crate) lambda1: f64,
}

/// A vertex and its spokes, counter-clockwise.
#[derive(Clone, Debug)]
pub(crate) struct Star {
    pub(crate) origin: Vec3,
    /// Mean tangent length: slivers would otherwise cost digits.
    pub(crate) scale: f64,
    pub(crate) frame: Frame,
    /// Second fundamental form times `scale`.
    pub(crate) shape: SymMat3,
    pub(crate) spokes: Vec<Spoke>,
}

impl Star {
    pub(crate) fn new(
        mesh: &BaseMeshView<'_>,
        curvature: &CurvatureView<'_>,
        network: &NetworkView<'_>,
        g0_fit: &G0FitView<'_>,
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
            let slot = first_inner_slot(halves[i].corner() as usize, 1);
            let start = point(&g0_fit.interior[halves[i].face() as usize], slot);
            Spoke {
                q1: tangents[i],
                q2: local(curves[i][2]),
                c: tangents[i] * (4.0 / 7.0),
                twist: local(start),
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
    pub(crate) fn twist_height(&self, i: usize) -> f64 {
        let next = &self.spokes[(i + 1) % self.spokes.len()];
        7.0 / 6.0 * apply(&self.shape, &self.spokes[i].c, &next.c)
    }

    /// Right-hand side of the row k = 1 of spoke `i`, relative to the vertex [TK, Eq. (16)].
    pub(crate) fn right_side(&self, i: usize) -> Vec3 {
        let n = self.spokes.len();
        let (s, next) = (&self.spokes[i], &self.spokes[(i + 1) % n]);
        let previous = &self.spokes[(i + n - 1) % n];
        3.0 * ((1.0 - s.mu0) * s.q1 + s.mu0 * s.q2)
            - ((1.0 - s.lambda1) * next.c + s.lambda1 * previous.c)
    }

    /// Largest residual of the rows k = 1, divided by the mean tangent length; `twists` are
    /// relative to the vertex, in model units.
    pub(crate) fn residual(&self, twists: &[Vec3], mu1: &[f64]) -> f64 {
        let n = self.spokes.len();
        let row = |i: usize| {
            let s = &self.spokes[i];
            let mixed = (1.0 - s.lambda0) * twists[i] + s.lambda0 * twists[(i + n - 1) % n];
            (6.0 * mixed / self.scale - 4.0 * mu1[i] * s.q1 - self.right_side(i)).norm()
        };
        (0..n).map(row).fold(0.0, f64::max)
    }
}
