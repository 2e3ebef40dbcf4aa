//! What a user reads about the state of a store.

use crate::toys::{Bench, FILES};
use crate::{Given, GraphError, Node, RunError};
use isospline_artifact::kinds::Curvature;
use isospline_artifact::{MemoryStore, Store};
use serde_json::json;

fn status(bench: &Bench, store: &dyn Store) -> Vec<String> {
    bench.pipeline(store).status().unwrap().iter().map(ToString::to_string).collect()
}

#[test]
fn missing_fresh_and_stale_are_told_with_reasons() {
    let store = MemoryStore::new();
    let missing = ["seed is missing", "blend is missing", "fit is missing"];
    assert_eq!(status(&Bench::new(), &store), missing);
    let store = Bench::new().stored();
    let fresh = ["seed is fresh", "blend is fresh", "fit is fresh"];
    assert_eq!(status(&Bench::new(), &store), fresh);
    let bench = Bench::new().set("blend", json!({"samples": 24}));
    let changed =
        ["seed is fresh", "blend is stale: samples 17 -> 24", "fit is stale: blend is not fresh"];
    assert_eq!(status(&bench, &store), changed);
    store.remove(FILES[0]).unwrap();
    let text = status(&Bench::new(), &store);
    assert_eq!(text, ["seed is missing", "blend is fresh", "fit is fresh"]);
}

#[test]
fn changes_of_the_model_are_named_in_every_stage() {
    let store = Bench::new().stored();
    let mut bench = Bench::new();
    bench.model.content.insert("level".into(), "0.5".into());
    bench.model.content.insert("parameters.r".into(), "2".into());
    let text = status(&bench, &store);
    assert_eq!(text[0], "seed is stale: model.level 0 -> 0.5, model.parameters.r = 2 is new");
    assert!(text[2].starts_with("fit is stale: model.level 0 -> 0.5"));
}

#[test]
fn a_changed_input_is_named_by_its_kind() {
    let store = Bench::new().stored();
    let bench = Bench::new().set("seed", json!({"scale": 3.0}));
    let only = crate::RunOptions { only: Some("seed"), ..crate::RunOptions::default() };
    bench.run(&store, &only).0.unwrap();
    let text = status(&bench, &store);
    assert_eq!(text[1], "blend is stale: curvature changed");
    assert_eq!(text[2], "fit is stale: curvature changed, blend is not fresh");
}

#[test]
fn a_lost_record_costs_the_reason_alone() {
    let store = Bench::new().stored();
    store.remove("02-blend.json").unwrap();
    assert_eq!(status(&Bench::new(), &store)[1], "blend is fresh");
    let bench = Bench::new().set("blend", json!({"samples": 24}));
    let text = "blend is stale: made from other inputs; its record is lost";
    assert_eq!(status(&bench, &store)[1], text);
}

#[test]
fn rows_from_outside_are_compared_by_content() {
    let given = |value: f64| {
        let mut bench = Bench::new();
        let rows = Curvature { shape: vec![[value; 6]; 20] };
        bench.graph.nodes = vec![Node::new("blend")];
        bench.graph.nodes[0].given = vec![Given::new("numbers.txt", rows)];
        bench
    };
    let store = given(1.0).stored();
    assert_eq!(status(&given(1.0), &store), ["blend is fresh"]);
    assert_eq!(status(&given(2.0), &store), ["blend is stale: curvature changed"]);
    assert_eq!(given(2.0).computed(&store), ["blend"]);
}

#[test]
fn graphs_that_cannot_run_are_refused() {
    let failed = |nodes: Vec<Node>| {
        let mut bench = Bench::new();
        bench.graph.nodes = nodes;
        match bench.pipeline(&MemoryStore::new()).status().unwrap_err() {
            RunError::Graph(error) => error,
            other => panic!("{other}"),
        }
    };
    let (seed, blend) = (|| Node::new("seed"), || Node::new("blend"));
    let name = |s: &str| s.to_owned();
    let twice = failed(vec![seed(), seed()]);
    assert_eq!(twice, GraphError::Twice { stage: name("seed") });
    let unknown = failed(vec![Node::new("sead")]);
    assert_eq!(unknown, GraphError::UnknownStage { stage: name("sead") });
    let order = failed(vec![blend().reading([0])]);
    assert_eq!(order, GraphError::Order { stage: name("blend"), input: 0 });
    let second = Node { round: 1, ..seed() };
    let kind = "curvature";
    let missing = failed(vec![seed(), blend()]);
    assert_eq!(missing, GraphError::Input { stage: name("blend"), kind, found: 0 });
    let double = failed(vec![seed(), second, blend().reading([0, 1])]);
    assert_eq!(double, GraphError::Input { stage: name("blend"), kind, found: 2 });
}
