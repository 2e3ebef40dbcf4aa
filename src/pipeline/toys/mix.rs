//! A toy that names rows all over its sources, of two stages still at work.

use super::ToyError;
use isospline_artifact::kinds::{
    CurvatureView, EdgeSystems, EdgeWeights, G0FitView, VertexSystemsView,
};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Params, Piece, Plan, Stage, Task};
use serde::{Deserialize, Serialize};
use std::ops::Range;

#[derive(Debug)]
pub(crate) struct Mix {
    n: usize,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct MixParams {}

impl Params for MixParams {}

impl Mix {
    fn of_blend(&self, row: usize) -> usize {
        (7 * row + 3) % self.n
    }

    fn of_fit(&self, row: usize) -> usize {
        self.n - 1 - row
    }
}

impl Stage for Mix {
    const NAME: &'static str = "mix";
    const VERSION: u32 = 1;
    type Params = MixParams;
    type Whole<'a> = (CurvatureView<'a>,);
    type Rows<'a> = (VertexSystemsView<'a>, G0FitView<'a>);
    type Output = EdgeSystems;
    type Error = ToyError;

    fn prepare(
        _: &Ctx<'_>,
        _: &MixParams,
        (seed,): (CurvatureView<'_>,),
    ) -> Result<Self, ToyError> {
        Ok(Self { n: seed.shape.len() })
    }

    fn plan(&self, _: (CurvatureView<'_>,), rows_per_task: usize) -> Plan {
        let task = |rows: Range<usize>| {
            let blend = ranges(rows.clone().map(|row| self.of_blend(row)).collect());
            let fit = ranges(rows.clone().map(|row| self.of_fit(row)).collect());
            let needs = vec![
                Need { input: 0, section: "twist", rows: blend },
                Need { input: 1, section: "interior", rows: fit },
            ];
            Task { writes: vec![rows; 3], needs }
        };
        let tasks = cut(self.n, rows_per_task).map(task).collect();
        Plan::Rows { lengths: vec![self.n; 3], tasks }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        _: (CurvatureView<'_>,),
        (blend, fit): (VertexSystemsView<'_>, G0FitView<'_>),
        task: &Task,
    ) -> Result<Piece<EdgeSystems>, ToyError> {
        let mut piece = Piece::<EdgeSystems>::default();
        for row in task.writes[0].clone() {
            let twist = blend.twist[self.of_blend(row)][0];
            piece.rows.left.push([twist; 9]);
            piece.rows.right.push([fit.interior[self.of_fit(row)][44]; 9]);
            piece.rows.weights.push(EdgeWeights { nu: 1.0, mu2: 0.0, residual: 0.0 });
            piece.counters.count("mixed", 1);
            piece.counters.max("twist", twist);
        }
        Ok(piece)
    }
}
