//! Eight patches evaluated side by side, single points or a grid row by row.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::evaluate::{N_WEIGHTS, Stencil, children};
use crate::grid::{N_CURVE, Row};
use crate::lanes::{LANES, Lane, Triple, minus, put, weighed};
use crate::surface::Net;
use isospline_implicit::{Kernel, run_widest};

/// Eight patches made ready: for each monomial of degree 6, with `a`, `b`, `c` the control points
/// that it weighs for corners 0, 1 and 2, `a` relative to corner 0 of the net, `b - a` and `c - a`.
///
/// Differences are formed before they are weighed: normals then keep their digits on patches that
/// are small against their distance from the origin.
///
/// Aligned as all that is loaded vector by vector: every second load would meet two cache lines.
#[repr(C, align(64))]
pub(crate) struct Octet {
    /// Corner 0 of each net.
    pub(crate) origin: Triple,
    coefficients: [Coefficient; N_WEIGHTS],
}

/// Three vectors of each patch.
type Coefficient = [Lane; 9];

/// The polynomials along a row of a grid.
#[repr(C, align(64))]
pub(crate) struct Curve([Coefficient; N_CURVE]);

/// A point of each patch and a seventh of its derivatives.
pub(crate) struct PatchPoints {
    /// From corner 0.
    pub(crate) offset: Triple,
    /// From corner 0 towards corner 1.
    pub(crate) along: Triple,
    /// From corner 0 towards corner 2.
    pub(crate) across: Triple,
}

impl Octet {
    pub(crate) fn new() -> Self {
        Self { origin: [[0.0; LANES]; 3], coefficients: [[[0.0; LANES]; 9]; N_WEIGHTS] }
    }

    /// Takes in other patches, 1 to 8 of them; idle places hold the last one.
    pub(crate) fn set(&mut self, nets: &[Net]) {
        run_widest(Fill { octet: self, nets });
    }

    /// The point of each patch at a stencil.
    #[inline(always)]
    pub(crate) fn at(&self, stencil: &Stencil) -> PatchPoints {
        let terms = stencil.weights.iter().copied().zip(&self.coefficients);
        PatchPoints::new(stencil.at, &weighed(terms))
    }
}

impl Curve {
    pub(crate) fn new() -> Self {
        Self([[[0.0; LANES]; 9]; N_CURVE])
    }

    /// Becomes that of a row.
    #[inline(always)]
    pub(crate) fn set(&mut self, octet: &Octet, row: &Row) {
        for (out, sum) in self.0.iter_mut().zip(&row.sums) {
            *out = weighed(sum.iter().map(|&(i, weight)| (weight, &octet.coefficients[i])));
        }
    }

    /// The point of each patch at a point of the row.
    #[inline(always)]
    pub(crate) fn at(&self, (at, weights): &([f64; 3], [f64; N_CURVE])) -> PatchPoints {
        PatchPoints::new(*at, &weighed(weights.iter().copied().zip(&self.0)))
    }
}

impl PatchPoints {
    /// `u P_u + v P_v + w P_w = P_u + v (P_v - P_u) + w (P_w - P_u)`.
    #[inline(always)]
    fn new([_, v, w]: [f64; 3], sum: &Coefficient) -> Self {
        let [x, y, z, along @ .., _, _, _] = *sum;
        let across = [sum[6], sum[7], sum[8]];
        let mut offset = [x, y, z];
        for c in 0..3 {
            for k in 0..LANES {
                offset[c][k] += v * along[c][k] + w * across[c][k];
            }
        }
        Self { offset, along, across }
    }
}

