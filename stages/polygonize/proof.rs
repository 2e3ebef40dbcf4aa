//! Refining until the topology is proved, or until it is clear that it will not be.

use crate::certificate::{Cube, failing};
use crate::complex::{Complex, Tetrahedron};
use crate::grid::Site;
use crate::params::PolygonizeParams;
use crate::{PolygonizeError, singular};
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::{Counters, Ctx, map};

/// Cells a task.
const CELLS_A_TASK: usize = 64;
/// Cubes a task in refinement rounds: a small model has a few hundred, each of many boxes.
const CUBES_A_TASK: usize = 16;
/// Failing tetrahedra from which a singular point is searched, spread over all that fail.
const SEARCHES: usize = 16;
/// Failing tetrahedra, of those that the surface passes, from which on it may be singular
/// everywhere.
const ALL: f64 = 0.95;

/// Refines `complex` until all its tetrahedra pass the test; returns those that will not: all
/// surface that the mesh may lack lies in them.
///
/// # Errors
/// [`PolygonizeError::SingularPoint`] where refinement converges onto one, and what
/// [`Complex::refine`] meets.
pub(crate) fn prove(
    ctx: &Ctx<'_>,
    complex: &mut Complex,
    params: &PolygonizeParams,
    counters: &mut Counters,
) -> Result<Vec<Tetrahedron>, PolygonizeError> {
    let mut failed = failing_cells(ctx, complex);
    search_singular_points(ctx, complex, &failed, are_all(complex, &failed))?;
    let smallest = complex.grid.scale() >> params.max_depth;
    let mut budget = budget(complex);
    let mut rounds = 0;
    while !failed.is_empty() {
        ctx.host.progress(rounds, 3 * u64::from(params.max_depth))?;
        if rounds > 0 {
            search_singular_points(ctx, complex, &failed, false)?;
        }
        counters.count("tetrahedra_refined", failed.len() as u64);
        if failed.len() > budget || failed.iter().any(|t| width(complex, t) <= smallest) {
            return Ok(failed);
        }
        budget -= failed.len();
        rounds += 1;
        let new = complex.refine(ctx, &failed)?;
        failed = failing_tetrahedra(ctx, complex, &new);
    }
    counters.count("refinement_rounds", rounds);
    Ok(failed)
}

/// Tetrahedra tested in refinement rounds before the proof is given up: along a kink their number
/// doubles with every halving and nothing is gained.
fn budget(complex: &Complex) -> usize {
    /// As many as the grid had, in a small grid.
    const SMALL: usize = 60_000;
    /// The least.
    const LEAST: usize = 10_000;
    /// A share of those that a large grid had. A regular surface fails in a few there; a sheet
    /// thinner than the grid fails everywhere, and a round takes a minute.
    const SHARE: usize = 8;
    let n_tetrahedra = 6 * complex.n_cells();
    LEAST.max(n_tetrahedra.min(SMALL)).max(n_tetrahedra / SHARE)
}

/// Searches singular points where the unrefined complex fails the test.
///
/// # Errors
/// [`PolygonizeError::SingularPoint`] if there is one.
pub(crate) fn no_singular_point(ctx: &Ctx<'_>, complex: &Complex) -> Result<(), PolygonizeError> {
    let failed = failing_cells(ctx, complex);
    search_singular_points(ctx, complex, &failed, are_all(complex, &failed))
}

fn failing_cells(ctx: &Ctx<'_>, complex: &Complex) -> Vec<Tetrahedron> {
    let n_tasks = complex.n_cells().div_ceil(CELLS_A_TASK);
    let cube = |cell: usize| Cube {
        domain: complex.cell_box(cell),
        tetrahedra: complex.tetrahedra(cell).collect(),
    };
    map(ctx.host, n_tasks, |task| {
        let last = ((task + 1) * CELLS_A_TASK).min(complex.n_cells());
        let cubes: Vec<_> = (task * CELLS_A_TASK..last).map(cube).collect();
        failing(ctx.field, complex, &cubes)
    })
    .concat()
}

/// Tests tetrahedra cube by cube, so that those of one cube share its enclosures.
fn failing_tetrahedra(
    ctx: &Ctx<'_>,
    complex: &Complex,
    tetrahedra: &[Tetrahedron],
) -> Vec<Tetrahedron> {
    let mut homes: Vec<_> = tetrahedra.iter().map(|t| (home(complex, t), *t)).collect();
    // Stable: within a cube the order stays.
    homes.sort_by_key(|&(cube, _)| cube);
    let cubes: Vec<_> = homes.chunk_by(|a, b| a.0 == b.0).collect();
    let shares: Vec<_> = cubes.chunks(CUBES_A_TASK).collect();
    let cube = |members: &&[((Site, u32), Tetrahedron)]| {
        let (lo, width) = members[0].0;
        Cube {
            domain: complex.grid.intervals(lo, lo.map(|c| c + width)),
            tetrahedra: members.iter().map(|m| m.1).collect(),
        }
    };
    map(ctx.host, shares.len(), |i| {
        let cubes: Vec<_> = shares[i].iter().map(cube).collect();
        failing(ctx.field, complex, &cubes)
    })
    .concat()
}

/// The cube of the bisection tree that a tetrahedron lies in: its lower corner and width.
pub(crate) fn home(complex: &Complex, t: &Tetrahedron) -> (Site, u32) {
    let width = width(complex, t);
    let sites = t.map(|n| complex.site(n));
    let least = |k: usize| sites.iter().map(|s| s[k]).min().expect("invariant: four nodes");
    ([0, 1, 2].map(|k| least(k) / width * width), width)
}

fn width(complex: &Complex, t: &Tetrahedron) -> u32 {
    let (i, j) = complex.longest_edge(t);
    complex.extent(t[i], t[j])
}

fn search_singular_points(
    ctx: &Ctx<'_>,
    complex: &Complex,
    failed: &[Tetrahedron],
    is_everywhere: bool,
) -> Result<(), PolygonizeError> {
    let scale = complex.typical_value();
    let mut first = None;
    for t in failed.iter().step_by(failed.len().div_ceil(SEARCHES).max(1)) {
        let points = t.map(|n| complex.point(n));
        let middle: Vec3 = 0.25 * points.iter().sum::<Vec3>();
        let around = Aabb::around(&points);
        let cell = complex.grid.lattice_step() * f64::from(complex.grid.scale());
        let reach = Aabb::new(around.min.add_scalar(-cell), around.max.add_scalar(cell));
        match singular::near(ctx.field, middle, &reach, scale, cell) {
            Some(found) if !is_everywhere => return Err(found),
            Some(found) => drop(first.get_or_insert(found)),
            // One regular place is enough: what was found is a point or a curve.
            None if is_everywhere => return first.map_or(Ok(()), Err),
            None => {}
        }
    }
    Err(match first {
        None => return Ok(()),
        Some(PolygonizeError::SingularPoint { at, .. }) => PolygonizeError::LevelNotRegular { at },
        Some(other) => other,
    })
}

/// Whether about all tetrahedra of the unrefined complex that have nodes on both sides failed.
fn are_all(complex: &Complex, failed: &[Tetrahedron]) -> bool {
    let crosses = |t: &Tetrahedron| {
        let first = complex.inside(t[0]);
        t[1..].iter().any(|&n| complex.inside(n) != first)
    };
    let count = |cell: usize| complex.tetrahedra(cell).filter(crosses).count();
    let n_surface: usize = (0..complex.n_cells()).map(count).sum();
    failed.len() >= SEARCHES && failed.len() as f64 >= ALL * n_surface as f64
}
