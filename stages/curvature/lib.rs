//! Stage curvature: the second fundamental form at every sector of the base mesh.

mod error;

pub use error::CurvatureError;

use isospline_artifact::kinds::{BaseMeshView, Curvature};
use isospline_fitting::shape::second_fundamental_form;
use isospline_geometry::Vec3;
use isospline_implicit::Jet2;
use isospline_stage::plan::cut;
use isospline_stage::{Counters, Ctx, Params, Piece, Plan, Stage, Task};

/// This stage has no parameters.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CurvatureParams {}

impl Params for CurvatureParams {}

/// Evaluates `M = -P H P / |grad f|` (see [`second_fundamental_form`]), or takes over the forms that
/// free vertices were given.
#[derive(Clone, Copy, Debug)]
pub struct CurvatureStage;

impl Stage for CurvatureStage {
    const NAME: &'static str = "curvature";
    const VERSION: u32 = 1;
    type Params = CurvatureParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = ();
    type Output = Curvature;
    type Error = CurvatureError;

    fn prepare(
        _: &Ctx<'_>,
        _: &CurvatureParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, CurvatureError> {
        Ok(Self)
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let n_sectors = mesh.frame.len();
        let task = |rows| Task { writes: vec![rows], needs: Vec::new() };
        Plan::Rows {
            lengths: vec![n_sectors],
            tasks: cut(n_sectors, rows_per_task).map(task).collect(),
        }
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (): (),
        task: &Task,
    ) -> Result<Piece<Curvature>, CurvatureError> {
        if !mesh.shape.is_empty() {
            let shape = mesh.shape[task.writes[0].clone()].to_vec();
            return Ok(Piece { rows: Curvature { shape }, counters: Counters::default() });
        }
        let at = |s: usize| Vec3::from(mesh.position[mesh.frame[s].vertex as usize]);
        let points: Vec<Vec3> = task.writes[0].clone().map(at).collect();
        let zero = Jet2 { value: 0.0, gradient: Vec3::zeros(), hessian: [0.0; 6] };
        let mut jets = vec![zero; points.len()];
        ctx.field.hessians(&points, &mut jets);
        let shape: Vec<[f64; 6]> = jets.iter().map(second_fundamental_form).collect();
        if let Some(k) = shape.iter().position(|m| m.iter().any(|x| !x.is_finite())) {
            return Err(CurvatureError::NotFinite { place: points[k] });
        }
        Ok(Piece { rows: Curvature { shape }, counters: Counters::default() })
    }
}
