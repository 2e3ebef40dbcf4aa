//! Normal and second fundamental form of a level set.

use isospline_geometry::{Mat3, Vec3};
use isospline_implicit::Jet2;
use isospline_implicit::field::{SymMat3, full};

/// Second fundamental form `M = -P H P / |grad f|`, `P = I - N N^T` [derived; TK, Eq. (5) is not
/// symmetric and has the other sign], with respect to the outward normal `N`.
///
/// Returns `[xx, xy, xz, yy, yz, zz]` in 1/length: `t^T M t` is the normal curvature along the
/// unit tangent `t`, -1 on the unit sphere. NaN where the gradient vanishes.
pub fn second_fundamental_form(jet: &Jet2) -> SymMat3 {
    let slope = jet.gradient.norm();
    let n = jet.gradient / slope;
    let p = Mat3::identity() - n * n.transpose();
    let m = p * full(&jet.hessian) * p / -slope;
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]
}

/// `a^T M b`.
#[inline]
pub fn apply(m: &SymMat3, a: &Vec3, b: &Vec3) -> f64 {
    let mb = Vec3::new(
        m[0] * b.x + m[1] * b.y + m[2] * b.z,
        m[1] * b.x + m[3] * b.y + m[4] * b.z,
        m[2] * b.x + m[4] * b.y + m[5] * b.z,
    );
    a.dot(&mb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_of_radius_two_has_curvature_minus_a_half_along_every_tangent() {
        let p = 2.0 * Vec3::new(2.0, -1.0, 2.0) / 3.0;
        let jet = Jet2 { value: 0.0, gradient: 2.0 * p, hessian: [2.0, 0.0, 0.0, 2.0, 0.0, 2.0] };
        let m = second_fundamental_form(&jet);
        let t = p.cross(&Vec3::x()).normalize();
        let s = p.cross(&t).normalize();
        assert!((apply(&m, &t, &t) + 0.5).abs() < 1e-15);
        assert!((apply(&m, &s, &s) + 0.5).abs() < 1e-15);
        assert!(apply(&m, &s, &t).abs() < 1e-15);
        assert!(apply(&m, &p, &t).abs() < 1e-15);
    }
}
