//! Small stages, graphs of them, and what tests ask of a run.

mod mix;

use crate::{
    Event, Graph, ModelKey, Node, Pipeline, Registry, RunError, RunOptions, RunReport, Scene,
};
use isospline_artifact::kinds::{
    Curvature, CurvatureView, FaceFit, G0Fit, VertexSystems, VertexSystemsView,
};
use isospline_artifact::{MemoryStore, Store};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{Field, Interval, IntervalJet, Jet1, Jet2};
use isospline_stage::plan::{Need, cut};
use isospline_stage::{Counters, Ctx, Diagnosis, Params, Piece, Plan, Stage, Stopped, Task, map};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::ops::Range;
use std::sync::Mutex;

/// A field that no toy looks at.
#[derive(Debug)]
pub(crate) struct NoField;

impl Field for NoField {
    fn values(&self, _: &[Vec3], _: &mut [f64]) {}
    fn gradients(&self, _: &[Vec3], _: &mut [Jet1]) {}
    fn hessians(&self, _: &[Vec3], _: &mut [Jet2]) {}
    fn value_enclosure(&self, _: [Interval; 3]) -> Option<Interval> {
        None
    }
    fn gradient_enclosure(&self, _: [Interval; 3]) -> Option<IntervalJet> {
        None
    }
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum ToyError {
    #[error(transparent)]
    Stopped(#[from] Stopped),
    #[error("row {row} has no solution")]
    NoSolution { row: usize },
}

impl Diagnosis for ToyError {
    fn code(&self) -> &'static str {
        "toy-no-solution"
    }

    fn help(&self) -> Option<String> {
        Some("use another toy".to_owned())
    }
}

/// Makes numbers; `remark` changes nothing.
#[derive(Debug)]
pub(crate) struct Seed {
    params: SeedParams,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct SeedParams {
    rows: usize,
    scale: f64,
    remark: String,
}

impl Default for SeedParams {
    fn default() -> Self {
        Self { rows: 100, scale: 1.0, remark: String::new() }
    }
}

impl Params for SeedParams {
    fn validate(&self) -> Result<(), (&'static str, String)> {
        if self.rows > 0 { Ok(()) } else { Err(("rows", "must be at least 1".to_owned())) }
    }
}

impl Stage for Seed {
    const NAME: &'static str = "seed";
    const VERSION: u32 = 1;
    type Params = SeedParams;
    type Whole<'a> = ();
    type Rows<'a> = ();
    type Output = Curvature;
    type Error = ToyError;

    fn prepare(_: &Ctx<'_>, params: &SeedParams, (): ()) -> Result<Self, ToyError> {
        Ok(Self { params: params.clone() })
    }

    fn plan(&self, (): (), _: usize) -> Plan {
        Plan::Whole
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (): (),
        (): (),
        _: &Task,
    ) -> Result<Piece<Curvature>, ToyError> {
        let scale = self.params.scale;
        let shape = map(ctx.host, self.params.rows, |i| [scale * i as f64; 6]);
        ctx.host.progress(1, 1)?;
        Ok(Piece { rows: Curvature { shape }, ..Piece::default() })
    }
}

/// What goes wrong in [`Blend`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Fault {
    #[default]
    None,
    Fails,
    Panics,
    LeavesAGap,
    MakesTooFew,
}

/// Blends neighbours: one row of `twist`, two of `weights` a row, and a status.
#[derive(Debug)]
pub(crate) struct Blend {
    params: BlendParams,
    n: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct BlendParams {
    samples: u32,
    fault: Fault,
}

impl Default for BlendParams {
    fn default() -> Self {
        Self { samples: 17, fault: Fault::None }
    }
}

impl Params for BlendParams {}

impl Stage for Blend {
    const NAME: &'static str = "blend";
    const VERSION: u32 = 4;
    type Params = BlendParams;
    type Whole<'a> = (CurvatureView<'a>,);
    type Rows<'a> = ();
    type Output = VertexSystems;
    type Error = ToyError;

