//! Prints Table 3 of [TK] with our figures: `paper_table out/torus out/deccube ...`, each a folder
//! that `isospline run` has written.
#![expect(clippy::print_stdout, reason = "a table for people")]

use serde_json::Value;
use std::path::Path;

/// Columns of stage times, as the report names the stages.
const STAGES: [&str; 10] = [
    "polygonize",
    "decimate",
    "project",
    "adapt",
    "curvature",
    "network",
    "g0_fit",
    "vertex_systems",
    "edge_systems",
    "fairing",
];

const HEADS: [&str; 10] =
    ["polyg.", "decim.", "proj.", "adapt", "curv.", "netw.", "G0", "vertex", "edge", "fair."];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "times in ms; iter.: mean iterations a boundary curve; errors relative to the diagonal"
    );
    print!("{:<14}{:>6}", "model", "faces");
    for head in HEADS {
        print!("{head:>8}");
    }
    println!(
        "{:>8}{:>7}{:>9}{:>9}{:>10}{:>6}{:>8}{:>9}{:>8}",
        "all", "iter.", "max", "rms", "G1, deg", "genus", "MB", "repairs", "check"
    );
    for folder in std::env::args().skip(1) {
        let text = std::fs::read_to_string(Path::new(&folder).join("report.json"))?;
        row(&serde_json::from_str(&text)?);
    }
    Ok(())
}

fn row(report: &Value) {
    let check = &report["check"];
    print!("{:<14}{:>6}", report["model"].as_str().unwrap_or("?"), check["faces"].to_string());
    let times: Vec<Option<f64>> =
        STAGES.iter().map(|name| stage(report, name)?["own_seconds"].as_f64()).collect();
    for time in &times {
        print!("{:>8}", time.map_or_else(|| "-".to_owned(), |s| format!("{:.1}", 1e3 * s)));
    }
    let all: f64 = times.iter().flatten().sum();
    let counts = stage(report, "network").map(|network| &network["counters"]["counts"]);
    let mean = counts.and_then(|c| Some(c["curve_iterations"].as_f64()? / c["curves"].as_f64()?));
    let small = |name: &str| format!("{:.1e}", check[name].as_f64().unwrap_or(f64::NAN));
    let repairs = check["repairs"].as_object();
    let repairs: u64 = repairs.into_iter().flatten().filter_map(|(_, n)| n.as_u64()).sum();
    println!(
        "{:>8.1}{:>7.2}{:>9}{:>9}{:>10}{:>6}{:>8.1}{repairs:>9}{:>8}",
        1e3 * all,
        mean.unwrap_or(f64::NAN),
        small("rel_error_max"),
        small("rel_error_rms"),
        small("g1_angle_deg_max"),
        check["genus"].to_string(),
        report["peak_resident_bytes"].as_f64().unwrap_or(f64::NAN) / 1e6,
        if check["pass"] == true { "passed" } else { "FAILED" },
    );
}

fn stage<'a>(report: &'a Value, name: &str) -> Option<&'a Value> {
    report["stages"].as_array()?.iter().find(|stage| stage["stage"] == name)
}
