//! Folds of patches at their boundary, however narrow.
//!
//! The normal distance does not mind how a patch is parametrised, so while it is lowered the first
//! inner row of a patch may creep across the boundary over a short stretch between the samples; by
//! G1 the row of the neighbour creeps across as well. Deccube of 2000 faces had three folds after
//! three sweeps and 28 after eighteen, most of them such pairs.

use crate::degree::Degree;
use crate::samples::Interior;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::bernstein;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, boundary_index, first_inner_index, interior_indices,
};

/// Steps a side: with 12 two of three folds stay, with 32 or 48 no more go than with 24 and
/// [`MARGIN`].
const STEPS: u32 = 24;
/// Least derivative across the boundary, over that of a row evenly spaced between the corners: what
/// lies between the places must not fold either. Without it folds of deccube of 1700 to 2400 faces
/// are twice as many, with twice as much no fewer.
const MARGIN: f64 = 0.05;

/// Places along the sides of a net, corners left out, side by side. Slots beyond the degree weigh
/// nothing.
#[derive(Clone, Debug)]
pub(crate) struct Rim {
    /// Values at the places of a side of the Bernstein polynomials of its first inner row.
    rows: Vec<[f64; DEGREE]>,
    /// Those of the boundary.
    points: Vec<[f64; DEGREE + 1]>,
    sides: [Side; 3],
}

/// Slots of a side, from its first corner on.
#[derive(Clone, Debug)]
struct Side {
    outer: [usize; DEGREE + 1],
    /// First and last point of the first inner row, which lie on the next boundaries, and their
    /// steps.
    ends: [(usize, usize); 2],
    /// Steps of the others, and their places among the interior points.
    inner: Vec<(usize, usize)>,
}

/// What the boundary of a net, which does not move, asks of its inner rows.
#[derive(Clone, Debug)]
pub(crate) struct RimFace {
    /// Across the boundary at each place, into the patch, tangent to the surface; as long as the
    /// derivative along the boundary.
    inward: Vec<Vec3>,
    /// How far the interior points of the row, weighted, must lie that way.
    least: Vec<f64>,
}

impl Rim {
    pub(crate) fn new(degree: Degree) -> Self {
        let n = degree.number();
        let places = || (1..STEPS).map(|i| f64::from(i) / f64::from(STEPS));
        Self {
            rows: places().map(|t| values(n - 1, t)).collect(),
            points: places().map(|t| values(n, t)).collect(),
            sides: [0, 1, 2].map(|corner| Side::new(degree, corner)),
        }
    }

    /// The places on a net of this boundary.
    pub(crate) fn places<'a>(
        &'a self,
        net: &'a [Vec3; N_CONTROL],
    ) -> impl Iterator<Item = Vec3> + 'a {
        let point = move |side: &Side, weights: &[f64; DEGREE + 1]| -> Vec3 {
            weights.iter().zip(side.outer).map(|(w, slot)| *w * net[slot]).sum()
        };
        self.sides.iter().flat_map(move |side| self.points.iter().map(move |w| point(side, w)))
    }

    /// What a net asks where the surface has these unit normals at its places; nothing where it has
    /// none.
    pub(crate) fn of_boundary(&self, net: &[Vec3; N_CONTROL], normals: &[Vec3]) -> RimFace {
        let n = self.rows.len();
        let mut face = RimFace {
            inward: Vec::with_capacity(normals.len()),
            least: Vec::with_capacity(normals.len()),
        };
        for (i, normal) in normals.iter().enumerate() {
            let (side, row) = (&self.sides[i / n], &self.rows[i % n]);
            let outer = side.outer.map(|slot| net[slot]);
            let steps = || row.iter().zip(outer.windows(2));
            let along: Vec3 = steps().map(|(w, pair)| *w * (pair[1] - pair[0])).sum();
            let inward = normal.cross(&along);
            let boundary: f64 = steps().map(|(w, pair)| w * inward.dot(&pair[0])).sum();
            let end = |(s, slot): (usize, usize)| row[s] * inward.dot(&net[slot]);
            let height = |(s, slot): (usize, usize)| inward.dot(&(net[slot] - outer[s]));
            let t = (i % n + 1) as f64 / f64::from(STEPS);
            let even = (1.0 - t) * height(side.ends[0]) + t * height(side.ends[1]);
            face.inward.push(inward);
            let ends = end(side.ends[0]) + end(side.ends[1]);
            face.least.push(boundary - ends + MARGIN * even.max(0.0));
        }
        face
    }

    /// Number of places where the patch folds, or nearly does.
    pub(crate) fn folds(&self, face: &RimFace, interior: &Interior) -> usize {
        let n = self.rows.len();
        let is_folded = |i: usize| {
            let (side, row) = (&self.sides[i / n], &self.rows[i % n]);
            let inner: Vec3 = side.inner.iter().map(|&(s, at)| row[s] * interior[at]).sum();
            face.inward[i].dot(&inner) < face.least[i]
        };
        (0..face.inward.len()).filter(|&i| is_folded(i)).count()
    }
}

impl Side {
    fn new(degree: Degree, corner: usize) -> Self {
        let (n, slots, interior) = (degree.number(), degree.slots(), interior_indices());
        let row = |s: usize| (s, slots[first_inner_index(n, corner, s)]);
        let place = |(s, slot): (usize, usize)| {
            let at = interior.iter().position(|&i| i == slot);
            (s, at.expect("invariant: inner steps are interior points"))
        };
        Self {
            outer: std::array::from_fn(|s| slots[boundary_index(n, corner, s.min(n))]),
            ends: [row(0), row(n - 1)],
            inner: (1..n - 1).map(|s| place(row(s))).collect(),
        }
    }
}

/// The Bernstein polynomials of degree `n` at `t`, filled up with zeros.
fn values<const N: usize>(n: usize, t: f64) -> [f64; N] {
    let values = bernstein(n, t);
    std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::first_inner_slot;

    fn folds(degree: Degree, side: f64, change: impl Fn(&mut Interior)) -> usize {
        let (rim, net) = (Rim::new(degree), degree.flat_net());
        let places: Vec<Vec3> = rim.places(&net).collect();
        let on_boundary = |p: &Vec3| [p.x, p.y, 1.0 - p.x - p.y].iter().any(|x| x.abs() < 1e-15);
        assert!(places.len() == 69 && places.iter().all(on_boundary));
        let face = rim.of_boundary(&net, &vec![side * Vec3::z(); places.len()]);
        let mut interior = interior_indices().map(|i| net[i]);
        change(&mut interior);
        rim.folds(&face, &interior)
    }

    #[test]
    fn a_flat_net_is_sound_from_above_folded_from_below_and_unknown_without_normals() {
        for degree in [Degree::Six, Degree::Seven] {
            let found = [1.0, -1.0, 0.0].map(|side| folds(degree, side, |_| ()));
            assert_eq!(found, [0, 69, 0], "{degree:?}");
        }
    }

    #[test]
    fn a_row_that_crosses_the_boundary_over_a_short_stretch_is_seen() {
        // The row stands 1/7 inside. Its middle point weighs 0.3125 half-way along the side, where
        // the others leave 0.6875 / 7: with -0.319 it is 1e-3 beyond the boundary.
        let push =
            |y: f64| folds(Degree::Seven, 1.0, |interior| interior[first_inner_slot(0, 3)].y = y);
        assert_eq!(push(-0.2), 0);
        assert!((1..6).contains(&push(-0.319)), "{}", push(-0.319));
        // Short of it by less than the margin.
        assert!((1..4).contains(&push(-0.305)), "{}", push(-0.305));
    }
}
