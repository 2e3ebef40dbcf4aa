//! What streaming saves: a streamed run of the decorative cube against the same stages one after
//! another, in the fit of the paper, at 5 000 and 50 000 faces: `cargo run --release --example
//! overlap`. In memory and in a folder that is synced; the least of several runs.
#![expect(clippy::print_stdout, reason = "a table for people")]

use isospline::config::ModelFile;
use isospline::{Model, stages};
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store};
use isospline_pipeline::{Event, Pipeline, RunOptions, RunReport, Scene};
use std::error::Error;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// Faces, and runs of which the fastest counts.
const SIZES: [(u32, usize); 2] = [(5_000, 7), (50_000, 3)];

/// First of the stages that stream, and the last one.
const ENDS: [&str; 2] = ["curvature", "fairing"];

const HEAD: &str = "\
Wall time, ms. rows: from the end of adapt on, where stages stream; first: from there to the first
rows of the last stage; busy: time in tasks of these stages, of wall time and threads: what is not
busy is all that overlap could save.
";

fn main() -> Result<(), Box<dyn Error>> {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/deccube.toml");
    println!("{HEAD}");
    println!(
        "{:<8}{:<9}{:<12}{:>8}{:>8}{:>8}{:>7}",
        "faces", "store", "", "all", "rows", "first", "busy"
    );
    for (faces, n_runs) in SIZES {
        let overrides = [format!("target.faces={faces}"), "target.fit=paper".to_owned()];
        let model = Model::new(ModelFile::open(&config, &overrides)?)?;
        for durable in [false, true] {
            compare(&model, faces, durable, n_runs)?;
        }
    }
    Ok(())
}

fn compare(model: &Model, faces: u32, durable: bool, n_runs: usize) -> Result<(), Box<dyn Error>> {
    let mut least = [Times::WORST; 2];
    // Taken in turn, so that a change of the machine's load meets both.
    for _ in 0..n_runs {
        for (streaming, least) in [false, true].into_iter().zip(&mut least) {
            *least = least.better(run(model, streaming, durable)?);
        }
    }
    let store = if durable { "durable" } else { "memory" };
    for (name, times) in ["one by one", "streamed"].into_iter().zip(least) {
        let [all, rows, first] = [times.all, times.rows, times.first].map(|t| 1e3 * t);
        let busy = 100.0 * times.busy;
        println!("{faces:<8}{store:<9}{name:<12}{all:>8.1}{rows:>8.1}{first:>8.1}{busy:>5.0} %");
    }
    let [serial, streamed] = least;
    let ratios =
        [streamed.all / serial.all, streamed.rows / serial.rows, streamed.first / serial.first];
    println!("{:<29}{:>8.2}{:>8.2}{:>8.2}", "ratio", ratios[0], ratios[1], ratios[2]);
    Ok(())
}

/// What one run took, seconds.
#[derive(Clone, Copy)]
struct Times {
    all: f64,
    /// From the end of adapt.
    rows: f64,
    /// From there to the first rows of the last stage.
    first: f64,
    /// Share of the threads' time in tasks after adapt.
    busy: f64,
}

impl Times {
    const WORST: Self =
        Self { all: f64::INFINITY, rows: f64::INFINITY, first: f64::INFINITY, busy: 0.0 };

    fn better(self, other: Self) -> Self {
        let all = self.all.min(other.all);
        let first = self.first.min(other.first);
        let (rows, busy) =
            if other.rows < self.rows { (other.rows, other.busy) } else { (self.rows, self.busy) };
        Self { all, rows, first, busy }
    }
}

#[expect(clippy::disallowed_methods, reason = "a bench looks at the clock")]
fn run(model: &Model, streaming: bool, durable: bool) -> Result<Times, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let store: Box<dyn Store> = if durable {
        Box::new(FolderStore::new(folder.path(), Durability::Durable))
    } else {
        Box::new(MemoryStore::new())
    };
    let registry = stages::registry();
    let graph = stages::graph(&registry, &model.file.stages, model.base_mesh.as_ref());
    let key = model.key();
    let pipeline = Pipeline { registry: &registry, graph: &graph, model: &key, store: &*store };
    let scene = Scene { field: &model.field, domain: model.domain };
    let options = RunOptions { streaming, ..RunOptions::default() };
    let [begun, seen] = [OnceLock::new(), OnceLock::new()];
    let start = Instant::now();
    let listen = |event: &Event| match event {
        Event::StageStarted { stage, .. } if stage == ENDS[0] => {
            begun.get_or_init(|| start.elapsed());
        }
        Event::Progress { stage, .. } if stage == ENDS[1] => {
            seen.get_or_init(|| start.elapsed());
        }
        _ => {}
    };
    let report = pipeline.run(scene, &options, &listen)?;
    let at = |moment: &OnceLock<Duration>| moment.get().map_or(f64::NAN, Duration::as_secs_f64);
    let (all, rows) = (report.seconds, report.seconds - at(&begun));
    let busy = task_seconds(&report) / (rows * options.threads as f64);
    Ok(Times { all, rows, first: at(&seen) - at(&begun), busy })
}

/// Time in tasks of the stages that stream, added over the threads.
fn task_seconds(report: &RunReport) -> f64 {
    let rows = report.nodes.iter().skip_while(|node| node.stage != ENDS[0]);
    let records = rows.filter_map(|node| node.provenance.as_ref());
    records.map(|record| record.cost.prepare_seconds + record.cost.task_seconds).sum()
}
