//! Levenberg-Marquardt on the normal distance of one curve, under the conditions at its ends.

use super::conditions::{COINCIDENT, Frame, N, Unknowns};
use isospline_geometry::linear::solve;
use isospline_implicit::Jet1;

/// Damping at the start, and its least value. One damping for all edges would let one bad edge
/// hold up the others.
const DAMPING: [f64; 2] = [1e-6, 1e-15];
/// Damping after which an edge is left: no step lowers its distance any more.
const HOPELESS: f64 = 1.0;
/// What a success divides the damping by.
const EASE: f64 = 8.0;
/// What a failure multiplies the damping by.
const TIGHTEN: f64 = 10.0;
/// Longest step, times the chord.
const STEP_CAP: f64 = 0.1;
/// Distances, times the chord, that are rounding.
const ROUNDING: f64 = 1e-15;

/// State of the descent of one edge.
pub(super) struct Descent {
    trial: Unknowns,
    best: Option<Best>,
    damping: f64,
    /// Times the curve was judged.
    pub(super) iterations: u32,
}

/// The best curve so far and its linear model.
struct Best {
    x: Unknowns,
    cost: f64,
    largest: f64,
    /// `J^T J` and `J^T r`.
    normal: [[f64; N]; N],
    gradient: Unknowns,
}

impl Descent {
    /// Starts at `x`.
    pub(super) fn from(x: Unknowns) -> Self {
        Self { trial: x, best: None, damping: DAMPING[0], iterations: 0 }
    }

    /// The curve to be judged next.
    pub(super) fn trial(&self) -> &Unknowns {
        &self.trial
    }

    /// The best curve; `None` if the field was finite along none.
    pub(super) fn best(&self) -> Option<&Unknowns> {
        self.best.as_ref().map(|best| &best.x)
    }

    /// Largest distance of the best curve at the samples, times the chord.
    pub(super) fn largest(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |best| best.largest)
    }

    /// Takes in the field along the trial curve and chooses the next; false where it ends.
    pub(super) fn judge(&mut self, frame: &Frame, weights: &[[f64; 5]], jets: &[Jet1]) -> bool {
        self.iterations += 1;
        let judged = Best::new(frame, self.trial, weights, jets);
        let old = self.best.as_ref().map_or(f64::INFINITY, |best| best.cost);
        if judged.cost < old {
            self.damping = (self.damping / EASE).max(DAMPING[1]);
            self.best = Some(judged);
        } else {
            self.damping *= TIGHTEN;
        }
        let Some(best) = &self.best else { return false };
        if best.largest <= ROUNDING {
            return false;
        }
        while self.damping <= HOPELESS {
            if let Some(x) = best.step(frame, self.damping) {
                self.trial = x;
                return true;
            }
            self.damping *= TIGHTEN;
        }
        false
    }
}

impl Best {
    fn new(frame: &Frame, x: Unknowns, weights: &[[f64; 5]], jets: &[Jet1]) -> Self {
        let mut normal = [[0.0; N]; N];
        let mut gradient = [0.0; N];
        let (mut cost, mut largest) = (0.0, 0.0_f64);
        for (w, jet) in weights.iter().zip(jets) {
            let slope = jet.gradient.norm();
            let distance = jet.value / slope / frame.chord();
            let row = frame.distance_gradient(w, &(jet.gradient / slope));
            for i in 0..N {
                gradient[i] += row[i] * distance;
                for j in 0..=i {
                    normal[i][j] += row[i] * row[j];
                }
            }
            cost += distance * distance;
            largest = largest.max(distance.abs());
        }
        for i in 0..N {
            for j in i + 1..N {
                normal[i][j] = normal[j][i];
            }
        }
        Self { x, cost, largest, normal, gradient }
    }

    /// The next curve: a damped Gauss-Newton step along the linearised conditions, then back onto
    /// them.
    fn step(&self, frame: &Frame, damping: f64) -> Option<Unknowns> {
        const M: usize = N + 2;
        let g = frame.condition_gradients(&self.x);
        let mut matrix = [[0.0; M]; M];
        let mut rhs = [0.0; M];
        for i in 0..N {
            matrix[i][..N].copy_from_slice(&self.normal[i]);
            matrix[i][i] += damping;
            rhs[i] = -self.gradient[i];
            for k in 0..2 {
                matrix[i][N + k] = -g[k][i];
                matrix[N + k][i] = g[k][i];
            }
        }
        for k in 0..2 {
            matrix[N + k][N + k] = COINCIDENT;
        }
        let s = solve(matrix, rhs)?;
        let length = s[..N].iter().map(|x| x * x).sum::<f64>().sqrt();
        let scale = if length > STEP_CAP { STEP_CAP / length } else { 1.0 };
        let moved: Unknowns = std::array::from_fn(|i| self.x[i] + scale * s[i]);
        frame.restore(frame.clamped(moved))
    }
}
