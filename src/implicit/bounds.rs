//! A box around the zero set of a field, by interval bisection.

use crate::inside::Side;
use crate::{Field, Interval};
use isospline_geometry::{Aabb, Vec3};
use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};
use thiserror::Error;

/// Free space beside the zero set on each side, as a part of the box: the models of MATH.md have
/// about 10 %.
const MARGIN_REL: f64 = 0.08;

/// How far the zero set may turn out smaller than the box without margin, on each side: makes the
/// true margin 8 to 12 %. Half of it costs twice the cells.
const SLACK_REL: f64 = 0.04;

/// Cells that may be looked at: ten times what the models of the paper need, below 100 ms.
const MAX_CELLS: usize = 60_000;

/// Depths from which a cell of unknown enclosure counts as empty: if all its samples are NaN, and
/// if none differ in sign. Without them the border of a field's domain would count as surface.
const UNDEFINED_DEPTHS: [u32; 2] = [6, 18];

/// Depth of a cell at the limit from which on it counts as one where f comes to zero, if no sample
/// differs in sign and the enclosure is bounded: about 1e-5 of the search cube a side.
const TOUCHING_DEPTH: u32 = 51;

/// Points a side of the first grid of samples, 0.1 ms for deccube: where it meets the set, the
/// search knows from the start how exact it has to be.
const SEED_SAMPLES: usize = 24;

/// Halvings of the distance of two samples with a zero between: far below the slack.
const N_BISECTIONS: usize = 10;

/// Why no box was found.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum BoundsError {
    /// A limit of 0.
    #[error("the limit of the box must be positive and finite, not {limit}")]
    Limit {
        /// It.
        limit: f64,
    },
    /// A closure: its values outside of samples are unknown.
    #[error("the field has no interval arithmetic to find its box by; state the box")]
    NoIntervals,
    /// `x^2 + y^2 + z^2 + 1`
    #[error("the level set is empty: within {limit} of the origin f lies between {low} and {high}")]
    Empty {
        /// Half side of the cube searched.
        limit: f64,
        /// Smallest value seen.
        low: f64,
        /// Largest value seen.
        high: f64,
    },
    /// `x^2 + y^2 + z^2`
    #[error("f does not change sign: it lies between {low} and {high}, nearest to zero by ({}, {}, {})", near[0], near[1], near[2])]
    NoChangeOfSign {
        /// Smallest value seen.
        low: f64,
        /// Largest value seen.
        high: f64,
        /// Point of the value nearest to zero.
        near: [f64; 3],
    },
    /// `ln(-1 - x^2)`
    #[error("f is not a number wherever it was evaluated within {limit} of the origin")]
    Undefined {
        /// Half side of the cube searched.
        limit: f64,
    },
    /// `max(x^2 + y^2 + z^2 - 1, min(0, z - 2))`
    #[error("f comes to zero without changing its sign as far as the limit {limit} at {side}, near ({}, {}, {}): no box is sure to hold the surface", near[0], near[1], near[2])]
    TouchesLimit {
        /// Where.
        side: Side,
        /// Half side of the cube searched.
        limit: f64,
        /// A point there.
        near: [f64; 3],
    },
    /// `x^2 + y^2 - 1`
    #[error("the surface reaches the limit {limit} at {side}")]
    ReachesLimit {
        /// Where.
        side: Side,
        /// Half side of the cube searched.
        limit: f64,
    },
}

