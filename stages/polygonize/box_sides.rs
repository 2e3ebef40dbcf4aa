//! Whether the surface stays off the sides of the model's box.

use crate::PolygonizeError;
use crate::certificate::spread;
use crate::complex::Complex;
use crate::error::Side;
use crate::grid::{Grid, Site};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Interval, Jet1};
use isospline_stage::Ctx;

/// How often a side of a cell is cut in four before it is left undecided.
const DEPTH: u32 = 7;
/// The surface counts as reaching the side if f/|grad f| puts it this near, in cell sides.
const CONTACT: f64 = 1.0 / 16.0;

/// What is known of a flat box.
enum Finding {
    /// f does not vanish there.
    Clear,
    /// Enclosures are too wide to tell, and the surface is not near.
    Unknown,
    /// The surface is there or within a small part of a cell.
    Contact(Vec3),
}

/// Whether enclosures show that f does not vanish on the sides of the box.
///
/// # Errors
/// [`PolygonizeError::LeavesBox`] with the first place where the surface reaches a side.
pub(crate) fn are_clear(
    ctx: &Ctx<'_>,
    grid: &Grid,
    cells: &[Site],
) -> Result<bool, PolygonizeError> {
    let mut clear = true;
    for cell in cells {
        for side in sides().filter(|&side| touches(ctx, grid, side, cell)) {
            let lo = cell.map(|c| c << grid.levels);
            let hi = cell.map(|c| (c + 1) << grid.levels);
            let mut flat = grid.intervals(lo, hi);
            let reach = CONTACT * (flat[side.axis].hi - flat[side.axis].lo);
            let end = if side.upper { flat[side.axis].hi } else { flat[side.axis].lo };
            flat[side.axis] = Interval::new(end, end);
            match look(ctx.field, flat, reach, DEPTH) {
                Finding::Clear => {}
                Finding::Unknown => clear = false,
                Finding::Contact(at) => return Err(PolygonizeError::LeavesBox { side, at }),
            }
        }
    }
    Ok(clear)
}

/// Finds a crossing between two nodes of one side: the surface is seen to leave.
///
/// # Errors
/// [`PolygonizeError::LeavesBox`] with the first such place.
pub(crate) fn no_crossing_on_sides(
    ctx: &Ctx<'_>,
    complex: &Complex,
    crossings: &[[u32; 2]],
) -> Result<(), PolygonizeError> {
    let grid = &complex.grid;
    let flat = |side: &Side| if side.upper { grid.end(side.axis) } else { 0 };
    let sides: Vec<(Side, u32)> = sides()
        .filter(|side| is_model_side(ctx, grid, *side))
        .map(|side| (side, flat(&side)))
        .collect();
    for &[a, b] in crossings {
        let (at_a, at_b) = (complex.site(a), complex.site(b));
        for &(side, flat) in &sides {
            if at_a[side.axis] == flat && at_b[side.axis] == flat {
                let at = 0.5 * (complex.point(a) + complex.point(b));
                return Err(PolygonizeError::LeavesBox { side, at });
            }
        }
    }
    Ok(())
}

fn sides() -> impl Iterator<Item = Side> {
    (0..6).map(|i| Side { axis: i / 2, upper: i % 2 == 1 })
}

/// A grid cropped to the surface has sides that are not the model's.
fn is_model_side(ctx: &Ctx<'_>, grid: &Grid, side: Side) -> bool {
    let of = |b: &isospline_geometry::Aabb| if side.upper { b.max } else { b.min };
    of(&grid.domain)[side.axis].to_bits() == of(&ctx.domain)[side.axis].to_bits()
}

fn touches(ctx: &Ctx<'_>, grid: &Grid, side: Side, cell: &Site) -> bool {
    let outermost = if side.upper { grid.cells[side.axis] - 1 } else { 0 };
    cell[side.axis] == outermost && is_model_side(ctx, grid, side)
}

/// Looks at a flat box and, where need be, at its quarters.
fn look(field: &dyn Field, flat: [Interval; 3], reach: f64, depth: u32) -> Finding {
    if excludes_zero(field, flat) {
        return Finding::Clear;
    }
    let middle = Vec3::from(flat.map(|i| f64::midpoint(i.lo, i.hi)));
    if depth == 0 {
        let jet = field.gradient(middle);
        // Not "greater": NaN is no contact, it is unknown.
        let is_near = jet.value.abs() <= reach * jet.gradient.norm();
        let is_contact = is_near && changes_sign(field, middle, &jet, reach);
        return if is_contact { Finding::Contact(middle) } else { Finding::Unknown };
    }
    let mut found = Finding::Clear;
    for quarter in 0..4u32 {
        let mut part = flat;
        for (bit, k) in (0..3).filter(|&k| flat[k].lo < flat[k].hi).enumerate() {
            let end = if quarter >> bit & 1 == 1 { &mut part[k].lo } else { &mut part[k].hi };
            *end = middle[k];
        }
        match look(field, part, reach, depth - 1) {
            Finding::Clear => {}
            Finding::Unknown => found = Finding::Unknown,
            contact @ Finding::Contact(_) => return contact,
        }
    }
    found
}

/// Whether f has both signs within twice `reach` of a point, along its gradient there or exactly
/// there: faces that meet in CSG leave lines on which f is zero and has one sign all around.
fn changes_sign(field: &dyn Field, at: Vec3, jet: &Jet1, reach: f64) -> bool {
    let along = jet.gradient * (2.0 * reach / jet.gradient.norm());
    let is_inside = |p: Vec3| field.value(p) < 0.0;
    // Touching with a gradient of zero is left to the search for singular points.
    !along.iter().all(|x| x.is_finite()) || is_inside(at + along) != is_inside(at - along)
}

/// By the plain enclosure or by the mean value form `f(m) + grad f . (x - m)`, whose excess
/// shrinks with the square of the box: f of high degree beside the box needs it.
pub(crate) fn excludes_zero(field: &dyn Field, domain: [Interval; 3]) -> bool {
    let Some(jet) = field.gradient_enclosure(domain) else {
        return field.value_enclosure(domain).is_some_and(|f| !f.may_be_zero());
    };
    if !jet.value.may_be_zero() {
        return true;
    }
    let middle = domain.map(|i| f64::midpoint(i.lo, i.hi));
    let Some(f) = field.value_enclosure(middle.map(|m| Interval::new(m, m))) else {
        return false;
    };
    let radius = [0, 1, 2].map(|k| (domain[k].hi - middle[k]).max(middle[k] - domain[k].lo));
    let spread = spread(&jet.gradient, &radius.into()) * (1.0 + 1e-12);
    // Unbounded slopes make the spread infinite or NaN, and nothing is excluded.
    f.lo > spread || f.hi < -spread
}
