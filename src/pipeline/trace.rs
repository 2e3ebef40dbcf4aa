//! Who did what when, in the trace format of Chrome, which trace viewers open.

use crate::clock;
use serde_json::{Value, json};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Collects the spans of a run: tasks, writes, hashes and syncs, each on the lane of its thread.
#[derive(Debug)]
pub struct Trace {
    origin: Instant,
    record: Mutex<Record>,
}

#[derive(Debug, Default)]
struct Record {
    lanes: Vec<String>,
    spans: Vec<Span>,
}

#[derive(Debug)]
struct Span {
    lane: usize,
    /// Label of the node.
    stage: String,
    work: &'static str,
    start: Instant,
    seconds: f64,
    /// Number and rows.
    task: Option<(usize, usize)>,
}

/// A thread's line in the picture; collects nothing where no trace is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lane<'t>(Option<(&'t Trace, usize)>);

impl Default for Trace {
    fn default() -> Self {
        Self::new()
    }
}

impl Trace {
    /// An empty trace; its times count from now.
    pub fn new() -> Self {
        Self { origin: clock::now(), record: Mutex::default() }
    }

    /// The trace as a file of JSON: an event of type `X` a span, times in microseconds.
    pub fn to_json(&self) -> Vec<u8> {
        let record = self.record();
        let name = |(k, name): (usize, &String)| json!({"ph": "M", "name": "thread_name", "pid": 1, "tid": k, "args": {"name": name}});
        let names = record.lanes.iter().enumerate().map(name);
        let events: Vec<Value> = names.chain(record.spans.iter().map(|s| self.event(s))).collect();
        let trace = json!({"displayTimeUnit": "ms", "traceEvents": events});
        serde_json::to_vec(&trace).expect("invariant: maps have text keys")
    }

    fn event(&self, span: &Span) -> Value {
        let start = span.start.saturating_duration_since(self.origin).as_secs_f64();
        let args = span.task.map_or(json!({}), |(task, rows)| json!({"task": task, "rows": rows}));
        json!({
            "ph": "X", "name": span.stage, "cat": span.work, "pid": 1, "tid": span.lane,
            "ts": 1e6 * start, "dur": 1e6 * span.seconds, "args": args,
        })
    }

    fn record(&self) -> MutexGuard<'_, Record> {
        // Every change is one insertion, so a panic elsewhere leaves the record whole.
        self.record.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<'t> Lane<'t> {
    /// A new lane of `trace`.
    pub(crate) fn new(trace: Option<&'t Trace>, name: impl FnOnce() -> String) -> Self {
        Self(trace.map(|trace| {
            let lanes = &mut trace.record().lanes;
            lanes.push(name());
            (trace, lanes.len() - 1)
        }))
    }

    /// Notes work that began at `start` and ends now.
    pub(crate) fn note(
        self,
        stage: &str,
        work: &'static str,
        start: Instant,
        task: Option<(usize, usize)>,
    ) {
        if let Some((trace, lane)) = self.0 {
            let (stage, seconds) = (stage.to_owned(), start.elapsed().as_secs_f64());
            trace.record().spans.push(Span { lane, stage, work, start, seconds, task });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_complete_events_on_named_lanes() {
        let trace = Trace::new();
        Lane::new(None, || "nobody".to_owned()).note("seed", "task", clock::now(), None);
        let lane = Lane::new(Some(&trace), || "worker 0".to_owned());
        lane.note("fit", "task", clock::now(), Some((3, 7)));
        let text: Value = serde_json::from_slice(&trace.to_json()).unwrap();
        let events = text["traceEvents"].as_array().unwrap();
        assert_eq!(events.len(), 2);
        assert_eq!(events[0]["args"]["name"], "worker 0");
        assert_eq!(events[1]["ph"], "X");
        assert_eq!(events[1]["tid"], events[0]["tid"]);
        assert_eq!((&events[1]["name"], &events[1]["args"]["task"]), (&json!("fit"), &json!(3)));
        assert!(events[1]["ts"].as_f64().unwrap() >= 0.0);
    }
}
