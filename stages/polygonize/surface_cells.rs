//! Which cells of a grid the surface may touch.
//!
//! With interval arithmetic a tree of boxes is pruned wherever the enclosure of f excludes zero:
//! nothing is missed, however small. Without it the field is sampled at every node and only
//! sheets and components that some grid edge crosses are seen.

use crate::PolygonizeError;
use crate::bulk;
use crate::grid::{Grid, Site};
use isospline_stage::{Ctx, map};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Boxes handed out to threads; more would not balance better.
const SHARES: usize = 64;
/// Cells along the longest side up to which a field without intervals is sampled everywhere.
pub(crate) const MOST_DENSE_CELLS: u32 = 256;

/// Cells `lo .. hi` of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Block {
    lo: Site,
    hi: Site,
}

/// The cells that the surface may touch, in the order of the tree, at most `limit`.
///
/// # Errors
/// [`PolygonizeError::TooManyCells`]; without intervals also [`PolygonizeError::NotANumber`].
pub(crate) fn surface_cells(
    ctx: &Ctx<'_>,
    grid: &Grid,
    limit: u32,
) -> Result<Vec<Site>, PolygonizeError> {
    let whole = Block { lo: [0; 3], hi: grid.cells };
    if !has_intervals(ctx, grid) {
        return sampled_cells(ctx, grid, limit);
    }
    let mut blocks = vec![whole];
    while blocks.len() < SHARES && blocks.iter().any(|b| !b.is_cell()) {
        blocks = blocks
            .iter()
            .filter(|b| b.may_hold_surface(ctx, grid))
            .flat_map(|b| if b.is_cell() { vec![*b] } else { b.children() })
            .collect();
    }
    let found = AtomicUsize::new(0);
    let parts = map(ctx.host, blocks.len(), |i| {
        let mut cells = Vec::new();
        descend(ctx, grid, blocks[i], &mut |cell| {
            cells.push(cell);
            found.fetch_add(1, Ordering::Relaxed) < limit as usize
        });
        cells
    });
    if found.into_inner() > limit as usize {
        return Err(too_many(grid, limit));
    }
    Ok(parts.concat())
}

/// Whether the field answers with enclosures of its value.
pub(crate) fn has_intervals(ctx: &Ctx<'_>, grid: &Grid) -> bool {
    ctx.field
        .value_enclosure(grid.intervals([0; 3], grid.cells.map(|n| n << grid.levels)))
        .is_some()
}

fn too_many(grid: &Grid, limit: u32) -> PolygonizeError {
    PolygonizeError::TooManyCells { cells: u64::from(grid.longest()), limit }
}

/// Visits the cells of a block that may hold surface until `visit` says no; false if it did.
fn descend(ctx: &Ctx<'_>, grid: &Grid, block: Block, visit: &mut impl FnMut(Site) -> bool) -> bool {
    if !block.may_hold_surface(ctx, grid) {
        return true;
    }
    if block.is_cell() {
        return visit(block.lo);
    }
    block.children().into_iter().all(|child| descend(ctx, grid, child, visit))
}

impl Block {
    fn is_cell(&self) -> bool {
        (0..3).all(|k| self.hi[k] - self.lo[k] == 1)
    }

    fn may_hold_surface(&self, ctx: &Ctx<'_>, grid: &Grid) -> bool {
        let domain =
            grid.intervals(self.lo.map(|c| c << grid.levels), self.hi.map(|c| c << grid.levels));
        ctx.field.value_enclosure(domain).is_none_or(|f| f.may_be_zero())
    }

    /// The block halved along every axis that has more than one cell.
    fn children(&self) -> Vec<Self> {
        let mut blocks = vec![*self];
        for k in 0..3 {
            if self.hi[k] - self.lo[k] > 1 {
                let middle = u32::midpoint(self.lo[k], self.hi[k]);
                let mut upper = blocks.clone();
                for (lower, upper) in blocks.iter_mut().zip(&mut upper) {
                    lower.hi[k] = middle;
                    upper.lo[k] = middle;
                }
                blocks.extend(upper);
            }
        }
        blocks
    }
}

/// The cells whose corners lie on both sides.
fn sampled_cells(ctx: &Ctx<'_>, grid: &Grid, limit: u32) -> Result<Vec<Site>, PolygonizeError> {
    if grid.longest() > MOST_DENSE_CELLS {
        return Err(too_many(grid, limit));
    }
    let [nx, ny, nz] = grid.cells.map(|n| n as usize + 1);
    let sites = |layer: usize| {
        let at = move |i: usize| [(i % nx) as u32, (i / nx) as u32, layer as u32];
        (0..nx * ny).map(move |i| at(i).map(|c| c << grid.levels))
    };
    let layers = map(ctx.host, nz, |z| {
        let points: Vec<_> = sites(z).map(|at| grid.point(at)).collect();
        bulk::values(ctx.field, &points)
    });
    for (z, layer) in layers.iter().enumerate() {
        if let Some(i) = layer.iter().position(|f| f.is_nan()) {
            let at = sites(z).nth(i).map(|at| grid.point(at));
            return Err(PolygonizeError::NotANumber {
                at: at.expect("invariant: a site each value"),
            });
        }
    }
    let mut cells = Vec::new();
    for z in 0..nz - 1 {
        for i in (0..(ny - 1) * nx).filter(|i| i % nx + 1 < nx) {
            let column = |layer: &[f64]| [0, 1, nx, nx + 1].map(|k| layer[i + k] < 0.0);
            let (below, above) = (column(&layers[z]), column(&layers[z + 1]));
            if below != above || below.iter().any(|&inside| inside != below[0]) {
                cells.push([(i % nx) as u32, (i / nx) as u32, z as u32]);
            }
        }
    }
    if cells.len() > limit as usize { Err(too_many(grid, limit)) } else { Ok(cells) }
}
