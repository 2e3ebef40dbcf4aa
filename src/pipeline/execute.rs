//! Runs one stage: prepare, plan, tasks on the threads, rows into the store.

use crate::driver::Frame;
use crate::erase::{Bundle, ErasedPiece, Failure, Prepared};
use crate::finisher::Finished;
use crate::freshness::Resolved;
use crate::host::StageHost;
use crate::provenance::Cost;
use crate::workers::{Active, Crew, Done, Job, TaskFailure, caught};
use crate::{Event, NodeReport, Outcome, Provenance, Reason, RunError, clock, memory, tiling};
use crossbeam::select;
use isospline_artifact::{Identity, Key, Sealed, SectionSource, Writer};
use isospline_stage::{Counters, Ctx, Host, Plan, Task};
use std::sync::Arc;
use std::time::Duration;

/// A node about to run.
pub(crate) struct Execution<'e, 'f> {
    pub(crate) frame: &'f Frame<'f>,
    pub(crate) idx: usize,
    pub(crate) reasons: Vec<Reason>,
    pub(crate) inputs: Vec<(&'static str, Arc<dyn SectionSource>)>,
    pub(crate) contents: &'e [Option<Key>],
}

/// Rows that are all written, and what they cost.
struct Made {
    writer: Writer,
    counters: Counters,
    cost: Cost,
}

/// Runs the node; the artifact is readable at once and has yet to be stored.
pub(crate) fn execute<'f>(
    execution: Execution<'_, 'f>,
    crew: &Crew<'f>,
) -> Result<(NodeReport, Finished), RunError> {
    let (frame, idx) = (execution.frame, execution.idx);
    let label = frame.nodes[idx].label.clone();
    let start = clock::now();
    let reasons = execution.reasons.iter().map(ToString::to_string).collect();
    (frame.events)(&Event::StageStarted { node: idx, stage: label.clone(), reasons });
    let node = StageRun { frame, idx, identity: identity(&execution), crew };
    let made = node.make(Bundle(execution.inputs))?;
    let sealing = clock::now();
    let derivation = frame.nodes[idx].derivation(execution.contents);
    let sealed = made.writer.hash()?.seal(derivation.expect("invariant: inputs are there"))?;
    let resident = memory::resident();
    let cost = Cost {
        seconds: start.elapsed().as_secs_f64(),
        seal_seconds: sealing.elapsed().as_secs_f64(),
        threads: frame.options.threads.max(1),
        peak_resident_bytes: resident.peak,
        anonymous_bytes: resident.anonymous,
        ..made.cost
    };
    let (counters, seconds, bytes) = (made.counters, cost.seconds, sealed.container.length());
    let provenance = provenance(frame, idx, execution.contents, &sealed, counters.clone(), cost);
    let report = report(&frame.nodes[idx], idx, &sealed, provenance.clone());
    let artifact = frame.nodes[idx].artifact.clone();
    let finished = Finished { node: idx, label: label.clone(), artifact, sealed, provenance };
    (frame.events)(&Event::StageFinished { node: idx, stage: label, seconds, counters, bytes });
    Ok((report, finished))
}

/// A stage at work.
struct StageRun<'e, 'f> {
    frame: &'f Frame<'f>,
    idx: usize,
    identity: Identity,
    crew: &'e Crew<'f>,
}