/// A box around the zero set of `field` inside of `[-limit, limit]^3`, with a margin of 8 to 12 %
/// of its size on every side.
///
/// # Errors
/// If the zero set is empty, reaches the limit or has no change of sign, or if `field` has no
/// interval arithmetic.
///
/// # Examples
/// ```
/// use isospline_implicit::{BoundsError, Formula, Side, auto_box};
///
/// let formula = |text| Formula::parse(text, &Default::default()).unwrap();
/// let found = auto_box(&formula("x^2 + y^2 + z^2 - 4"), 100.0)?;
/// assert!((2.3..2.6).contains(&found.max.x));
/// let open = auto_box(&formula("x^2 + y^2 - 4"), 100.0);
/// assert_eq!(open, Err(BoundsError::ReachesLimit { side: Side::ZMin, limit: 100.0 }));
/// # Ok::<(), BoundsError>(())
/// ```
pub fn auto_box(field: &dyn Field, limit: f64) -> Result<Aabb, BoundsError> {
    if !(limit > 0.0 && limit.is_finite()) {
        return Err(BoundsError::Limit { limit });
    }
    let corner = Vec3::repeat(limit);
    let whole = Cell { aabb: Aabb::new(-corner, corner), depth: 0, axis: 0 };
    let mut search = Search::new(field, whole);
    search.seed(&whole.aabb);
    match search.settled(limit) {
        Err(BoundsError::NoChangeOfSign { .. }) => {}
        found => return found,
    }
    // Where f is zero at a corner of all cells around it, as `(x-1)^2 + y^2 + z^2 - 1` is at the
    // origin, the cells that reach farthest lead there and nowhere else: look everywhere alike.
    let mut search = Search::new(field, whole);
    search.spread()?;
    search.settled(limit)
}

/// A part of the search cube that may hold a zero.
#[derive(Clone, Copy)]
struct Cell {
    aabb: Aabb,
    depth: u32,
    /// The axis along which f varies most, to be halved next.
    axis: usize,
}

impl Cell {
    fn halves(&self) -> [Self; 2] {
        let middle = 0.5 * (self.aabb.min[self.axis] + self.aabb.max[self.axis]);
        let mut halves = [Self { depth: self.depth + 1, ..*self }; 2];
        halves[0].aabb.max[self.axis] = middle;
        halves[1].aabb.min[self.axis] = middle;
        halves
    }
}

/// A cell by how far it reaches towards a side.
struct Ranked {
    reach: f64,
    cell: Cell,
}

impl Ord for Ranked {
    fn cmp(&self, other: &Self) -> Ordering {
        self.reach.total_cmp(&other.reach)
    }
}

impl PartialOrd for Ranked {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ranked {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Ranked {}

/// Values seen.
struct Range {
    low: f64,
    high: f64,
    /// Smallest magnitude, and its point.
    least: f64,
    near: [f64; 3],
}

/// Side by side, the cell that reaches farthest is split until it reaches no farther than known
/// zeros do, up to the slack. Cells behind them are never looked at again.
struct Search<'a> {
    field: &'a dyn Field,
    /// Disjoint cells that hold all zeros.
    cells: Vec<Cell>,
    /// Around the zeros found.
    proven: Aabb,
    range: Range,
    n_seen: usize,
}

impl<'a> Search<'a> {
    fn new(field: &'a dyn Field, whole: Cell) -> Self {
        let range = Range {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            least: f64::INFINITY,
            near: [0.0; 3],
        };
        Self { field, cells: vec![whole], proven: Aabb::EMPTY, range, n_seen: 0 }
    }

    /// Zeros between neighbours of a grid along x, and the range of f.
    fn seed(&mut self, whole: &Aabb) {
        let n = SEED_SAMPLES;
        let step = whole.size() / n as f64;
        // Midpoints of grid cells: symmetry planes, where kinks and poles lie, are left out.
        let at = |k: [usize; 3]| {
            Vec3::from_fn(|axis, _| whole.min[axis] + (k[axis] as f64 + 0.5) * step[axis])
        };
        for row in 0..n * n {
            let points: Vec<Vec3> = (0..n).map(|k| at([k, row % n, row / n])).collect();
            let mut values = vec![0.0; n];
            self.field.values(&points, &mut values);
            self.note(&points, &values);
            for k in 1..n {
                if values[k - 1] * values[k] < 0.0 {
                    self.prove(points[k - 1], points[k], values[k - 1]);
                }
            }
        }
    }

