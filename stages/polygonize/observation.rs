//! Topology without proof: two resolutions that agree.

use crate::complex::Complex;
use crate::crossing;
use crate::error::PolygonizeError;
use crate::grid::Grid;
use crate::lost_parts::{middle, thinner};
use crate::marching::Pieces;
use crate::params::PolygonizeParams;
use crate::surface_cells::{MOST_DENSE_CELLS, has_intervals, surface_cells};
use crate::{box_sides, resolution};
use isospline_geometry::TriangleMesh;
use isospline_implicit::Interval;
use isospline_stage::Ctx;

/// Fewest cells along the longest side of a grid that is observed.
const LEAST_CELLS: u32 = 32;
/// Most cells along the longest side, unless more are asked for: where enclosures prune the cells.
const MOST_CELLS: u32 = 2048;
/// Cells of such a grid that the surface may touch: thin tubes and small parts have fewer.
const MOST_FEW_CELLS: u32 = 500_000;
/// Difference of the volumes of a component that two resolutions may show.
const VOLUME_TOLERANCE: f64 = 0.05;

/// A component as two resolutions are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Component {
    euler_characteristic: i64,
    volume: f64,
}

/// The coarsest complex, from the grid given upwards, whose components agree with those of the
/// grid twice as fine in Euler characteristic and volume.
///
/// `doubtful` are the boxes that may hold surface without a proof.
///
/// # Errors
/// [`PolygonizeError::TopologyUnresolved`] if no two resolutions agree within the limits,
/// [`PolygonizeError::ThinnerThanGrid`] if a grid shows nothing though there are doubtful boxes.
pub(crate) fn observe(
    ctx: &Ctx<'_>,
    grid: &Grid,
    params: &PolygonizeParams,
    doubtful: &[[Interval; 3]],
) -> Result<Complex, PolygonizeError> {
    let mut coarse = at(ctx, grid, grid.longest().max(LEAST_CELLS), params.max_cells)?;
    let plain = MOST_DENSE_CELLS.max(2 * grid.longest());
    let many = if has_intervals(ctx, grid) { MOST_CELLS } else { MOST_DENSE_CELLS };
    let most = many.max(plain).min(Grid::most_cells(grid.levels));
    let mut rounds = 0;
    loop {
        rounds += 1;
        ctx.host.progress(rounds, rounds + 1)?;
        let cells = coarse.grid.longest();
        let unresolved = PolygonizeError::TopologyUnresolved { cells };
        if 2 * cells > most {
            return Err(unresolved);
        }
        let few = if 2 * cells > plain { MOST_FEW_CELLS } else { u32::MAX };
        let fine = match at(ctx, grid, 2 * cells, params.max_cells.min(few)) {
            Err(PolygonizeError::TooManyCells { .. }) => return Err(unresolved),
            found => found?,
        };
        if agree(&components(ctx, &coarse, doubtful)?, &components(ctx, &fine, doubtful)?) {
            return Ok(coarse);
        }
        coarse = fine;
    }
}

fn at(ctx: &Ctx<'_>, grid: &Grid, cells: u32, limit: u32) -> Result<Complex, PolygonizeError> {
    let grid = Grid::new(grid.domain, cells, grid.levels);
    let cells = surface_cells(ctx, &grid, limit)?;
    Complex::new(ctx, grid, &cells)
}

/// Components in the order of characteristic and volume.
fn components(
    ctx: &Ctx<'_>,
    complex: &Complex,
    doubtful: &[[Interval; 3]],
) -> Result<Vec<Component>, PolygonizeError> {
    let pieces = Pieces::of(complex);
    if pieces.crossings.is_empty() {
        return Err(match doubtful.first() {
            Some(part) => thinner(ctx.field, &complex.grid, middle(part)),
            None => resolution::empty_level_set(ctx),
        });
    }
    box_sides::no_crossing_on_sides(ctx, complex, &pieces.crossings)?;
    let positions = crossing::linear_positions(complex, &pieces.crossings);
    let mesh = pieces.triangulate(positions);
    let opposite = mesh.opposites().expect("invariant: marching tetrahedra make a manifold");
    let of_face = mesh.face_components(&opposite);
    let mut all = vec![Component { euler_characteristic: 0, volume: 0.0 }; largest(&of_face) + 1];
    let mut seen = vec![false; mesh.positions.len()];
    for (face, &component) in (0u32..).zip(&of_face) {
        let component = &mut all[component as usize];
        component.volume += volume_under(&mesh, face);
        // V - E + F of a closed triangulation: E = 3/2 F, so V - F/2; halves are kept whole here.
        component.euler_characteristic -= 1;
        for v in mesh.faces[face as usize] {
            if !std::mem::replace(&mut seen[v as usize], true) {
                component.euler_characteristic += 2;
            }
        }
    }
    for component in &mut all {
        component.euler_characteristic /= 2;
    }
    let key = |c: &Component| c.euler_characteristic;
    all.sort_by(|a, b| key(a).cmp(&key(b)).then(a.volume.total_cmp(&b.volume)));
    Ok(all)
}

fn largest(components: &[u32]) -> usize {
    components.iter().max().map_or(0, |&c| c as usize)
}

/// Signed volume of the tetrahedron over a face; all share their apex, so they sum to the volume.
fn volume_under(mesh: &TriangleMesh, face: u32) -> f64 {
    let origin = mesh.positions[0];
    let [a, b, c] = mesh.corners(face).map(|p| p - origin);
    a.dot(&b.cross(&c)) / 6.0
}

fn agree(coarse: &[Component], fine: &[Component]) -> bool {
    let close = |(a, b): (&Component, &Component)| {
        a.euler_characteristic == b.euler_characteristic
            && (a.volume - b.volume).abs() <= VOLUME_TOLERANCE * b.volume.abs()
    };
    coarse.len() == fine.len() && coarse.iter().zip(fine).all(close)
}
