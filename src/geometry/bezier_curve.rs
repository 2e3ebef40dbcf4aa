//! Bézier curves of fixed degree.

use crate::Vec3;
use std::ops::{Add, Div, Mul};

/// Binomial coefficients up to 14, exact in f64.
pub fn binomial(n: usize, k: usize) -> f64 {
    (0..k.min(n - k)).fold(1.0, |acc, j| acc * (n - j) as f64 / (j + 1) as f64)
}

/// Values of the Bernstein polynomials of degree `n` at `t`: `C(n,i) t^i (1-t)^(n-i)`, `i = 0..=n`.
pub fn bernstein(n: usize, t: f64) -> Vec<f64> {
    let s = 1.0 - t;
    (0..=n).map(|i| binomial(n, i) * t.powi(i as i32) * s.powi((n - i) as i32)).collect()
}

/// Point at `t` of the curve with these control points, by de Casteljau's algorithm.
pub fn evaluate(control: &[Vec3], t: f64) -> Vec3 {
    let mut points: Vec<Vec3> = control.to_vec();
    for n in (1..points.len()).rev() {
        for i in 0..n {
            points[i] = (1.0 - t) * points[i] + t * points[i + 1];
        }
    }
    points[0]
}

/// Raises a quartic to degree 7: `c_i = sum_j C(4,j) C(3,i-j) / C(7,i) q_j`.
///
/// The sums run from `q0` to `q4`, so the two directions of a curve agree only up to rounding:
/// raise an edge's curve once, from its lower vertex, and copy.
#[expect(clippy::inline_always, reason = "also of many curves together, for wide vectors")]
#[inline(always)]
pub fn raise_quartic_to_septic<V>(q: &[V; 5]) -> [V; 8]
where
    V: Copy + Add<Output = V> + Mul<f64, Output = V> + Div<f64, Output = V>,
{
    [
        q[0],
        (q[0] * 3.0 + q[1] * 4.0) / 7.0,
        (q[0] * 3.0 + q[1] * 12.0 + q[2] * 6.0) / 21.0,
        (q[0] + q[1] * 12.0 + q[2] * 18.0 + q[3] * 4.0) / 35.0,
        (q[1] * 4.0 + q[2] * 18.0 + q[3] * 12.0 + q[4]) / 35.0,
        (q[2] * 6.0 + q[3] * 12.0 + q[4] * 3.0) / 21.0,
        (q[3] * 4.0 + q[4] * 3.0) / 7.0,
        q[4],
    ]
}

/// Raises a quartic to degree 6; the note of [`raise_quartic_to_septic`] holds here too.
#[inline]
pub fn raise_quartic_to_sextic(q: &[Vec3; 5]) -> [Vec3; 7] {
    [
        q[0],
        (q[0] + 2.0 * q[1]) / 3.0,
        (q[0] + q[1] * 8.0 + q[2] * 6.0) / 15.0,
        (q[1] + q[2] * 3.0 + q[3]) / 5.0,
        (q[2] * 6.0 + q[3] * 8.0 + q[4]) / 15.0,
        (2.0 * q[3] + q[4]) / 3.0,
        q[4],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raising_keeps_every_point_of_the_curve() {
        let q = [
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(1.0, 2.0, -1.0),
            Vec3::new(2.0, -1.0, 3.0),
            Vec3::new(3.0, 0.5, 0.25),
            Vec3::new(4.0, 0.0, 1.0),
        ];
        let (sextic, septic) = (raise_quartic_to_sextic(&q), raise_quartic_to_septic(&q));
        for t in [0.0, 0.125, 0.3, 0.5, 0.77, 1.0] {
            assert!((evaluate(&q, t) - evaluate(&sextic, t)).norm() < 1e-14);
            assert!((evaluate(&q, t) - evaluate(&septic, t)).norm() < 1e-14);
        }
    }

    #[test]
    fn bernstein_polynomials_sum_to_one() {
        for n in 0..=14 {
            let sum: f64 = bernstein(n, 0.37).iter().sum();
            assert!((sum - 1.0).abs() < 1e-14);
        }
    }
}
