//! Stage polygonize: a field becomes a closed triangle mesh about as fine as wanted.
//!
//! 1. A coarse pass counts triangles; the cell size follows from the faces wanted.
//! 2. A tree of boxes, pruned by interval enclosures of f, gives all cells that the surface may
//!    touch; cells are cut into Kuhn's six tetrahedra.
//! 3. Tetrahedra that fail the interval test below are refined by conforming bisection.
//! 4. Each tetrahedron with nodes on both sides gives a triangle or two, with corners at bracketed
//!    roots of f on its edges; short edges are merged where the topology stays.
//!
//! # What is promised
//! The mesh is closed, oriented and manifold whatever the field: it separates the inside from the
//! outside nodes of a conforming complex.
//!
//! [`TopologyProof::Certified`] is stored if in addition, by interval arithmetic with outward
//! rounding, f does not vanish on the sides of the box, nor on cells that were pruned, and every
//! remaining tetrahedron T with linear interpolant L of its node values passes: `grad L . g > 0`
//! for all g in the enclosure of grad f wherever, on the boxes of a cover of T, f and L are not
//! shown to have one strict sign. Then the separating surface is isotopic to `f = 0` in the box: the same
//! number of components, the same genus of each, nested alike.
//!
//! This is the small normal variation of [PV04, Sec. 3] with one of its two interval gradients
//! replaced by the gradient of the mesh itself: the components of grad L are difference quotients
//! along axes, members of any enclosure of grad f over the cell. It needs no balanced tree, and
//! boxes may be cut for the test alone.
//!
//! Proof \[derived\]. Let `F_s = (1-s) f + s L`, s in \[0, 1\], L continuous over the complex. If
//! `F_s(x) = 0` for some s, then `f(x) L(x) <= 0`, so x lies in no pruned cell (there f and the
//! node values, hence L on shared faces, have one sign), and in every tetrahedron T about x f and
//! L have not one strict sign: `g . a > 0` for `g = grad L` on T and all a in the generalized
//! gradient of f at x. So 0 is in no convex combination of such g and a; the hull of them all
//! lies in an open half space and a direction v increases every `F_s` near x. A partition of
//! unity joins such directions to one smooth field v transversal to all the sets `F_s = 0`, which
//! are therefore graphs over each other along v and form an isotopy from `f = 0` to `L = 0`; it
//! stays off the sides of the box since none of the `F_s` vanishes there. Node values may be any
//! numbers of the right sign in pruned cells, so rounding of f does no harm, and an exact zero
//! stands for a small positive number. Sliding the corners of `L = 0` along their edges to the
//! roots of f keeps every piece in its tetrahedron. Merging short edges keeps the topological
//! type by the link condition.
//!
//! A mesh across which the gradient of f jumps, however near its sides are, is refused after that:
//! the surface has a sharp edge there, which no smooth patches follow.
//!
//! Otherwise (kinks, fields without intervals, the depth limit) two grids of n >= 32 and 2 n cells
//! that agree in the Euler characteristic and the volume of every component give
//! [`TopologyProof::Observed`], which proves nothing: what falls between the nodes of both is
//! missed. Where enclosures cannot exclude a part of the surface away from the mesh, the run is
//! refused instead.

mod box_sides;
mod bulk;
mod certificate;
mod complex;
mod crossing;
pub mod error;
mod grid;
mod hopeless;
mod interpolant;
mod key_map;
mod lost_parts;
mod marching;
mod observation;
pub mod params;
mod proof;
mod resolution;
mod sharp_edges;
mod short_edges;
mod singular;
mod small_parts;
mod surface_cells;
#[cfg(test)]
mod tests;
mod transversal;

pub use error::{PolygonizeError, Side};
pub use params::PolygonizeParams;

use complex::Complex;
use isospline_artifact::kinds::{Mesh, TopologyProof};
use isospline_geometry::TriangleMesh;
use isospline_stage::{Counters, Ctx, Piece, Plan, Stage, Task};
use marching::Pieces;
use proof::Beside;
use resolution::Survey;
use std::sync::OnceLock;

/// Triangles made at least for each face wanted: decimation only takes away.
const LEAST_OF_FACES: f64 = 1.05;
/// Cells up to which the mesh is made beside the proof, on a copy of the complex; the parts of a
/// larger one keep all threads busy, and it has no memory to spare.
const SMALL: usize = 100_000;
/// Grids on which that is tried.
const MOST_TRIES: u32 = 3;

/// Stage polygonize.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygonize {
    params: PolygonizeParams,
}

impl Stage for Polygonize {
    const NAME: &'static str = "polygonize";
    const VERSION: u32 = 7;
    type Params = PolygonizeParams;
    type Whole<'a> = ();
    type Rows<'a> = ();
    type Output = Mesh;
    type Error = PolygonizeError;

    fn prepare(
        _: &Ctx<'_>,
        params: &Self::Params,
        (): Self::Whole<'_>,
    ) -> Result<Self, Self::Error> {
        Ok(Self { params: params.clone() })
    }

    fn plan(&self, (): Self::Whole<'_>, _: usize) -> Plan {
        Plan::Whole
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (): Self::Whole<'_>,
        (): Self::Rows<'_>,
        _: &Task,
    ) -> Result<Piece<Mesh>, PolygonizeError> {
        let mut counters = Counters::default();
        let (mesh, proof) = polygonize(ctx, &self.params, &mut counters)?;
        let rows = self.rows(ctx, &mesh, proof, &mut counters)?;
        counters.count("triangles", rows.face.len() as u64);
        Ok(Piece { rows, counters })
    }
}

