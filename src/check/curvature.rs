//! Jump of the normal curvature across shared edges, from second derivatives of the patches.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::grid::bernstein;
use crate::lanes::{LANES, Lane, cross, dot, minus, put, vector, weighed};
use crate::percentile::percentile;
use crate::report::worse;
use crate::seam::{Both, Derivatives, N_EDGE_POINTS, Seam, Side};
use isospline_geometry::bezier_triangle::DEGREE;

/// Percentiles over edges of their relative curvature jumps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvatureJump {
    pub(crate) median: f64,
    pub(crate) p99: f64,
}

/// Points an edge, ends included: `t = i / 8` and `1 - t` are exact.
const N_POINTS: usize = 9;
/// One of them in so many of those at which normals are compared.
const STEP: usize = (N_EDGE_POINTS - 1) / (N_POINTS - 1);
/// Those of eight edges.
const N_CURVATURES: usize = LANES * N_POINTS;
/// Curvature, over the diagonal, below which a jump is not divided by it: planes have none.
pub(crate) const FLAT_REL: f64 = 1e-3;

/// Bernstein polynomials of degree 5 at the points of an edge.
pub(crate) struct CurvatureTable([Weights; N_POINTS]);

/// Those at one point.
type Weights = [f64; DEGREE - 1];

impl CurvatureTable {
    pub(crate) fn new() -> Self {
        Self(std::array::from_fn(|i| bernstein(i as f64 / (N_POINTS - 1) as f64)))
    }
}

/// Second derivatives over 42 at all points of eight edges, those of a point beside each other.
#[repr(C, align(64))]
pub(crate) struct Second {
    along_along: [[f64; N_CURVATURES]; 3],
    along_inward: [[f64; N_CURVATURES]; 3],
    inward_inward: [[f64; N_CURVATURES]; 3],
}

/// The relative jump of each of eight edges, from the derivatives on both sides.
///
/// The normal curvature is taken along the direction normal to the edge in the tangent plane,
/// from each side; an edge's figure is its largest jump over its largest curvature, which counts as
/// `flat` at least.
#[inline(always)]
pub(crate) fn relative_jumps(first: &Both<Derivatives>, second: &Both<Second>, flat: f64) -> Lane {
    let a = curvatures(&first.left, &second.left);
    let b = curvatures(&first.right, &second.right);
    let (mut jump, mut scale) = ([0.0; LANES], [flat; LANES]);
    for (a, b) in a.iter().zip(&b) {
        for k in 0..LANES {
            jump[k] = worse(jump[k], (a[k] - b[k]).abs());
            scale[k] = worse(worse(scale[k], a[k].abs()), b[k].abs());
        }
    }
    // What is infinite becomes not-a-number here.
    std::array::from_fn(|k| jump[k] / scale[k])
}

impl Second {
    pub(crate) fn new() -> Self {
        let zero = [[0.0; N_CURVATURES]; 3];
        Self { along_along: zero, along_inward: zero, inward_inward: zero }
    }

    /// Become those on both sides of a seam, the points in the order of the left one.
    #[inline(always)]
    pub(crate) fn set_both(both: &mut Both<Self>, seam: &Seam, table: &CurvatureTable) {
        let CurvatureTable(points) = table;
        both.left.set(&seam.left, points.iter());
        both.right.set(&seam.right, points.iter().rev());
    }

    #[inline(always)]
    fn set<'a>(&mut self, side: &Side, points: impl Iterator<Item = &'a Weights>) {
        let differences = second_differences(side);
        for (i, weights) in points.enumerate() {
            let sum = weighed(weights.iter().copied().zip(&differences));
            for c in 0..3 {
                self.along_along[c][LANES * i..][..LANES].copy_from_slice(&sum[c]);
                self.along_inward[c][LANES * i..][..LANES].copy_from_slice(&sum[3 + c]);
                self.inward_inward[c][LANES * i..][..LANES].copy_from_slice(&sum[6 + c]);
            }
        }
    }
}

/// Second differences of the net: twice along the edge, along it and inward, twice inward.
#[inline(always)]
fn second_differences(side: &Side) -> [[Lane; 9]; DEGREE - 1] {
    let mut out = [[[0.0; LANES]; 9]; DEGREE - 1];
    for (s, out) in out.iter_mut().enumerate() {
        let (along, inward) = (side.along(s), side.inward(s));
        let parts = [
            minus(&side.along(s + 1), &along),
            minus(&side.inward(s + 1), &inward),
            minus(&minus(side.second(s), side.inner(s)), &inward),
        ];
        put(parts, out);
    }
    out
}

