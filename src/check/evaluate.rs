//! The checker's own evaluation of degree-7 Bézier triangles: single points of one patch.
//!
//! One step of de Casteljau from the top: with the Bernstein polynomials of degree 6,
//! `P_u = sum B6_ijk b_(i+1)jk` and likewise `P_v`, `P_w`; the point is `u P_u + v P_v + w P_w`
//! and the derivative from corner 0 towards corner 1 is `7 (P_v - P_u)`, so one pass gives both.

use crate::surface::Net;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, exponents, index, n_control};

/// Bernstein polynomials of degree 6.
pub(crate) const N_WEIGHTS: usize = n_control(DEGREE - 1);

/// Bernstein values of degree 6 at one barycentric point.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    pub(crate) at: [f64; 3],
    pub(crate) weights: [f64; N_WEIGHTS],
}

impl Stencil {
    pub(crate) fn new(at: [f64; 3]) -> Self {
        let [u, v, w] = at.map(powers);
        let mut weights = [0.0; N_WEIGHTS];
        for (slot, [i, j, k]) in weights.iter_mut().zip(exponents(DEGREE - 1)) {
            let multinomial = FACTORIAL[6] / (FACTORIAL[i] * FACTORIAL[j] * FACTORIAL[k]);
            *slot = multinomial * (u[i] * v[j] * w[k]);
        }
        Self { at, weights }
    }

    /// The point of the patch with this net.
    pub(crate) fn point(&self, net: &Net) -> Vec3 {
        let [u, v, w] = self.at;
        let mut offset = Vec3::zeros();
        for (weight, [a, b, c]) in self.weights.iter().zip(children()) {
            let [a, b, c] = [a, b, c].map(|i| net[i] - net[0]);
            offset += *weight * (u * a + v * b + w * c);
        }
        net[0] + offset
    }
}

/// For each monomial of degree 6, in storage order, the three control points that it weighs.
pub(crate) fn children() -> impl Iterator<Item = [usize; 3]> {
    exponents(DEGREE - 1).map(|[i, j, k]| [[i + 1, j, k], [i, j + 1, k], [i, j, k + 1]].map(index))
}

const FACTORIAL: [f64; 7] = [1.0, 1.0, 2.0, 6.0, 24.0, 120.0, 720.0];

fn powers(x: f64) -> [f64; 7] {
    let mut out = [1.0; 7];
    for i in 1..7 {
        out[i] = out[i - 1] * x;
    }
    out
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::grid;

    /// Blossoms give the net of `u^2 w e_x + v w e_y + u e_z` in degree 7 without evaluation code:
    /// a monomial of degree d has control points equal to its value in falling factorials.
    pub(crate) fn net_of_a_known_cubic() -> Net {
        let mut net = [Vec3::zeros(); 36];
        for e in exponents(7) {
            let [i, j, k] = e.map(|x| x as f64);
            net[index(e)] = Vec3::new(i * (i - 1.0) * k / (7.0 * 6.0 * 5.0), j * k / 42.0, i / 7.0);
        }
        net
    }

    #[test]
    fn points_of_a_known_polynomial_are_right() {
        for at in grid(5) {
            let [u, v, w] = at;
            let found = Stencil::new(at).point(&net_of_a_known_cubic());
            assert!((found - Vec3::new(u * u * w, v * w, u)).norm() < 1e-15);
        }
    }
}
