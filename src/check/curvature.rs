//! Jump of the normal curvature across shared edges, from second derivatives of the patches.

use crate::lent_threads::{ForEach, map};
use crate::surface::Surface;
use crate::topology::{Joint, Topology};
use isospline_geometry::bezier_triangle::{DEGREE, index};
use isospline_geometry::{HalfEdge, Vec3};

/// Percentiles over edges of their relative curvature jumps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvatureJump {
    pub(crate) median: f64,
    pub(crate) p99: f64,
}

/// Points an edge, ends included: `t = i / 8` and `1 - t` are exact.
const N_EDGE_POINTS: usize = 9;
/// Curvature, over the diagonal, below which a jump is not divided by it: planes have none.
const FLAT_REL: f64 = 1e-3;

/// Measures every edge with two faces.
///
/// The normal curvature is taken along the direction normal to the edge in the tangent plane,
/// from each side; an edge's figure is its largest jump over its largest curvature.
pub(crate) fn measure(
    surface: &Surface<'_>,
    topology: &Topology,
    for_each: ForEach<'_>,
) -> CurvatureJump {
    let joints = &topology.joints;
    let flat = FLAT_REL / surface.diagonal();
    let jumps = map(for_each, joints.len(), |range| {
        joints[range].iter().map(|&joint| relative_jump(surface, joint, flat)).collect()
    });
    percentiles(jumps)
}

fn relative_jump(surface: &Surface<'_>, joint: Joint, flat: f64) -> f64 {
    let (left, right) = (Rows::of(surface, joint.left), Rows::of(surface, joint.right));
    let (mut jump, mut scale) = (0.0_f64, flat);
    for i in 0..N_EDGE_POINTS {
        let t = i as f64 / (N_EDGE_POINTS - 1) as f64;
        let (a, b) = (left.curvature_across(t), right.curvature_across(1.0 - t));
        if !(a.is_finite() && b.is_finite()) {
            return f64::NAN;
        }
        jump = jump.max((a - b).abs());
        scale = scale.max(a.abs()).max(b.abs());
    }
    jump / scale
}

/// First and second derivatives of a patch at a half-edge, as Bézier curves along it.
struct Rows {
    along: [Vec3; DEGREE],
    inward: [Vec3; DEGREE],
    along_along: [Vec3; DEGREE - 1],
    along_inward: [Vec3; DEGREE - 1],
    inward_inward: [Vec3; DEGREE - 1],
}

impl Rows {
    fn of(surface: &Surface<'_>, h: HalfEdge) -> Self {
        // symbols: n the degree; rows b of the net, the boundary first
        let net = surface.net(h.face() as usize);
        let b = |row: usize, s: usize| net[row_index(h.corner() as usize, row, s)];
        let n = DEGREE as f64;
        let m = n * (n - 1.0);
        let along: [Vec3; DEGREE] = std::array::from_fn(|s| b(0, s + 1) - b(0, s));
        let inward: [Vec3; DEGREE] = std::array::from_fn(|s| b(1, s) - b(0, s));
        Self {
            along: along.map(|d| n * d),
            inward: inward.map(|d| n * d),
            along_along: std::array::from_fn(|s| m * (along[s + 1] - along[s])),
            along_inward: std::array::from_fn(|s| m * (inward[s + 1] - inward[s])),
            inward_inward: std::array::from_fn(|s| m * (b(2, s) - b(1, s) - inward[s])),
        }
    }

    /// Normal curvature at `t` of the half-edge along the direction normal to it.
    fn curvature_across(&self, t: f64) -> f64 {
        let (along, inward) = (at(t, self.along), at(t, self.inward));
        let normal = along.cross(&inward).normalize();
        let across = normal.cross(&along).normalize();
        // across = x along + y inward
        let y = 1.0 / inward.dot(&across);
        let x = -y * inward.dot(&along) / along.norm_squared();
        let form = |row: &[Vec3; DEGREE - 1]| at(t, *row).dot(&normal);
        x * x * form(&self.along_along)
            + 2.0 * x * y * form(&self.along_inward)
            + y * y * form(&self.inward_inward)
    }
}

/// Index of the control point `s` steps along the row `row` within the edge from `corner`.
fn row_index(corner: usize, row: usize, s: usize) -> usize {
    let mut e = [0; 3];
    e[corner] = DEGREE - row - s;
    e[(corner + 1) % 3] = s;
    e[(corner + 2) % 3] = row;
    index(e)
}

/// Point at `t` of the Bézier curve with these control points, by de Casteljau's algorithm.
fn at<const N: usize>(t: f64, mut points: [Vec3; N]) -> Vec3 {
    for n in (1..N).rev() {
        for s in 0..n {
            points[s] = (1.0 - t) * points[s] + t * points[s + 1];
        }
    }
    points[0]
}

fn percentiles(mut values: Vec<f64>) -> CurvatureJump {
    if values.is_empty() || values.iter().any(|x| x.is_nan()) {
        return CurvatureJump { median: f64::NAN, p99: f64::NAN };
    }
    values.sort_unstable_by(f64::total_cmp);
    let reached = |percent: usize| values[(values.len() * percent).div_ceil(100) - 1];
    CurvatureJump { median: reached(50), p99: reached(99) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Net;
    use isospline_geometry::bezier_triangle::exponents;

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

    fn jump(left: f64, right: f64) -> CurvatureJump {
        let surface = two_graphs(left, right);
        measure(&surface, &Topology::of(&surface), &|n, body| (0..n).for_each(body))
    }

    #[test]
    fn a_known_jump_is_measured() {
        // At (x, 0) the graph has slope x in y: across the edge k = c / (1 + x^2)^(3/2), so both
        // the largest jump and the largest curvature stand at the origin.
        assert!((jump(2.0, 1.5).p99 - 0.25).abs() < 1e-13);
        assert!((jump(-1.0, 1.0).median - 2.0).abs() < 1e-13);
    }

    #[test]
    fn one_polynomial_on_both_sides_has_no_jump() {
        assert!(jump(1.3, 1.3).p99 < 1e-13);
    }

    #[test]
    fn flat_patches_are_held_against_the_diagonal() {
        let surface = two_graphs(0.0, 0.0);
        let found = jump(0.0, 1e-6).p99;
        let expected = 1e-6 / (FLAT_REL / surface.diagonal());
        assert!((found / expected - 1.0).abs() < 1e-6, "{found:e} {expected:e}");
    }
}