    /// Settles all sides.
    fn settled(&mut self, limit: f64) -> Result<Aabb, BoundsError> {
        for side in Side::ALL {
            self.settle(side, limit)?;
        }
        self.finish(limit)
    }

    /// Splits all cells alike until a change of sign is found, with half of the work at most.
    fn spread(&mut self) -> Result<(), BoundsError> {
        let mut cells: VecDeque<Cell> = self.cells.drain(..).collect();
        while self.proven.min.x > self.proven.max.x && self.n_seen < MAX_CELLS / 2 {
            let Some(largest) = cells.pop_front() else { break };
            for mut cell in largest.halves() {
                if self.may_hold_zero(&mut cell, Side::XMin)? {
                    cells.push_back(cell);
                }
            }
        }
        self.cells = cells.into();
        Ok(())
    }

    /// Splits cells until none reaches much farther to `side` than the zeros found.
    fn settle(&mut self, side: Side, limit: f64) -> Result<(), BoundsError> {
        let rank = |cell: Cell| Ranked { reach: side.reach(&cell.aabb), cell };
        let mut heap: BinaryHeap<Ranked> = self.cells.drain(..).map(rank).collect();
        while let Some(farthest) = heap.pop() {
            if farthest.reach <= self.goal(side) || self.n_seen >= MAX_CELLS {
                heap.push(farthest);
                break;
            }
            if farthest.reach >= limit && farthest.cell.depth >= TOUCHING_DEPTH {
                let near = farthest.cell.aabb.center().into();
                return Err(BoundsError::TouchesLimit { side, limit, near });
            }
            for mut cell in farthest.cell.halves() {
                if self.may_hold_zero(&mut cell, side)? {
                    heap.push(rank(cell));
                }
            }
        }
        self.cells = heap.into_iter().map(|ranked| ranked.cell).collect();
        Ok(())
    }

    /// How far cells may reach.
    fn goal(&self, side: Side) -> f64 {
        if self.proven.min.x > self.proven.max.x {
            return f64::NEG_INFINITY;
        }
        side.reach(&self.proven) + SLACK_REL * self.proven.size()[side.axis()]
    }

    fn may_hold_zero(&mut self, cell: &mut Cell, side: Side) -> Result<bool, BoundsError> {
        self.n_seen += 1;
        let domain: [Interval; 3] =
            std::array::from_fn(|k| Interval::new(cell.aabb.min[k], cell.aabb.max[k]));
        let value = self.field.value_enclosure(domain).ok_or(BoundsError::NoIntervals)?;
        if !value.may_be_zero() {
            return Ok(false);
        }
        let slopes =
            self.field.gradient_enclosure(domain).ok_or(BoundsError::NoIntervals)?.gradient;
        let mean = self.mean_value_form(domain, slopes).ok_or(BoundsError::NoIntervals)?;
        if !mean.may_be_zero() {
            return Ok(false);
        }
        cell.axis = steepest_axis(domain, slopes);
        let sample = self.sample(&cell.aabb, side);
        let undefined_depth = match sample {
            _ if !value.is_unknown() => u32::MAX,
            Sample::ChangesSign => u32::MAX,
            Sample::Undefined => UNDEFINED_DEPTHS[0],
            Sample::OneSign => UNDEFINED_DEPTHS[1],
        };
        Ok(cell.depth < undefined_depth)
    }

    /// As in [`Field::tight_value_enclosure`], from known slopes.
    fn mean_value_form(&self, domain: [Interval; 3], slopes: [Interval; 3]) -> Option<Interval> {
        let center = domain.map(|side| Interval::point(side.midpoint()));
        let parts = (0..3).map(|k| slopes[k] * (domain[k] - center[k]));
        Some(parts.fold(self.field.value_enclosure(center)?, |sum, part| sum + part))
    }