struct Fill<'a> {
    octet: &'a mut Octet,
    nets: &'a [Net],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let mut control = [[[0.0; LANES]; 3]; 36];
        for k in 0..LANES {
            let net = &self.nets[k.min(self.nets.len() - 1)];
            for (out, point) in control.iter_mut().zip(net) {
                (out[0][k], out[1][k], out[2][k]) = (point.x, point.y, point.z);
            }
        }
        let octet = self.octet;
        octet.origin = control[0];
        for (out, [a, b, c]) in octet.coefficients.iter_mut().zip(children()) {
            let parts = [
                minus(&control[a], &octet.origin),
                minus(&control[b], &control[a]),
                minus(&control[c], &control[a]),
            ];
            put(parts, out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tests::net_of_a_known_cubic;
    use crate::grid::Grid;
    use isospline_geometry::Vec3;
    use isospline_geometry::bezier_triangle::{exponents, index};

    /// Numbers without a pattern, in (-1, 1).
    fn noise(seed: usize) -> impl FnMut() -> f64 {
        let mut state = seed as u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// Random nets: two wild ones, a small one far from the origin, and degenerate ones: drawn to a
    /// line, to a point, with two corners in one place.
    fn nets(seed: usize) -> Vec<Net> {
        let mut random = noise(seed);
        let mut vector = || Vec3::new(random(), random(), random());
        let wild: [Net; 6] = std::array::from_fn(|_| std::array::from_fn(|_| vector()));
        let line = wild[3].map(|p| p.x * Vec3::new(1.0, -2.0, 0.5));
        let mut wedge = wild[5];
        (0..8).for_each(|s| wedge[index([0, 7 - s, s])] = wedge[28]);
        let small = wild[2].map(|p| Vec3::new(100.0, -200.0, 300.0) + 1e-3 * p);
        vec![wild[0], wild[1], small, line, [wild[4][0]; 36], wedge, net_of_a_known_cubic()]
    }

    /// Point relative to corner 0 and derivatives over 7 by de Casteljau's algorithm, step by step
    /// over the whole net.
    fn de_casteljau(net: &Net, [u, v, w]: [f64; 3]) -> [Vec3; 3] {
        let mut points: Vec<Vec3> = net.iter().map(|p| p - net[0]).collect();
        for n in (1..7).rev() {
            points = exponents(n)
                .map(|[i, j, k]| {
                    let at = |e| points[index(e)];
                    u * at([i + 1, j, k]) + v * at([i, j + 1, k]) + w * at([i, j, k + 1])
                })
                .collect();
        }
        let [a, b, c] = [points[0], points[1], points[2]];
        [u * a + v * b + w * c, b - a, c - a]
    }

    fn compare(octet: &Octet, nets: &[Net], at: [f64; 3], found: &PatchPoints) {
        for k in 0..LANES {
            let net = &nets[k.min(nets.len() - 1)];
            let vector = |t: &Triple| Vec3::new(t[0][k], t[1][k], t[2][k]);
            assert_eq!(vector(&octet.origin), net[0]);
            let size = net.iter().map(|p| (p - net[0]).norm()).fold(0.0, f64::max);
            let found = [&found.offset, &found.along, &found.across].map(vector);
            for (found, expected) in found.iter().zip(de_casteljau(net, at)) {
                let apart = (found - expected).norm();
                assert!(apart <= 2e-15 * size, "patch {k} at {at:?}: {apart:e} {size:e}");
            }
        }
    }

    #[test]
    fn every_point_of_the_grid_is_where_de_casteljaus_algorithm_puts_it() {
        let (mut octet, mut curve) = (Octet::new(), Curve::new());
        for (seed, n) in [(1, 1), (2, 3), (3, 16)] {
            let (grid, nets) = (Grid::new(n), nets(seed));
            octet.set(&nets);
            for row in grid.rows() {
                curve.set(&octet, row);
                for point in &row.points {
                    compare(&octet, &nets, point.0, &curve.at(point));
                }
            }
            for &at in grid.places() {
                compare(&octet, &nets, at, &octet.at(&Stencil::new(at)));
            }
        }
    }

    #[test]
    fn derivatives_of_a_known_polynomial_are_right() {
        let mut octet = Octet::new();
        octet.set(&[net_of_a_known_cubic()]);
        for &at in Grid::new(5).places() {
            let [u, v, w] = at;
            let found = octet.at(&Stencil::new(at));
            let vector = |t: &Triple| 7.0 * Vec3::new(t[0][7], t[1][7], t[2][7]);
            let (along, across) = (vector(&found.along), vector(&found.across));
            assert!((along - Vec3::new(-2.0 * u * w, w, -1.0)).norm() < 1e-14);
            assert!((across - Vec3::new(u * u - 2.0 * u * w, v, -1.0)).norm() < 1e-14);
        }
    }
}
