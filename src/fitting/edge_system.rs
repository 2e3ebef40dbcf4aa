//! The uniformly regular edge system [derived; replaces TK, Eq. (20)-(25)].
//!
//! Rows k = 2, 3, 4 stay; row k = 5 is replaced by the alternating sum of all eight rows, divided
//! by the small number `lambda1 - lambda0`:
//!
//! ```text
//! 15 (p2 - r2) - 20 (p3 - r3) + 15 (p4 - r4) + nu D4 q
//!     = 6 (p1 - r1) + 6 (p5 - r5) - (p0 - r0) - (p6 - r6)
//! D4 q = q0 - 4 q1 + 6 q2 - 4 q3 + q4
//! mu2  = (-mu0 + 4 mu1 + 4 mu3 - mu4) / 6 + (lambda1 - lambda0) nu / 6
//! ```
//!
//! with `nu` free. The condition stays near 8 for all lambdas; the printed system degenerates
//! where they meet.
//
// symbols: A x + d nu = b for x = (p2, r2, p3, r3, p4, r4), one 4 by 6 matrix for the three axes

use crate::edge_rows::Edge;
use isospline_geometry::Vec3;
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// Corrections by the residual: one brings it to rounding.
const REFINEMENTS: u32 = 1;

/// Six points p2, r2, p3, r3, p4, r4.
pub type Points = [Vec3; 6];

/// Moves p2..p4 and r2..r4 of `edge` least from where they are, sets `mu2`, returns `nu`.
///
/// Minimises the squared moves, in chords, plus `nu_weight (nu - nu_start)^2`.
pub fn solve(edge: &mut Edge, nu_start: f64, nu_weight: f64) -> f64 {
    let system = System::new(edge.lambda);
    let (b, d) = (right_side(edge), nu_column(&edge.q, edge.lambda));
    let start = unknowns(edge);
    let missing = subtract(&subtract(&b, &d.map(|d| nu_start * d)), &system.product(&start));
    let (along_d, along_b) = (system.least_norm(&d), system.least_norm(&missing));
    let nu = nu_start + inner(&along_d, &along_b) / (inner(&along_d, &along_d) + nu_weight);
    let goal: [Vec3; 4] = std::array::from_fn(|k| b[k] - nu * d[k]);
    let mut x = start;
    for _ in 0..=REFINEMENTS {
        let step = system.least_norm(&subtract(&goal, &system.product(&x)));
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
    }
    for s in 0..3 {
        edge.p[2 + s] = x[2 * s];
        edge.r[2 + s] = x[2 * s + 1];
    }
    edge.mu[2] = edge.paper_mu2() + mu2_slope(edge.lambda) * nu;
    nu
}

/// The matrix of an edge, the same for the three axes, with the factor of `A A^T`.
#[derive(Clone, Debug)]
pub struct System {
    /// `A` over p2, r2, p3, r3, p4, r4.
    pub a: [[f64; 6]; 4],
    factor: [[f64; 4]; 4],
}

impl System {
    /// The system of an edge with these `lambda_0`, `lambda_1`.
    pub fn new(lambda: [f64; 2]) -> Self {
        let a = matrix(lambda);
        let factor = cholesky(&gram(&a)).expect("invariant: the condition of A is near 8");
        Self { a, factor }
    }

    /// `A^T (A A^T)^-1 rhs`.
    pub fn least_norm(&self, rhs: &[Vec3; 4]) -> Points {
        let mut y: [[f64; 3]; 4] = rhs.map(Into::into);
        cholesky_solve(&self.factor, &mut y);
        let y = y.map(Vec3::from);
        let a = &self.a;
        std::array::from_fn(|k| a[0][k] * y[0] + a[1][k] * y[1] + a[2][k] * y[2] + a[3][k] * y[3])
    }

    fn product(&self, x: &Points) -> [Vec3; 4] {
        let row = |i: usize| (0..6).fold(Vec3::zeros(), |acc, k| acc + self.a[i][k] * x[k]);
        std::array::from_fn(row)
    }
}

/// `d mu2 / d nu`.
fn mu2_slope([l0, l1]: [f64; 2]) -> f64 {
    (l1 - l0) / 6.0
}

fn unknowns(edge: &Edge) -> Points {
    std::array::from_fn(|i| if i % 2 == 0 { edge.p[2 + i / 2] } else { edge.r[2 + i / 2] })
}

fn matrix([l0, l1]: [f64; 2]) -> [[f64; 6]; 4] {
    let (m0, m1) = (1.0 - l0, 1.0 - l1);
    [
        [15.0 * m0, 15.0 * l0, 0.0, 0.0, 0.0, 0.0],
        [15.0 * m1, 15.0 * l1, 20.0 * m0, 20.0 * l0, 0.0, 0.0],
        [0.0, 0.0, 20.0 * m1, 20.0 * l1, 15.0 * m0, 15.0 * l0],
        [15.0, -15.0, -20.0, 20.0, 15.0, -15.0],
    ]
}

/// Right sides for `nu = 0`.
fn right_side(edge: &Edge) -> [Vec3; 4] {
    let (q, p, r) = (&edge.q, &edge.p, &edge.r);
    let m2 = edge.paper_mu2();
    let [m0, m1, _, m3, m4] = edge.mu;
    let l1 = edge.lambda[1];
    let blend = |m: f64, i: usize| (1.0 - m) * q[i] + m * q[i + 1];
    [
        3.0 * blend(m0, 2) + 12.0 * blend(m1, 1) + 6.0 * blend(m2, 0)
            - 6.0 * ((1.0 - l1) * p[1] + l1 * r[1]),
        blend(m0, 3) + 12.0 * blend(m1, 2) + 18.0 * blend(m2, 1) + 4.0 * blend(m3, 0),
        4.0 * blend(m1, 3) + 18.0 * blend(m2, 2) + 12.0 * blend(m3, 1) + blend(m4, 0),
        6.0 * (p[1] - r[1]) + 6.0 * (p[5] - r[5]) - (p[0] - r[0]) - (p[6] - r[6]),
    ]
}

/// Column of `nu`, moved to the left side, for the control points `q` of a curve.
pub fn nu_column(q: &[Vec3; 5], lambda: [f64; 2]) -> [Vec3; 4] {
    let slope = mu2_slope(lambda);
    [
        -6.0 * slope * (q[1] - q[0]),
        -18.0 * slope * (q[2] - q[1]),
        -18.0 * slope * (q[3] - q[2]),
        q[0] - 4.0 * q[1] + 6.0 * q[2] - 4.0 * q[3] + q[4],
    ]
}

fn gram(a: &[[f64; 6]; 4]) -> [[f64; 4]; 4] {
    let entry = |i: usize, j: usize| (0..6).map(|k| a[i][k] * a[j][k]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

fn subtract(a: &[Vec3; 4], b: &[Vec3; 4]) -> [Vec3; 4] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn inner(a: &Points, b: &Points) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
