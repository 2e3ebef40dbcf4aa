//! Refining until the topology is proved, or until it is clear that it will not be.

use crate::certificate::{box_around, failing};
use crate::complex::{Complex, Tetrahedron};
use crate::params::PolygonizeParams;
use crate::{PolygonizeError, singular};
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::{Counters, Ctx, map};

/// Cells a task of the first round.
const CELLS_A_TASK: usize = 64;
/// Tetrahedra a task of the later rounds.
const TETRAHEDRA_A_TASK: usize = 64;
/// Failing tetrahedra from which a singular point is searched, spread over all that fail.
const SEARCHES: usize = 16;
/// Tetrahedra tested in refinement rounds, for each that the grid had and at least
/// [`LEAST_BUDGET`], before the proof is given up: along a kink their number doubles with every
/// halving and nothing is gained.
const BUDGET: usize = 4;
const LEAST_BUDGET: usize = 50_000;

/// Refines `complex` until all its tetrahedra pass the test; false if they will not.
///
/// # Errors
/// [`PolygonizeError::SingularPoint`] where refinement converges onto one, and what
/// [`Complex::refine`] meets.
pub(crate) fn prove(
    ctx: &Ctx<'_>,
    complex: &mut Complex,
    params: &PolygonizeParams,
    counters: &mut Counters,
) -> Result<bool, PolygonizeError> {
    let mut failed = failing_cells(ctx, complex);
    let smallest = complex.grid.scale() >> params.max_depth;
    let mut budget = LEAST_BUDGET.max(BUDGET * 6 * complex.n_cells());
    let mut rounds = 0;
    while !failed.is_empty() {
        ctx.host.progress(rounds, 3 * u64::from(params.max_depth))?;
        search_singular_points(ctx, complex, &failed)?;
        counters.count("tetrahedra_refined", failed.len() as u64);
        if failed.len() > budget || failed.iter().any(|t| width(complex, t) <= smallest) {
            return Ok(false);
        }
        budget -= failed.len();
        rounds += 1;
        let new = complex.refine(ctx, &failed)?;
        failed = failing_tetrahedra(ctx, complex, &new);
    }
    counters.count("refinement_rounds", rounds);
    Ok(true)
}

fn failing_cells(ctx: &Ctx<'_>, complex: &Complex) -> Vec<Tetrahedron> {
    let n_tasks = complex.n_cells().div_ceil(CELLS_A_TASK);
    let of_cell = |cell: usize| {
        let tetrahedra: Vec<_> = complex.tetrahedra(cell).collect();
        failing(ctx, complex, &tetrahedra, complex.cell_box(cell))
    };
    map(ctx.host, n_tasks, |task| {
        let last = ((task + 1) * CELLS_A_TASK).min(complex.n_cells());
        (task * CELLS_A_TASK..last).flat_map(of_cell).collect::<Vec<_>>()
    })
    .concat()
}

fn failing_tetrahedra(
    ctx: &Ctx<'_>,
    complex: &Complex,
    tetrahedra: &[Tetrahedron],
) -> Vec<Tetrahedron> {
    let shares: Vec<_> = tetrahedra.chunks(TETRAHEDRA_A_TASK).collect();
    let of_one = |t: &Tetrahedron| failing(ctx, complex, &[*t], box_around(complex, t));
    map(ctx.host, shares.len(), |i| shares[i].iter().flat_map(of_one).collect::<Vec<_>>()).concat()
}

fn width(complex: &Complex, t: &Tetrahedron) -> u32 {
    let (i, j) = complex.longest_edge(t);
    complex.extent(t[i], t[j])
}

fn search_singular_points(
    ctx: &Ctx<'_>,
    complex: &Complex,
    failed: &[Tetrahedron],
) -> Result<(), PolygonizeError> {
    let scale = complex.typical_value();
    for t in failed.iter().step_by(failed.len().div_ceil(SEARCHES)) {
        let points = t.map(|n| complex.point(n));
        let middle: Vec3 = 0.25 * points.iter().sum::<Vec3>();
        let around = Aabb::around(&points);
        let cell = complex.grid.lattice_step() * f64::from(complex.grid.scale());
        let reach = Aabb::new(around.min.add_scalar(-cell), around.max.add_scalar(cell));
        if let Some(found) = singular::near(ctx.field, middle, &reach, scale, cell) {
            return Err(found);
        }
    }
    Ok(())
}