/// Normal curvatures at all points along the direction normal to the edge.
#[inline(always)]
fn curvatures(first: &Derivatives, second: &Second) -> [Lane; N_POINTS] {
    let mut out = [[0.0; LANES]; N_POINTS];
    for (point, out) in out.iter_mut().enumerate() {
        let (at, first_at) = (LANES * point, LANES * STEP * point);
        for k in 0..LANES {
            let along = vector(&first.along, first_at + k);
            let inward = vector(&first.inward, first_at + k);
            let seconds = [&second.along_along, &second.along_inward, &second.inward_inward];
            out[k] = curvature_across(along, inward, seconds.map(|d| vector(d, at + k)));
        }
    }
    out
}

/// Normal curvature along the direction normal to `along`, from first derivatives over 7 and second
/// derivatives over 42.
#[inline(always)]
fn curvature_across(along: [f64; 3], inward: [f64; 3], second: [[f64; 3]; 3]) -> f64 {
    // symbols: n the degree; across = x along + y inward
    let n = DEGREE as f64;
    let normal = unit(cross(along, inward));
    let across = unit(cross(normal, along));
    let y = 1.0 / dot(inward, across);
    let x = -y * dot(inward, along) / dot(along, along);
    let [aa, ab, bb] = second.map(|d| dot(d, normal));
    (n - 1.0) / n * (x * x * aa + 2.0 * x * y * ab + y * y * bb)
}

#[inline(always)]
fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// Median and 99th percentile; not-a-number if one of the jumps is, or if there is none.
pub(crate) fn percentiles(jumps: &mut [f64]) -> CurvatureJump {
    CurvatureJump { median: percentile(jumps, 50), p99: percentile(jumps, 99) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edges::Gauge;
    use crate::surface::{Net, Surface};
    use crate::topology::Topology;
    use isospline_geometry::Vec3;
    use isospline_geometry::bezier_triangle::{exponents, index};
    use isospline_implicit::Jet1;

    /// The graph of `c y^2 / 2 + x y` over the triangle (0,0), (1,0), (0.5, side), degree 7.
    fn graph(c: f64, side: f64) -> Net {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.5, side]];
        let polar = |p: [f64; 2], q: [f64; 2]| {
            0.5 * c * p[1] * q[1] + 0.5 * p[0] * q[1] + 0.5 * p[1] * q[0]
        };
        let mut net = [Vec3::zeros(); 36];
        for e in exponents(DEGREE) {
            let (mut x, mut y, mut z) = (0.0, 0.0, 0.0);
            for i in 0..3 {
                let w = e[i] as f64 / 7.0;
                x += w * corners[i][0];
                y += w * corners[i][1];
                for j in 0..3 {
                    let pairs = if i == j { e[i] * e[i].saturating_sub(1) } else { e[i] * e[j] };
                    z += pairs as f64 / 42.0 * polar(corners[i], corners[j]);
                }
            }
            net[index(e)] = Vec3::new(x, y, z);
        }
        net
    }

    /// Two quadratic graphs that meet along the x axis with the curvatures `left` and `right`
    /// across it at the origin.
    fn two_graphs(left: f64, right: f64) -> Surface<'static> {
        let (above, below) = (graph(left, 0.8), graph(right, -0.9));
        // The second face runs from (1, 0) to (0, 0): corners 0 and 1 change places.
        let mut turned = below;
        for [i, j, k] in exponents(DEGREE) {
            turned[index([j, i, k])] = below[index([i, j, k])];
        }
        let vertices = vec![above[0], above[index([0, 7, 0])], above[35], below[35]];
        Surface::new(vertices, vec![[0, 1, 2], [1, 0, 3]], vec![above, turned]).unwrap()
    }

    fn jump(left: f64, right: f64) -> f64 {
        let surface = two_graphs(left, right);
        let flat = Jet1 { value: 0.0, gradient: Vec3::z() };
        let at_vertices = vec![flat; surface.vertices().len()];
        let joints = Topology::of(&surface).joints;
        let jumps = Gauge::new(&surface, &at_vertices).measure(&joints).jumps;
        assert_eq!(jumps.len(), 1);
        jumps[0]
    }

    #[test]
    fn a_known_jump_is_measured() {
        // At (x, 0) the graph has slope x in y: across the edge k = c / (1 + x^2)^(3/2), so both
        // the largest jump and the largest curvature stand at the origin.
        assert!((jump(2.0, 1.5) - 0.25).abs() < 1e-13);
        assert!((jump(-1.0, 1.0) - 2.0).abs() < 1e-13);
    }

    #[test]
    fn one_polynomial_on_both_sides_has_no_jump() {
        assert!(jump(1.3, 1.3) < 1e-13);
    }

    #[test]
    fn flat_patches_are_held_against_the_diagonal() {
        let surface = two_graphs(0.0, 0.0);
        let found = jump(0.0, 1e-6);
        let expected = 1e-6 / (FLAT_REL / surface.diagonal());
        assert!((found / expected - 1.0).abs() < 1e-6, "{found:e} {expected:e}");
    }
}
