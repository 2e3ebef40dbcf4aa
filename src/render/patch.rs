//! Degree-7 patches made ready for evaluation: point, first and second derivatives in one pass.
//!
//! Two steps of de Casteljau from the top: with the Bernstein polynomials of degree 5,
//! `S_ab = sum B5_ijk b_(ijk + a + b)` for the six pairs of corners a, b; the point is
//! `sum a b S_ab` and every first and second derivative is a difference of the same six sums.

use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, index, n_control};

/// Coefficients of the Bernstein polynomials of degree 5.
const N_TERMS: usize = n_control(DEGREE - 2);
/// Pairs of corners, in the order of the sums.
const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// A patch, relative to its corner 0.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    origin: Vec3,
    /// For each term the six control points that it weighs, in the order of [`PAIRS`].
    children: [[f64; 18]; N_TERMS],
}

/// Point and derivatives at barycentric (1 - v - w, v, w).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet {
    pub(crate) point: Vec3,
    pub(crate) dv: Vec3,
    pub(crate) dw: Vec3,
    pub(crate) dvv: Vec3,
    pub(crate) dvw: Vec3,
    pub(crate) dww: Vec3,
}

/// Curvatures with respect to the outward normal: -1/r on a sphere of radius r.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curvature {
    /// Half the sum of the principal curvatures, 1/length.
    pub(crate) mean: f64,
    /// Their product, 1/length^2.
    pub(crate) gaussian: f64,
}

impl Patch {
    pub(crate) fn new(net: &[Vec3; N_CONTROL]) -> Self {
        let origin = net[0];
        let mut children = [[0.0; 18]; N_TERMS];
        for (child, term) in children.iter_mut().zip(&TERMS) {
            for (place, pair) in PAIRS.iter().enumerate() {
                let mut exponents = term.exponents;
                for &corner in pair {
                    exponents[corner] += 1;
                }
                let p = net[index(exponents)] - origin;
                child[3 * place..3 * place + 3].copy_from_slice(p.as_slice());
            }
        }
        Self { origin, children }
    }

    /// Everything at (v, w); u is 1 - v - w.
    pub(crate) fn jet(&self, [v, w]: [f64; 2]) -> Jet {
        let u = 1.0 - v - w;
        let (us, vs, ws) = (powers(u), powers(v), powers(w));
        let mut sums = [0.0; 18];
        for (term, child) in TERMS.iter().zip(&self.children) {
            let [i, j, k] = term.exponents;
            let weight = term.factor * (us[i] * vs[j] * ws[k]);
            for c in 0..18 {
                sums[c] += weight * child[c];
            }
        }
        let s = |place: usize| Vec3::new(sums[3 * place], sums[3 * place + 1], sums[3 * place + 2]);
        let [uu, uv, uw, vv, vw, ww] = std::array::from_fn(s);
        let (pu, pv, pw) =
            (u * uu + v * uv + w * uw, u * uv + v * vv + w * vw, u * uw + v * vw + w * ww);
        let (n, m) = (DEGREE as f64, (DEGREE * (DEGREE - 1)) as f64);
        Jet {
            point: self.origin + (u * pu + v * pv + w * pw),
            dv: n * (pv - pu),
            dw: n * (pw - pu),
            dvv: m * (vv - 2.0 * uv + uu),
            dvw: m * (vw - uv - uw + uu),
            dww: m * (ww - 2.0 * uw + uu),
        }
    }

    /// Bound of `|d_vv| + 2 |d_vw| + |d_ww|` over the patch, model units: its triangle of n steps
    /// a side lies within an eighth of that over n^2 [derived: Taylor about the corners].
    pub(crate) fn bend(&self) -> f64 {
        let mut most = [0.0_f64; 3];
        for child in &self.children {
            let s = |p: usize| Vec3::new(child[3 * p], child[3 * p + 1], child[3 * p + 2]);
            let seconds =
                [s(3) - 2.0 * s(1) + s(0), s(4) - s(1) - s(2) + s(0), s(5) - 2.0 * s(2) + s(0)];
            for (most, second) in most.iter_mut().zip(seconds) {
                *most = most.max(second.norm());
            }
        }
        (DEGREE * (DEGREE - 1)) as f64 * (most[0] + 2.0 * most[1] + most[2])
    }
}

impl Jet {
    /// Outward normal, not of unit length.
    pub(crate) fn normal(&self) -> Vec3 {
        self.dv.cross(&self.dw)
    }