impl Polygonize {
    /// The rows of a mesh without sharp edges, which are looked for beside making them.
    fn rows(
        &self,
        ctx: &Ctx<'_>,
        mesh: &TriangleMesh,
        proof: TopologyProof,
        counters: &mut Counters,
    ) -> Result<Mesh, PolygonizeError> {
        let looked = OnceLock::new();
        let made = OnceLock::new();
        ctx.host.for_each(2, &|i| match i {
            0 => drop(looked.set(sharp_edges::none_on(ctx, mesh))),
            _ => drop(made.set({
                let mut counters = Counters::default();
                let kept = small_parts::without(mesh, self.params.drop_below, &mut counters);
                let rows = Mesh::from_triangles(kept.as_ref().unwrap_or(mesh), proof)
                    .expect("invariant: merging keeps a manifold manifold");
                (rows, counters)
            })),
        });
        looked.into_inner().expect("invariant: part 0 ran")?;
        let (rows, found) = made.into_inner().expect("invariant: part 1 ran");
        counters.merge(&found);
        Ok(rows)
    }
}

/// The mesh and how its topology is known.
///
/// # Errors
/// All of [`PolygonizeError`].
fn polygonize(
    ctx: &Ctx<'_>,
    params: &PolygonizeParams,
    counters: &mut Counters,
) -> Result<(TriangleMesh, TopologyProof), PolygonizeError> {
    let mut survey = resolution::choose(ctx, params)?;
    let least = LEAST_OF_FACES * f64::from(params.faces);
    let mut tries = 1;
    loop {
        let grid = survey.complex.grid.clone();
        let cells = f64::from(grid.longest());
        let mut found = Counters::default();
        let (mesh, proof) = triangulate(ctx, params, survey, &mut found)?;
        let share = mesh.faces.len() as f64 / least;
        let finer = if params.cells > 0 || share >= 1.0 || tries == MOST_TRIES {
            None
        } else {
            // A little more than the count asks for, so that one try is enough.
            resolution::finer(ctx, params, &grid, (1.1 * cells / share.sqrt()).ceil())?
        };
        let Some(finer) = finer else {
            *counters = found;
            ctx.host.progress(1, 1)?;
            return Ok((mesh, proof));
        };
        survey = finer;
        tries += 1;
    }
}

fn triangulate(
    ctx: &Ctx<'_>,
    params: &PolygonizeParams,
    survey: Survey,
    counters: &mut Counters,
) -> Result<(TriangleMesh, TopologyProof), PolygonizeError> {
    let Survey { mut complex, cells, .. } = survey;
    let grid = complex.grid.clone();
    ctx.host.progress(0, 1)?;
    let sides_are_clear = box_sides::are_clear(ctx, &grid, &cells).or_else(|leaves_box| {
        // A larger box would not mend a singular surface: that is the better message.
        proof::no_singular_point(ctx, &complex).and(Err(leaves_box))
    })?;
    drop(cells);
    counters.count("cells", complex.n_cells() as u64);
    counters.max("cells_a_side", f64::from(grid.longest()));
    let failed = if sides_are_clear && complex.n_cells() <= SMALL {
        match proof::prove_beside(ctx, &complex, params, counters, extract)? {
            Beside::Proved(mesh) => return Ok((mesh?, TopologyProof::Certified)),
            Beside::Refine(failed) => {
                let failed = (failed, usize::MAX);
                proof::refine_failing(ctx, &mut complex, params, failed, counters)?
            }
        }
    } else {
        proof::prove(ctx, &mut complex, params, counters)?
    };
    if sides_are_clear && failed.is_empty() {
        return Ok((extract(ctx, complex)?, TopologyProof::Certified));
    }
    // Without interval arithmetic every box fails: there the samples alone decide.
    let doubtful = if surface_cells::has_intervals(ctx, &grid) {
        lost_parts::boxes(&complex, &failed)
    } else {
        Vec::new()
    };
    let observed = observation::observe(ctx, &grid, params, &doubtful)?;
    let lost = lost_parts::none_is_lost(ctx, &observed, &doubtful);
    let mesh = extract(ctx, observed)?;
    if lost.is_err() {
        // A finer grid would not mend a sharp edge: that is the better message.
        sharp_edges::none_on(ctx, &mesh)?;
    }
    lost.map(|()| (mesh, TopologyProof::Observed))
}

fn extract(ctx: &Ctx<'_>, mut complex: Complex) -> Result<TriangleMesh, PolygonizeError> {
    complex.keep_as_it_is();
    let pieces = Pieces::of(&complex);
    if pieces.crossings.is_empty() {
        return Err(resolution::empty_level_set(ctx));
    }
    box_sides::no_crossing_on_sides(ctx, &complex, &pieces.crossings)?;
    let step = complex.grid.lattice_step();
    let side = |&[a, b]: &[u32; 2]| step * f64::from(complex.extent(a, b));
    let sides: Vec<_> = pieces.crossings.iter().map(side).collect();
    let positions = crossing::positions(ctx, &complex, &pieces.crossings);
    drop(complex);
    Ok(short_edges::merge(ctx, pieces.triangulate(positions), sides))
}
