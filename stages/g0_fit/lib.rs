//! Stage `g0_fit`: interior control points that follow the surface inside fixed boundary curves.

mod error;
mod params;

pub use error::G0FitError;
pub use params::G0FitParams;

use isospline_artifact::kinds::{BaseMeshView, FaceFit, G0Fit, NetworkView};
use isospline_fitting::lanes::N;
use isospline_fitting::net::{flat_interior, needed_edges};
use isospline_fitting::patch_fit::{Distance, PatchFit, interior_fit};
use isospline_fitting::projection::project_all;
use isospline_fitting::start::start_nets;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{N_INTERIOR, interior_indices};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};

/// Least squares of the distance to projected samples [TK, Eq. (12)].
#[derive(Clone, Debug)]
pub struct G0FitStage {
    fit: PatchFit<N_INTERIOR>,
}

impl Stage for G0FitStage {
    const NAME: &'static str = "g0_fit";
    const VERSION: u32 = 2;
    type Params = G0FitParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (NetworkView<'a>,);
    type Output = G0Fit;
    type Error = G0FitError;

    fn prepare(
        _: &Ctx<'_>,
        params: &G0FitParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, G0FitError> {
        Ok(Self { fit: interior_fit(params.grid) })
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let n_faces = mesh.face.len();
        let tasks = cut(n_faces, rows_per_task).map(|rows| {
            let edges = ranges(needed_edges(&mesh, rows.clone()));
            Task {
                writes: vec![rows; 2],
                needs: vec![Need { input: 0, section: "control", rows: edges }],
            }
        });
        Plan::Rows { lengths: vec![n_faces; 2], tasks: tasks.collect() }
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (network,): (NetworkView<'_>,),
        task: &Task,
    ) -> Result<Piece<G0Fit>, G0FitError> {
        let faces = task.writes[0].clone();
        let n_samples = self.fit.n_samples();
        let mut targets = vec![Vec3::zeros(); faces.len() * n_samples];
        let (mut nets, starts) = start_nets(&mesh, &network, faces.clone());
        self.fit.sample(&starts, &mut targets);
        let diagonal = mesh.bounds[0].diagonal;
        let projected = project_all(ctx.field, diagonal, &mut targets);
        let mut piece = Piece::<G0Fit>::default();
        piece.counters.repair("samples_off_surface", projected.failed as u64);
        for Distance { max, rms } in self.fit.fit(&mut nets, &targets) {
            piece.counters.max("g0_distance_max_rel", max / diagonal);
            piece.rows.fit.push(FaceFit { max, rms });
        }
        let slots = interior_indices();
        let interior = |k: usize| slots.map(|i| nets[k / N][i].get(k % N));
        piece.rows.interior = (0..faces.len()).map(|k| flat_interior(&interior(k))).collect();
        Ok(piece)
    }
}
