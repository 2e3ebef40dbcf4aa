//! Least-norm tangential twists [TK, Eq. (18)], one small system a vertex.
//!
//! Each row's component along its own edge only fixes `mu1`, so the twists answer to the
//! components across: n equations in 2n unknowns, of full rank while neighbouring tangents differ.

use crate::vertex_star::Star;
use isospline_geometry::Vec3;

/// Added to a diagonal that lost its rank to rounding, times its largest entry.
const RIDGE: f64 = 1e-10;
/// Corrections by the residual after the first solve: one brings it to rounding.
const REFINEMENTS: u32 = 2;

/// Buffers of the solver and the result of its last solve.
#[derive(Clone, Debug, Default)]
pub struct Solver {
    /// Twists relative to the vertex, in model units, in spoke order.
    pub twists: Vec<Vec3>,
    /// `mu1` of each spoke.
    pub mu1: Vec<f64>,
    flat: Vec<[f64; 2]>,
    factor: Vec<f64>,
    rows: Vec<Row>,
}

/// `own . T_i + other . T_{i-1} = rhs`.
#[derive(Clone, Copy, Debug)]
struct Row {
    own: [f64; 2],
    other: [f64; 2],
    rhs: f64,
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Solver {
    /// Solves a star; true if the system had to be regularised, `None` if it has no solution.
    pub fn solve(&mut self, star: &Star) -> Option<bool> {
        let n = star.spokes.len();
        self.rows.clear();
        self.rows.extend((0..n).map(|i| row(star, i)));
        self.flat.clear();
        self.flat.extend(star.spokes.iter().map(|s| star.frame.flatten(&s.twist)));
        let regularised = self.factorise()?;
        for _ in 0..=REFINEMENTS {
            self.correct();
        }
        self.finish(star);
        let finite = |x: &f64| x.is_finite();
        let sound = self.twists.iter().all(|t| t.iter().all(finite)) && self.mu1.iter().all(finite);
        sound.then_some(regularised)
    }

    /// Cholesky factor of `A A^T`, a cyclic tridiagonal matrix.
    fn factorise(&mut self) -> Option<bool> {
        let n = self.rows.len();
        let mut gram = vec![0.0; n * n];
        for i in 0..n {
            let (row, next) = (&self.rows[i], &self.rows[(i + 1) % n]);
            gram[i * n + i] += dot(row.own, row.own) + dot(row.other, row.other);
            // Row i + 1 reads the twist that row i owns.
            let shared = dot(row.own, next.other);
            gram[i * n + (i + 1) % n] += shared;
            gram[(i + 1) % n * n + i] += shared;
        }
        self.factor.clone_from(&gram);
        if cholesky(&mut self.factor, n) {
            return Some(false);
        }
        let largest = (0..n).map(|i| gram[i * n + i]).fold(0.0, f64::max);
        (0..n).for_each(|i| gram[i * n + i] += RIDGE * largest);
        self.factor = gram;
        cholesky(&mut self.factor, n).then_some(true)
    }

    /// One least-norm step onto the rows.
    fn correct(&mut self) {
        let n = self.rows.len();
        let before = |i: usize| (i + n - 1) % n;
        let mut y: Vec<f64> = (0..n)
            .map(|i| {
                let row = &self.rows[i];
                row.rhs - dot(row.own, self.flat[i]) - dot(row.other, self.flat[before(i)])
            })
            .collect();
        cholesky_solve(&self.factor, &mut y);
        for i in 0..n {
            let row = self.rows[i];
            for k in 0..2 {
                self.flat[i][k] += y[i] * row.own[k];
                self.flat[before(i)][k] += y[i] * row.other[k];
            }
        }
    }

    /// Twists with their heights, and the `mu1` that the components along the edges fix.
    fn finish(&mut self, star: &Star) {
        let n = star.spokes.len();
        self.twists.clear();
        self.mu1.clear();
        for i in 0..n {
            self.twists.push(star.scale * star.frame.lift(self.flat[i], star.twist_height(i)));
            let s = &star.spokes[i];
            let previous = self.flat[(i + n - 1) % n];
            let mixed = [0, 1]
                .map(|k| 6.0 * ((1.0 - s.lambda0) * self.flat[i][k] + s.lambda0 * previous[k]));
            let rhs = star.frame.flatten(&star.right_side(i));
            let q = star.frame.flatten(&s.q1);
            self.mu1.push(dot(q, [mixed[0] - rhs[0], mixed[1] - rhs[1]]) / (4.0 * dot(q, q)));
        }
    }
}

/// The row k = 1 of spoke `i`, across its edge.
fn row(star: &Star, i: usize) -> Row {
    let s = &star.spokes[i];
    let [x, y] = star.frame.flatten(&s.q1);
    let across = [-y, x];
    let weight = |w: f64| across.map(|a| 6.0 * w * a);
    let rhs = dot(across, star.frame.flatten(&star.right_side(i)));
    Row { own: weight(1.0 - s.lambda0), other: weight(s.lambda0), rhs }
}

/// Overwrites the lower triangle of a row-major `n` by `n` matrix by its Cholesky factor.
fn cholesky(a: &mut [f64], n: usize) -> bool {
    // A pivot this small beside its diagonal is rounding.
    const LEAST_PIVOT: f64 = 1e-13;
    for i in 0..n {
        let diagonal = a[i * n + i];
        for j in 0..=i {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= a[i * n + k] * a[j * n + k];
            }
            if i != j {
                a[i * n + j] = sum / a[j * n + j];
            } else if sum > LEAST_PIVOT * diagonal && sum.is_finite() {
                a[i * n + i] = sum.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// Solves `L L^T x = b` in place.
fn cholesky_solve(l: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        for k in 0..i {
            b[i] -= l[i * n + k] * b[k];
        }
        b[i] /= l[i * n + i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            b[i] -= l[k * n + i] * b[k];
        }
        b[i] /= l[i * n + i];
    }
}
