//! A batch converts what can be converted, says why it refuses the rest, and loses nothing.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline_tests::{Outcome, PAPER_FIT, Sandbox};
use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Stdio;
use std::time::Duration;

const SPHERE: &str = "x^2 + y^2 + z^2 - 1";

/// Few faces, fitted as in the paper: a tenth of a second a model.
const QUICK: [&str; 4] = ["--no-sync", "--set", "target.faces=100", "--set"];

fn model(formula: &str) -> String {
    format!("[model]\nformula = \"{formula}\"\nbox = [[-1.5, 1.5], [-1.5, 1.5], [-1.5, 1.5]]\n")
}

/// A library with a model of each outcome that needs no trick.
fn library() -> Sandbox {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("library/curved")).unwrap();
    sandbox.write("library/ball.toml", model(SPHERE));
    sandbox.write("library/curved/cone.toml", model("x^2 + y^2 - z^2*(1 - z^2)"));
    sandbox.write(
        "library/curved/ball.vm",
        "x var-x\ny var-y\nz var-z\na square x\nb square y\n\
        c square z\nd add a b\ne add d c\nr const 1\nf sub e r\n",
    );
    sandbox.write("library/bad, \"quoted\".toml", "[model]\nformula = \"x +\"\n");
    sandbox.write("library/notes.txt", "no model");
    sandbox
}

fn batch(sandbox: &Sandbox, more: &[&str]) -> Outcome {
    let args = [&["batch", "library", "--out", "out"], &QUICK[..], &PAPER_FIT[1..], more].concat();
    sandbox.isospline(&args)
}

/// The lines of the summary, by model; each model once.
fn summary(sandbox: &Sandbox) -> BTreeMap<String, Value> {
    let text = std::fs::read_to_string(sandbox.path("out/summary.jsonl")).unwrap();
    let mut records = BTreeMap::new();
    for line in text.lines() {
        let record: Value = serde_json::from_str(line).unwrap();
        let name = record["model"].as_str().unwrap().to_owned();
        assert!(records.insert(name, record).is_none(), "twice: {line}");
    }
    records
}

#[test]
fn every_model_has_its_outcome_and_a_refusal_stops_no_other() {
    let sandbox = library();
    let outcome = batch(&sandbox, &[]);
    assert_eq!(outcome.code, 3, "{}", outcome.stderr);
    let records = summary(&sandbox);
    let told: Vec<(&str, &str, &str)> = records
        .values()
        .map(|r| {
            let text = |key: &str| r[key].as_str().unwrap();
            (text("model"), text("outcome"), text("reason"))
        })
        .collect();
    assert_eq!(
        told,
        [
            ("bad, \"quoted\".toml", "refused", "formula"),
            ("ball.toml", "converted", ""),
            ("curved/ball.vm", "converted", ""),
            ("curved/cone.toml", "refused", "singular-point"),
        ]
    );
    let cone = &records["curved/cone.toml"];
    assert!(cone["point"][2].as_f64().unwrap().abs() < 1e-3, "{cone}");
    assert!(cone["what_to_do"].as_str().unwrap().contains("model.level"), "{cone}");
    let volume = records["ball.toml"]["parts"][0]["volume"].as_f64().unwrap();
    assert!((volume - 4.0 / 3.0 * std::f64::consts::PI).abs() < 1e-3, "{volume}");
    let table = std::fs::read_to_string(sandbox.path("out/summary.csv")).unwrap();
    assert!(table.contains("\r\n\"bad, \"\"quoted\"\".toml\",refused,formula,"), "{table}");
}

#[test]
fn what_is_done_is_not_done_again_and_what_changed_is() {
    let sandbox = library();
    batch(&sandbox, &[]);
    let before = summary(&sandbox);
    let again = batch(&sandbox, &["--json"]);
    assert_eq!((again.code, again.stdout.as_str()), (3, ""), "{}", again.stderr);
    assert_eq!(summary(&sandbox), before);

    sandbox.write("library/ball.toml", model("x^2 + y^2 + z^2 - 0.9"));
    let third = batch(&sandbox, &["--json"]);
    let done: Vec<&str> = third.stdout.lines().collect();
    assert_eq!(done.len(), 1, "{}", third.stdout);
    assert!(done[0].contains("\"ball.toml\""), "{}", third.stdout);
    assert_eq!(summary(&sandbox).len(), 4);
}

