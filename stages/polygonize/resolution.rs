//! Where the grid lies and how fine it is.

use crate::complex::Complex;
use crate::grid::{Grid, Site};
use crate::marching::Pieces;
use crate::params::PolygonizeParams;
use crate::surface_cells::{MOST_DENSE_CELLS, has_intervals, surface_cells};
use crate::{PolygonizeError, bulk, proof};
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::Ctx;

/// Cells a side of the first pass: enough to see most models, over in a millisecond.
const FIRST_CELLS: u32 = 16;
/// Cells a side at which looking for a first triangle ends.
const LAST_CELLS: u32 = 4096;
/// The same where a field without intervals is sampled everywhere.
const LAST_DENSE_CELLS: u32 = 128;
/// Cells in which [`ENOUGH_TRIANGLES`] are looked for: a regular surface has far more there.
const MOST_SEARCHED: u32 = 20_000;
/// Cells in which a first triangle is looked for. A sheet a hundredth of the box thick has as many.
const MOST_SOUGHT: u32 = 400_000;
/// Triangles of a pass that foretell the count of a finer one to some 10 %.
const ENOUGH_TRIANGLES: usize = 400;
/// Triangles that remain of a hundred after short edges are merged (measured: 32 to 38 on the
/// models of [TK, Fig. 9-15]).
const REMAINING: f64 = 0.34;
/// Share of the triangles wanted that a grid must show: fewer means that the forecast failed.
const ENOUGH_OF_WANTED: f64 = 0.75;
/// Finer grids that are tried where too few triangles were found.
const MOST_FORECASTS: u32 = 6;
/// Factor of the cells a side in one such try: few triangles foretell little.
const MOST_GROWTH: f64 = 4.0;
/// The box is cropped to the surface where that takes away this share of its longest side:
/// otherwise a sphere in a box a million times its size would need as many cells.
const CROP: f64 = 0.25;
/// Size of the box, of that given, below which it is not cropped further: it closes in on a point
/// where f touches zero, and squares of smaller numbers vanish.
const POINT: f64 = 1e-60;

/// A grid with what it shows.
#[derive(Clone, Debug)]
pub(crate) struct Survey {
    /// The cells that the surface may touch.
    pub(crate) cells: Vec<Site>,
    /// Their tetrahedra; it has the grid.
    pub(crate) complex: Complex,
    n_triangles: usize,
}

/// The survey on which the surface has about as many triangles as wanted.
///
/// # Errors
/// [`PolygonizeError::EmptyBox`], [`PolygonizeError::EmptyLevelSet`],
/// [`PolygonizeError::TooManyCells`], [`PolygonizeError::NotANumber`] and, where no triangle is
/// found, [`PolygonizeError::SingularPoint`].
pub(crate) fn choose(ctx: &Ctx<'_>, params: &PolygonizeParams) -> Result<Survey, PolygonizeError> {
    let levels = params.max_depth;
    // Also false for NaN.
    let has_volume = |size: Vec3| size.iter().all(|&s| s > 0.0 && s.is_finite());
    if !has_volume(ctx.domain.size()) {
        return Err(PolygonizeError::EmptyBox);
    }
    if params.cells > 0 {
        return survey(ctx, params.max_cells, Grid::new(ctx.domain, params.cells, levels));
    }
    let domain = crop(ctx, params, levels)?;
    let first = search(ctx, params, Grid::new(domain, FIRST_CELLS, levels))?;
    if first.n_triangles == 0 {
        proof::no_singular_point(ctx, &first.complex).map_err(|error| touching(ctx, error))?;
        return survey(ctx, params.max_cells, Grid::new(domain, FIRST_CELLS, levels));
    }
    let cells = forecast(params, &first, f64::INFINITY);
    if cells > f64::from(Grid::most_cells(levels)) {
        return Err(PolygonizeError::TooManyCells { cells: cells as u64, limit: params.max_cells });
    }
    let grid =
        Grid::new(domain, (cells as u32).clamp(4, most_cells(ctx, &first.complex.grid)), levels);
    let mut chosen = survey(ctx, params.max_cells, grid)?;
    for _ in 0..MOST_FORECASTS {
        if chosen.n_triangles as f64 >= ENOUGH_OF_WANTED * wanted(params) {
            break;
        }
        let cells = forecast(params, &chosen, MOST_GROWTH);
        let Some(finer) = finer(ctx, params, &chosen.complex.grid, cells)? else { break };
        chosen = finer;
    }
    Ok(chosen)
}

