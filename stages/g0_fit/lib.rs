//! Stage `g0_fit`: interior control points that follow the surface inside fixed boundary curves.

mod error;
mod params;

pub use error::G0FitError;
pub use params::G0FitParams;

use isospline_artifact::kinds::{BaseMeshView, FaceFit, G0Fit, NetworkView};
use isospline_fitting::net::{flat_interior, needed_edges};
use isospline_fitting::patch_fit::{PatchFit, interior_fit};
use isospline_fitting::projection::project_all;
use isospline_fitting::start::start_nets;
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{N_CONTROL, N_INTERIOR};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};

/// Least squares of the distance to projected samples [TK, Eq. (12)].
#[derive(Clone, Debug)]
pub struct G0FitStage {
    fit: PatchFit<N_INTERIOR>,
}

impl Stage for G0FitStage {
    const NAME: &'static str = "g0_fit";
    const VERSION: u32 = 1;
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
        let mut nets = Vec::with_capacity(faces.len());
        for (face, targets) in faces.zip(targets.chunks_exact_mut(n_samples)) {
            let (net, start) = start_nets(&mesh, &network, face);
            self.fit.sample(&start, targets);
            nets.push(net);
        }
        let diagonal = mesh.bounds[0].diagonal;
        let projected = project_all(ctx.field, diagonal, &mut targets);
        let mut piece = Piece::<G0Fit>::default();
        piece.counters.repair("samples_off_surface", projected.failed as u64);
        for (net, targets) in nets.iter_mut().zip(targets.chunks_exact(n_samples)) {
            self.fit.fit(net, targets);
            piece.rows.interior.push(flat_interior(net));
            let fit = self.distance(net, targets);
            piece.counters.max("g0_distance_max_rel", fit.max / diagonal);
            piece.rows.fit.push(fit);
        }
        Ok(piece)
    }
}

impl G0FitStage {
    fn distance(&self, net: &[Vec3; N_CONTROL], targets: &[Vec3]) -> FaceFit {
        let mut points = vec![Vec3::zeros(); targets.len()];
        self.fit.sample(net, &mut points);
        let square = |(p, t): (&Vec3, &Vec3)| (p - t).norm_squared();
        let squares: Vec<f64> = points.iter().zip(targets).map(square).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        FaceFit {
            max: squares.iter().fold(0.0, |acc: f64, s| acc.max(*s)).sqrt(),
            rms: mean.sqrt(),
        }
    }
}
