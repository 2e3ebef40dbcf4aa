//! How the nearest curve of an edge answers to moves of its ends.
//
// symbols: r distances at the samples, J and K their gradients in the unknowns of the curve and in
// the moves, G and H the gradients of the conditions likewise, n multipliers

use super::conditions::{COINCIDENT, Frame, N, Unknowns};
use super::{NormalCurve, NormalEdge, NormalFit};
use isospline_geometry::Vec3;
use isospline_geometry::linear::solve;
use isospline_implicit::Jet1;

/// Moves of one end: an offset along its normal, the normal's tilts towards two axes, and the second
/// fundamental form's entries aa, ab and bb in these axes.
pub const OWN: usize = 6;
/// Moves of both ends.
pub const MOVES: usize = 2 * OWN;

/// Keeps unknowns that move the curve along itself; beside squared Bernstein values.
const DAMPING: f64 = 1e-11;

/// Half the squared distances at the samples of the nearest curve, as a quadratic function of the
/// moves of its ends: `gradient . u + u . matrix u / 2` more than now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Symmetric; offsets in chords, tilts in radians, forms over chords, values in squared chords.
    pub matrix: [[f64; MOVES]; MOVES],
    /// In the same units.
    pub gradient: [f64; MOVES],
    /// Half the squared distances now, in squared chords.
    pub cost: f64,
}

impl NormalFit {
    /// Points of a curve at the samples.
    pub fn points<'a>(
        &'a self,
        edge: &NormalEdge,
        curve: &NormalCurve,
    ) -> impl Iterator<Item = Vec3> + 'a {
        let ([start, end], [q1, q2, q3]) = (edge.ends.points, curve.inner);
        let q = [start, q1, q2, q3, end];
        self.weights.iter().map(move |w| (0..5).map(|i| w[i] * q[i]).sum())
    }

    /// The answer of a fitted curve; `jets` are the field's at its [`points`](Self::points), `axes`
    /// two tangents at each end that its normal tilts to.
    ///
    /// The curve is the nearest one under its conditions before and after, so its own unknowns are
    /// eliminated. `None` where the field is not finite or the edge has no frame.
    pub fn answer(
        &self,
        edge: &NormalEdge,
        curve: &NormalCurve,
        jets: &[Jet1],
        axes: &[[Vec3; 2]; 2],
    ) -> Option<Answer> {
        let frame = Frame::new(edge)?;
        let x = frame.unknowns(&curve.inner);
        let mut sums = Sums::default();
        for (w, jet) in self.weights.iter().zip(jets) {
            let slope = jet.gradient.norm();
            let normal = jet.gradient / slope;
            let distance = jet.value / slope / frame.chord();
            let moves = frame.distance_by_moves(w, &normal, &x, axes);
            sums.add(distance, &frame.distance_gradient(w, &normal), &moves);
        }
        let conditions = frame.condition_gradients(&x);
        sums.eliminate(&conditions, &frame.conditions_by_moves(&x, axes))
    }
}

/// `J^T J`, `J^T K`, `K^T K`, `J^T r`, `K^T r`.
#[derive(Default)]
struct Sums {
    curve: [[f64; N]; N],
    mixed: [[f64; MOVES]; N],
    moves: [[f64; MOVES]; MOVES],
    by_curve: Unknowns,
    by_moves: [f64; MOVES],
    cost: f64,
}

impl Sums {
    fn add(&mut self, distance: f64, j: &Unknowns, k: &[f64; MOVES]) {
        for a in 0..N {
            (0..N).for_each(|b| self.curve[a][b] += j[a] * j[b]);
            (0..MOVES).for_each(|b| self.mixed[a][b] += j[a] * k[b]);
            self.by_curve[a] += j[a] * distance;
        }
        for a in 0..MOVES {
            (0..MOVES).for_each(|b| self.moves[a][b] += k[a] * k[b]);
            self.by_moves[a] += k[a] * distance;
        }
        self.cost += 0.5 * distance * distance;
    }

    fn eliminate(&self, g: &[Unknowns; 2], h: &[[f64; MOVES]; 2]) -> Option<Answer> {
        const M: usize = N + 2;
        let mut matrix = [[0.0; M]; M];
        for i in 0..N {
            matrix[i][..N].copy_from_slice(&self.curve[i]);
            matrix[i][i] += DAMPING;
            for k in 0..2 {
                matrix[i][N + k] = g[k][i];
                matrix[N + k][i] = g[k][i];
            }
        }
        for k in 0..2 {
            matrix[N + k][N + k] = -COINCIDENT;
        }
        let answered = |by: &dyn Fn(usize) -> f64, conditions: [f64; 2]| {
            let rhs = std::array::from_fn(|i| if i < N { -by(i) } else { -conditions[i - N] });
            solve(matrix, rhs)
        };
        // What the answer `[x, n]` of the curve adds to a derivative by move `a`.
        let added = |a: usize, answer: &[f64; M]| {
            let by_curve: f64 = (0..N).map(|i| self.mixed[i][a] * answer[i]).sum();
            by_curve + h[0][a] * answer[N] + h[1][a] * answer[N + 1]
        };
        let own = answered(&|i| self.by_curve[i], [0.0; 2])?;
        let mut out = Answer { matrix: self.moves, gradient: self.by_moves, cost: self.cost };
        for b in 0..MOVES {
            let answer = answered(&|i| self.mixed[i][b], [h[0][b], h[1][b]])?;
            (0..MOVES).for_each(|a| out.matrix[a][b] += added(a, &answer));
        }
        (0..MOVES).for_each(|a| out.gradient[a] += added(a, &own));
        let is_finite = out.matrix.iter().flatten().chain(&out.gradient).all(|x| x.is_finite());
        is_finite.then_some(out)
    }
}

impl Frame {
    /// Gradient of a distance in the moves, the unknowns held: tangents turn with their planes.
    fn distance_by_moves(
        &self,
        w: &[f64; 5],
        normal: &Vec3,
        x: &Unknowns,
        axes: &[[Vec3; 2]; 2],
    ) -> [f64; MOVES] {
        let [n0, n1] = self.normals().map(|n| n.dot(normal));
        let offsets = [(w[0] + w[1]) * n0, (w[3] + w[4]) * n1];
        let tilts = [-w[1] * n0, w[3] * n1];
        let mut out = [0.0; MOVES];
        for end in 0..2 {
            out[OWN * end] = offsets[end];
            for axis in 0..2 {
                let part = axes[end][axis].dot(&self.leg(x, end));
                out[OWN * end + 1 + axis] = tilts[end] * part;
            }
        }
        out
    }

    /// Gradients of the two conditions in the moves.
    pub(super) fn conditions_by_moves(
        &self,
        x: &Unknowns,
        axes: &[[Vec3; 2]; 2],
    ) -> [[f64; MOVES]; 2] {
        let mut out = [[0.0; MOVES]; 2];
        let from_ends = self.middle_from_ends(x);
        for end in 0..2 {
            let leg = self.leg(x, end);
            let [a, b] = axes[end].map(|axis| axis.dot(&leg));
            let [along, across] = axes[end].map(|axis| axis.dot(&from_ends[end]));
            let own = [3.0, -3.0 * along, -3.0 * across, 4.0 * a * a, 8.0 * a * b, 4.0 * b * b];
            out[end][OWN * end..OWN * (end + 1)].copy_from_slice(&own);
        }
        out
    }
}
