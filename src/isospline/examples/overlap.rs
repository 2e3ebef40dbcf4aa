//! What streaming saves: the wall time of a streamed run of the decorative cube against the same
//! stages one after another, in the fit of the paper, at 5 000 and 50 000 faces: `cargo run
//! --release --example overlap`. The least of several runs, in memory and in a folder that is synced.
#![expect(clippy::print_stdout, reason = "a table for people")]

use isospline::config::ModelFile;
use isospline::{Model, stages};
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store};
use isospline_pipeline::{Pipeline, RunOptions, RunReport, Scene};
use std::error::Error;
use std::path::Path;

/// Faces, and runs of which the fastest counts.
const SIZES: [(u32, usize); 2] = [(5_000, 7), (50_000, 3)];

fn main() -> Result<(), Box<dyn Error>> {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/deccube.toml");
    println!("one by one: wall time without streaming; all and rows: all stages, and those after");
    println!("adapt alone, which stream; one core: more threads than cores save nothing\n");
    println!("{:<8}{:<9}{:>12}{:>12}{:>8}", "faces", "store", "one by one", "streamed", "ratio");
    for (faces, n_runs) in SIZES {
        let overrides = [format!("target.faces={faces}"), "target.fit=paper".to_owned()];
        let model = Model::new(ModelFile::open(&config, &overrides)?)?;
        for durable in [false, true] {
            // Taken in turn, so that a change of the machine's load meets both.
            let mut least = [[f64::INFINITY; 2]; 2];
            for _ in 0..n_runs {
                for (streaming, least) in [false, true].into_iter().zip(&mut least) {
                    let seconds = run(&model, streaming, durable)?;
                    least.iter_mut().zip(seconds).for_each(|(l, s)| *l = l.min(s));
                }
            }
            let store = if durable { "durable" } else { "memory" };
            for (k, part) in ["all", "rows"].into_iter().enumerate() {
                let [serial, streamed] = [least[0][k], least[1][k]];
                println!(
                    "{faces:<8}{store:<9}{:>9.1} ms{:>9.1} ms{:>8.2}   {part}",
                    1e3 * serial,
                    1e3 * streamed,
                    streamed / serial
                );
            }
        }
    }
    Ok(())
}

/// Wall time of the whole run, and from the end of adapt to its end; seconds.
fn run(model: &Model, streaming: bool, durable: bool) -> Result<[f64; 2], Box<dyn Error>> {
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
    let report = pipeline.run(scene, &options, &|_| ())?;
    Ok([report.seconds, report.seconds - before_rows(&report)])
}

/// Time of the stages up to adapt, which run one after another either way.
fn before_rows(report: &RunReport) -> f64 {
    let base = report.nodes.iter().take_while(|node| node.stage != "curvature");
    let records = base.filter_map(|node| node.provenance.as_ref());
    records.map(|record| record.cost.prepare_seconds + record.cost.task_seconds).sum()
}