    /// The signs at the centre and the corners; the zero between those nearest to `side` is noted.
    fn sample(&mut self, cell: &Aabb, side: Side) -> Sample {
        let corner = |k: usize| Vec3::from_fn(|axis, _| [cell.min, cell.max][k >> axis & 1][axis]);
        let points: [Vec3; 9] =
            std::array::from_fn(|k| if k < 8 { corner(k) } else { cell.center() });
        let mut values = [0.0; 9];
        self.field.values(&points, &mut values);
        if values.iter().all(|value| value.is_nan()) {
            return Sample::Undefined;
        }
        self.note(&points, &values);
        let farthest = |sign: f64| {
            let reach = |k: &usize| side.reach(&Aabb::new(points[*k], points[*k]));
            let of_sign = (0..9).filter(|&k| sign * values[k] > 0.0);
            of_sign.max_by(|a, b| reach(a).total_cmp(&reach(b)))
        };
        let (Some(low), Some(high)) = (farthest(-1.0), farthest(1.0)) else {
            return Sample::OneSign;
        };
        if side.reach(cell) > side.reach(&self.proven) {
            self.prove(points[low], points[high], values[low]);
        }
        Sample::ChangesSign
    }

    fn note(&mut self, points: &[Vec3], values: &[f64]) {
        for (value, point) in values.iter().zip(points).filter(|(value, _)| !value.is_nan()) {
            self.range.low = self.range.low.min(*value);
            self.range.high = self.range.high.max(*value);
            if value.abs() < self.range.least {
                self.range.least = value.abs();
                self.range.near = (*point).into();
            }
        }
    }

    /// Notes a zero between `a`, with value `at_a`, and `b`.
    fn prove(&mut self, mut a: Vec3, mut b: Vec3, at_a: f64) {
        for _ in 0..N_BISECTIONS {
            let middle = 0.5 * (a + b);
            if (self.field.value(middle) < 0.0) == (at_a < 0.0) {
                a = middle;
            } else {
                b = middle;
            }
        }
        self.proven = self.proven.including(&a);
    }

