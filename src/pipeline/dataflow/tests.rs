//! Stages at work behind each other, and runs that go on where an earlier one ended.

use crate::faulty::FaultyStore;
use crate::toys::{Bench, FILES, NoField, all_bytes};
use crate::{Event, Outcome, RunError, RunOptions, Scene, Trace};
use isospline_artifact::journal::HEAD;
use isospline_artifact::{Durability, FolderStore, MemoryStore, Store};
use isospline_geometry::Aabb;
use serde_json::json;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Tasks of ten rows: 10 of blend, 10 of fit and 10 of mix.
const TASKS: usize = 30;

fn options(threads: usize, rows_per_task: usize) -> RunOptions<'static> {
    RunOptions { threads, rows_per_task, ..RunOptions::default() }
}

/// Runs until the `k`-th task is done, and what was under way then; gives the tasks kept.
fn stopped_after(k: usize, bench: &Bench, store: &dyn Store, options: RunOptions<'_>) -> usize {
    let (stop, tasks) = (AtomicBool::new(false), AtomicUsize::new(0));
    let listen = |event: &Event| {
        if matches!(event, Event::Progress { node: 1.., .. })
            && tasks.fetch_add(1, Ordering::Relaxed) + 1 == k
        {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
    let options = RunOptions { stop: &stop, ..options };
    match bench.pipeline(store).run(scene, &options, &listen) {
        Err(RunError::Stopped { kept, .. }) => {
            let kept: usize = kept.iter().map(|k| k.done).sum();
            let finished = store.names().unwrap().iter().filter(|n| *n != FILES[0]).count();
            assert_eq!(kept + 10 * finished, tasks.into_inner());
            kept
        }
        // The last task may be done before the stop is heard.
        Ok(_) => 0,
        Err(other) => panic!("{other}"),
    }
}

/// Tasks taken from an earlier run, and tasks done.
fn goes_on(bench: &Bench, store: &dyn Store, options: &RunOptions<'_>) -> (usize, usize) {
    let (report, events) = bench.run(store, options);
    let resumed = report.unwrap().nodes.iter().map(crate::NodeReport::resumed_tasks).sum();
    let done = events.iter().filter(|e| matches!(e, Event::Progress { node: 1.., .. })).count();
    (resumed, done)
}

fn discarded(bench: &Bench, store: &dyn Store, options: &RunOptions<'_>) -> Vec<String> {
    let (report, events) = bench.run(store, options);
    report.unwrap();
    let reason = |event: &Event| match event {
        Event::Discarded { stage, reason, .. } => Some(format!("{stage}: {reason}")),
        _ => None,
    };
    events.iter().filter_map(reason).collect()
}

#[test]
fn a_stage_begins_before_the_stage_it_reads_has_ended() {
    let (report, events) = Bench::long().run(&MemoryStore::new(), &options(1, 1));
    report.unwrap();
    let first_of_fit = events.iter().position(|e| matches!(e, Event::Progress { node: 2, .. }));
    let last_of_blend = events.iter().rposition(|e| matches!(e, Event::Progress { node: 1, .. }));
    assert!(first_of_fit < last_of_blend, "{first_of_fit:?} {last_of_blend:?}");
}

#[test]
fn without_streaming_one_stage_runs_after_another() {
    let options = RunOptions { streaming: false, ..options(3, 1) };
    let (report, events) = Bench::long().run(&MemoryStore::new(), &options);
    report.unwrap();
    let nodes: Vec<usize> = events
        .iter()
        .filter_map(|event| match event {
            Event::StageStarted { node, .. }
            | Event::Progress { node, .. }
            | Event::StageFinished { node, .. } => Some(*node),
            _ => None,
        })
        .collect();
    assert!(nodes.is_sorted(), "{nodes:?}");
}

#[test]
fn rows_all_over_the_sources_are_there_when_they_are_read() {
    let expected = all_bytes(&Bench::long().stored());
    assert_eq!(expected.len(), 4);
    for streaming in [false, true] {
        for threads in [1, 2, 3, 8] {
            for rows_per_task in [1, 3, 40, 1000] {
                let store = MemoryStore::new();
                let options = RunOptions { streaming, ..options(threads, rows_per_task) };
                Bench::long().run(&store, &options).0.unwrap();
                let case = format!("streaming {streaming}, {threads} threads, {rows_per_task}");
                assert!(all_bytes(&store) == expected, "{case}");
            }
        }
    }
}

#[test]
fn a_run_stopped_after_any_task_goes_on_there() {
    let bench = Bench::long();
    let expected = all_bytes(&bench.stored());
    let folder = tempfile::tempdir().unwrap();
    for threads in [1, 3] {
        for k in 1..=TASKS {
            let path = folder.path().join(format!("{threads}-{k}"));
            let stores: [Box<dyn Store>; 2] =
                [Box::new(MemoryStore::new()), Box::new(FolderStore::new(path, Durability::Fast))];
            for store in stores {
                let kept = stopped_after(k, &bench, &*store, options(threads, 10));
                let finished = all_bytes(&*store).len().saturating_sub(1);
                let (resumed, done) = goes_on(&bench, &*store, &options(threads, 10));
                assert_eq!((resumed, resumed + done + 10 * finished), (kept, TASKS), "{k}");
                assert!(all_bytes(&*store) == expected, "{k}");
                assert_eq!(store.drafts().unwrap(), [""; 0]);
            }
        }
    }
}

#[test]
fn a_fault_at_any_operation_of_a_resumed_run_is_reported_and_repaired_by_the_next_one() {
    let bench = Bench::long();
    let expected = all_bytes(&bench.stored());
    let mut faults = 0;
    for k in 1.. {
        let kept = MemoryStore::new();
        stopped_after(12, &bench, &kept, options(1, 10));
        let (result, _) = bench.run(&FaultyStore::new(kept.clone(), k), &options(2, 10));
        let Err(error) = result else { break };
        faults += 1;
        assert!(error.to_string().ends_with("injected"), "{k}: {error}");
        for file in all_bytes(&kept) {
            assert!(expected.contains(&file), "{k}: {} is not what it should be", file.0);
        }
        bench.run(&kept, &options(2, 10)).0.unwrap();
        assert!(all_bytes(&kept) == expected, "{k}");
    }
    // Three stages: journal read, opened and written a task, file opened, mapped, written.
    assert!(faults > 60, "{faults} faults");
}

#[test]
fn a_stage_whose_rows_are_all_there_is_stored_although_the_run_is_stopped() {
    let store = MemoryStore::new();
    let stop = AtomicBool::new(false);
    // By then the rows of seed are there, hashed or not.
    let listen = |event: &Event| {
        if matches!(event, Event::StageStarted { node: 1, .. }) {
            stop.store(true, Ordering::Relaxed);
        }
    };
    let scene = Scene { field: &NoField, domain: Aabb::EMPTY };
    let options = RunOptions { stop: &stop, ..options(1, 10) };
    let failed = Bench::long().pipeline(&store).run(scene, &options, &listen).unwrap_err();
    assert!(matches!(&failed, RunError::Stopped { stage, .. } if stage == "blend"), "{failed}");
    assert_eq!(store.names().unwrap(), [FILES[0]]);
}

#[test]
fn counters_of_a_resumed_stage_are_those_of_one_run() {
    let bench = Bench::long();
    let counters = |store: &MemoryStore| {
        let record = |name: &str| crate::read_provenance(store, name).unwrap().unwrap();
        ["02-blend.isos", "04-mix.isos"].map(|name| record(name).counters)
    };
    let store = MemoryStore::new();
    stopped_after(7, &bench, &store, options(2, 10));
    let (resumed, _) = goes_on(&bench, &store, &options(2, 10));
    assert!(resumed >= 7, "{resumed}");
    assert_eq!(counters(&store), counters(&bench.stored()));
}

#[test]
fn a_torn_journal_costs_the_torn_tasks_alone() {
    let bench = Bench::long();
    let expected = all_bytes(&bench.stored());
    let stopped = || {
        let store = MemoryStore::new();
        stopped_after(6, &bench, &store, options(1, 10));
        store
    };
    let name = stopped().drafts().unwrap()[0].clone();
    let length = stopped().read_journal(&name).unwrap().unwrap().len();
    assert!(length > HEAD);
    for keep in (0..length).step_by(5) {
        let store = stopped();
        store.journal(&name, keep as u64).unwrap().append(b"torn").unwrap();
        goes_on(&bench, &store, &options(2, 10));
        assert!(all_bytes(&store) == expected, "{keep}");
    }
}

#[test]
fn rows_that_did_not_reach_the_disk_are_made_again() {
    let bench = Bench::long();
    let expected = all_bytes(&bench.stored());
    let store = MemoryStore::new();
    let kept = stopped_after(5, &bench, &store, options(1, 10));
    let name = FILES[1];
    let file = store.read_partial(name).unwrap().unwrap().bytes().to_vec();
    // In a row of a task that is done: all others are zero.
    let place = file.iter().rposition(|&byte| byte != 0).unwrap();
    let mut partial = store.reopen(name, file.len() as u64).unwrap().unwrap();
    partial.write_at(place as u64, &[0x55]).unwrap();
    drop(partial);
    let (report, events) = bench.run(&store, &options(2, 10));
    let resumed: usize = report.unwrap().nodes.iter().map(crate::NodeReport::resumed_tasks).sum();
    assert_eq!(resumed, kept - 1);
    let reason = "1 tasks: their rows did not reach the disk";
    let told = |e: &Event| matches!(e, Event::Discarded { reason: r, .. } if r == reason);
    assert!(events.iter().any(told), "{events:?}");
    assert!(all_bytes(&store) == expected);
}

#[test]
fn what_was_begun_otherwise_is_discarded_with_a_reason() {
    let stopped = || {
        let store = MemoryStore::new();
        stopped_after(5, &Bench::long(), &store, options(1, 10));
        store
    };
    let changed = Bench::long().set("blend", json!({"samples": 24}));
    let reasons = discarded(&changed, &stopped(), &options(1, 10));
    assert_eq!(reasons[0], "blend: it was begun with other parameters, model or inputs");
    let reasons = discarded(&Bench::long(), &stopped(), &options(1, 20));
    assert_eq!(reasons[0], "blend: it was cut into other tasks");
    let store = stopped();
    drop(store.create(FILES[1], 10).unwrap());
    let reasons = discarded(&Bench::long(), &store, &options(1, 10));
    assert_eq!(reasons[0], "blend: its file is gone or of another size");
    let store = stopped();
    drop(store.journal(FILES[1], 20).unwrap());
    let reasons = discarded(&Bench::long(), &store, &options(1, 10));
    assert_eq!(reasons[0], "blend: its journal is damaged");
}

#[test]
fn the_status_tells_what_is_begun() {
    let store = MemoryStore::new();
    let kept = stopped_after(5, &Bench::new(), &store, options(1, 10));
    let status = |bench: &Bench| bench.pipeline(&store).status().unwrap();
    let begun: Vec<_> = status(&Bench::new()).iter().filter_map(|n| n.begun).collect();
    assert_eq!(begun.iter().map(|b| b.done).sum::<usize>(), kept);
    let done = begun[0].done;
    let text = format!("blend is missing; {done} of 10 tasks are done");
    assert_eq!(status(&Bench::new())[1].to_string(), text);
    let text = format!("blend is missing; {done} of 10 tasks of something else are done");
    assert_eq!(status(&Bench::new().set("blend", json!({"samples": 2})))[1].to_string(), text);
}

#[test]
fn a_closure_leaves_nothing_to_go_on_with() {
    let mut bench = Bench::long();
    bench.model.hashable = false;
    let store = MemoryStore::new();
    stopped_after(5, &bench, &store, options(1, 10));
    assert_eq!(store.drafts().unwrap(), [""; 0]);
    assert_eq!(goes_on(&bench, &store, &options(1, 10)), (0, TASKS));
}

#[test]
fn a_run_that_succeeds_removes_what_others_left() {
    let bench = Bench::long();
    let store = MemoryStore::new();
    store.create("09-old.isos", 100).unwrap().outlive();
    drop(store.journal("08-older.isos", 0).unwrap());
    bench.run(&store, &RunOptions::default()).0.unwrap();
    assert_eq!(store.drafts().unwrap(), [""; 0]);
}

#[test]
fn a_fresh_store_is_used_without_its_lock() {
    let bench = Bench::long();
    let store = bench.stored();
    let _held = store.lock().unwrap();
    for verify in [false, true] {
        let options = RunOptions { verify, ..RunOptions::default() };
        assert!(bench.run(&store, &options).0.unwrap().all_fresh());
    }
}

#[test]
fn a_stage_whose_inputs_alone_were_made_again_waits_for_their_content() {
    let store = Bench::long().stored();
    let bench = Bench::long().set("seed", json!({"remark": "nothing changes"}));
    let (report, events) = bench.run(&store, &options(2, 10));
    let computed = report.unwrap().nodes.iter().filter(|n| n.outcome == Outcome::Computed).count();
    assert_eq!(computed, 1);
    let seed = events.iter().position(|e| matches!(e, Event::StageStarted { node: 0, .. }));
    let blend = events.iter().position(|e| matches!(e, Event::Fresh { node: 1, .. }));
    assert!(seed < blend, "{events:?}");
}

#[test]
fn a_trace_has_a_span_for_every_task_and_every_write() {
    let trace = Trace::new();
    let options = RunOptions { trace: Some(&trace), ..options(2, 10) };
    Bench::long().run(&MemoryStore::new(), &options).0.unwrap();
    let text: serde_json::Value = serde_json::from_slice(&trace.to_json()).unwrap();
    let spans = text["traceEvents"].as_array().unwrap();
    let count = |work: &str| spans.iter().filter(|e| e["cat"] == work).count();
    // The one task of seed is written by the worker that did it, and has its spans too.
    assert_eq!((count("task"), count("write")), (TASKS + 1, TASKS + 1));
    assert_eq!((count("prepare"), count("hash"), count("store")), (4, 4, 4));
}
