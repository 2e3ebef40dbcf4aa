//! Stage relax: patches as near to the surface as exact G1 lets them be.
//!
//! Gauss-Newton on the normal distance inside the space of exact G1 surfaces over fixed curves,
//! tile by tile with the rest fixed. Nothing is traded for the error: every surface on the way is
//! G1 and watertight.

mod element;
mod envelope;
mod error;
mod face_moves;
mod moves;
mod numbering;
mod params;
mod restore;
mod samples;
mod tile_solve;
mod tiling;

pub use error::RelaxError;
pub use params::RelaxParams;

use isospline_artifact::kinds::{
    BaseMeshView, CurvatureView, EdgeSystemsView, NetworkView, Patches, PatchesView,
    VertexSystemsView,
};
use isospline_fitting::net::point;
use isospline_stage::{Counters, Ctx, Piece, Plan, Stage, Task, map};
use moves::Moves;
use restore::Conditions;
use samples::{Interior, Samples};
use tile_solve::{FIRST_DAMPING, Outcome, Problem};
use tiling::{Tile, Tiling};

/// A visit that lowers a tile's squared distance by a smaller part than this lets it rest.
const LITTLE_GAIN: f64 = 0.05;
/// Steps that a tile takes however near it is.
const FIRST_STEPS: u32 = 2;
/// Sweeps that such a tile rests: plateaus come before the last factor ten, so it is not done.
const REST: u32 = 3;

/// Lowers the squared normal distance of all patches, tile by tile in colours that share no face.
#[derive(Clone, Debug)]
pub struct Relax {
    params: RelaxParams,
}

impl Stage for Relax {
    const NAME: &'static str = "relax";
    const VERSION: u32 = 1;
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
        let mut surface = Surface {
            interior: patches.interior.iter().map(interior).collect(),
            nu: edges.weights.iter().map(|w| w.nu).collect(),
        };
        let samples = Samples::new(self.params.grid);
        let moves = Moves::new(ctx.host, &mesh, &network, &vertices);
        let problem = Problem { mesh, network, moves: &moves, samples: &samples, field: ctx.field };
        let mut counters = self.sweep(ctx, &problem, &mut surface)?;
        let conditions = Conditions { mesh, curvature, network, vertices };
        let restored = conditions.restore(ctx.host, &mut surface.interior, &surface.nu);
        counters.merge(&restored);
        let rows = Patches {
            meta: patches.meta.to_vec(),
            position: patches.position.to_vec(),
            face: patches.face.to_vec(),
            edge_of: patches.edge_of.to_vec(),
            boundary: patches.boundary.to_vec(),
            interior: surface.interior.iter().map(flat).collect(),
        };
        Ok(Piece { rows, counters })
    }
}

/// What the moves change.
struct Surface {
    interior: Vec<Interior>,
    /// The free scalar of each edge.
    nu: Vec<f64>,
}

impl Surface {
    fn take(&mut self, tile: &Tile, outcome: Outcome) {
        for (&f, points) in tile.faces.iter().zip(outcome.interior.unwrap_or_default()) {
            self.interior[f as usize] = points;
        }
        for (&e, change) in tile.edges.iter().zip(&outcome.nu) {
            self.nu[e as usize] += change;
        }
    }
}

impl Relax {
    /// All sweeps. Tiles of one colour share no face, so their order does not matter.
    fn sweep(
        &self,
        ctx: &Ctx<'_>,
        problem: &Problem<'_>,
        surface: &mut Surface,
    ) -> Result<Counters, RelaxError> {
        let Tiling { tiles, colours } = Tiling::new(&problem.mesh, self.params.tile as usize);
        let mut states = vec![TileState { damping: FIRST_DAMPING, rest: 0, steps: 0 }; tiles.len()];
        let mut counters = Counters::default();
        let goal = self.params.goal * problem.mesh.bounds[0].diagonal;
        let of = u64::from(self.params.sweeps) * colours.len() as u64;
        let all = std::iter::repeat_n(&colours, self.params.sweeps as usize).flatten();
        for (done, colour) in all.enumerate() {
            ctx.host.progress(done as u64, of)?;
            let (awake, resting): (Vec<usize>, Vec<usize>) =
                colour.iter().partition(|&&t| states[t].rest == 0);
            for t in resting {
                states[t].rest -= 1;
            }
            let outcomes = map(ctx.host, awake.len(), |i| {
                let t = awake[i];
                // Surfaces of the stages before may be folded where no sample sees it; the first
                // steps unfold them.
                let goal = if states[t].steps < FIRST_STEPS { 0.0 } else { goal };
                problem.visit(&tiles[t], &surface.interior, states[t].damping, goal)
            });
            counters.count("visits", awake.len() as u64);
            for (t, outcome) in awake.into_iter().zip(outcomes) {
                // Its neighbours may move what it shares with them: one that is near is looked at
                // again too.
                let rest = if outcome.gain < LITTLE_GAIN { REST } else { 0 };
                let steps = states[t].steps + u32::from(outcome.interior.is_some());
                states[t] = TileState { damping: outcome.damping, rest, steps };
                counters.count("visits_without_step", u64::from(outcome.interior.is_none()));
                surface.take(&tiles[t], outcome);
            }
        }
        counters.count("tiles", tiles.len() as u64);
        Ok(counters)
    }
}

/// What a tile carries from visit to visit.
#[derive(Clone, Copy, Debug)]
struct TileState {
    damping: f64,
    /// Sweeps that it sits out.
    rest: u32,
    /// Steps taken.
    steps: u32,
}

fn interior(row: &[f64; 45]) -> Interior {
    std::array::from_fn(|i| point(row, i))
}

fn flat(points: &Interior) -> [f64; 45] {
    std::array::from_fn(|i| points[i / 3][i % 3])
}
