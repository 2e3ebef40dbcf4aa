//! Which cells of a grid the surface may touch.
//!
//! With interval arithmetic a tree of boxes is pruned wherever the enclosure of f excludes zero:
//! nothing is missed, however small. Without it the field is sampled at every node and only
//! sheets and components that some grid edge crosses are seen.

use crate::PolygonizeError;
use crate::bulk;
use crate::grid::{Grid, Site};
use isospline_implicit::Interval;
use isospline_stage::{Ctx, map};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Boxes handed out to threads; more would not balance better.
const SHARES: usize = 64;
/// Blocks that are halved before the halves are looked at: bounds the memory of those in vain.
const BLOCKS_AT_ONCE: usize = 1024;
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
        blocks = halved(&holding_surface(ctx, grid, blocks));
    }
    let found = AtomicUsize::new(0);
    let parts = map(ctx.host, blocks.len(), |i| {
        if found.load(Ordering::Relaxed) > limit as usize {
            return Vec::new();
        }
        let cells = cells_of(ctx, grid, blocks[i], limit as usize);
        found.fetch_add(cells.len(), Ordering::Relaxed);
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

/// The cells of a block that may hold surface, in the order of the tree; more than `limit` of any
/// kind if a level of the tree has more. Level by level: the field encloses many boxes faster than
/// one by one.
fn cells_of(ctx: &Ctx<'_>, grid: &Grid, block: Block, limit: usize) -> Vec<Site> {
    let mut blocks = holding_surface(ctx, grid, vec![block]);
    while blocks.len() <= limit && !blocks.iter().all(Block::is_cell) {
        let mut finer = Vec::new();
        for some in blocks.chunks(BLOCKS_AT_ONCE) {
            finer.extend(holding_surface(ctx, grid, halved(some)));
            if finer.len() > limit {
                break;
            }
        }
        blocks = finer;
    }
    blocks.iter().map(|cell| cell.lo).collect()
}

fn halved(blocks: &[Block]) -> Vec<Block> {
    blocks.iter().flat_map(Block::children).collect()
}

/// Those where the enclosure of f does not exclude zero.
fn holding_surface(ctx: &Ctx<'_>, grid: &Grid, mut blocks: Vec<Block>) -> Vec<Block> {
    let site = |at: Site| at.map(|c| c << grid.levels);
    let domains: Vec<_> = blocks.iter().map(|b| grid.intervals(site(b.lo), site(b.hi))).collect();
    let mut values = vec![None; blocks.len()];
    ctx.field.value_enclosures(&domains, &mut values);
    let mut values = values.iter();
    blocks.retain(|_| {
        let value = values.next().expect("invariant: a value each block");
        value.is_none_or(|f: Interval| f.may_be_zero())
    });
    blocks
}

impl Block {
    fn is_cell(&self) -> bool {
        (0..3).all(|k| self.hi[k] - self.lo[k] == 1)
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
