//! A tolerance in place of a number of faces: met, just met, resumed, and said where it is not.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline::config::ModelFile;
use isospline_tests::{Sandbox, config_path, number, root};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

const TORUS: &str = "[model]\nname = \"torus\"\nformula = \"(sqrt(x^2 + y^2) - 5)^2 + z^2 - 1\"\n\
    box = [[-6.6, 6.6], [-6.6, 6.6], [-1.1, 1.1]]\n";

/// A run of the torus with `target` and what was said as JSON.
fn run(sandbox: &Sandbox, target: &str, more: &[&str]) -> (i32, Vec<Value>) {
    let model = sandbox.write("torus.toml", format!("{TORUS}[target]\n{target}\n"));
    let model = model.display().to_string();
    let mut args = vec!["run", model.as_str(), "--out", "out", "--no-sync", "--json"];
    args.extend(more);
    let outcome = sandbox.isospline(&args);
    let lines = outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap());
    (outcome.code, lines.collect())
}

fn report(lines: &[Value]) -> &Value {
    &lines.iter().find(|line| line["event"] == "report").unwrap()["report"]
}

/// Within a factor of three, unless meshes of fewer faces are said to be unsound or beyond.
fn is_just_below(report: &Value, error: f64, tolerance: f64) {
    assert!(error <= tolerance, "{tolerance}: {error:e}");
    let verdict = &report["rounds"]["verdict"];
    let is_tight = 3.0 * error >= tolerance;
    assert!(is_tight || verdict == "fewest_sound", "{tolerance}: {error:e}, {verdict}");
}

/// Stages that were computed, of all rounds.
fn computed(lines: &[Value]) -> usize {
    lines.iter().filter(|line| line["event"] == "stage_finished").count()
}

#[test]
fn the_error_ends_below_the_tolerance_and_above_a_third_of_it() {
    // Half as many again as the fewest found by hand, for 1e-5 (no fewer are sound) and for 1e-6.
    for (tolerance, most_faces) in [(1e-4, 321), (1e-6, 390)] {
        let sandbox = Sandbox::new();
        let (code, lines) = run(&sandbox, &format!("tolerance = {tolerance}"), &[]);
        assert_eq!(code, 0, "{tolerance}: {lines:?}");
        let report = report(&lines);
        is_just_below(report, number(&report["check"], "rel_error_max"), tolerance);
        let faces = report["check"]["faces"].as_u64().unwrap();
        assert!(faces <= most_faces, "{tolerance}: {faces} faces");
        assert_eq!(report["check"]["flipped_patches"], 0, "{tolerance}");
    }
}

#[test]
fn an_absolute_tolerance_is_met_in_units_of_the_model() {
    let sandbox = Sandbox::new();
    let (code, lines) = run(&sandbox, "tolerance_abs = 1e-5", &[]);
    assert_eq!(code, 0, "{lines:?}");
    let report = report(&lines);
    let check = &report["check"];
    is_just_below(report, number(check, "rel_error_max") * number(check, "diagonal"), 1e-5);
}

#[test]
fn a_library_of_shapes_that_nobody_tuned_for_is_within_its_tolerance() {
    for name in ["metaballs", "ellipsoid_small", "peanut_large"] {
        let sandbox = Sandbox::new();
        let path = config_path(&format!("library/{name}"));
        sandbox.succeeds(&["run", &path, "--out", "out", "--no-sync"]);
        let report = sandbox.checked();
        assert_eq!(report["pass"], true, "{name}: {}", report["failures"]);
        let (error, diagonal) = (number(&report, "rel_error_max"), number(&report, "diagonal"));
        let file = ModelFile::open(path.as_ref(), &[]).unwrap();
        let tolerance = file.target.tolerance(diagonal).unwrap();
        assert!((tolerance / 3.0..=tolerance).contains(&error), "{name}: {error:e}");
    }
}

