//! Each stage's time, share and nanoseconds a patch on the decorative cube, at 5 000, 50 000 and
//! 500 000 faces in the fit of the paper and at 5 000 in the others: `cargo run --release --example
//! stage_times`. The least of several runs, in memory.
#![expect(clippy::print_stdout, reason = "a table for people")]

use isospline::config::ModelFile;
use isospline::{Model, Options, convert};
use isospline_pipeline::RunOptions;
use std::path::Path;

/// Fit, faces, and runs of which the fastest counts.
const CASES: [(&str, u32, usize); 5] = [
    ("paper", 5_000, 7),
    ("paper", 50_000, 3),
    ("paper", 500_000, 1),
    ("fast", 5_000, 3),
    ("full", 5_000, 1),
];

/// The first of the stages that work row by row.
const FIRST_OF_ROWS: &str = "curvature";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/deccube.toml");
    let mut rows_ns = Vec::new();
    for (fit, faces, n_runs) in CASES {
        let model = Model::new(ModelFile::open(&config, &[format!("target.fit={fit}")])?)?;
        let times = least_times(&model, faces, n_runs)?;
        let all: f64 = times.iter().map(|t| t.1).sum();
        println!("fit {fit}, {faces} faces, {:.1} ms in stages", 1e3 * all);
        let ns = |seconds: f64| 1e9 * seconds / f64::from(faces);
        for (stage, seconds) in &times {
            println!(
                "  {stage:<15}{:>9.2} ms{:>7.1} %{:>10.0} ns a patch",
                1e3 * seconds,
                100.0 * seconds / all,
                ns(*seconds)
            );
        }
        if fit == "paper" {
            let by_row = times.iter().skip_while(|t| t.0 != FIRST_OF_ROWS);
            rows_ns.push((faces, ns(by_row.map(|t| t.1).sum())));
        }
    }
    println!("fit paper, stages that work row by row, {FIRST_OF_ROWS} to fairing:");
    for (faces, ns) in &rows_ns {
        println!("  {faces:>7} faces{ns:>10.0} ns a patch{:>7.2} times", ns / rows_ns[0].1);
    }
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
