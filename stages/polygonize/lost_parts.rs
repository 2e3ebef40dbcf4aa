//! Parts of the surface that an observed mesh may lack.
//!
//! All surface lies in cells that passed the interval test or in the boxes that failed it. Beside
//! a kink of the mesh a failed box is no surprise. Away from the mesh it may hold a part that
//! falls between the nodes: there the box is searched by enclosures, and the mesh is refused
//! unless they exclude zero.

use crate::PolygonizeError;
use crate::box_sides::excludes_zero;
use crate::complex::{Complex, Tetrahedron};
use crate::grid::{Grid, Site, pack};
use crate::key_map::KeyMap;
use crate::marching::Pieces;
use crate::proof;
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Interval};
use isospline_stage::Ctx;

/// A box counts as beside the mesh if a crossing is within this many cells along every axis.
const BESIDE: u32 = 2;
/// Boxes looked at in one failed box before it counts as holding surface.
const MOST_BOXES: u32 = 4000;
/// Halvings of a cell in which the two sides of a thin part are looked for.
const HALVINGS: u32 = 30;
/// Halvings along every axis after which an unbounded enclosure counts as that of a pole.
const POLE_DEPTH: u32 = 20;

/// The boxes of the tetrahedra, each once.
pub(crate) fn boxes(complex: &Complex, failed: &[Tetrahedron]) -> Vec<[Interval; 3]> {
    let mut homes: Vec<_> = failed.iter().map(|t| proof::home(complex, t)).collect();
    homes.sort_unstable();
    homes.dedup();
    homes.iter().map(|&(lo, width)| complex.grid.intervals(lo, lo.map(|c| c + width))).collect()
}

/// Whether every box that is not beside a crossing of `complex` is free of surface.
///
/// # Errors
/// [`PolygonizeError::ThinnerThanGrid`] with a place in the first box that may hold surface.
pub(crate) fn none_is_lost(
    ctx: &Ctx<'_>,
    complex: &Complex,
    doubtful: &[[Interval; 3]],
) -> Result<(), PolygonizeError> {
    let seen = Seen::of(complex);
    let place = doubtful.iter().find_map(|part| seen.suspect(ctx.field, *part));
    place.map_or(Ok(()), |at| Err(thinner(ctx.field, &complex.grid, at)))
}

/// The error that tells of a part near `at` that `grid` cannot show.
pub(crate) fn thinner(field: &dyn Field, grid: &Grid, at: Vec3) -> PolygonizeError {
    let cell = grid.lattice_step() * f64::from(grid.scale());
    PolygonizeError::ThinnerThanGrid { at, thickness: thickness(field, at, cell), cell }
}

/// How far f keeps its sign along the gradient through `at`; `None` if that is more than a cell.
fn thickness(field: &dyn Field, at: Vec3, cell: f64) -> Option<f64> {
    let jet = field.gradient(at);
    let along = jet.gradient.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()))?;
    let keeps_sign = |t: f64| (field.value(at + along * t) < 0.0) == (jet.value < 0.0);
    let reach = |direction: f64| {
        let far = |k: u32| cell / f64::from(1_u32 << (HALVINGS - k));
        let beyond = (0..=HALVINGS).find(|&k| !keeps_sign(direction * far(k)))?;
        let (mut lo, mut hi) = (if beyond == 0 { 0.0 } else { far(beyond - 1) }, far(beyond));
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(lo, hi);
            *if keeps_sign(direction * middle) { &mut lo } else { &mut hi } = middle;
        }
        Some(hi)
    };
    Some(reach(1.0)? + reach(-1.0)?)
}

/// Where a mesh is.
struct Seen<'a> {
    grid: &'a Grid,
    /// Cells about the crossings.
    near: KeyMap,
}

impl<'a> Seen<'a> {
    fn of(complex: &'a Complex) -> Self {
        let mut near = KeyMap::with_room_for(complex.n_cells());
        for [a, _] in Pieces::of(complex).crossings {
            let cell = complex.site(a).map(|c| c >> complex.grid.levels);
            near.get_or_insert(pack(cell), 0);
        }
        Self { grid: &complex.grid, near }
    }

    fn cell(&self, at: Vec3) -> Site {
        let (size, from) = (self.grid.domain.size(), at - self.grid.domain.min);
        [0, 1, 2].map(|k| (from[k] / size[k] * f64::from(self.grid.cells[k])) as u32)
    }

    /// Whether a box of about a cell is beside a crossing.
    fn is_beside(&self, part: &[Interval; 3]) -> bool {
        let lo = self.cell(Vec3::from(part.map(|i| i.lo)));
        let hi = self.cell(Vec3::from(part.map(|i| i.hi)));
        if (0..3).any(|k| hi[k] - lo[k] > BESIDE) {
            return false;
        }
        let cell = self.cell(middle(part));
        let reach = |k: usize| cell[k].saturating_sub(BESIDE)..=cell[k] + BESIDE;
        let has_crossing = |at: Site| self.near.get(pack(at)).is_some();
        reach(2).any(|z| reach(1).any(|y| reach(0).any(|x| has_crossing([x, y, z]))))
    }

    /// A point of a box, away from the mesh, where f has not the sign of the next node, or else
    /// where enclosures still hold zero when the search ends.
    fn suspect(&self, field: &dyn Field, whole: [Interval; 3]) -> Option<Vec3> {
        let is_inside = |at: Vec3| field.value(at) < 0.0;
        let node = |at: Vec3| self.grid.point(self.cell(at).map(|c| c << self.grid.levels));
        let mut stack = vec![(whole, 0)];
        for _ in 0..MOST_BOXES {
            let (part, depth) = stack.pop()?;
            if self.is_beside(&part) || excludes_zero(field, part) {
                continue;
            }
            let at = middle(&part);
            let in_one_cell = self.cell(Vec3::from(part.map(|i| i.lo))) == self.cell(at);
            if in_one_cell && is_inside(at) != is_inside(node(at)) {
                return Some(at);
            }
            let is_bounded = |f: Interval| f.lo.is_finite() && f.hi.is_finite();
            if depth < POLE_DEPTH {
                stack.extend(eighths(&part).map(|part| (part, depth + 1)));
            } else if field.value_enclosure(part).is_some_and(is_bounded) {
                return Some(at);
            }
        }
        stack.last().map(|(part, _)| middle(part))
    }
}

fn eighths(whole: &[Interval; 3]) -> [[Interval; 3]; 8] {
    let at = middle(whole);
    std::array::from_fn(|i| {
        std::array::from_fn(|k| {
            let upper = i >> k & 1 == 1;
            let Interval { lo, hi } = whole[k];
            if upper { Interval::new(at[k], hi) } else { Interval::new(lo, at[k]) }
        })
    })
}

/// The middle of a box.
pub(crate) fn middle(part: &[Interval; 3]) -> Vec3 {
    Vec3::from(part.map(|i| f64::midpoint(i.lo, i.hi)))
}
