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

use crate::edge::Edge;
use isospline_geometry::Vec3;
use isospline_geometry::linear::{cholesky, cholesky_solve};

/// Corrections by the residual: one brings it to rounding.
const REFINEMENTS: u32 = 1;

type Matrix = [[f64; 6]; 4];

/// Moves p2..p4 and r2..r4 of `edge` least from where they are, sets `mu2`, returns `nu`.
///
/// Minimises the squared moves plus `nu_weight nu^2`.
pub(crate) fn solve(edge: &mut Edge, nu_weight: f64) -> f64 {
    let a = matrix(edge);
    let factor = cholesky(&gram(&a)).expect("invariant: the condition of A is near 8");
    let (b, d) = (right_side(edge), nu_column(edge));
    let start = unknowns(edge);
    let missing = subtract(&b, &product(&a, &start));
    let (along_d, along_b) = (least_norm(&a, &factor, &d), least_norm(&a, &factor, &missing));
    let nu = inner(&along_d, &along_b) / (inner(&along_d, &along_d) + nu_weight);
    let goal: [Vec3; 4] = std::array::from_fn(|k| b[k] - nu * d[k]);
    let mut x = start;
    for _ in 0..=REFINEMENTS {
        let step = least_norm(&a, &factor, &subtract(&goal, &product(&a, &x)));
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
    }
    for s in 0..3 {
        edge.p[2 + s] = x[2 * s];
        edge.r[2 + s] = x[2 * s + 1];
    }
    edge.mu[2] = edge.paper_mu2() + mu2_slope(edge) * nu;
    nu
}

/// `d mu2 / d nu`.
fn mu2_slope(edge: &Edge) -> f64 {
    (edge.lambda[1] - edge.lambda[0]) / 6.0
}

fn unknowns(edge: &Edge) -> [Vec3; 6] {
    std::array::from_fn(|i| if i % 2 == 0 { edge.p[2 + i / 2] } else { edge.r[2 + i / 2] })
}

fn matrix(edge: &Edge) -> Matrix {
    let [l0, l1] = edge.lambda;
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

/// Column of `nu`, moved to the left side.
fn nu_column(edge: &Edge) -> [Vec3; 4] {
    let q = &edge.q;
    let slope = mu2_slope(edge);
    [
        -6.0 * slope * (q[1] - q[0]),
        -18.0 * slope * (q[2] - q[1]),
        -18.0 * slope * (q[3] - q[2]),
        q[0] - 4.0 * q[1] + 6.0 * q[2] - 4.0 * q[3] + q[4],
    ]
}

fn gram(a: &Matrix) -> [[f64; 4]; 4] {
    let entry = |i: usize, j: usize| (0..6).map(|k| a[i][k] * a[j][k]).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// `A^T (A A^T)^-1 rhs`.
fn least_norm(a: &Matrix, factor: &[[f64; 4]; 4], rhs: &[Vec3; 4]) -> [Vec3; 6] {
    let mut y: [[f64; 3]; 4] = rhs.map(Into::into);
    cholesky_solve(factor, &mut y);
    let y = y.map(Vec3::from);
    std::array::from_fn(|k| a[0][k] * y[0] + a[1][k] * y[1] + a[2][k] * y[2] + a[3][k] * y[3])
}

fn product(a: &Matrix, x: &[Vec3; 6]) -> [Vec3; 4] {
    std::array::from_fn(|i| (0..6).fold(Vec3::zeros(), |acc, k| acc + a[i][k] * x[k]))
}

fn subtract(a: &[Vec3; 4], b: &[Vec3; 4]) -> [Vec3; 4] {
    std::array::from_fn(|i| a[i] - b[i])
}

fn inner(a: &[Vec3; 6], b: &[Vec3; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
