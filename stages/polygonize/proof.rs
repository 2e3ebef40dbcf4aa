//! Refining until the topology is proved, or until it is clear that it will not be.

use crate::certificate::{Cube, failing};
use crate::complex::{Complex, Tetrahedron};
use crate::grid::Site;
use crate::params::PolygonizeParams;
use crate::{PolygonizeError, singular};
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::{Counters, Ctx, map};
use std::sync::OnceLock;

/// Cells a task.
const CELLS_A_TASK: usize = 64;
/// Cubes a task in refinement rounds: a small model has a few hundred, each of many boxes.
const CUBES_A_TASK: usize = 16;
/// Of so many cells the one where the slopes of f change most is tested first. What fails of
/// deccube, 10 000 faces, and of the chair is in the twentieth that bends most.
const BENT: usize = 12;
/// The same of the cells that the mesh passes, counted among all: of deccube, 5000 faces, an
/// eleventh.
const BENT_ON_SURFACE: usize = 7;
/// Tetrahedra refined for a mesh that is made beside the proof; deccube of 5000 faces takes 132. With
/// 4096, a gyroid in a ball, where most cells fail, took 1.4 times as long for work in vain.
const GUESSED: usize = 512;
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
    let all: Vec<u32> = (0..complex.n_cells() as u32).collect();
    let failed = tetrahedra(failing_cells(ctx, complex, &all));
    refine_failing(ctx, complex, params, (failed, usize::MAX), counters)
}

/// What [`prove_beside`] finds.
#[derive(Debug)]
pub(crate) enum Beside<T> {
    /// All passes, and this is the work on the refined complex.
    Proved(T),
    /// The tetrahedra that fail without being refined.
    Refine(Vec<Tetrahedron>),
}

/// Tests a complex, and does the work that waits for the proof beside it: cells that f bends in
/// most are tested first, and refined as if they were all that fail. If that is so, the complex and
/// its mesh are those that [`prove`] leads to.
///
/// # Errors
/// As [`prove`].
pub(crate) fn prove_beside<T: Send + Sync>(
    ctx: &Ctx<'_>,
    complex: &Complex,
    params: &PolygonizeParams,
    counters: &mut Counters,
    work: impl Fn(&Ctx<'_>, Complex) -> T + Sync,
) -> Result<Beside<T>, PolygonizeError> {
    let (bent, rest) = by_bend(complex);
    let first = failing_cells(ctx, complex, &bent);
    let guess = || {
        let mut complex = complex.clone();
        let mut counters = Counters::default();
        let failed = (tetrahedra(first.clone()), GUESSED);
        let failed = refine_failing(ctx, &mut complex, params, failed, &mut counters)?;
        Ok(failed.is_empty().then(|| (work(ctx, complex), counters)))
    };
    let tasks: Vec<&[u32]> = rest.chunks(CELLS_A_TASK).collect();
    let guessed = OnceLock::new();
    let found = map(ctx.host, 1 + tasks.len(), |i| match i {
        0 => {
            // The longest task, and the first to be begun.
            guessed.get_or_init(guess);
            Vec::new()
        }
        _ => failing_of(ctx, complex, tasks[i - 1]),
    });
    let others = found.concat();
    let guessed = guessed.into_inner().expect("invariant: task 0 ran");
    match guessed {
        Err(error) if others.is_empty() => Err(error),
        Ok(Some((done, found))) if others.is_empty() => {
            counters.merge(&found);
            Ok(Beside::Proved(done))
        }
        _ => {
            let mut all = [first, others].concat();
            // Stable: within a cell the order stays.
            all.sort_by_key(|&(cell, _)| cell);
            Ok(Beside::Refine(tetrahedra(all)))
        }
    }
}

/// The cells that are likely to fail, and the others, both in order.
fn by_bend(complex: &Complex) -> (Vec<u32>, Vec<u32>) {
    let cells = 0..complex.n_cells();
    let bends: Vec<f64> = cells.clone().map(|cell| complex.bend(cell)).collect();
    let on_surface: Vec<f64> =
        cells.map(|cell| if complex.is_one_sided(cell) { 0.0 } else { bends[cell] }).collect();
    let (least, least_on) = (most_of(&bends, BENT), most_of(&on_surface, BENT_ON_SURFACE));
    // Also where f is not a number.
    let is_bent = |&cell: &u32| {
        let cell = cell as usize;
        !(bends[cell] < least && on_surface[cell] < least_on)
    };
    (0..bends.len() as u32).partition(is_bent)
}

/// The value that one of so many reaches.
fn most_of(values: &[f64], one_of: usize) -> f64 {
    let place = values.len() / one_of;
    let mut values = values.to_vec();
    if values.is_empty() {
        return f64::INFINITY;
    }
    *values.select_nth_unstable_by(place, |x, y| y.total_cmp(x)).1
}

/// Refines `complex` from the tetrahedra that failed, at most so many in all, until all pass;
/// returns those that will not.
///
/// # Errors
/// As [`prove`].
pub(crate) fn refine_failing(
    ctx: &Ctx<'_>,
    complex: &mut Complex,
    params: &PolygonizeParams,
    (mut failed, most): (Vec<Tetrahedron>, usize),
    counters: &mut Counters,
) -> Result<Vec<Tetrahedron>, PolygonizeError> {
    search_singular_points(ctx, complex, &failed, are_all(complex, &failed))?;
    let smallest = complex.grid.scale() >> params.max_depth;
    let mut budget = budget(complex).min(most);
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
    let all: Vec<u32> = (0..complex.n_cells() as u32).collect();
    let failed = tetrahedra(failing_cells(ctx, complex, &all));
    search_singular_points(ctx, complex, &failed, are_all(complex, &failed))
}

/// A tetrahedron with the place of its cell.
type Failed = (u32, Tetrahedron);

fn tetrahedra(failed: Vec<Failed>) -> Vec<Tetrahedron> {
    failed.into_iter().map(|(_, t)| t).collect()
}

/// Those of some unrefined cells that fail, on the host's threads.
fn failing_cells(ctx: &Ctx<'_>, complex: &Complex, cells: &[u32]) -> Vec<Failed> {
    let tasks: Vec<&[u32]> = cells.chunks(CELLS_A_TASK).collect();
    map(ctx.host, tasks.len(), |task| failing_of(ctx, complex, tasks[task])).concat()
}

fn failing_of(ctx: &Ctx<'_>, complex: &Complex, cells: &[u32]) -> Vec<Failed> {
    let cube = |&cell: &u32| Cube {
        domain: complex.cell_box(cell as usize),
        tetrahedra: complex.tetrahedra(cell as usize).collect(),
    };
    let cubes: Vec<_> = cells.iter().map(cube).collect();
    let failed = failing(ctx.field, complex, &cubes);
    failed.into_iter().map(|(cube, t)| (cells[cube], t)).collect()
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
        let failed = failing(ctx.field, complex, &cubes);
        failed.into_iter().map(|(_, t)| t).collect::<Vec<_>>()
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
