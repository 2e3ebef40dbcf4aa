//! Stage relax: patches as near to the surface as exact G1 lets them be.
//!
//! Gauss-Newton on the normal distance inside the space of exact G1 surfaces over fixed curves,
//! tile by tile with the rest fixed. Nothing is traded for the error: every surface on the way is
//! G1 and watertight.

mod degree;
mod element;
mod envelope;
mod error;
mod face_moves;
mod functionals;
mod moves;
mod numbering;
mod params;
mod progress;
mod restore;
mod rim;
mod roughness;
mod samples;
mod sextic;
mod ties;
mod tile_solve;
mod tiling;

pub use error::RelaxError;
pub use params::RelaxParams;

use degree::Degree;
use isospline_artifact::kinds::{
    BaseMeshView, CurvatureView, EdgeSystemsView, NetworkView, PatchMeta, Patches, PatchesView,
    VertexSystemsView,
};
use isospline_fitting::net::point;
use isospline_stage::{Counters, Ctx, Piece, Plan, Stage, Task, map};
use moves::Moves;
use progress::{Progress, Start, TileState};
use restore::Conditions;
use rim::Rim;
use samples::{Interior, Samples};
use tile_solve::Problem;
use tiling::{Tile, Tiling};

/// A visit that lowers a tile's squared distance by a smaller part than this lets it rest.
const LITTLE_GAIN: f64 = 0.05;
/// Steps that a tile takes however near it is.
const FIRST_STEPS: u32 = 2;
/// Sweeps that such a tile rests: plateaus come before the last factor ten, so it is not done.
const REST: u32 = 3;
/// Tiles visited between two looks at the stop signal: well under a second.
const TILES_BETWEEN_STOPS: usize = 128;

/// Lowers the squared normal distance of all patches, tile by tile in colours that share no face.
#[derive(Clone, Debug)]
pub struct Relax {
    params: RelaxParams,
}

impl Stage for Relax {
    const NAME: &'static str = "relax";
    const VERSION: u32 = 5;
    type Params = RelaxParams;
    type Whole<'a> = (
        BaseMeshView<'a>,
        CurvatureView<'a>,
        NetworkView<'a>,
        VertexSystemsView<'a>,
        EdgeSystemsView<'a>,
        PatchesView<'a>,
    );
    type Rows<'a> = ();
    type Output = Patches;
    type Error = RelaxError;

    fn prepare(_: &Ctx<'_>, params: &RelaxParams, _: Self::Whole<'_>) -> Result<Self, RelaxError> {
        Ok(Self { params: params.clone() })
    }

    fn plan(&self, _: Self::Whole<'_>, _: usize) -> Plan {
        Plan::Whole
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh, curvature, network, vertices, edges, patches): Self::Whole<'_>,
        (): (),
        _: &Task,
    ) -> Result<Piece<Patches>, RelaxError> {
        let degree = self.params.degree();
        let tiling = Tiling::new(&mesh, self.params.tile as usize);
        let samples = Samples::new(self.params.grid, self.params.smoothness, degree);
        let moves = Moves::new(ctx.host, &mesh, &network, &vertices, degree);
        let conditions = Conditions { mesh, curvature, network, vertices };
        let start = match degree {
            Degree::Six => conditions.lowered(ctx.host, &moves, patches.interior),
            Degree::Seven => Start {
                interior: patches.interior.iter().map(interior).collect(),
                nu: edges.weights.iter().map(|w| w.nu).collect(),
                gap: Vec::new(),
            },
        };
        let mut at = Progress::new(start, tiling.tiles.len());
        let (rim, field) = (Rim::new(degree), ctx.field);
        let (moves, samples, rim) = (&moves, &samples, &rim);
        let problem = Problem { mesh, network, moves, samples, rim, field, degree };
        self.sweep(ctx, &problem, &tiling, &mut at)?;
        let mut counters = Counters::default();
        counters.count("tiles", tiling.tiles.len() as u64);
        counters.count("visits", at.visits);
        counters.count("visits_without_step", at.idle_visits);
        let (surface, nu) = (&mut at.interior, &mut at.nu);
        let restored = match degree {
            Degree::Six => conditions.restore_sextic(ctx.host, moves, surface, nu),
            Degree::Seven => conditions.restore(ctx.host, surface, nu),
        };
        counters.merge(&restored);
        let row = |f: usize| match degree {
            Degree::Six => conditions.raised(&at.interior[f], f),
            Degree::Seven => flat(&at.interior[f]),
        };
        let rows = Patches {
            meta: vec![PatchMeta { degree: degree.number() as u32, ..patches.meta[0] }],
            position: patches.position.to_vec(),
            face: patches.face.to_vec(),
            edge_of: patches.edge_of.to_vec(),
            boundary: patches.boundary.to_vec(),
            interior: map(ctx.host, at.interior.len(), row),
        };
        Ok(Piece { rows, counters })
    }
}

