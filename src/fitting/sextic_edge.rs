//! Edges between patches of degree 6: the rows of the G1 condition and what solves them.
//!
//! With first inner rows `p`, `r` of degree 5 and a cubic `mu` the condition [TK, Eq. (3)] has seven
//! rows \[derived\]. Those of the ends, k = 0, 1, 5, 6, are those of septic patches: both degrees have
//! the same mixed derivatives at a corner. Of the rows k = 2, 3, 4 and the alternating sum of all
//! seven, divided by `lambda1 - lambda0`,
//!
//! ```text
//! 10 (p2 - r2) - 10 (p3 - r3) = nu D4 q - (p0 - r0) + 5 (p1 - r1) - 5 (p4 - r4) + (p5 - r5)
//! -mu0 + 3 mu1 - 3 mu2 + mu3 = (lambda1 - lambda0) nu
//! ```
//!
//! three are independent, so row k = 3 is left out. The second line ties `mu1`, which belongs to the
//! lower vertex, to `mu2`, which belongs to the higher one: septic patches have a free scalar between.
//
// symbols: q quartic boundary, p and r first inner rows left and right, all along the edge;
// A x = b for x = (p2, r2, p3, r3), one 3 by 4 matrix for the three axes

use isospline_geometry::Vec3;
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// Corrections by the residual: one brings it to rounding.
const REFINEMENTS: u32 = 1;

/// Four points p2, r2, p3, r3.
pub type SexticPoints = [Vec3; 4];

/// One edge between two faces, the lower vertex at the origin.
#[derive(Clone, Debug)]
pub struct SexticEdge {
    /// Control points of the curve.
    pub q: [Vec3; 5],
    /// Left row 0..=5; 2 and 3 are what the system moves.
    pub p: [Vec3; 6],
    /// Right row.
    pub r: [Vec3; 6],
    /// `lambda_0`, `lambda_1`.
    pub lambda: [f64; 2],
    /// `mu_0 .. mu_3`.
    pub mu: [f64; 4],
    /// The free scalar.
    pub nu: f64,
}

impl SexticEdge {
    /// Moves p2, r2, p3, r3 least onto the rows.
    pub fn solve(&mut self) {
        let system = SexticSystem::new(self.lambda);
        for _ in 0..=REFINEMENTS {
            let x = [self.p[2], self.r[2], self.p[3], self.r[3]];
            let (b, ax) = (self.right_side(), system.product(&x));
            let step = system.least_norm(&std::array::from_fn(|k| b[k] - ax[k]));
            for s in 0..2 {
                self.p[2 + s] += step[2 * s];
                self.r[2 + s] += step[2 * s + 1];
            }
        }
    }

    fn right_side(&self) -> [Vec3; 3] {
        let Self { q, p, r, lambda: [l0, l1], mu: [m0, m1, m2, m3], nu } = self;
        let blend = |m: &f64, i: usize| (1.0 - m) * q[i] + *m * q[i + 1];
        let mixed = |l: &f64, i: usize| (1.0 - l) * p[i] + *l * r[i];
        let apart = |i: usize| p[i] - r[i];
        [
            3.0 * blend(m0, 2) + 9.0 * blend(m1, 1) + 3.0 * blend(m2, 0) - 5.0 * mixed(l1, 1),
            3.0 * blend(m1, 3) + 9.0 * blend(m2, 2) + 3.0 * blend(m3, 1) - 5.0 * mixed(l0, 4),
            *nu * fourth_difference(q) - apart(0) + 5.0 * apart(1) - 5.0 * apart(4) + apart(5),
        ]
    }

    /// How far the weights are from the row that ties both ends:
    /// `-mu0 + 3 mu1 - 3 mu2 + mu3 - (lambda1 - lambda0) nu`.
    pub fn gap(&self) -> f64 {
        let ([l0, l1], [m0, m1, m2, m3]) = (self.lambda, self.mu);
        -m0 + 3.0 * m1 - 3.0 * m2 + m3 - (l1 - l0) * self.nu
    }

