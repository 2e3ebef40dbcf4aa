//! The checker's own evaluation of degree-7 Bézier triangles.
//!
//! One step of de Casteljau from the top: with the Bernstein polynomials of degree 6,
//! `P_u = sum B6_ijk b_(i+1)jk` and likewise `P_v`, `P_w`; the point is `u P_u + v P_v + w P_w`
//! and the derivative from corner 0 towards corner 1 is `7 (P_v - P_u)`, so one pass gives both.

use crate::surface::Net;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, exponents, index, n_control};

/// Coefficients of the Bernstein polynomials of degree 6.
const N_WEIGHTS: usize = n_control(DEGREE - 1);

/// Bernstein values of degree 6 at one barycentric point.
#[derive(Clone, Debug)]
pub(crate) struct Stencil {
    pub(crate) at: [f64; 3],
    weights: [f64; N_WEIGHTS],
}

/// A point of a patch and its oriented, unnormalised normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PatchPoint {
    pub(crate) point: Vec3,
    pub(crate) normal: Vec3,
    /// Product of the squared lengths of the two derivatives: what `normal` would measure,
    /// squared, if they were orthogonal.
    normal_scale_sq: f64,
}

/// Points evaluated side by side: the nine sums of two points fill the sixteen vector registers
/// of the plainest 64-bit processor; four points spill and take half as long again.
const LANES: usize = 2;

/// Stencils of many points, their weights interleaved by lanes.
#[derive(Clone, Debug)]
pub(crate) struct StencilTable {
    stencils: Vec<Stencil>,
    lanes: Vec<[[f64; LANES]; N_WEIGHTS]>,
}

impl StencilTable {
    /// Barycentric grid with `n` steps a side, corners included.
    pub(crate) fn grid(n: usize) -> Self {
        let stencils: Vec<Stencil> =
            exponents(n).map(|e| Stencil::new(e.map(|x| x as f64 / n as f64))).collect();
        let lanes = stencils
            .chunks(LANES)
            .map(|chunk| {
                let weight = |s: usize, lane: usize| chunk.get(lane).map_or(0.0, |c| c.weights[s]);
                std::array::from_fn(|s| std::array::from_fn(|lane| weight(s, lane)))
            })
            .collect();
        Self { stencils, lanes }
    }

    /// The points, in order.
    pub(crate) fn stencils(&self) -> &[Stencil] {
        &self.stencils
    }
}

/// A patch made ready for evaluation: for each monomial of degree 6 the three control points
/// that it weighs, relative to corner 0.
#[derive(Debug)]
pub(crate) struct PreparedPatch {
    origin: Vec3,
    children: [[f64; 9]; N_WEIGHTS],
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
}

impl PreparedPatch {
    pub(crate) fn new(net: &Net) -> Self {
        let origin = net[0];
        let mut children = [[0.0; 9]; N_WEIGHTS];
        for (slot, [i, j, k]) in children.iter_mut().zip(exponents(DEGREE - 1)) {
            for (c, e) in [[i + 1, j, k], [i, j + 1, k], [i, j, k + 1]].into_iter().enumerate() {
                let p = net[index(e)] - origin;
                slot[3 * c..3 * c + 3].copy_from_slice(p.as_slice());
            }
        }
        Self { origin, children }
    }

    pub(crate) fn evaluate(&self, stencil: &Stencil) -> PatchPoint {
        let mut acc = [0.0; 9];
        for (weight, child) in stencil.weights.iter().zip(&self.children) {
            for c in 0..9 {
                acc[c] += weight * child[c];
            }
        }
        self.assemble(stencil.at, &acc)
    }

    /// Evaluates all points of `table` and hands them to `take` with their index; the same values
    /// as [`Self::evaluate`] gives.
    #[inline]
    pub(crate) fn evaluate_all(
        &self,
        table: &StencilTable,
        mut take: impl FnMut(usize, PatchPoint),
    ) {
        for (chunk, weights) in table.lanes.iter().enumerate() {
            let mut acc = [[0.0; LANES]; 9];
            for (weight, child) in weights.iter().zip(&self.children) {
                for c in 0..9 {
                    for lane in 0..LANES {
                        acc[c][lane] += weight[lane] * child[c];
                    }
                }
            }
            let first = chunk * LANES;
            for (lane, stencil) in table.stencils[first..].iter().take(LANES).enumerate() {
                take(first + lane, self.assemble(stencil.at, &acc.map(|a| a[lane])));
            }
        }
    }

    #[inline]
    fn assemble(&self, [u, v, w]: [f64; 3], acc: &[f64; 9]) -> PatchPoint {
        let [pu, pv, pw] = [0, 3, 6].map(|c| Vec3::new(acc[c], acc[c + 1], acc[c + 2]));
        let (along, across) = (DEGREE as f64 * (pv - pu), DEGREE as f64 * (pw - pu));
        PatchPoint {
            point: self.origin + (u * pu + v * pv + w * pw),
            normal: along.cross(&across),
            normal_scale_sq: along.norm_squared() * across.norm_squared(),
        }
    }
}

impl PatchPoint {
    /// Whether the two derivatives are too nearly parallel to span a tangent plane.
    ///
    /// Below a sine of 1e-10 half of the digits of the normal are rounding.
    #[inline]
    pub(crate) fn is_degenerate(&self) -> bool {
        let spans = self.normal.norm_squared() > 1e-20 * self.normal_scale_sq;
        !spans
    }
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
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::grid;

    /// Blossoms give the net of `u^2 w e_x + v w e_y + u e_z` in degree 7 without evaluation code:
    /// a monomial of degree d has control points equal to its value in falling factorials.
    fn net_of_a_known_cubic() -> Net {
        let mut net = [Vec3::zeros(); 36];
        for e in exponents(7) {
            let [i, j, k] = e.map(|x| x as f64);
            net[index(e)] = Vec3::new(i * (i - 1.0) * k / (7.0 * 6.0 * 5.0), j * k / 42.0, i / 7.0);
        }
        net
    }

    #[test]
    fn points_and_normals_of_a_known_polynomial_are_right() {
        let patch = PreparedPatch::new(&net_of_a_known_cubic());
        for at in grid(5) {
            let [u, v, w] = at;
            let found = patch.evaluate(&Stencil::new(at));
            assert!((found.point - Vec3::new(u * u * w, v * w, u)).norm() < 1e-15);
            let along = Vec3::new(-2.0 * u * w, w, -1.0);
            let across = Vec3::new(u * u - 2.0 * u * w, v, -1.0);
            assert!((found.normal - along.cross(&across)).norm() < 1e-14);
        }
    }

    #[test]
    fn a_table_of_points_gives_the_bits_of_single_points() {
        let patch = PreparedPatch::new(&net_of_a_known_cubic());
        for n in [1, 2, 4, 7] {
            let table = StencilTable::grid(n);
            let mut seen = 0;
            patch.evaluate_all(&table, |i, found| {
                let single = patch.evaluate(&table.stencils()[i]);
                assert_eq!((i, found.point, found.normal), (seen, single.point, single.normal));
                seen += 1;
            });
            assert_eq!(seen, table.stencils().len());
        }
    }

    #[test]
    fn a_patch_drawn_out_to_a_line_is_degenerate() {
        let mut net = [Vec3::zeros(); 36];
        for e in exponents(7) {
            net[index(e)] = Vec3::new(e[0] as f64, 0.0, 1.0);
        }
        let found = PreparedPatch::new(&net).evaluate(&Stencil::new([0.25, 0.25, 0.5]));
        assert!(found.is_degenerate());
    }
}
