//! A process that is killed in the middle of a stage: the next run continues there.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline_artifact::kinds::{FaceFit, G0Fit};
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{Field, Interval, IntervalJet, Jet1, Jet2};
use isospline_pipeline::{Event, Graph, ModelKey, Node, Pipeline, Registry, RunOptions, Scene};
use isospline_stage::plan::cut;
use isospline_stage::{Ctx, Diagnosis, Params, Piece, Plan, Stage, Stopped, Task};
use serde::{Deserialize, Serialize};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

const TASKS: usize = 200;
const ROWS_PER_TASK: usize = 8;
/// Tells the test binary to be the process that is killed, and where its store is.
const FOLDER: &str = "ISOSPLINE_TEST_KILLED_RUN";

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
struct SquareError(#[from] Stopped);

impl Diagnosis for SquareError {
    fn code(&self) -> &'static str {
        "stopped"
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct SquareParams {}

impl Params for SquareParams {}

struct Square;

impl Stage for Square {
    const NAME: &'static str = "square";
    const VERSION: u32 = 1;
    type Params = SquareParams;
    type Whole<'a> = ();
    type Rows<'a> = ();
    type Output = G0Fit;
    type Error = SquareError;

    fn prepare(_: &Ctx<'_>, _: &SquareParams, (): ()) -> Result<Self, SquareError> {
        Ok(Self)
    }

    fn plan(&self, (): (), rows_per_task: usize) -> Plan {
        let n = TASKS * ROWS_PER_TASK;
        let task = |rows| Task { writes: vec![rows; 2], needs: Vec::new() };
        let tasks = cut(n, rows_per_task).map(|rows: std::ops::Range<usize>| task(rows)).collect();
        Plan::Rows { lengths: vec![n; 2], tasks }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (): (),
        (): (),
        task: &Task,
    ) -> Result<Piece<G0Fit>, SquareError> {
        let mut piece = Piece::<G0Fit>::default();
        for row in task.writes[0].clone() {
            piece.rows.interior.push([(row * row) as f64; 45]);
            piece.rows.fit.push(FaceFit { max: row as f64, rms: 0.0 });
            piece.counters.count("rows", 1);
        }
        Ok(piece)
    }
}

/// Runs the stage into `store`; gives the tasks taken from an earlier run and the rows counted.
fn run(store: &dyn Store, events: &(dyn Fn(&Event) + Sync)) -> (usize, u64) {
    let registry = Registry::new().with::<Square>();
    let mut graph = Graph::default();
    graph.push(Node::new("square"));
    let model = ModelKey { name: "killed".into(), hashable: true, ..ModelKey::default() };
    let pipeline = Pipeline { registry: &registry, graph: &graph, model: &model, store };
    let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
    let options = RunOptions { threads: 2, rows_per_task: ROWS_PER_TASK, ..RunOptions::default() };
    let report = pipeline.run(scene, &options, events).unwrap();
    let counters = &report.nodes[0].provenance.as_ref().unwrap().counters;
    (report.nodes[0].resumed_tasks(), counters.counts["rows"])
}

/// Not a test of its own: the process that [`a_killed_run_continues_where_it_was`] kills.
#[test]
fn the_process_that_is_killed() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let store = FolderStore::new(folder, Durability::Durable);
    run(&store, &|event| {
        if let Event::Progress { done, .. } = event {
            println!("done {done}");
            if *done as usize == TASKS * 6 / 10 {
                // The other end has the word and will kill; nothing more is begun meanwhile.
                loop {
                    std::thread::park();
                }
            }
        }
    });
}

#[test]
fn a_killed_run_continues_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "the_process_that_is_killed", "--nocapture", "--test-threads=1"])
        .env(FOLDER, folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let last = format!("done {}", TASKS * 6 / 10);
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let seen = lines.map(Result::unwrap).any(|line| line.ends_with(&last));
    // SIGKILL on unix: no destructor runs, no buffer is flushed.
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success());
    assert!(seen, "the process ended before it was killed");

    let store = FolderStore::new(folder.path(), Durability::Durable);
    assert_eq!(store.drafts().unwrap(), ["01-square.isos"]);
    let (resumed, rows) = run(&store, &|_| ());
    assert!((TASKS * 6 / 10..TASKS).contains(&resumed), "{resumed} of {TASKS} tasks were kept");
    assert_eq!(rows as usize, TASKS * ROWS_PER_TASK);
    assert_eq!(store.drafts().unwrap(), [""; 0]);

    let whole = MemoryStore::new();
    assert_eq!(run(&whole, &|_| ()).0, 0);
    let bytes = |store: &dyn Store| store.read("01-square.isos").unwrap().unwrap().bytes().to_vec();
    assert!(bytes(&store) == bytes(&whole));
}