#[test]
fn every_model_of_the_library_is_valid_and_has_a_tolerance() {
    let mut n_files = 0;
    for entry in std::fs::read_dir(root().join("configs/library")).unwrap() {
        let path = entry.unwrap().path();
        let file = ModelFile::open(&path, &[]).unwrap();
        assert!(file.target.is_by_tolerance(), "{}", path.display());
        assert_eq!(Some(file.model.name.as_str()), path.file_stem().unwrap().to_str());
        n_files += 1;
    }
    assert!(n_files >= 10, "{n_files}");
}

#[test]
fn a_second_run_finds_all_fresh_and_another_tolerance_searches_anew() {
    let sandbox = Sandbox::new();
    let first = run(&sandbox, "tolerance = 1e-4", &[]).1;
    let (artifacts, rounds) = (sandbox.artifacts(), report(&first)["rounds"].clone());
    let again = run(&sandbox, "tolerance = 1e-4", &[]).1;
    assert_eq!(computed(&again), 0, "{again:?}");
    assert_eq!(report(&again)["rounds"], rounds);
    assert!(artifacts == sandbox.artifacts());
    let status = sandbox.succeeds(&["status", "out", "--json"]).stdout;
    assert!(status.lines().all(|line| line.contains("\"fresh\"")), "{status}");
    let other = run(&sandbox, "tolerance = 1e-5", &[]).1;
    assert!(computed(&other) > 0);
    assert_ne!(report(&other)["rounds"]["faces"], rounds["faces"]);
}

#[test]
fn a_run_killed_in_its_third_round_goes_on_in_that_round() {
    let (killed, whole) = (Sandbox::new(), Sandbox::new());
    let all = computed(&run(&whole, "tolerance = 1e-4", &[]).1);
    let model = killed.write("torus.toml", format!("{TORUS}[target]\ntolerance = 1e-4\n"));
    let model = model.display().to_string();
    let args = ["run", model.as_str(), "--out", "out", "--no-sync", "--json"];
    let mut child = killed.command(&args).stdout(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let is_end_of = |line: &String, stage: &str| {
        line.contains("\"stage_finished\"") && line.contains(&format!("\"{stage}\""))
    };
    let mut n_rounds = 0;
    for line in lines {
        let line = line.unwrap();
        n_rounds += usize::from(is_end_of(&line, "network"));
        if n_rounds == 2 && is_end_of(&line, "decimate") {
            break;
        }
    }
    assert_eq!(n_rounds, 2, "the run ended before");
    child.kill().unwrap();
    child.wait().unwrap();
    let (code, lines) = run(&killed, "tolerance = 1e-4", &[]);
    assert_eq!(code, 0);
    // The two rounds of six stages that were done are not done again.
    assert!(computed(&lines) <= all - 12, "{} of {all}", computed(&lines));
    assert!(killed.artifacts() == whole.artifacts());
}

#[test]
fn a_tolerance_out_of_reach_leaves_the_best_surface_and_says_where_it_is_worst() {
    let sandbox = Sandbox::new();
    let few = ["--set", "polygonize.max_cells=1100", "--set", "relax.sweeps=2"];
    let (code, lines) = run(&sandbox, "tolerance = 1e-11", &few);
    assert_eq!(code, 1, "{lines:?}");
    let report = report(&lines);
    assert_eq!(report["rounds"]["verdict"], "not_reached");
    let failures = report["check"]["failures"].as_array().unwrap();
    let told = failures.iter().filter_map(Value::as_str).any(|f| {
        f.contains("rel_error_max")
            && f.contains("the limit is 1.000e-11")
            && f.contains("worst in")
    });
    assert!(told, "{failures:?}");
    assert!(number(&report["check"], "rel_error_max") < 1e-6);
}

#[test]
fn faces_and_a_tolerance_together_are_refused_by_name() {
    let sandbox = Sandbox::new();
    let (code, lines) = run(&sandbox, "faces = 100\ntolerance = 1e-4", &[]);
    assert_eq!(code, 11);
    let message = lines.last().unwrap()["message"].as_str().unwrap();
    assert!(message.contains("target.faces") && message.contains("target.tolerance"), "{message}");
}
