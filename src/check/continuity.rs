//! Gaps and angles between patches along their shared edges.

use crate::lent_threads::{ForEach, map};
use crate::report::{Place, worse};
use crate::surface::Surface;
use crate::topology::{Joint, Topology};
use isospline_geometry::bezier_triangle::{DEGREE, boundary_index, first_inner_index};
use isospline_geometry::{HalfEdge, Vec3};

/// What the shared edges show; gaps in model units.
#[derive(Debug)]
pub(crate) struct Continuity {
    pub(crate) gap: f64,
    /// Part of `gap`: net corners against vertices.
    pub(crate) corner_gap: f64,
    pub(crate) bits_differ: u64,
    pub(crate) angle_deg_max: f64,
    pub(crate) angle_deg_p99: f64,
    pub(crate) worst_angle: Option<Place>,
    pub(crate) degenerate_normals: u64,
}

/// Points an edge at which normals are compared, ends included: `t = i / 32` and `1 - t` are
/// exact, so both patches are evaluated at the same parameter.
const N_EDGE_POINTS: usize = 33;

pub(crate) fn measure(
    surface: &Surface<'_>,
    topology: &Topology,
    for_each: ForEach<'_>,
) -> Continuity {
    let table = bernstein_table();
    let joints = &topology.joints;
    let edges = map(for_each, joints.len(), |range| {
        joints[range].iter().map(|&joint| EdgeFigures::of(surface, joint, &table)).collect()
    });
    let mut out = corners(surface);
    for edge in &edges {
        out.gap = worse(out.gap, edge.gap);
        out.bits_differ += u64::from(edge.bits_differ);
        out.degenerate_normals += edge.degenerate;
        if out.worst_angle.is_none() || edge.angle_deg > out.angle_deg_max {
            out.worst_angle = Some(edge.place());
        }
        out.angle_deg_max = worse(out.angle_deg_max, edge.angle_deg);
    }
    out.angle_deg_p99 = percentile_99(edges.iter().map(|e| e.angle_deg).collect());
    out
}

/// Net corners against vertices.
fn corners(surface: &Surface<'_>) -> Continuity {
    let (mut gap, mut bits_differ) = (0.0, 0);
    for (f, face) in surface.faces().iter().enumerate() {
        let net = surface.net(f);
        for (corner, &v) in face.iter().enumerate() {
            let (p, q) = (net[boundary_index(DEGREE, corner, 0)], surface.vertices()[v as usize]);
            gap = worse(gap, (p - q).norm());
            bits_differ += u64::from(!same_bits(&p, &q));
        }
    }
    Continuity {
        gap,
        corner_gap: gap,
        bits_differ,
        angle_deg_max: 0.0,
        angle_deg_p99: 0.0,
        worst_angle: None,
        degenerate_normals: 0,
    }
}

#[derive(Clone, Copy, Debug)]
struct EdgeFigures {
    left: HalfEdge,
    gap: f64,
    bits_differ: bool,
    angle_deg: f64,
    /// Place of the largest angle on the edge: index of its parameter and point.
    worst: (usize, Vec3),
    degenerate: u64,
}

impl EdgeFigures {
    fn of(surface: &Surface<'_>, joint: Joint, table: &[[f64; DEGREE]]) -> Self {
        let left = EdgeRows::of(surface, joint.left);
        let right = EdgeRows::of(surface, joint.right);
        let mut out = Self {
            left: joint.left,
            gap: 0.0,
            bits_differ: false,
            angle_deg: 0.0,
            worst: (0, left.boundary[0]),
            degenerate: 0,
        };
        for s in 0..=DEGREE {
            let (p, q) = (left.boundary[s], right.boundary[DEGREE - s]);
            out.gap = worse(out.gap, (p - q).norm());
            out.bits_differ |= !same_bits(&p, &q);
        }
        for i in 0..N_EDGE_POINTS {
            let normals = [left.normal(&table[i]), right.normal(&table[N_EDGE_POINTS - 1 - i])];
            let angle = angle_deg(normals, &mut out.degenerate);
            if angle > out.angle_deg || angle.is_nan() {
                out.worst = (i, left.point(&table[i], i));
            }
            out.angle_deg = worse(out.angle_deg, angle);
        }
        out
    }

    fn place(&self) -> Place {
        let t = parameter(self.worst.0);
        let corner = self.left.corner() as usize;
        let mut barycentric = [0.0; 3];
        barycentric[corner] = 1.0 - t;
        barycentric[(corner + 1) % 3] = t;
        let (face, point) = (self.left.face(), self.worst.1.into());
        Place { face, barycentric, point, value: self.angle_deg }
    }
}