    /// Largest residual of the seven rows of the G1 condition [TK, Eq. (3)], in chords.
    pub fn residual(&self) -> f64 {
        let largest = (0..7).map(|k| self.row_residual(k).norm()).fold(0.0, f64::max);
        largest / (self.q[4] - self.q[0]).norm()
    }

    /// Left minus right side of row `k`, from the products of Bernstein forms.
    fn row_residual(&self, k: usize) -> Vec3 {
        const C3: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
        const C5: [f64; 6] = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0];
        let mut sum = Vec3::zeros();
        for (i, l) in self.lambda.iter().enumerate() {
            if let Some(s) = k.checked_sub(i).filter(|s| *s < 6) {
                sum += C5[s] * ((1.0 - l) * self.p[s] + *l * self.r[s]);
            }
        }
        for (i, (c3, m)) in C3.iter().zip(&self.mu).enumerate() {
            if let Some(s) = k.checked_sub(i).filter(|s| *s < 4) {
                sum -= c3 * C3[s] * ((1.0 - m) * self.q[s] + *m * self.q[s + 1]);
            }
        }
        sum
    }
}

/// The matrix of an edge, the same for the three axes, with the factor of `A A^T`.
#[derive(Clone, Debug)]
pub struct SexticSystem {
    a: [[f64; 4]; 3],
    factor: [[f64; 3]; 3],
}

impl SexticSystem {
    /// The system of an edge with these `lambda_0`, `lambda_1`.
    pub fn new([l0, l1]: [f64; 2]) -> Self {
        let a = [
            [10.0 * (1.0 - l0), 10.0 * l0, 0.0, 0.0],
            [0.0, 0.0, 10.0 * (1.0 - l1), 10.0 * l1],
            [10.0, -10.0, -10.0, 10.0],
        ];
        let entry = |i: usize, j: usize| (0..4).map(|k: usize| a[i][k] * a[j][k]).sum();
        let gram = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        // (1 - l, l) and (1, -1) are never parallel for l in (0, 1).
        let factor = cholesky(&gram).expect("invariant: the rows of A are independent");
        Self { a, factor }
    }

    /// `A^T (A A^T)^-1 rhs`.
    pub fn least_norm(&self, rhs: &[Vec3; 3]) -> SexticPoints {
        let mut y: [[f64; 3]; 3] = rhs.map(Into::into);
        cholesky_solve(&self.factor, &mut y);
        let y = y.map(Vec3::from);
        let a = &self.a;
        std::array::from_fn(|k| a[0][k] * y[0] + a[1][k] * y[1] + a[2][k] * y[2])
    }

    fn product(&self, x: &SexticPoints) -> [Vec3; 3] {
        let row = |i: usize| (0..4).fold(Vec3::zeros(), |acc, k| acc + self.a[i][k] * x[k]);
        std::array::from_fn(row)
    }
}

/// The one combination of p2, r2, p3, r3 that no row sees, of length 1.
pub fn free_combination([l0, l1]: [f64; 2]) -> [f64; 4] {
    let along = [l0, l0 - 1.0, l1, l1 - 1.0];
    let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
    along.map(|x| x / length)
}

/// `D4 q`.
pub fn fourth_difference(q: &[Vec3; 5]) -> Vec3 {
    q[0] - 4.0 * q[1] + 6.0 * q[2] - 4.0 * q[3] + q[4]
}

/// Change of the right sides when p1, r1 and `mu1` of the lower end change by these.
pub fn lower_end(q: &[Vec3; 5], l1: f64, p1: Vec3, r1: Vec3, mu1: f64) -> [Vec3; 3] {
    let d = |i: usize| q[i + 1] - q[i];
    [9.0 * mu1 * d(1) - 5.0 * ((1.0 - l1) * p1 + l1 * r1), 3.0 * mu1 * d(3), 5.0 * (p1 - r1)]
}

