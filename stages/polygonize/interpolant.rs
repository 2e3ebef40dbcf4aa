//! The linear interpolant on a tetrahedron, and what boxes tell about it.

use crate::complex::{Complex, EDGES, Tetrahedron};
use isospline_geometry::Vec3;
use isospline_implicit::Interval;

/// Margin for the rounding of the interpolant, relative to the terms that are summed.
pub(crate) const ROUNDING: f64 = 1e-10;

/// The linear interpolant L of the node values on a tetrahedron T.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interpolant {
    corners: [Vec3; 4],
    values: [f64; 4],
    /// Gradients of the barycentrics of corners 1, 2, 3.
    barycentric: [Vec3; 3],
    /// Gradient of L.
    pub(crate) gradient: Vec3,
    /// Least and largest node value.
    pub(crate) least: f64,
    pub(crate) most: f64,
}

impl Interpolant {
    /// The interpolant on a tetrahedron of a complex.
    pub(crate) fn of(complex: &Complex, t: &Tetrahedron) -> Self {
        let corners = t.map(|n| complex.point(n));
        let values = t.map(|n| complex.value(n));
        let [a, b, c] = [1, 2, 3].map(|k| corners[k] - corners[0]);
        let volume = a.cross(&b).dot(&c);
        let barycentric = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|n| n / volume);
        let gradient = (0..3).map(|k| (values[k + 1] - values[0]) * barycentric[k]).sum();
        let [least, most] = [f64::min, f64::max].map(|pick| values.into_iter().reduce(pick));
        let (least, most) = least.zip(most).expect("invariant: four nodes");
        Self { corners, values, barycentric, gradient, least, most }
    }

    /// Where L vanishes on the edges.
    pub(crate) fn crossings(&self) -> impl Iterator<Item = Vec3> + '_ {
        EDGES.iter().filter_map(|&(i, j)| {
            let (f, g) = (self.values[i], self.values[j]);
            let place = f / (f - g);
            let crosses = (f < 0.0) != (g < 0.0) && place.is_finite();
            crosses.then(|| self.corners[i] + place * (self.corners[j] - self.corners[i]))
        })
    }

    /// `grad L . g > 0` for all `g` of the enclosure.
    pub(crate) fn is_transversal(&self, enclosure: &[Interval; 3]) -> bool {
        let (mut least, mut size) = (0.0, 0.0);
        for (g, slope) in self.gradient.iter().zip(enclosure) {
            least += (g * slope.lo).min(g * slope.hi);
            size += g.abs() * slope.lo.abs().max(slope.hi.abs());
        }
        // Unbounded or unknown slopes prove nothing.
        least > ROUNDING * size && enclosure.iter().all(|i| i.lo.is_finite() && i.hi.is_finite())
    }

    /// `f`, enclosed by `value`, and `L` are both positive or both negative on what the box
    /// shares with T.
    pub(crate) fn has_sign_of(&self, value: Interval, middle: Vec3, radius: Vec3) -> bool {
        if value.may_be_zero() {
            return false;
        }
        let (lo, hi) = self.range(middle, radius);
        (value.lo > 0.0 && lo > 0.0) || (value.hi < 0.0 && hi < 0.0)
    }

    /// The linear function L at any place.
    pub(crate) fn at(&self, place: Vec3) -> f64 {
        self.values[0] + self.gradient.dot(&(place - self.corners[0]))
    }

    /// Bounds of `L` on what the box shares with T.
    fn range(&self, middle: Vec3, radius: Vec3) -> (f64, f64) {
        let center = self.at(middle);
        let rounding = ROUNDING * self.least.abs().max(self.most.abs());
        let spread = self.gradient.abs().dot(&radius) + rounding;
        // On T the interpolant also stays between the node values.
        ((center - spread).max(self.least), (center + spread).min(self.most))
    }

    /// The box does not meet T: a barycentric is negative on all of it.
    pub(crate) fn is_beside(&self, middle: Vec3, radius: Vec3) -> bool {
        let offset = middle - self.corners[0];
        let negative = |constant: f64, slope: Vec3| {
            constant + slope.dot(&offset) + slope.abs().dot(&radius) < -ROUNDING
        };
        let [b1, b2, b3] = self.barycentric;
        negative(1.0, -(b1 + b2 + b3)) || self.barycentric.iter().any(|&b| negative(0.0, b))
    }
}