    fn finish(&self, limit: f64) -> Result<Aabb, BoundsError> {
        let Range { low, high, near, .. } = self.range;
        if self.cells.is_empty() {
            return Err(if low > high {
                BoundsError::Undefined { limit }
            } else {
                BoundsError::Empty { limit, low, high }
            });
        }
        if self.proven.min.x > self.proven.max.x {
            return Err(BoundsError::NoChangeOfSign { low, high, near });
        }
        let outer = self.cells.iter().fold(self.proven, |all, cell| {
            Aabb::new(all.min.inf(&cell.aabb.min), all.max.sup(&cell.aabb.max))
        });
        if let Some(side) = Side::ALL.into_iter().find(|side| side.reach(&outer) >= limit) {
            return Err(BoundsError::ReachesLimit { side, limit });
        }
        // Cells that need not be split may still be larger than the set in them.
        let slack = SLACK_REL * self.proven.size();
        let tight = Aabb::new(
            outer.min.sup(&(self.proven.min - slack)),
            outer.max.inf(&(self.proven.max + slack)),
        );
        let result = if self.n_seen >= MAX_CELLS { outer } else { tight };
        let margin = MARGIN_REL * result.size();
        Ok(Aabb::new(result.min - margin, result.max + margin))
    }
}

/// Signs of the samples of a cell.
#[derive(Clone, Copy)]
enum Sample {
    Undefined,
    OneSign,
    ChangesSign,
}

/// Where halving lowers the variation of f most; the longest axis where slopes are unbounded.
fn steepest_axis(domain: [Interval; 3], slopes: [Interval; 3]) -> usize {
    let variation = |k: usize| domain[k].width() * slopes[k].lo.abs().max(slopes[k].hi.abs());
    let bounded = (0..3).all(|k| variation(k).is_finite());
    let weight = |k: &usize| if bounded { variation(*k) } else { domain[*k].width() };
    (0..3).max_by(|a, b| weight(a).total_cmp(&weight(b))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ClosureField, Formula};

    fn find(text: &str, limit: f64) -> Result<Aabb, BoundsError> {
        auto_box(&Formula::parse(text, &std::collections::BTreeMap::new()).unwrap(), limit)
    }

    #[track_caller]
    fn check(text: &str, limit: f64, half: [f64; 3]) {
        let found = find(text, limit).unwrap();
        for (k, half) in half.into_iter().enumerate() {
            for reach in [found.max[k], -found.min[k]] {
                let margin = (reach - half) / (2.0 * half);
                assert!((0.08..0.13).contains(&margin), "{text}: axis {k}: {reach} for {half}");
            }
        }
    }

    #[test]
    fn boxes_of_the_paper_have_about_ten_percent_margin() {
        for limit in [10.0, 1000.0] {
            check("(sqrt(x^2+y^2)-5)^2 + z^2 - 1", limit, [6.0, 6.0, 1.0]);
            check("x^6+y^6+z^6+20*(x^4*y^2+y^4*z^2+z^4*x^2)-1", limit, [1.0; 3]);
            check("x^8-2*x^6+x^4+2*x^4*y^2-2*x^2*y^2+y^4+z^2-0.04", limit, [1.0820, 0.6708, 0.2]);
            check(
                "a=0.8;((x^2+y^2-a^2)^2+(z^2-1)^2)*((y^2+z^2-a^2)^2+(x^2-1)^2)\
                 *((z^2+x^2-a^2)^2+(y^2-1)^2)-0.02",
                limit,
                [1.0720; 3],
            );
        }
        check(
            "k=5;(x^2+y^2+z^2-0.95*k^2)^2-0.8*((z-k)^2-2*x^2)*((z+k)^2-2*y^2)",
            6.0,
            [4.9014, 4.9014, 4.9336],
        );
    }

    #[test]
    fn a_surface_that_touches_the_planes_of_bisection_is_found() {
        for text in ["(x-1)^2+y^2+z^2-1", "x^2+(y+2)^2+z^2-4", "(x-1)^2+(y-1)^2+(z-1)^2-1"] {
            let found = find(text, 1000.0).unwrap();
            let size = found.size().max();
            assert!((2.0..10.0).contains(&size), "{text}: {found:?}");
        }
    }

    #[test]
    fn a_field_that_touches_zero_as_far_as_the_limit_is_told_with_a_place() {
        let error = find("min(x^2+y^2+z^2-1, max(abs(y-3)+abs(z), 0))", 1000.0).unwrap_err();
        let BoundsError::TouchesLimit { near, .. } = error else { panic!("{error}") };
        assert!((near[1] - 3.0).abs() < 0.1 && near[2].abs() < 0.1, "{near:?}");
    }

    #[test]
    fn small_and_distant_parts_are_found() {
        let found = find("min((x-40)^2+y^2+z^2-1, (x+40)^2+y^2+(z-3)^2-0.01)", 100.0).unwrap();
        assert!(found.min.x < -40.1 && found.max.x > 41.0 && found.max.x < 60.0);
        assert!(found.max.z > 3.1 && found.max.z < 4.0);
    }

    #[test]
    fn open_empty_and_singular_sets_are_told_apart() {
        let open = find("x^2 + z^2 - 1", 8.0).unwrap_err();
        assert_eq!(open, BoundsError::ReachesLimit { side: Side::YMin, limit: 8.0 });
        assert!(matches!(find("x^2+y^2+z^2+1", 8.0), Err(BoundsError::Empty { .. })));
        assert!(matches!(find("x^2+y^2+z^2", 8.0), Err(BoundsError::NoChangeOfSign { .. })));
        assert_eq!(find("ln(-1-x^2)", 8.0), Err(BoundsError::Undefined { limit: 8.0 }));
        assert_eq!(find("x", -1.0), Err(BoundsError::Limit { limit: -1.0 }));
        let closure = ClosureField::new(1.0, |p: Vec3| p.norm() - 1.0);
        assert_eq!(auto_box(&closure, 8.0), Err(BoundsError::NoIntervals));
    }
}