    /// Curvatures by the two fundamental forms; not a number where the derivatives are parallel.
    pub(crate) fn curvature(&self) -> Curvature {
        // symbols: e f g the first, l m n the second fundamental form
        let (e, f, g) = (self.dv.dot(&self.dv), self.dv.dot(&self.dw), self.dw.dot(&self.dw));
        let normal = self.normal().normalize();
        let (l, m, n) = (self.dvv.dot(&normal), self.dvw.dot(&normal), self.dww.dot(&normal));
        let area_sq = e * g - f * f;
        let mean = (e * n - 2.0 * f * m + g * l) / (2.0 * area_sq);
        Curvature { mean, gaussian: (l * n - m * m) / area_sq }
    }
}

/// One Bernstein polynomial of degree 5.
#[derive(Clone, Copy, Debug)]
struct Term {
    exponents: [usize; 3],
    factor: f64,
}

const TERMS: [Term; N_TERMS] = terms();

const fn terms() -> [Term; N_TERMS] {
    const FACTORIAL: [f64; 6] = [1.0, 1.0, 2.0, 6.0, 24.0, 120.0];
    let mut out = [Term { exponents: [0; 3], factor: 0.0 }; N_TERMS];
    let (mut at, mut r) = (0, 0);
    while r <= DEGREE - 2 {
        let mut k = 0;
        while k <= r {
            let [i, j] = [DEGREE - 2 - r, r - k];
            let factor = FACTORIAL[5] / (FACTORIAL[i] * FACTORIAL[j] * FACTORIAL[k]);
            out[at] = Term { exponents: [i, j, k], factor };
            at += 1;
            k += 1;
        }
        r += 1;
    }
    out
}

fn powers(x: f64) -> [f64; 6] {
    let mut out = [1.0; 6];
    for i in 1..6 {
        out[i] = out[i - 1] * x;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{bowl_net, polynomial_net};

    #[test]
    fn every_derivative_of_a_known_polynomial_is_right() {
        // x = u^2 w, y = v w, z = u in terms of v and w alone.
        let patch = Patch::new(&polynomial_net());
        for [v, w] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.2, 0.3], [0.7, 0.1], [1.1, -0.2]] {
            let u = 1.0 - v - w;
            let jet = patch.jet([v, w]);
            let close = |found: Vec3, x: f64, y: f64, z: f64| {
                assert!((found - Vec3::new(x, y, z)).norm() < 1e-13, "{found} {x} {y} {z}");
            };
            close(jet.point, u * u * w, v * w, u);
            close(jet.dv, -2.0 * u * w, w, -1.0);
            close(jet.dw, u * u - 2.0 * u * w, v, -1.0);
            close(jet.dvv, 2.0 * w, 0.0, 0.0);
            close(jet.dvw, 2.0 * w - 2.0 * u, 1.0, 0.0);
            close(jet.dww, 2.0 * w - 4.0 * u, 0.0, 0.0);
        }
    }

    #[test]
    fn curvatures_of_a_bowl_are_those_of_its_closed_form() {
        // z = (a x^2 + b y^2) / 2, normal upwards.
        let (a, b) = (1.5, -0.7);
        let patch = Patch::new(&bowl_net(a, b));
        for at in [[0.3, 0.3], [0.0, 0.5], [0.9, 0.05], [1.0 / 3.0, 1.0 / 3.0]] {
            let jet = patch.jet(at);
            let (x, y) = (jet.point.x, jet.point.y);
            let slope = 1.0 + a * a * x * x + b * b * y * y;
            let mean =
                (a * (1.0 + b * b * y * y) + b * (1.0 + a * a * x * x)) / (2.0 * slope.powf(1.5));
            let found = jet.curvature();
            assert!((found.mean - mean).abs() < 1e-12, "{} {mean}", found.mean);
            assert!((found.gaussian - a * b / (slope * slope)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_patch_lies_as_near_to_its_triangles_as_its_bend_says() {
        let patch = Patch::new(&bowl_net(1.5, -0.7));
        for n in [1.0, 2.0, 5.0, 9.0] {
            let at = |i: usize, j: usize| [i as f64 / n, j as f64 / n];
            let bound = patch.bend() / (8.0 * n * n);
            let corners = [at(0, 0), at(1, 0), at(0, 1)].map(|c| patch.jet(c).point);
            let middle = patch.jet([0.5 / n, 0.5 / n]).point;
            let off = (middle - 0.5 * (corners[1] + corners[2])).norm();
            assert!(off <= bound && off > 0.0, "{off} {bound}");
        }
    }
}
