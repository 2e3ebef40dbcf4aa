//! Gaps and angles between patches along their shared edges.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::distance::place;
use crate::evaluate::Stencil;
use crate::lanes::{LANES, Lane, Triple, dot, minus, normal, vector};
use crate::report::{Place, worse};
use crate::seam::{Both, Derivatives, N_EDGE_POINTS, N_SAMPLES, Seam, parameter};
use crate::slope::{Slope, Slopes, Steepest};
use crate::surface::Surface;
use isospline_geometry::HalfEdge;
use isospline_geometry::bezier_triangle::DEGREE;

/// What shared edges show; gaps in model units.
#[derive(Debug, Default)]
pub(crate) struct Continuity {
    pub(crate) gap: f64,
    /// Edges whose control points differ in some bit.
    pub(crate) bits_differ: u64,
    /// Points at which the two normals are not both there.
    pub(crate) degenerate_normals: u64,
    /// Largest angle between the normals of the two patches, by edge.
    pub(crate) angles_deg: Vec<f64>,
    worst: Option<Worst>,
}

/// The largest angle of all: of which edge, as its left patch has it, at which point.
#[derive(Clone, Copy, Debug)]
struct Worst {
    angle_deg: f64,
    left: HalfEdge,
    point: usize,
}

/// Angles between the normals of both sides at all points of eight edges; half a turn, and a one,
/// where not both exist.
pub(crate) struct Angles {
    slopes: Slopes<N_SAMPLES>,
    degenerate: [f64; N_SAMPLES],
}

/// What eight edges show, each in its lane.
pub(crate) struct Eight {
    gap_sq: Lane,
    bits_differ: [bool; LANES],
    steepest: Steepest,
    degenerate: Lane,
}

impl Continuity {
    /// Takes in edges one after another, 8 at most, given by their half-edges on the left.
    pub(crate) fn enter(&mut self, eight: &Eight, left: impl Iterator<Item = HalfEdge>) {
        for (k, left) in left.enumerate() {
            self.gap = worse(self.gap, eight.gap_sq[k].sqrt());
            self.bits_differ += u64::from(eight.bits_differ[k]);
            self.degenerate_normals += eight.degenerate[k] as u64;
            let angle_deg = eight.steepest.of(k).angle_deg();
            self.angles_deg.push(angle_deg);
            self.enter_worst(Worst { angle_deg, left, point: eight.steepest.at(k) });
        }
    }

    /// Takes in the edges that follow.
    pub(crate) fn append(&mut self, other: Self) {
        self.gap = worse(self.gap, other.gap);
        self.bits_differ += other.bits_differ;
        self.degenerate_normals += other.degenerate_normals;
        self.angles_deg.extend(other.angles_deg);
        if let Some(worst) = other.worst {
            self.enter_worst(worst);
        }
    }

    fn enter_worst(&mut self, new: Worst) {
        let outranks = |old: Worst| !(old.angle_deg.is_nan() || new.angle_deg <= old.angle_deg);
        if self.worst.is_none_or(outranks) {
            self.worst = Some(new);
        }
    }

    /// The largest angle; 0 without edges.
    pub(crate) fn angle_deg_max(&self) -> f64 {
        self.worst.map_or(0.0, |worst| worst.angle_deg)
    }

    /// Place of the largest angle.
    pub(crate) fn worst_angle(&self, surface: &Surface<'_>) -> Option<Place> {
        let Worst { angle_deg, left, point } = self.worst?;
        let (corner, t) = (left.corner() as usize, parameter(point));
        let mut at = [0.0; 3];
        (at[corner], at[(corner + 1) % 3]) = (1.0 - t, t);
        Some(place(surface, left.face() as usize, &Stencil::new(at), angle_deg))
    }
}

impl Eight {
    /// Measures a seam whose angles are known.
    #[inline(always)]
    pub(crate) fn of(seam: &Seam, angles: &Angles) -> Self {
        let (mut gap_sq, mut bits_differ) = ([0.0; LANES], [false; LANES]);
        for s in 0..=DEGREE {
            let (p, q) = (seam.left.boundary(s), seam.right.boundary(DEGREE - s));
            let apart = minus(p, q);
            for k in 0..LANES {
                gap_sq[k] = worse(gap_sq[k], dot(vector(&apart, k), vector(&apart, k)));
                bits_differ[k] |= !same_bits(p, q, k);
            }
        }
        let Angles { slopes, degenerate } = angles;
        let mut out =
            Self { gap_sq, bits_differ, steepest: Steepest::NONE, degenerate: [0.0; LANES] };
        for point in 0..N_EDGE_POINTS {
            let first = LANES * point;
            out.steepest.enter(point, slopes, first);
            for k in 0..LANES {
                out.degenerate[k] += degenerate[first + k];
            }
        }
        out
    }
}

impl Angles {
    pub(crate) fn new() -> Self {
        Self { slopes: Slopes::new(), degenerate: [0.0; N_SAMPLES] }
    }

    /// Become those between two sides.
    #[inline(always)]
    pub(crate) fn set(&mut self, Both { left, right }: &Both<Derivatives>) {
        for i in 0..N_SAMPLES {
            let (a, a_exists) = normal(vector(&left.along, i), vector(&left.inward, i));
            let (b, b_exists) = normal(vector(&right.along, i), vector(&right.inward, i));
            let slope = Slope::between(a, b);
            let both_exist = a_exists && b_exists;
            self.slopes.set(i, if both_exist { slope } else { Slope::HALF_TURN });
            self.degenerate[i] = if both_exist { 0.0 } else { 1.0 };
        }
    }
}

#[inline(always)]
fn same_bits(p: &Triple, q: &Triple, k: usize) -> bool {
    (0..3).all(|c| p[c][k].to_bits() == q[c][k].to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives the same at all points of all edges.
    fn constant(along: [f64; 3], inward: [f64; 3]) -> Derivatives {
        let spread = |v: [f64; 3]| v.map(|x| [x; N_SAMPLES]);
        Derivatives { along: spread(along), inward: spread(inward) }
    }

    fn angles(left: Derivatives, right: Derivatives) -> Angles {
        let mut angles = Angles::new();
        angles.set(&Both { left, right });
        angles
    }

    #[test]
    fn a_known_dihedral_angle_is_measured_at_every_point() {
        let left = || constant([1.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        for angle in [1e-9, 1e-3, 1.0, 90.0, 179.0] {
            let turn = f64::to_radians(angle);
            let across = [0.0, -libm::cos(turn), -libm::sin(turn)];
            let Angles { slopes, degenerate } = angles(left(), constant([-3.0, 0.0, 0.0], across));
            assert!(degenerate.iter().sum::<f64>() < 0.5);
            for i in 0..N_SAMPLES {
                let found = slopes.get(i).angle_deg();
                assert!((found - angle).abs() < 1e-13 * angle, "{found} {angle}");
            }
        }
    }

    #[test]
    fn a_missing_normal_is_half_a_turn_and_counted() {
        let left = constant([1.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        let mut right = constant([-1.0, 0.0, 0.0], [0.0, -2.0, 0.0]);
        right.inward[1][40] = 0.0;
        let Angles { slopes, degenerate } = angles(left, right);
        for i in 0..N_SAMPLES {
            let is_missing = i == 40;
            assert_eq!(degenerate[i] > 0.5, is_missing);
            assert_eq!(slopes.get(i).angle_deg() > 179.0, is_missing);
        }
    }
}