    fn prepare(
        _: &Ctx<'_>,
        params: &BlendParams,
        (seed,): (CurvatureView<'_>,),
    ) -> Result<Self, ToyError> {
        Ok(Self { params: params.clone(), n: seed.shape.len() })
    }

    fn plan(&self, _: (CurvatureView<'_>,), rows_per_task: usize) -> Plan {
        let made = self.n - usize::from(self.params.fault == Fault::LeavesAGap);
        let task = |rows: Range<usize>| Task {
            writes: vec![rows.clone(), 2 * rows.start..2 * rows.end, rows],
            needs: Vec::new(),
        };
        let tasks = cut(made, rows_per_task).map(task).collect();
        Plan::Rows { lengths: vec![self.n, 2 * self.n, self.n], tasks }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (seed,): (CurvatureView<'_>,),
        (): (),
        task: &Task,
    ) -> Result<Piece<VertexSystems>, ToyError> {
        let rows = task.writes[0].clone();
        let half = rows.contains(&(self.n / 2));
        if self.params.fault == Fault::Fails && half {
            return Err(ToyError::NoSolution { row: self.n / 2 });
        }
        assert!(self.params.fault != Fault::Panics || !half, "the toy is broken");
        let mut out = VertexSystems::default();
        let mut counters = Counters::default();
        for i in rows {
            let next = seed.shape[(i + 1) % self.n][0];
            let blend = seed.shape[i][0] + next / f64::from(self.params.samples);
            out.twist.push([blend; 3]);
            out.weights.extend([[blend, next, 1.0]; 2]);
            out.status.push(u8::from(i % 10 == 0));
            counters.repair("tenth", u64::from(i % 10 == 0));
            counters.max("blend", blend);
        }
        if self.params.fault == Fault::MakesTooFew {
            out.status.pop();
        }
        Ok(Piece { rows: out, counters })
    }
}

/// Reads both, the second one row by row.
#[derive(Debug)]
pub(crate) struct Fit {
    n: usize,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct FitParams {}

impl Params for FitParams {}

impl Stage for Fit {
    const NAME: &'static str = "fit";
    const VERSION: u32 = 1;
    type Params = FitParams;
    type Whole<'a> = (CurvatureView<'a>,);
    type Rows<'a> = (VertexSystemsView<'a>,);
    type Output = G0Fit;
    type Error = ToyError;

    fn prepare(
        _: &Ctx<'_>,
        _: &FitParams,
        (seed,): (CurvatureView<'_>,),
    ) -> Result<Self, ToyError> {
        Ok(Self { n: seed.shape.len() })
    }

    fn plan(&self, _: (CurvatureView<'_>,), rows_per_task: usize) -> Plan {
        let task = |rows: Range<usize>| {
            let need = Need { input: 0, section: "twist", rows: vec![rows.clone()] };
            Task { writes: vec![rows.clone(), rows], needs: vec![need] }
        };
        let tasks = cut(self.n, rows_per_task).map(task).collect();
        Plan::Rows { lengths: vec![self.n, self.n], tasks }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (seed,): (CurvatureView<'_>,),
        (blend,): (VertexSystemsView<'_>,),
        task: &Task,
    ) -> Result<Piece<G0Fit>, ToyError> {
        let rows = task.writes[0].clone();
        let interior = rows.clone().map(|i| [blend.twist[i][0] - seed.shape[i][1]; 45]).collect();
        let fit = rows.map(|i| FaceFit { max: i as f64, rms: 0.5 }).collect();
        Ok(Piece { rows: G0Fit { interior, fit }, counters: Counters::default() })
    }
}

/// A model of the three stages in a store.
#[derive(Debug)]
pub(crate) struct Bench {
    pub(crate) registry: Registry,
    pub(crate) graph: Graph,
    pub(crate) model: ModelKey,
}

/// Names of the artifacts of a [`Bench`].
pub(crate) const FILES: [&str; 3] = ["01-seed.isos", "02-blend.isos", "03-fit.isos"];

impl Bench {
    pub(crate) fn new() -> Self {
        let registry =
            Registry::new().with::<Seed>().with::<Blend>().with::<Fit>().with::<mix::Mix>();
        let mut graph = Graph::default();
        let seed = graph.push(Node::new("seed"));
        let blend = graph.push(Node::new("blend").reading([seed]));
        graph.push(Node::new("fit").reading([seed, blend]));
        let content = [("formula", "x^2 - 1"), ("level", "0")];
        let content = content.map(|(k, v)| (k.to_owned(), v.to_owned())).into();
        Self { registry, graph, model: ModelKey { name: "toy".into(), content, hashable: true } }
    }

    /// A fourth stage, which reads rows all over the second and the third.
    pub(crate) fn long() -> Self {
        let mut bench = Self::new();
        bench.graph.push(Node::new("mix").reading([0, 1, 2]));
        bench
    }

    pub(crate) fn set(mut self, stage: &str, params: Value) -> Self {
        let node = self.graph.nodes.iter_mut().find(|n| n.stage == stage).unwrap();
        node.params = params;
        self
    }

    pub(crate) fn broken(fault: Fault) -> Self {
        Self::new().set("blend", json!({ "fault": fault }))
    }

    pub(crate) fn pipeline<'a>(&'a self, store: &'a dyn Store) -> Pipeline<'a> {
        let Self { registry, graph, model } = self;
        Pipeline { registry, graph, model, store }
    }

    /// Runs it; also gives the events in order of arrival.
    pub(crate) fn run(
        &self,
        store: &dyn Store,
        options: &RunOptions<'_>,
    ) -> (Result<RunReport, RunError>, Vec<Event>) {
        let events = Mutex::new(Vec::new());
        let listen = |event: &Event| events.lock().unwrap().push(event.clone());
        let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
        let result = self.pipeline(store).run(scene, options, &listen);
        (result, events.into_inner().unwrap())
    }

    /// The labels of the stages that had to run.
    pub(crate) fn computed(&self, store: &dyn Store) -> Vec<String> {
        let report = self.run(store, &RunOptions::default()).0.unwrap();
        let computed = report.nodes.iter().filter(|n| n.outcome == crate::Outcome::Computed);
        computed.map(|n| n.stage.clone()).collect()
    }

    /// A store after a full run.
    pub(crate) fn stored(&self) -> MemoryStore {
        let store = MemoryStore::new();
        self.run(&store, &RunOptions::default()).0.unwrap();
        store
    }
}

/// Bytes of all artifacts.
pub(crate) fn all_bytes(store: &dyn Store) -> Vec<(String, Vec<u8>)> {
    let bytes = |name: &String| store.read(name).unwrap().unwrap().bytes().to_vec();
    store.names().unwrap().into_iter().map(|name| (name.clone(), bytes(&name))).collect()
}
