//! The data of one edge, in units of its chord with the lower vertex at the origin.
//
// symbols: q quartic boundary, p and r first inner rows left and right, both along the edge

use crate::edge_end::{outgoing_curve, outgoing_tangent};
use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::{HalfEdge, Vec3};

/// One edge between two faces.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Control points of the curve.
    pub q: [Vec3; 5],
    /// Left row 0..=6; 2, 3, 4 are what the system moves.
    pub p: [Vec3; 7],
    /// Right row, along the edge as well.
    pub r: [Vec3; 7],
    /// `lambda_0`, `lambda_1`.
    pub lambda: [f64; 2],
    /// `mu_0 .. mu_4`; `mu_2` belongs to the system.
    pub mu: [f64; 5],
    origin: Vec3,
    chord: f64,
}

impl Edge {
    /// The data of `edge`.
    ///
    /// `points` are steps 1..=5 of the first inner row along a half-edge, in model units;
    /// `weights` are `[lambda0, mu0, mu1]` in star order.
    pub fn new(
        mesh: &BaseMeshView<'_>,
        network: &NetworkView<'_>,
        points: impl Fn(HalfEdge) -> [Vec3; 5],
        weights: &[[f64; 3]],
        edge: usize,
    ) -> Self {
        let [h, g] = mesh.edge_half[edge].map(HalfEdge);
        let curve = outgoing_curve(mesh, network, h);
        let (origin, chord) = (curve[0], (curve[4] - curve[0]).norm());
        let local = |p: Vec3| (p - origin) / chord;
        let row = |half| inner_row(mesh, network, half, points(half)).map(local);
        let mut r = row(g);
        r.reverse();
        let [at_a, at_b] = [h, g].map(|half| weights[mesh.star_row[half.row()] as usize]);
        let mut edge = Self {
            q: curve.map(local),
            p: row(h),
            r,
            lambda: [at_a[0], 1.0 - at_b[0]],
            mu: [at_a[1], at_a[2], 0.0, 1.0 - at_b[2], 1.0 - at_b[1]],
            origin,
            chord,
        };
        edge.mu[2] = edge.paper_mu2();
        edge
    }

    /// `mu2` of the case of equal lambdas [TK, Eq. (23)].
    pub fn paper_mu2(&self) -> f64 {
        (-self.mu[0] + 4.0 * self.mu[1] + 4.0 * self.mu[3] - self.mu[4]) / 6.0
    }

    /// Points 2, 3, 4 of a row in model units.
    pub fn model_row(&self, row: &[Vec3; 7]) -> [f64; 9] {
        flat([2, 3, 4].map(|s| self.origin + self.chord * row[s]))
    }

    /// Largest residual of the eight rows of the G1 condition [TK, Eq. (3)], in chords.
    pub fn residual(&self) -> f64 {
        (0..8).map(|k| self.row_residual(k).norm()).fold(0.0, f64::max)
    }

    /// Left minus right side of row `k`, from the products of Bernstein forms.
    fn row_residual(&self, k: usize) -> Vec3 {
        const C1: [f64; 2] = [1.0, 1.0];
        const C3: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
        const C4: [f64; 5] = [1.0, 4.0, 6.0, 4.0, 1.0];
        const C6: [f64; 7] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];
        let mut sum = Vec3::zeros();
        for (i, c1) in C1.iter().enumerate() {
            if let Some(s) = k.checked_sub(i).filter(|s| *s < 7) {
                let l = self.lambda[i];
                sum += c1 * C6[s] * ((1.0 - l) * self.p[s] + l * self.r[s]);
            }
        }
        for (i, c4) in C4.iter().enumerate() {
            if let Some(s) = k.checked_sub(i).filter(|s| *s < 4) {
                let m = self.mu[i];
                sum -= c4 * C3[s] * ((1.0 - m) * self.q[s] + m * self.q[s + 1]);
            }
        }
        sum
    }
}

/// First inner row of the face of `h`, along `h`, in model units: its ends follow from the
/// neighbouring curves.
fn inner_row(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    h: HalfEdge,
    [p1, p2, p3, p4, p5]: [Vec3; 5],
) -> [Vec3; 7] {
    let position = |h: HalfEdge| {
        Vec3::from(mesh.position[mesh.face[h.face() as usize][h.corner() as usize] as usize])
    };
    // The curve of the previous half-edge ends here; its reverse leaves the same vertex.
    let back = HalfEdge(mesh.opposite[h.prev().row()]);
    let first = position(h) + outgoing_tangent(mesh, network, back) * (4.0 / 7.0);
    let last = position(h.next()) + outgoing_tangent(mesh, network, h.next()) * (4.0 / 7.0);
    [first, p1, p2, p3, p4, p5, last]
}

/// Three points as a row.
fn flat(points: [Vec3; 3]) -> [f64; 9] {
    let [a, b, c] = points;
    [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
}