/// A survey of the box of `grid` with more cells, unless that breaks a limit.
///
/// # Errors
/// [`PolygonizeError::NotANumber`].
pub(crate) fn finer(
    ctx: &Ctx<'_>,
    params: &PolygonizeParams,
    grid: &Grid,
    cells: f64,
) -> Result<Option<Survey>, PolygonizeError> {
    let cells = (cells as u32).min(most_cells(ctx, grid));
    if cells <= grid.longest() {
        return Ok(None);
    }
    match survey(ctx, params.max_cells, Grid::new(grid.domain, cells, grid.levels)) {
        Err(PolygonizeError::TooManyCells { .. }) => Ok(None),
        found => found.map(Some),
    }
}

/// Triangles wanted before short edges are merged.
fn wanted(params: &PolygonizeParams) -> f64 {
    f64::from(params.faces) * params.oversampling / REMAINING
}

/// Cells a side that should show the triangles wanted.
fn forecast(params: &PolygonizeParams, seen: &Survey, most_growth: f64) -> f64 {
    let growth = (wanted(params) / seen.n_triangles.max(1) as f64).sqrt();
    (f64::from(seen.complex.grid.longest()) * growth.min(most_growth)).ceil()
}

fn most_cells(ctx: &Ctx<'_>, grid: &Grid) -> u32 {
    let most = Grid::most_cells(grid.levels);
    if has_intervals(ctx, grid) { most } else { most.min(MOST_DENSE_CELLS / 2) }
}

/// Halves the cells until there are triangles enough to foretell more, or at least one, or until
/// the search gets too long.
fn search(ctx: &Ctx<'_>, params: &PolygonizeParams, grid: Grid) -> Result<Survey, PolygonizeError> {
    let last = if has_intervals(ctx, &grid) { LAST_CELLS } else { LAST_DENSE_CELLS };
    let mut seen = survey(ctx, params.max_cells, grid)?;
    let mut most = MOST_SEARCHED;
    while seen.n_triangles < ENOUGH_TRIANGLES {
        let grid = &seen.complex.grid;
        if 2 * grid.longest() > last.min(Grid::most_cells(grid.levels)) {
            break;
        }
        let finer = Grid::new(grid.domain, 2 * grid.longest(), grid.levels);
        match survey(ctx, most.min(params.max_cells), finer) {
            Ok(finer) => seen = finer,
            // A box full of possible surface: the test may tell more, unless there is no mesh.
            Err(PolygonizeError::TooManyCells { .. })
                if seen.n_triangles == 0 && most < MOST_SOUGHT =>
            {
                proof::no_singular_point(ctx, &seen.complex)
                    .map_err(|error| touching(ctx, error))?;
                most = MOST_SOUGHT;
            }
            Err(PolygonizeError::TooManyCells { .. }) => break,
            Err(other) => return Err(other),
        }
    }
    Ok(seen)
}

fn survey(ctx: &Ctx<'_>, limit: u32, grid: Grid) -> Result<Survey, PolygonizeError> {
    let cells = surface_cells(ctx, &grid, limit)?;
    let complex = Complex::new(ctx, grid, &cells)?;
    let n_triangles = Pieces::count(&complex);
    Ok(Survey { cells, complex, n_triangles })
}

/// A singular point where no node is on the other side is one where f touches zero.
fn touching(ctx: &Ctx<'_>, error: PolygonizeError) -> PolygonizeError {
    let (PolygonizeError::SingularPoint { at, .. } | PolygonizeError::LevelNotRegular { at }) =
        error
    else {
        return error;
    };
    let [min, max] = range(ctx);
    PolygonizeError::NoSignChange { at, min, max }
}

/// The error that says which values f takes, from the nodes of a coarse grid.
pub(crate) fn empty_level_set(ctx: &Ctx<'_>) -> PolygonizeError {
    let [min, max] = range(ctx);
    PolygonizeError::EmptyLevelSet { min, max }
}

/// Least and largest value of f at the nodes of a coarse grid.
fn range(ctx: &Ctx<'_>) -> [f64; 2] {
    let grid = Grid::new(ctx.domain, FIRST_CELLS, 0);
    let [nx, ny, nz] = grid.cells.map(|n| n + 1);
    let sites = (0..nx * ny * nz).map(|i| [i % nx, i / nx % ny, i / (nx * ny)]);
    let points: Vec<_> = sites.map(|at| grid.point(at)).collect();
    let values = bulk::values(ctx.field, &points);
    let known = || values.iter().copied().filter(|f| !f.is_nan());
    let min = known().fold(f64::INFINITY, f64::min);
    let max = known().fold(f64::NEG_INFINITY, f64::max);
    [min, max]
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
        let is_point = hull.size().max() < POINT * ctx.domain.size().max();
        if !shrinks || is_point || !hull.size().iter().all(|&s| s > 0.0) {
            return Ok(domain);
        }
        domain = hull;
    }
    Ok(domain)
}

fn fold(cells: &[Site], pick: fn(u32, u32) -> u32) -> Site {
    cells.iter().copied().reduce(|a, b| [0, 1, 2].map(|k| pick(a[k], b[k]))).unwrap_or_default()
}