#[test]
fn a_batch_that_is_killed_loses_no_model_and_does_none_twice() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("library")).unwrap();
    for k in 0..12 {
        let formula = format!("x^2 + y^2 + z^2 - {}", 0.5 + 0.05 * f64::from(k));
        sandbox.write(&format!("library/m{k:02}.toml"), model(&formula));
    }
    let args = [&["batch", "library", "--out", "out"], &QUICK[..], &PAPER_FIT[1..]].concat();
    let mut child = sandbox.command(&args).stderr(Stdio::null()).spawn().unwrap();
    let lines = || std::fs::read(sandbox.path("out/summary.jsonl")).unwrap_or_default();
    let n_lines = || String::from_utf8_lossy(&lines()).lines().count();
    while n_lines() < 4 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = n_lines();
    assert!((4..12).contains(&kept), "{kept} models were done when it was killed");
    let rest = batch(&sandbox, &["--json"]);
    assert_eq!(rest.code, 0, "{}", rest.stderr);
    assert_eq!(rest.stdout.lines().count(), 12 - kept, "{}", rest.stdout);
    let records = summary(&sandbox);
    assert_eq!(records.len(), 12);
    assert!(records.values().all(|r| r["outcome"] == "converted"));
}

#[test]
fn a_run_that_takes_too_long_is_ended_and_tried_again_next_time() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("library")).unwrap();
    sandbox.write("library/slow.toml", model(SPHERE));
    sandbox.write("library/wrong.toml", "[model]\nformula = \"y )\"\n");
    let args = ["batch", "library", "--out", "out", "--timeout", "1", "--no-sync", "--json"];
    let slow = ["--set", "target.faces=200000", "--set", "target.fit=full"];
    let outcome = sandbox.isospline(&[&args[..], &slow].concat());
    assert_eq!(outcome.code, 4, "{}", outcome.stderr);
    let records = summary(&sandbox);
    assert_eq!(records["slow.toml"]["reason"], "time-limit");
    assert_eq!(records["wrong.toml"]["reason"], "formula");
    let again = sandbox.isospline(&[&args[..], &slow].concat());
    assert_eq!(again.stdout.lines().count(), 1, "{}", again.stdout);
}

#[test]
fn models_that_run_alone_are_taken_into_the_summary() {
    let sandbox = library();
    let alone = batch(&sandbox, &["--only", "ball.toml"]);
    assert_eq!(alone.code, 0, "{}", alone.stderr);
    let refused = batch(&sandbox, &["--only", "curved/cone.toml"]);
    assert_eq!(refused.code, 3, "{}", refused.stderr);
    let rest = batch(&sandbox, &["--json"]);
    assert_eq!(rest.stdout.lines().count(), 2, "{}", rest.stdout);
    assert_eq!(summary(&sandbox).len(), 4);
    assert_eq!(batch(&sandbox, &["--only", "nobody.toml"]).code, 2);
}

#[test]
fn scripts_for_clusters_name_every_model_and_hold_together() {
    let sandbox = library();
    for (scheduler, file) in [("slurm", "out/batch.slurm"), ("snakemake", "out/Snakefile")] {
        let outcome = batch(&sandbox, &["--emit", scheduler]);
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let text = std::fs::read_to_string(sandbox.path(file)).unwrap();
        for name in ["ball.toml", "curved/ball.vm", "curved/cone.toml"] {
            assert!(text.contains(name), "{text}");
        }
        assert!(!sandbox.path("out/summary.jsonl").exists());
    }
    // What Slurm does with the script, for one task.
    let mut task = std::process::Command::new("bash");
    task.arg(sandbox.path("out/batch.slurm")).env("SLURM_ARRAY_TASK_ID", "3");
    assert!(task.status().unwrap().success());
    let done = batch(&sandbox, &["--json"]);
    assert_eq!(done.stdout.lines().count(), 3, "{}", done.stdout);
    assert_eq!(summary(&sandbox)["curved/cone.toml"]["outcome"], "refused");
}

#[test]
fn an_imported_model_is_the_same_model() {
    let sandbox = library();
    let args = ["import", "library/curved/ball.vm", "-o", "ball.toml"];
    sandbox.succeeds(&args);
    assert_eq!(sandbox.isospline(&args).code, 2, "a file that is there is not replaced");
    let convert = |file: &str, out: &str| {
        let args = [&["run", file, "--out", out], &QUICK[..], &PAPER_FIT[1..]].concat();
        sandbox.succeeds(&args);
        std::fs::read(sandbox.path(&format!("{out}/11-fairing.isos"))).unwrap()
    };
    let (own, foreign) = (convert("ball.toml", "a"), convert("library/curved/ball.vm", "b"));
    assert!(own == foreign, "the surfaces differ");
}

#[test]
fn a_folder_without_models_and_a_file_that_is_not_there_are_errors() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("empty")).unwrap();
    assert_eq!(sandbox.isospline(&["batch", "empty", "--out", "out"]).code, 2);
    assert_eq!(sandbox.isospline(&["batch", "nothing.toml", "--out", "out"]).code, 10);
}