/// Boundary and first inner row of a net along a half-edge, in its direction.
struct EdgeRows {
    boundary: [Vec3; DEGREE + 1],
    inner: [Vec3; DEGREE],
}

impl EdgeRows {
    fn of(surface: &Surface<'_>, h: HalfEdge) -> Self {
        let net = surface.net(h.face() as usize);
        let corner = h.corner() as usize;
        Self {
            boundary: std::array::from_fn(|s| net[boundary_index(DEGREE, corner, s)]),
            inner: std::array::from_fn(|s| net[first_inner_index(DEGREE, corner, s)]),
        }
    }

    /// Oriented normal, unnormalised; `None` where the derivatives do not span a plane.
    ///
    /// Differences are formed before they are weighed: the angle then keeps its digits on edges
    /// that are short against their distance from the origin.
    fn normal(&self, weights: &[f64; DEGREE]) -> Option<Vec3> {
        let (mut along, mut across) = (Vec3::zeros(), Vec3::zeros());
        for s in 0..DEGREE {
            along += weights[s] * (self.boundary[s + 1] - self.boundary[s]);
            across += weights[s] * (self.inner[s] - self.boundary[s]);
        }
        let normal = along.cross(&across);
        // Below a sine of 1e-10 half of the digits of the normal are rounding.
        let floor_sq = 1e-20 * along.norm_squared() * across.norm_squared();
        (normal.norm_squared() > floor_sq).then_some(normal)
    }

    fn point(&self, weights: &[f64; DEGREE], i: usize) -> Vec3 {
        let t = parameter(i);
        (0..DEGREE).fold(Vec3::zeros(), |acc, s| {
            acc + weights[s] * ((1.0 - t) * self.boundary[s] + t * self.boundary[s + 1])
        })
    }
}

/// Angle between two normals; half a turn, and counted, where one does not exist.
fn angle_deg([a, b]: [Option<Vec3>; 2], degenerate: &mut u64) -> f64 {
    if let (Some(a), Some(b)) = (a, b) {
        return libm::atan2(a.cross(&b).norm(), a.dot(&b)).to_degrees();
    }
    *degenerate += 1;
    180.0
}

fn same_bits(p: &Vec3, q: &Vec3) -> bool {
    (0..3).all(|k| p[k].to_bits() == q[k].to_bits())
}

fn parameter(i: usize) -> f64 {
    i as f64 / (N_EDGE_POINTS - 1) as f64
}

/// Bernstein polynomials of degree 6 at the edge points.
fn bernstein_table() -> Vec<[f64; DEGREE]> {
    const BINOMIAL: [f64; DEGREE] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];
    (0..N_EDGE_POINTS)
        .map(|i| {
            let t = parameter(i);
            let power = |x: f64, n: usize| (0..n).fold(1.0, |acc, _| acc * x);
            std::array::from_fn(|s| BINOMIAL[s] * power(t, s) * power(1.0 - t, DEGREE - 1 - s))
        })
        .collect()
}

/// The value that 99 % of `values` do not exceed; not-a-number if one of them is, or if none is
/// given.
fn percentile_99(mut values: Vec<f64>) -> f64 {
    if values.is_empty() || values.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    values.sort_unstable_by(f64::total_cmp);
    values[(values.len() * 99).div_ceil(100) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_dihedral_angle_is_measured_to_rounding() {
        for angle in [1e-9, 1e-3, 1.0, 90.0, 179.0] {
            let turned = |a: f64| Vec3::new(0.0, libm::sin(a), libm::cos(a));
            let found = angle_deg([Some(Vec3::z()), Some(turned(f64::to_radians(angle)))], &mut 0);
            assert!((found - angle).abs() < 1e-13 * angle, "{found} {angle}");
        }
    }

    #[test]
    fn a_missing_normal_is_half_a_turn_and_counted() {
        let mut n_degenerate = 0;
        assert!(angle_deg([Some(Vec3::z()), None], &mut n_degenerate) > 179.0);
        assert_eq!(n_degenerate, 1);
    }

    #[test]
    fn the_percentile_leaves_one_in_a_hundred_above() {
        let values: Vec<f64> = (1..=200).map(f64::from).collect();
        assert!((percentile_99(values) - 198.0).abs() < 1e-15);
        assert!((percentile_99(vec![3.0]) - 3.0).abs() < 1e-15);
        assert!(percentile_99(vec![1.0, f64::NAN]).is_nan());
        assert!(percentile_99(Vec::new()).is_nan());
    }
}
