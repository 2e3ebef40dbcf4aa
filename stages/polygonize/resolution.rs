//! Where the grid lies and how fine it is.

use crate::complex::Complex;
use crate::grid::{Grid, Site};
use crate::marching::Pieces;
use crate::params::PolygonizeParams;
use crate::surface_cells::{MOST_DENSE_CELLS, has_intervals, surface_cells};
use crate::{PolygonizeError, bulk};
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::Ctx;

/// Cells a side of the first pass: enough to see most models, over in a millisecond.
const FIRST_CELLS: u32 = 16;
/// Cells a side at which looking for a first triangle ends.
const LAST_CELLS: u32 = 128;
/// Cells in which a first triangle is looked for: a regular surface has far more triangles there.
const MOST_SEARCHED: u32 = 20_000;
/// Triangles of a pass that foretell the count of a finer one to some 10 %.
const ENOUGH_TRIANGLES: usize = 400;
/// Triangles that remain of a hundred after short edges are merged (measured: 32 to 38 on the
/// models of [TK, Fig. 9-15]).
const REMAINING: f64 = 0.34;
/// The box is cropped to the surface where that takes away this share of its longest side:
/// otherwise a sphere in a box a million times its size would need as many cells.
const CROP: f64 = 0.25;

/// The grid on which the surface has about as many triangles as wanted.
///
/// # Errors
/// [`PolygonizeError::EmptyBox`], [`PolygonizeError::EmptyLevelSet`],
/// [`PolygonizeError::TooManyCells`] and [`PolygonizeError::NotANumber`].
pub(crate) fn choose(ctx: &Ctx<'_>, params: &PolygonizeParams) -> Result<Grid, PolygonizeError> {
    let levels = params.max_depth;
    // Also false for NaN.
    let has_volume = |size: Vec3| size.iter().all(|&s| s > 0.0 && s.is_finite());
    if !has_volume(ctx.domain.size()) {
        return Err(PolygonizeError::EmptyBox);
    }
    if params.cells > 0 {
        return Ok(Grid::new(ctx.domain, params.cells, levels));
    }
    let domain = crop(ctx, params, levels)?;
    let mut grid = Grid::new(domain, FIRST_CELLS, levels);
    let mut n_triangles = count_triangles(ctx, params, &grid)?;
    while n_triangles < ENOUGH_TRIANGLES && grid.longest() < LAST_CELLS {
        let finer = Grid::new(domain, 2 * grid.longest(), levels);
        let few =
            PolygonizeParams { max_cells: MOST_SEARCHED.min(params.max_cells), ..params.clone() };
        // A box full of possible surface is no reason to stop: the test will tell more.
        match count_triangles(ctx, &few, &finer) {
            Err(PolygonizeError::TooManyCells { .. }) => break,
            found => n_triangles = found?,
        }
        grid = finer;
    }
    if n_triangles == 0 {
        return Ok(Grid::new(domain, FIRST_CELLS, levels));
    }
    let wanted = f64::from(params.faces) * params.oversampling / REMAINING;
    let cells = (f64::from(grid.longest()) * (wanted / n_triangles as f64).sqrt()).ceil();
    if cells > f64::from(Grid::most_cells(levels)) {
        return Err(PolygonizeError::TooManyCells { cells: cells as u64, limit: params.max_cells });
    }
    let least = 4;
    let most = if has_intervals(ctx, &grid) { u32::MAX } else { MOST_DENSE_CELLS / 2 };
    Ok(Grid::new(domain, (cells as u32).clamp(least, most), levels))
}

/// The error that says which values f takes, from the nodes of a coarse grid.
pub(crate) fn empty_level_set(ctx: &Ctx<'_>) -> PolygonizeError {
    let grid = Grid::new(ctx.domain, FIRST_CELLS, 0);
    let [nx, ny, nz] = grid.cells.map(|n| n + 1);
    let sites = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / (nx * ny)]);
    let points: Vec<_> = sites.map(|at| grid.point(at)).collect();
    let values = bulk::values(ctx.field, &points);
    let known = || values.iter().copied().filter(|f| !f.is_nan());
    let min = known().fold(f64::INFINITY, f64::min);
    let max = known().fold(f64::NEG_INFINITY, f64::max);
    PolygonizeError::EmptyLevelSet { min, max }
}

/// The part of the domain that may hold surface, where that is much smaller.
fn crop(ctx: &Ctx<'_>, params: &PolygonizeParams, levels: u32) -> Result<Aabb, PolygonizeError> {
    let mut domain = ctx.domain;
    // Each round takes away a quarter at least: this many reach the limits of f64.
    for _ in 0..2048 {
        let grid = Grid::new(domain, FIRST_CELLS, levels);
        if !has_intervals(ctx, &grid) {
            return Ok(domain);
        }
        let cells = surface_cells(ctx, &grid, params.max_cells)?;
        if cells.is_empty() {
            return Err(empty_level_set(ctx));
        }
        let lo = fold(&cells, u32::min);
        let hi = fold(&cells, u32::max).map(|c| c + 1);
        let hull = grid.cell_box(lo, hi);
        let shrinks = hull.size().max() <= (1.0 - CROP) * domain.size().max();
        if !shrinks || !hull.size().iter().all(|&s| s > 0.0) {
            return Ok(domain);
        }
        domain = hull;
    }
    Ok(domain)
}

fn fold(cells: &[Site], pick: fn(u32, u32) -> u32) -> Site {
    cells.iter().copied().reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k]))).unwrap_or_default()
}

fn count_triangles(
    ctx: &Ctx<'_>,
    params: &PolygonizeParams,
    grid: &Grid,
) -> Result<usize, PolygonizeError> {
    let cells = surface_cells(ctx, grid, params.max_cells)?;
    Ok(Pieces::of(&Complex::new(ctx, grid.clone(), &cells)?).n_triangles())
}
