//! What a run promises: bytes, order, failures, interruptions.

use crate::faulty::FaultyStore;
use crate::toys::{Bench, FILES, Fault, NoField, all_bytes};
use crate::{Event, Outcome, RunError, RunOptions, Scene, State, read_provenance};
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store, StoreError};
use isospline_geometry::Aabb;
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};

fn options(threads: usize, rows_per_task: usize) -> RunOptions<'static> {
    RunOptions { threads, rows_per_task, ..RunOptions::default() }
}

#[test]
fn bytes_are_equal_for_all_threads_task_sizes_and_stores() {
    let bench = Bench::new();
    let expected = all_bytes(&bench.stored());
    assert_eq!(expected.iter().map(|f| &f.0).collect::<Vec<_>>(), FILES);
    for threads in [1, 2, 3, 8] {
        for rows_per_task in [1, 7, 512] {
            let store = MemoryStore::new();
            bench.run(&store, &options(threads, rows_per_task)).0.unwrap();
            assert!(all_bytes(&store) == expected, "{threads} threads, {rows_per_task} rows");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    for durability in [Durability::Durable, Durability::Fast] {
        let store = FolderStore::new(folder.path().join(format!("{durability:?}")), durability);
        bench.run(&store, &options(2, 7)).0.unwrap();
        assert!(all_bytes(&store) == expected, "folder, {durability:?}");
    }
}

#[test]
fn a_second_run_does_nothing() {
    let bench = Bench::new();
    let store = bench.stored();
    let (report, events) = bench.run(&store, &RunOptions::default());
    let report = report.unwrap();
    assert!(report.all_fresh());
    let fresh = |(node, stage): (usize, &str)| Event::Fresh { node, stage: stage.to_owned() };
    assert_eq!(events, [(0, "seed"), (1, "blend"), (2, "fit")].map(fresh));
    let repairs = &report.nodes[1].provenance.as_ref().unwrap().counters.repairs;
    assert_eq!(repairs["tenth"], 10, "repairs of fresh stages are known");
}

#[test]
fn every_stage_tells_start_progress_end_and_storage() {
    let (report, events) = Bench::new().run(&MemoryStore::new(), &options(2, 10));
    let text: Vec<String> = events
        .iter()
        .filter(|e| matches!(e, Event::StageStarted { .. } | Event::StageFinished { .. }))
        .map(|e| serde_json::to_value(e).unwrap())
        .map(|e| format!("{} {}", e["event"].as_str().unwrap(), e["stage"].as_str().unwrap()))
        .collect();
    for stage in ["seed", "blend", "fit"] {
        let told = text.iter().filter(|t| t.ends_with(stage)).collect::<Vec<_>>();
        assert_eq!(told, [&format!("stage_started {stage}"), &format!("stage_finished {stage}")]);
    }
    let progress = |e: &Event| match e {
        Event::Progress { node: 1, done, of: 10, .. } => Some(*done),
        _ => None,
    };
    assert_eq!(
        events.iter().filter_map(progress).collect::<Vec<_>>(),
        (1..=10).collect::<Vec<_>>()
    );
    let stored = events.iter().filter(|e| matches!(e, Event::Stored { .. })).count();
    assert_eq!(stored, 3);
    let report = report.unwrap();
    assert!(report.nodes.iter().all(|n| n.outcome == Outcome::Computed));
    assert_eq!(report.nodes[1].provenance.as_ref().unwrap().cost.tasks, 10);
}

#[test]
fn a_change_reruns_the_stage_and_what_depends_on_it() {
    let store = Bench::new().stored();
    let cases = [
        ("blend", json!({"samples": 24}), vec!["blend", "fit"]),
        ("blend", json!({"samples": 24}), vec![]),
        ("seed", json!({"scale": 2.0}), vec!["seed", "blend", "fit"]),
    ];
    let mut bench = Bench::new();
    for (stage, params, expected) in cases {
        bench = bench.set(stage, params.clone());
        assert_eq!(bench.computed(&store), expected, "{stage} {params}");
    }
    let mut level = bench;
    level.model.content.insert("level".into(), "0.5".into());
    assert_eq!(level.computed(&store), ["seed", "blend", "fit"]);
    level.model.name = "another name".into();
    assert_eq!(level.computed(&store), [""; 0]);
}

#[test]
fn equal_bytes_stop_the_cascade() {
    let store = Bench::new().stored();
    let bench = Bench::new().set("seed", json!({"remark": "nothing changes"}));
    assert_eq!(bench.computed(&store), ["seed"]);
    assert_eq!(bench.computed(&store), [""; 0]);
}

#[test]
fn results_come_back_when_a_parameter_is_set_back() {
    let store = Bench::new().stored();
    let expected = all_bytes(&store);
    Bench::new().set("blend", json!({"samples": 3})).computed(&store);
    assert!(all_bytes(&store) != expected);
    Bench::new().computed(&store);
    assert!(all_bytes(&store) == expected);
}

#[test]
fn from_runs_a_stage_and_its_dependents_again() {
    let bench = Bench::new();
    let store = bench.stored();
    let options = RunOptions { from: Some("blend"), ..RunOptions::default() };
    let report = bench.run(&store, &options).0.unwrap();
    let outcomes: Vec<Outcome> = report.nodes.iter().map(|n| n.outcome).collect();
    assert_eq!(outcomes, [Outcome::Fresh, Outcome::Computed, Outcome::Computed]);
    let unknown = RunOptions { from: Some("bland"), ..RunOptions::default() };
    let failed = bench.run(&store, &unknown).0.unwrap_err().to_string();
    assert_eq!(failed, "the model has no stage \"bland\"; it has seed, blend, fit");
}

#[test]
fn one_stage_alone_needs_fresh_inputs() {
    let only = |stage| RunOptions { only: Some(stage), ..RunOptions::default() };
    let store = MemoryStore::new();
    let bench = Bench::new();
    let failed = bench.run(&store, &only("blend")).0.unwrap_err().to_string();
    assert_eq!(failed, "blend cannot run alone: seed is not fresh");
    bench.run(&store, &only("seed")).0.unwrap();
    assert_eq!(store.names().unwrap(), [FILES[0]]);
    bench.run(&store, &only("blend")).0.unwrap();
    assert_eq!(store.names().unwrap(), FILES[..2]);
    let (report, _) = bench.run(&store, &only("blend"));
    assert!(report.unwrap().all_fresh());
    let again = RunOptions { from: Some("blend"), ..only("blend") };
    let report = bench.run(&store, &again).0.unwrap();
    assert_eq!(report.nodes.last().unwrap().outcome, Outcome::Computed);
}

#[test]
fn a_failing_stage_is_named_and_what_was_finished_is_kept() {
    let store = MemoryStore::new();
    let failed = Bench::broken(Fault::Fails).run(&store, &options(3, 1)).0.unwrap_err();
    assert_eq!(failed.to_string(), "blend: row 50 has no solution");
    assert_eq!(failed.stage(), Some("blend"));
    let diagnosis = failed.diagnosis().unwrap();
    assert_eq!((diagnosis.code(), diagnosis.help().is_some()), ("toy-no-solution", true));
    assert_eq!(store.names().unwrap(), [FILES[0]]);
    assert_eq!(Bench::new().computed(&store), ["blend", "fit"]);
}

#[test]
fn a_panic_is_an_error_with_stage_task_and_message() {
    let failed = Bench::broken(Fault::Panics).run(&MemoryStore::new(), &options(2, 10)).0;
    let failed = failed.unwrap_err().to_string();
    assert_eq!(failed, "blend: task 5 panicked: the toy is broken");
}

#[test]
fn tasks_that_break_their_promise_are_refused() {
    let failed = |fault| {
        let run = Bench::broken(fault).run(&MemoryStore::new(), &options(2, 10)).0;
        run.unwrap_err().to_string()
    };
    let gap = failed(Fault::LeavesAGap);
    assert_eq!(gap, "blend: the tasks make row 99 of section \"twist\" 0 times");
    let few = failed(Fault::MakesTooFew);
    assert!(few.ends_with("made 9 rows of section \"status\", not 10"), "{few}");
}

#[test]
fn parameters_out_of_order_are_refused_before_anything_runs() {
    let failed = |params| {
        let bench = Bench::new().set("seed", params);
        bench.run(&MemoryStore::new(), &RunOptions::default()).0.unwrap_err().to_string()
    };
    assert_eq!(failed(json!({"rows": 0})), "seed: rows: must be at least 1");
    let unknown = failed(json!({"row": 1}));
    assert!(unknown.starts_with("seed: unknown field `row`"), "{unknown}");
    assert!(failed(json!({"rows": "many"})).contains("invalid type"));
}

#[test]
fn a_stopped_run_keeps_what_is_finished_and_can_go_on() {
    let bench = Bench::new();
    let expected = all_bytes(&bench.stored());
    let store = MemoryStore::new();
    let stop = AtomicBool::new(false);
    let listen = |event: &Event| {
        if matches!(event, Event::Progress { node: 1, done: 3, .. }) {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let options = RunOptions { stop: &stop, ..options(2, 1) };
    let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
    let failed = bench.pipeline(&store).run(scene, &options, &listen).unwrap_err();
    assert!(matches!(&failed, RunError::Stopped { stage, .. } if stage == "blend"), "{failed}");
    assert_eq!(store.names().unwrap(), [FILES[0]]);
    assert_eq!(bench.computed(&store), ["blend", "fit"]);
    assert!(all_bytes(&store) == expected);
}

#[test]
fn a_damaged_input_is_computed_again() {
    let bench = Bench::new();
    let store = bench.stored();
    let expected = all_bytes(&Bench::new().set("blend", json!({"samples": 5})).stored());
    let mut file = store.read(FILES[0]).unwrap().unwrap().bytes().to_vec();
    file[1000] ^= 1;
    store.put(FILES[0], &file);
    assert!(bench.computed(&store).is_empty(), "rows are not read where nothing is to be done");
    let changed = Bench::new().set("blend", json!({"samples": 5}));
    let (report, events) = changed.run(&store, &RunOptions::default());
    report.unwrap();
    let reason = events.iter().find_map(|e| match e {
        Event::Damaged { node: 0, reason, .. } => Some(reason.clone()),
        _ => None,
    });
    assert_eq!(reason.unwrap(), "section \"shape\" is damaged in block 0 (rows 0..100)");
    assert!(all_bytes(&store) == expected);
}

#[test]
fn verification_finds_damaged_rows_of_fresh_artifacts() {
    let bench = Bench::new();
    let store = bench.stored();
    let expected = all_bytes(&store);
    for (name, bytes) in &expected {
        let mut damaged = bytes.clone();
        damaged[1000] ^= 1;
        store.put(name, &damaged);
        let options = RunOptions { verify: true, ..RunOptions::default() };
        let report = bench.run(&store, &options).0.unwrap();
        let computed = report.nodes.iter().filter(|n| n.outcome == Outcome::Computed);
        assert_eq!(computed.map(|n| &n.artifact).collect::<Vec<_>>(), [name]);
        assert!(all_bytes(&store) == expected);
    }
}

#[test]
fn an_artifact_of_another_container_version_is_refused_by_number() {
    let bench = Bench::new();
    let store = bench.stored();
    let mut file = store.read(FILES[1]).unwrap().unwrap().bytes().to_vec();
    file[8] = 7;
    store.put(FILES[1], &file);
    let status = bench.pipeline(&store).status().unwrap();
    assert!(matches!(status[1].state, State::Damaged(_)));
    let text = "blend is damaged: container version 7, this program reads version 1";
    assert_eq!(status[1].to_string(), text);
    assert_eq!(bench.computed(&store), ["blend"]);
}

#[test]
fn a_closure_is_never_fresh() {
    let mut bench = Bench::new();
    bench.model.hashable = false;
    let store = bench.stored();
    assert_eq!(bench.computed(&store), ["seed", "blend", "fit"]);
    assert_eq!(Bench::new().computed(&store), ["seed", "blend", "fit"]);
}

#[test]
fn a_store_in_use_is_refused() {
    let bench = Bench::new();
    let folder = tempfile::tempdir().unwrap();
    let store = FolderStore::new(folder.path(), Durability::Fast);
    let held = store.lock().unwrap();
    let failed = bench.run(&store, &RunOptions::default()).0.unwrap_err();
    assert!(matches!(failed, RunError::Store(StoreError::Locked { .. })), "{failed}");
    drop(held);
    bench.run(&store, &RunOptions::default()).0.unwrap();
}

#[test]
fn the_record_is_the_one_of_the_report() {
    let bench = Bench::new();
    let store = MemoryStore::new();
    let report = bench.run(&store, &RunOptions::default()).0.unwrap();
    for node in report.nodes {
        let record = read_provenance(&store, &node.artifact).unwrap();
        assert_eq!(record, node.provenance);
        let record = record.unwrap();
        assert_eq!(record.content, node.content);
        assert_eq!(record.inputs.len(), node.node);
    }
}

#[test]
fn a_fault_at_any_operation_of_the_store_is_reported_and_repaired_by_the_next_run() {
    let bench = Bench::new();
    let expected = all_bytes(&bench.stored());
    let mut faults = 0;
    for k in 1.. {
        let kept = MemoryStore::new();
        let (result, _) = bench.run(&FaultyStore::new(kept.clone(), k), &options(2, 40));
        let Err(error) = result else {
            break;
        };
        faults += 1;
        assert!(error.to_string().ends_with("injected"), "{k}: {error}");
        for file in all_bytes(&kept) {
            assert!(expected.contains(&file), "{k}: {} is not what it should be", file.0);
        }
        bench.run(&kept, &RunOptions::default()).0.unwrap();
        assert!(all_bytes(&kept) == expected, "{k}");
    }
    // Three stages with, at the least, create, header, rows, map, footer, map, note, rename, sync.
    assert!(faults > 27, "{faults} faults");
}
