//! A run does what is not fresh and nothing else, and says why.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use isospline_tests::{PAPER_FIT, Sandbox};

const FACES: [&str; 2] = ["--set", "target.faces=600"];

/// Stages that a run computed.
fn computed(stdout: &str) -> Vec<String> {
    let events = stdout.lines().map(|line| {
        serde_json::from_str::<serde_json::Value>(line).unwrap_or_else(|_| panic!("{line}"))
    });
    let started = events.filter(|event| event["event"] == "stage_started");
    started.map(|event| event["stage"].as_str().unwrap().to_owned()).collect()
}

fn run(sandbox: &Sandbox, more: &[&str]) -> Vec<String> {
    let outcome = sandbox.converts("torus", &[&FACES[..], &["--json"], more].concat());
    computed(&outcome.stdout)
}

#[test]
fn a_second_run_does_nothing_and_says_so() {
    let sandbox = Sandbox::new();
    assert_eq!(run(&sandbox, &[]).len(), 10);
    assert!(run(&sandbox, &[]).is_empty());
    let outcome = sandbox.converts("torus", &FACES);
    assert!(outcome.stdout.contains("nothing to do"), "{}", outcome.stdout);
}

#[test]
fn a_changed_parameter_reruns_its_stage_and_what_depends_on_it() {
    let sandbox = Sandbox::new();
    run(&sandbox, &[]);
    let rerun = run(&sandbox, &["--set", "network.samples=24"]);
    let expected = ["network", "g0_fit", "vertex_systems", "edge_systems", "fairing"];
    assert_eq!(rerun, expected);
}

#[test]
fn from_reruns_a_fresh_stage_and_what_follows() {
    let sandbox = Sandbox::new();
    run(&sandbox, &[]);
    let rerun = run(&sandbox, &["--from", "edge_systems"]);
    assert_eq!(rerun.first().map(String::as_str), Some("edge_systems"));
}

#[test]
fn names_comments_and_spacing_do_not_count() {
    let sandbox = Sandbox::new();
    let torus = |name: &str, formula: &str| {
        let text = format!(
            "[model]\nname = \"{name}\"\nunit = \"{name}\"\nformula = \"{formula}\"\n\
             box = [[-6.6, 6.6], [-6.6, 6.6], [-1.1, 1.1]]\n[target]\nfaces = 600\nfit = \"paper\"\n"
        );
        sandbox.write("model.toml", text);
        let args = ["run", "model.toml", "--out", "out", "--no-sync", "--json"];
        computed(&sandbox.succeeds(&args).stdout)
    };
    assert_eq!(torus("mm", "(sqrt(x^2 + y^2) - 5)^2 + z^2 - 1").len(), 10);
    assert_eq!(torus("cm", "(sqrt( x^2+y^2 )-5)^2+z^2-1 # a torus"), [""; 0]);
    assert_ne!(torus("cm", "(sqrt(x^2 + y^2) - 5)^2 + z^2 - 1.01").len(), 0);
}

#[test]
fn status_tells_fresh_stale_with_its_reason_and_missing() {
    let sandbox = Sandbox::new();
    run(&sandbox, &[]);
    let status = || sandbox.succeeds(&["status", "out"]).stdout;
    assert_eq!(status().matches("is fresh").count(), 10, "{}", status());

    let model = sandbox.path("out/model.toml");
    let text = std::fs::read_to_string(&model).unwrap();
    sandbox.write("out/model.toml", text.replace("samples = 17", "samples = 24"));
    assert!(status().contains("network is stale: samples 17 -> 24"), "{}", status());

    std::fs::remove_file(sandbox.path("out/11-fairing.isos")).unwrap();
    assert!(status().contains("fairing is missing"), "{}", status());
}

#[test]
fn a_stage_runs_alone_once_what_it_reads_is_fresh() {
    let sandbox = Sandbox::new();
    let config = isospline_tests::config_path("torus");
    let stage = |name: &str| {
        let args = ["stage", name, config.as_str(), "--out", "out"];
        sandbox.isospline(&[&args[..], &FACES, &PAPER_FIT].concat())
    };
    let early = stage("network");
    assert_eq!(early.code, 31, "{}", early.stderr);
    assert!(early.stderr.contains("cannot run alone"), "{}", early.stderr);
    let polygonized = stage("polygonize");
    assert_eq!(polygonized.code, 0, "{}", polygonized.stderr);
    assert_eq!(sandbox.artifacts().len(), 1);
    let unknown = stage("polygonise");
    assert_eq!(unknown.code, 2, "{}", unknown.stderr);
}
