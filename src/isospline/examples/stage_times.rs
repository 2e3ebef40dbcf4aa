//! Each stage's time, share and nanoseconds a patch on the decorative cube, at 5 000 and 50 000
//! faces in the fit of the paper and at 5 000 in the others: `cargo run --release --example
//! stage_times`. The least of several runs, in memory.
#![expect(clippy::print_stdout, reason = "a table for people")]

use isospline::config::ModelFile;
use isospline::{Model, Options, convert};
use isospline_pipeline::RunOptions;
use std::path::Path;

/// Fit, faces, and runs of which the fastest counts.
const CASES: [(&str, u32, usize); 4] =
    [("paper", 5_000, 5), ("paper", 50_000, 2), ("fast", 5_000, 3), ("full", 5_000, 1)];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/deccube.toml");
    let mut per_patch = Vec::new();
    for (fit, faces, n_runs) in CASES {
        let model = Model::new(ModelFile::open(&config, &[format!("target.fit={fit}")])?)?;
        let times = least_times(&model, faces, n_runs)?;
        let all: f64 = times.iter().map(|t| t.1).sum();
        println!("fit {fit}, {faces} faces, {:.1} ms in stages", 1e3 * all);
        for (stage, seconds) in &times {
            let ns = 1e9 * seconds / f64::from(faces);
            println!(
                "  {stage:<15}{:>9.2} ms{:>7.1} %{ns:>10.0} ns a patch",
                1e3 * seconds,
                100.0 * seconds / all
            );
        }
        per_patch.push(all / f64::from(faces));
    }
    println!(
        "fit paper: a patch costs {:.2} times as much at {} faces",
        per_patch[1] / per_patch[0],
        CASES[1].1
    );
    Ok(())
}

/// The least time of each stage over all runs, seconds.
fn least_times(
    model: &Model,
    faces: u32,
    n_runs: usize,
) -> Result<Vec<(String, f64)>, Box<dyn std::error::Error>> {
    let mut least: Vec<(String, f64)> = Vec::new();
    for _ in 0..n_runs {
        // One stage after another: a stage's wall time is its own then.
        let run = RunOptions { streaming: false, ..RunOptions::default() };
        let stages = model.file.stages.clone();
        let options = Options { faces, stages, run, ..Options::new(model.domain) };
        let surface = convert(&model.field, &options)?;
        for (k, node) in surface.report.nodes.iter().enumerate() {
            let seconds = node.provenance.as_ref().map_or(f64::NAN, |p| p.cost.seconds);
            match least.get_mut(k) {
                Some(slot) => slot.1 = slot.1.min(seconds),
                None => least.push((node.stage.clone(), seconds)),
            }
        }
    }
    Ok(least)
}