/// The same for p4, r4 and the `mu1` of the higher end, which is `1 - mu2` of the edge.
pub fn higher_end(q: &[Vec3; 5], l0: f64, p4: Vec3, r4: Vec3, mu1: f64) -> [Vec3; 3] {
    let d = |i: usize| q[i + 1] - q[i];
    [-3.0 * mu1 * d(0), -9.0 * mu1 * d(2) - 5.0 * ((1.0 - l0) * p4 + l0 * r4), 5.0 * (r4 - p4)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: usize) -> Vec3 {
        let x = |j: usize| ((k * 37 + j * 17 + k * k * 11) % 29) as f64 / 29.0 - 0.5;
        Vec3::new(x(0), x(1), x(2))
    }

    /// An edge whose rows k = 0, 1, 5, 6 and whose tie of both ends hold.
    fn edge(lambda: [f64; 2]) -> SexticEdge {
        let q: [Vec3; 5] = std::array::from_fn(|i| Vec3::new(i as f64, 0.0, 0.0) + 0.4 * noise(i));
        let [l0, l1] = lambda;
        let mut mu = [0.3, 0.45, 0.0, 0.6];
        let nu = 0.7;
        mu[2] = (-mu[0] + 3.0 * mu[1] + mu[3] - (l1 - l0) * nu) / 3.0;
        let mut p: [Vec3; 6] =
            std::array::from_fn(|i| Vec3::new(0.8 * i as f64, 1.0, 0.0) + 0.2 * noise(7 + i));
        let blend = |m: f64, i: usize| (1.0 - m) * q[i] + m * q[i + 1];
        let mut r = p;
        r[0] = (blend(mu[0], 0) - (1.0 - l0) * p[0]) / l0;
        r[5] = (blend(mu[3], 3) - (1.0 - l1) * p[5]) / l1;
        let row1 = 3.0 * blend(mu[0], 1) + 3.0 * blend(mu[1], 0) - (1.0 - l1) * p[0] - l1 * r[0];
        let row5 = 3.0 * blend(mu[3], 2) + 3.0 * blend(mu[2], 3) - (1.0 - l0) * p[5] - l0 * r[5];
        r[1] = (row1 / 5.0 - (1.0 - l0) * p[1]) / l0;
        r[4] = (row5 / 5.0 - (1.0 - l1) * p[4]) / l1;
        p[2] += Vec3::z();
        SexticEdge { q, p, r, lambda, mu, nu }
    }

    #[test]
    fn a_solved_edge_meets_all_seven_rows_for_equal_and_for_unequal_lambdas() {
        for lambda in [[0.5, 0.5], [0.3, 0.3 + 1e-9], [0.2, 0.8], [0.9, 0.45]] {
            let mut edge = edge(lambda);
            assert!(edge.gap().abs() < 1e-15);
            assert!(edge.residual() > 0.1, "the start is no solution");
            edge.solve();
            assert!(edge.residual() < 1e-14, "{lambda:?}: {:.1e}", edge.residual());
        }
    }

    #[test]
    fn no_row_sees_the_free_combination() {
        let mut edge = edge([0.35, 0.6]);
        edge.solve();
        let free = free_combination(edge.lambda);
        for s in 0..2 {
            edge.p[2 + s] += 0.7 * free[2 * s] * noise(3);
            edge.r[2 + s] += 0.7 * free[2 * s + 1] * noise(3);
        }
        assert!(edge.residual() < 1e-14, "{:.1e}", edge.residual());
    }

    #[test]
    fn what_an_end_entails_keeps_the_rows_in_the_middle() {
        let (lambda, shift, mu1) = ([0.35, 0.6], [noise(4), noise(5)], 0.11);
        let mut start = edge(lambda);
        start.solve();
        let system = SexticSystem::new(lambda);
        let q = start.q;
        let lower = lower_end(&q, lambda[1], shift[0], shift[1], mu1);
        let higher = higher_end(&q, lambda[0], shift[0], shift[1], mu1);
        for (at, rows) in [(1, lower), (4, higher)] {
            let x = system.least_norm(&rows);
            let mut moved = start.clone();
            moved.p[at] += shift[0];
            moved.r[at] += shift[1];
            moved.mu[if at == 1 { 1 } else { 2 }] += if at == 1 { mu1 } else { -mu1 };
            for s in 0..2 {
                moved.p[2 + s] += x[2 * s];
                moved.r[2 + s] += x[2 * s + 1];
            }
            for k in [2, 4] {
                assert!(moved.row_residual(k).norm() < 1e-13, "end {at}, row {k}");
            }
        }
    }
}
