//! What the driver costs: eleven stages that only copy, 9.4 MB of artifacts in all, as deccube at
//! 5 000 faces has.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use isospline_artifact::kinds::{FaceFit, G0Fit, G0FitView};
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{Field, Interval, IntervalJet, Jet1, Jet2};
use isospline_pipeline::{Given, Graph, ModelKey, Node, Pipeline, Registry, RunOptions, Scene};
use isospline_stage::plan::{Need, cut};
use isospline_stage::{Counters, Ctx, Diagnosis, Params, Piece, Plan, Stage, Stopped, Task};
use serde::{Deserialize, Serialize};

const STAGES: u32 = 11;
const FACES: usize = 2273;

struct NoField;

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
#[error(transparent)]
struct CopyError(#[from] Stopped);

impl Diagnosis for CopyError {
    fn code(&self) -> &'static str {
        "stopped"
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct CopyParams {
    add: f64,
}

impl Params for CopyParams {}

struct CopyRows {
    add: f64,
}

impl Stage for CopyRows {
    const NAME: &'static str = "copy";
    const VERSION: u32 = 1;
    type Params = CopyParams;
    type Whole<'a> = ();
    type Rows<'a> = (G0FitView<'a>,);
    type Output = G0Fit;
    type Error = CopyError;

    fn prepare(_: &Ctx<'_>, params: &CopyParams, (): ()) -> Result<Self, CopyError> {
        Ok(Self { add: params.add })
    }

    fn plan(&self, (): (), rows_per_task: usize) -> Plan {
        let need = |rows| Need { input: 0, section: "interior", rows: vec![rows] };
        let task = |rows: std::ops::Range<usize>| Task {
            writes: vec![rows.clone(), rows.clone()],
            needs: vec![need(rows)],
        };
        let tasks = cut(FACES, rows_per_task).map(task).collect();
        Plan::Rows { lengths: vec![FACES, FACES], tasks }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (): (),
        (input,): (G0FitView<'_>,),
        task: &Task,
    ) -> Result<Piece<G0Fit>, CopyError> {
        let rows = task.writes[0].clone();
        let interior = input.interior[rows.clone()].iter().map(|r| r.map(|x| x + self.add));
        let fit = input.fit[rows].to_vec();
        let rows = G0Fit { interior: interior.collect(), fit };
        Ok(Piece { rows, counters: Counters::default() })
    }
}

fn graph() -> Graph {
    let mut graph = Graph::default();
    for round in 0..STAGES {
        let params = serde_json::json!({"add": f64::from(round)});
        let mut node = Node { round, ..Node::new("copy").with(params) };
        match round {
            0 => {
                let interior = (0..FACES).map(|i| [i as f64; 45]).collect();
                let fit = vec![FaceFit::default(); FACES];
                node.given = vec![Given::new("rows", G0Fit { interior, fit })];
            }
            _ => node.inputs = vec![round as usize - 1],
        }
        graph.push(node);
    }
    graph
}

fn run(graph: &Graph, store: &dyn Store, from: Option<&str>) -> f64 {
    let registry = Registry::new().with::<CopyRows>();
    let model = ModelKey { name: "copy".into(), hashable: true, ..ModelKey::default() };
    let pipeline = Pipeline { registry: &registry, graph, model: &model, store };
    let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
    let options = RunOptions { from, ..RunOptions::default() };
    pipeline.run(scene, &options, &|_| ()).expect("copies do not fail").seconds
}

fn driver(criterion: &mut Criterion) {
    let graph = graph();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let store = |name: &str, durability| FolderStore::new(folder.path().join(name), durability);
    let (durable, fast) = (store("a", Durability::Durable), store("b", Durability::Fast));
    let memory = MemoryStore::new();
    let stores: [(&str, &dyn Store); 3] =
        [("durable", &durable), ("no-sync", &fast), ("memory", &memory)];
    let mut group = criterion.benchmark_group("driver");
    group.sample_size(20);
    for (name, store) in stores {
        group.throughput(Throughput::Elements(u64::from(STAGES)));
        group
            .bench_function(format!("{name}/all"), |b| b.iter(|| run(&graph, store, Some("copy"))));
        group.bench_function(format!("{name}/fresh"), |b| b.iter(|| run(&graph, store, None)));
    }
    group.finish();
}

criterion_group!(benches, driver);
criterion_main!(benches);