impl<'f> StageRun<'_, 'f> {
    fn make(&self, inputs: Bundle) -> Result<Made, RunError> {
        let start = clock::now();
        let frame = self.frame;
        let node = self.node();
        let host = StageHost {
            node: self.idx,
            label: &node.label,
            pool: &frame.pool,
            stop: frame.options.stop,
            events: frame.events,
        };
        let ctx = Ctx { field: frame.scene.field, domain: frame.scene.domain, host: &host };
        let stage = frame.pipeline.registry.erased(node.info.name);
        let stage = stage.expect("invariant: graph is checked");
        let prepare = || stage.prepare(&ctx, &node.params, &inputs);
        let prepared = caught(prepare).map_err(|f| self.failed(0, f))?;
        let plan = || prepared.plan(&inputs, frame.options.rows_per_task);
        let plan = caught(plan).map_err(|f| self.failed(0, f))?;
        let prepare_seconds = start.elapsed().as_secs_f64();
        let mut made = match plan {
            Plan::Whole => self.whole(&*prepared, &ctx, &inputs)?,
            Plan::Rows { lengths, tasks } => {
                let scene = frame.scene;
                self.rows(&lengths, Active { prepared, inputs, tasks, host, scene })?
            }
        };
        made.cost.prepare_seconds = prepare_seconds;
        Ok(made)
    }

    /// One task makes all rows; how many is known when it has.
    fn whole(
        &self,
        prepared: &dyn Prepared,
        ctx: &Ctx<'_>,
        inputs: &Bundle,
    ) -> Result<Made, RunError> {
        let start = clock::now();
        let process = || prepared.process(ctx, inputs, &Task::default());
        let piece = caught(process).map_err(|f| self.failed(0, f))?;
        let task_seconds = start.elapsed().as_secs_f64();
        let sections = piece.rows.all();
        let lengths: Vec<usize> = sections.iter().map(|s| s.bytes.len() / s.stride).collect();
        let mut writer = self.writer(&lengths)?;
        for (k, section) in sections.iter().enumerate() {
            writer.write_rows(k, 0, section.bytes)?;
        }
        drop(sections);
        let cost = Cost { tasks: 1, task_seconds, ..Cost::default() };
        Ok(Made { writer, counters: piece.counters, cost })
    }

    /// Many tasks, on all threads; this one writes their rows as they come.
    fn rows(&self, lengths: &[usize], active: Active<'f>) -> Result<Made, RunError> {
        let fault = tiling::fault(self.node().info.sections, lengths, &active.tasks);
        if let Some(tiling::Fault { section, row, times }) = fault {
            return Err(RunError::Tiling { stage: self.label(), section, row, times });
        }
        let writer = self.writer(lengths)?;
        let mut sink = Sink {
            run: self,
            writer,
            counters: Counters::default(),
            done: 0,
            time: Duration::ZERO,
        };
        let active = Arc::new(active);
        let result = self.feed(&active, &mut sink);
        let tasks = active.tasks.len();
        let cost = Cost { tasks, task_seconds: sink.time.as_secs_f64(), ..Cost::default() };
        result.map(|()| Made { writer: sink.writer, counters: sink.counters, cost })
    }

    /// Gives the tasks to the threads and their pieces to the sink; the first failure ends the
    /// giving, and what is under way is waited for.
    fn feed(&self, active: &Arc<Active<'f>>, sink: &mut Sink<'_, '_, 'f>) -> Result<(), RunError> {
        let n = active.tasks.len();
        let (mut next, mut under_way) = (0, 0_usize);
        let mut result = Ok(());
        while under_way > 0 || (next < n && result.is_ok()) {
            let job = || Job { stage: Arc::clone(active), task: next };
            let done = if next < n && result.is_ok() {
                select! {
                    send(self.crew.jobs, job()) -> sent => {
                        sent.expect("invariant: threads live as long as their channel");
                        (next, under_way) = (next + 1, under_way + 1);
                        continue;
                    }
                    recv(self.crew.done) -> done => done,
                }
            } else {
                self.crew.done.recv()
            };
            under_way -= 1;
            let done = done.expect("invariant: threads live as long as their channel");
            result = result.and_then(|()| sink.take(done, active));
        }
        result
    }

    fn writer(&self, lengths: &[usize]) -> Result<Writer, RunError> {
        let node = self.node();
        let (store, sections) = (self.frame.pipeline.store, node.info.sections);
        Ok(Writer::begin(store, &node.artifact, &self.identity, sections, lengths)?)
    }

    fn node(&self) -> &'f Resolved {
        &self.frame.nodes[self.idx]
    }

    fn label(&self) -> String {
        self.node().label.clone()
    }

    /// The run's error for a failed task; a stage that fails after the stop flag was raised did so because of it.
    fn failed(&self, task: usize, failure: TaskFailure) -> RunError {
        let stage = self.label();
        match failure {
            TaskFailure::Panicked(message) => RunError::Panicked { stage, task, message },
            TaskFailure::Failed(_) if self.frame.stopped() => RunError::Stopped { stage },
            TaskFailure::Failed(Failure::Stage(source)) => RunError::Stage { stage, source },
            TaskFailure::Failed(Failure::Rows(source)) => RunError::Rows { stage, source },
            TaskFailure::Failed(Failure::Params(source)) => RunError::Params { stage, source },
        }
    }
}