impl Relax {
    /// All sweeps. Tiles of one colour share no face, so their order does not matter.
    fn sweep(
        &self,
        ctx: &Ctx<'_>,
        problem: &Problem<'_>,
        tiling: &Tiling,
        at: &mut Progress,
    ) -> Result<(), RelaxError> {
        let of = u64::from(self.params.sweeps) * tiling.colours.len() as u64;
        if let Some(kept) = ctx.host.kept().and_then(|bytes| at.decode(&bytes)) {
            *at = kept;
        }
        let goal = self.params.goal * problem.mesh.bounds[0].diagonal;
        let all = std::iter::repeat_n(&tiling.colours, self.params.sweeps as usize).flatten();
        for colour in all.skip(at.colours as usize) {
            let awake = awake(colour, at);
            for batch in awake.chunks(TILES_BETWEEN_STOPS) {
                ctx.host.progress(at.colours, of)?;
                visit(ctx, problem, &tiling.tiles, batch, goal, at);
            }
            at.colours += 1;
            ctx.host.keep(at.colours, of, &|| at.encode());
        }
        Ok(())
    }
}

/// The tiles of a colour that do not rest; the others have rested one sweep more.
fn awake(colour: &[usize], at: &mut Progress) -> Vec<usize> {
    let (awake, resting): (Vec<usize>, Vec<usize>) =
        colour.iter().partition(|&&t| at.tiles[t].rest == 0);
    for t in resting {
        at.tiles[t].rest -= 1;
    }
    awake
}

/// Visits tiles of one colour; `goal` in model units.
fn visit(
    ctx: &Ctx<'_>,
    problem: &Problem<'_>,
    tiles: &[Tile],
    batch: &[usize],
    goal: f64,
    at: &mut Progress,
) {
    let outcomes = map(ctx.host, batch.len(), |i| {
        let (tile, state) = (&tiles[batch[i]], at.tiles[batch[i]]);
        // Surfaces of the stages before may be folded where no sample sees it; the first steps
        // unfold them.
        let goal = if state.steps < FIRST_STEPS { 0.0 } else { goal };
        problem.visit(tile, at, state.damping, goal)
    });
    for (&t, outcome) in batch.iter().zip(outcomes) {
        // Its neighbours may move what it shares with them: one that is near is looked at again
        // too.
        let rest = if outcome.gain < LITTLE_GAIN { REST } else { 0 };
        let steps = at.tiles[t].steps + u32::from(outcome.interior.is_some());
        at.tiles[t] = TileState { damping: outcome.damping, rest, steps };
        at.take(&tiles[t], outcome);
    }
}

fn interior(row: &[f64; 45]) -> Interior {
    std::array::from_fn(|i| point(row, i))
}

fn flat(points: &Interior) -> [f64; 45] {
    std::array::from_fn(|i| points[i / 3][i % 3])
}