/// Where pieces go.
struct Sink<'s, 'e, 'f> {
    run: &'s StageRun<'e, 'f>,
    writer: Writer,
    counters: Counters,
    done: u64,
    time: Duration,
}

impl Sink<'_, '_, '_> {
    fn take(&mut self, done: Done, active: &Active<'_>) -> Result<(), RunError> {
        let piece = done.result.map_err(|f| self.run.failed(done.task, f))?;
        self.time += done.time;
        self.write(done.task, &active.tasks[done.task], &piece)?;
        self.counters.merge(&piece.counters);
        self.done += 1;
        let going_on = active.host.progress(self.done, active.tasks.len() as u64);
        going_on.map_err(|_| RunError::Stopped { stage: self.run.label() })
    }

    fn write(&mut self, number: usize, task: &Task, piece: &ErasedPiece) -> Result<(), RunError> {
        let specs = self.run.node().info.sections;
        for (k, (spec, section)) in specs.iter().zip(piece.rows.all()).enumerate() {
            let rows = task.writes.get(k).cloned().unwrap_or_default();
            let (found, expected) = (section.bytes.len() / spec.stride, rows.len());
            if found != expected {
                let (stage, section) = (self.run.label(), spec.name);
                return Err(RunError::PieceSize { stage, task: number, section, found, expected });
            }
            self.writer.write_rows(k, rows.start as u64, section.bytes)?;
        }
        Ok(())
    }
}

fn identity(execution: &Execution<'_, '_>) -> Identity {
    let node = &execution.frame.nodes[execution.idx];
    Identity {
        kind: node.info.kind,
        schema: node.info.schema,
        stage: node.info.name.to_owned(),
        stage_version: node.info.version,
        recipe: node.recipe,
    }
}

fn provenance(
    frame: &Frame<'_>,
    idx: usize,
    contents: &[Option<Key>],
    sealed: &Sealed,
    counters: Counters,
    cost: Cost,
) -> Provenance {
    let node = &frame.nodes[idx];
    let header = sealed.container.header();
    Provenance {
        model: frame.pipeline.model.name.clone(),
        stage: node.info.name.to_owned(),
        stage_version: node.info.version,
        round: frame.pipeline.graph.nodes[idx].round,
        kind: node.info.kind.to_owned(),
        schema: node.info.schema,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        recipe: header.recipe,
        derivation: header.derivation,
        content: sealed.container.content(),
        params: node.params.clone(),
        ingredients: node.ingredients.clone(),
        inputs: node.input_records(contents),
        rows: header.sections.iter().map(|s| (s.name.clone(), s.rows)).collect(),
        bytes: sealed.container.length(),
        counters,
        cost,
    }
}

fn report(node: &Resolved, idx: usize, sealed: &Sealed, provenance: Provenance) -> NodeReport {
    NodeReport {
        node: idx,
        stage: node.label.clone(),
        artifact: node.artifact.clone(),
        outcome: Outcome::Computed,
        content: sealed.container.content(),
        bytes: sealed.container.length(),
        provenance: Some(provenance),
        container: Some(Arc::clone(&sealed.container)),
    }
}
