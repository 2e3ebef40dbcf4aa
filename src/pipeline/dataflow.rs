//! Brings the nodes of a graph up to date, each as soon as the rows that it reads are there.
//!
//! One thread decides; it never waits for anything but a notice. A stage is prepared when its
//! whole inputs are complete and its streamed inputs are complete or being made; its tasks begin
//! when the tasks that write the rows they name have reported. Of all tasks that can begin, those
//! of the last stage go first: their rows are warm, and little is in flight.

mod decide;
mod stand;

use crate::driver::{Frame, Wanted};
use crate::error::Kept;
use crate::finisher::{Finished, Finisher};
use crate::freshness::Source;
use crate::prepare::{Assignment, Planned};
use crate::workers::{Crew, Job, Notice};
use crate::{Event, NodeReport, Provenance, RunError, clock, keeper, memory};
use isospline_artifact::{Hashed, Key, SectionSource, StoreError};
use stand::{Figures, Running, Stand, Trust};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{Builder, Scope};
use std::time::Instant;

/// State of a run.
pub(crate) struct Dataflow<'scope, 'f> {
    frame: &'f Frame<'f>,
    scope: &'scope Scope<'scope, 'f>,
    wanted: Wanted,
    stands: Vec<Stand<'f>>,
    contents: Vec<Option<Key>>,
    reports: Vec<Option<NodeReport>>,
    /// Jobs that go before all tasks.
    urgent: VecDeque<Job<'f>>,
    crew: Crew<'f>,
    finisher: Finisher<'scope>,
    /// Jobs that have not been answered.
    under_way: usize,
    /// The failure of the first node and task that failed.
    failure: Option<((usize, usize), RunError)>,
    /// Whether a node may have something to do that it had not before.
    stirred: bool,
}

impl<'scope, 'f> Dataflow<'scope, 'f> {
    pub(crate) fn start(
        frame: &'f Frame<'f>,
        scope: &'scope Scope<'scope, 'f>,
        wanted: Wanted,
    ) -> Result<Self, RunError> {
        let n = frame.nodes.len();
        Ok(Self {
            frame,
            scope,
            wanted,
            stands: (0..n).map(|_| Stand::Open { known: None }).collect(),
            contents: vec![None; n],
            reports: vec![None; n],
            urgent: VecDeque::new(),
            crew: Crew::start(scope, frame)?,
            finisher: Finisher::start(scope, frame)?,
            under_way: 0,
            failure: None,
            stirred: true,
        })
    }

    /// Runs to the end, or until something fails or stops it; what is under way is waited for.
    pub(crate) fn run(mut self) -> Result<Vec<Option<NodeReport>>, RunError> {
        loop {
            if std::mem::take(&mut self.stirred)
                && let Err(error) = self.advance()
            {
                self.fail((0, 0), error);
            }
            self.hand_out();
            if self.under_way == 0 {
                break;
            }
            let notice = self.crew.notices.recv();
            self.take(notice.expect("invariant: the outbox is held here"));
        }
        self.end()
    }

    /// Whether nothing new is begun.
    fn halted(&self) -> bool {
        self.frame.halted() || self.finisher.has_failed()
    }

    fn fail(&mut self, place: (usize, usize), error: RunError) {
        // Tasks fail in any order; of those that were under way the first is told.
        if self.failure.as_ref().is_none_or(|(first, _)| place < *first) {
            self.failure = Some((place, error));
            self.frame.failed.store(true, Ordering::Relaxed);
        }
    }

    /// Fills the channel of jobs, which nobody else does, so that a send never waits.
    fn hand_out(&mut self) {
        while !self.halted() && !self.crew.jobs.is_full() {
            let Some(job) = self.next_job() else { return };
            self.crew.jobs.send(job).expect("invariant: workers live as long as their channel");
            self.under_way += 1;
        }
    }

    fn next_job(&mut self) -> Option<Job<'f>> {
        if let Some(job) = self.urgent.pop_front() {
            return Some(job);
        }
        let stage = self.stands.iter_mut().rev().find_map(Stand::with_ready_tasks)?;
        let task = stage.ready.pop_first().expect("invariant: it has ready tasks") as usize;
        Some(Job::Task { stage: Arc::clone(&stage.active), task })
    }

    /// Looks at every node once, in order: what is known of earlier ones decides of later ones.
    fn advance(&mut self) -> Result<(), RunError> {
        for idx in 0..self.stands.len() {
            // What is made is kept, whatever ends the run.
            if self.halted() && !matches!(self.stands[idx], Stand::Hashed(..)) {
                continue;
            }
            if let Stand::Open { known } = self.stands[idx] {
                self.decide(idx, known)?;
            }
            match &self.stands[idx] {
                Stand::Fresh { trust: Trust::Unread, .. } if self.frame.options.verify => {
                    self.verify(idx);
                }
                Stand::Due(_) => self.begin(idx)?,
                Stand::Hashed(..) => self.seal(idx)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Gives out the preparation of a node, if its inputs are there or coming.
    fn begin(&mut self, idx: usize) -> Result<(), RunError> {
        let settled = |stand: &Stand<'_>| stand.is_settled();
        if !self.frame.options.streaming && !self.stands[..idx].iter().all(settled) {
            return Ok(());
        }
        let Some(assignment) = self.assignment(idx)? else { return Ok(()) };
        let preparing = Stand::Preparing(clock::now());
        if let Stand::Due(reasons) = std::mem::replace(&mut self.stands[idx], preparing) {
            let reasons = reasons.iter().map(ToString::to_string).collect();
            let stage = self.frame.label(idx);
            (self.frame.events)(&Event::StageStarted { node: idx, stage, reasons });
        }
        self.urgent.push_back(Job::Prepare(Box::new(assignment)));
        Ok(())
    }

    /// The inputs of a node; `None` while one of them is not there.
    fn assignment(&mut self, idx: usize) -> Result<Option<Assignment>, RunError> {
        let frame = self.frame;
        let node = &frame.nodes[idx];
        let streamed = node.info.rows;
        let mut sources = vec![None; streamed.len()];
        let mut inputs = Vec::with_capacity(node.inputs.len());
        for input in &node.inputs {
            let place = streamed.iter().position(|kind| *kind == input.kind);
            let rows: Option<Arc<dyn SectionSource>> = match input.source {
                Source::Given(k, _) => {
                    Some(Arc::clone(&frame.pipeline.graph.nodes[idx].given[k].rows))
                }
                Source::Node(source) => {
                    self.verify(source);
                    match (&self.stands[source], place) {
                        (Stand::Skipped, _) => return Err(frame.not_ready(idx, source)),
                        (Stand::Running(running), Some(place)) => {
                            sources[place] = Some((source, Arc::clone(&running.owners)));
                            Some(Arc::new(running.figures.rows.clone()))
                        }
                        (stand, _) => stand.rows(),
                    }
                }
            };
            inputs.push(rows.map(|rows| (input.kind, rows)));
        }
        let inputs: Option<Vec<_>> = inputs.into_iter().collect();
        let inputs = inputs.map(crate::erase::Bundle);
        Ok(inputs.map(|inputs| Assignment { node: idx, inputs, sources }))
    }

    fn take(&mut self, notice: Notice<'f>) {
        match notice {
            Notice::Verified { node, result } => self.verified(node, result),
            Notice::Planned(planned) => self.planned(*planned),
            Notice::Committed { node, task, counters, time } => {
                if let Stand::Running(running) = &mut self.stands[node] {
                    running.figures.counters.merge(&counters);
                    running.figures.cost.task_seconds += time.as_secs_f64();
                }
                self.committed(node, task);
                self.under_way -= 1;
            }
            Notice::Written { node, rows, counters, prepare, time } => {
                let mut figures = Figures::new(self.started(node), rows);
                figures.counters = counters;
                figures.cost.prepare_seconds = prepare.as_secs_f64();
                figures.cost.task_seconds = time.as_secs_f64();
                figures.cost.tasks = 1;
                self.stands[node] = Stand::Written(Box::new(figures));
                self.stirred = true;
            }
            Notice::Hashed { node, hashed, time } => {
                self.hashed(node, hashed, time.as_secs_f64());
                self.under_way -= 1;
            }
            Notice::Failed { node, task, error } => {
                self.under_way -= 1;
                if let Some(error) = error {
                    self.fail((node, task), error);
                }
            }
        }
    }

    fn started(&self, idx: usize) -> Instant {
        match self.stands[idx] {
            Stand::Preparing(start) => start,
            _ => clock::now(),
        }
    }

    /// Starts the writer of a stage and links its tasks to those that they wait for.
    fn planned(&mut self, planned: Planned<'f>) {
        let (idx, frame) = (planned.active.node, self.frame);
        let Planned { active, writer, pieces, rows, owners, taken, awaited, time } = planned;
        let mut figures = Figures::new(self.started(idx), rows);
        figures.cost.prepare_seconds = time.as_secs_f64();
        figures.cost.tasks = active.tasks.len();
        figures.cost.resumed_tasks = taken.len();
        for (_, counters) in &taken {
            figures.counters.merge(counters);
        }
        let taken: Vec<usize> = taken.into_iter().map(|(task, _)| task).collect();
        let mut running = Running::new(figures, active, owners, &taken);
        for (source, lists) in awaited {
            if let Stand::Running(source) = &mut self.stands[source] {
                running.wait_for(idx, source, &lists);
            }
        }
        running.release();
        let outbox = self.crew.outbox.clone();
        let builder = Builder::new().name(format!("isospline-{}", writer.label));
        let started =
            builder.spawn_scoped(self.scope, move || writer.serve(frame, &pieces, &outbox));
        if started.is_err() {
            self.under_way -= 1;
            return self.fail((idx, 0), RunError::Threads { threads: 1 });
        }
        self.stands[idx] = Stand::Running(Box::new(running));
        self.stirred = true;
        // The job is answered; if nothing is left to do, the writer answers once more.
        self.under_way -= 1;
        self.finish_tasks(idx);
    }

    /// The rows of a task are there: tells those that wait for them.
    fn committed(&mut self, idx: usize, task: usize) {
        let Stand::Running(running) = &mut self.stands[idx] else { return };
        let followers = running.commit(task);
        let (done, of) = (running.n_committed as u64, running.active.tasks.len() as u64);
        for (node, task) in followers {
            if let Stand::Running(follower) = &mut self.stands[node as usize] {
                follower.one_less(task);
            }
        }
        let stage = self.frame.label(idx);
        (self.frame.events)(&Event::Progress { node: idx, stage, done, of });
        self.finish_tasks(idx);
    }

    /// If all rows are there, the writer is hashing them.
    fn finish_tasks(&mut self, idx: usize) {
        let done = |r: &Running<'_>| r.n_committed == r.active.tasks.len();
        let stand = std::mem::replace(&mut self.stands[idx], Stand::Skipped);
        self.stands[idx] = match stand {
            Stand::Running(running) if done(&running) => {
                self.under_way += 1;
                self.stirred = true;
                Stand::Written(Box::new(running.figures))
            }
            stand => stand,
        };
    }

    fn hashed(&mut self, idx: usize, hashed: Hashed, seconds: f64) {
        self.contents[idx] = Some(hashed.content);
        self.stirred = true;
        let stand = std::mem::replace(&mut self.stands[idx], Stand::Skipped);
        self.stands[idx] = match stand {
            Stand::Written(mut figures) => {
                figures.cost.seal_seconds = seconds;
                Stand::Hashed(figures, Box::new(hashed))
            }
            stand => stand,
        };
    }

    /// Completes an artifact once the contents of all its inputs are known.
    fn seal(&mut self, idx: usize) -> Result<(), RunError> {
        let frame = self.frame;
        let Some(derivation) = frame.nodes[idx].derivation(&self.contents) else { return Ok(()) };
        let stand = std::mem::replace(&mut self.stands[idx], Stand::Skipped);
        let Stand::Hashed(figures, hashed) = stand else { return Ok(()) };
        let sealed = hashed.seal(derivation)?;
        let (counters, resident) = (figures.counters, memory::resident());
        let mut cost = figures.cost;
        cost.seconds = figures.start.elapsed().as_secs_f64();
        cost.threads = frame.threads();
        cost.peak_resident_bytes = resident.peak;
        cost.anonymous_bytes = resident.anonymous;
        let (seconds, bytes) = (cost.seconds, sealed.container.length());
        let record = Provenance::of(frame, idx, &self.contents, &sealed, counters, cost);
        let counters = record.counters.clone();
        let (stage, artifact) = (frame.label(idx), frame.nodes[idx].artifact.clone());
        self.stands[idx] = Stand::Done(Arc::clone(&sealed.container));
        self.reports[idx] = Some(NodeReport::computed(&stage, &artifact, idx, &sealed, &record));
        let finished =
            Finished { node: idx, label: stage.clone(), artifact, sealed, provenance: record };
        (frame.events)(&Event::StageFinished { node: idx, stage, seconds, counters, bytes });
        // A finisher that has given up tells why at the end.
        self.finisher.take_over(finished);
        self.stirred = true;
        Ok(())
    }

    /// Waits until all is stored; tells what is there, or what went wrong first.
    fn end(mut self) -> Result<Vec<Option<NodeReport>>, RunError> {
        // A store that fails is the cause of what follows from it.
        self.finisher.finish()?;
        let unsettled = self.stands.iter().position(|stand| !stand.is_settled());
        match (self.failure.take(), unsettled) {
            (Some((_, RunError::Stopped { .. })), _) => {}
            (Some((_, error)), _) => return Err(error),
            (None, None) => {
                discard_drafts(self.frame, &self.stands)?;
                return Ok(self.reports);
            }
            (None, Some(_)) => {
                assert!(self.frame.stopped(), "invariant: a node waits for what will come");
            }
        }
        let stage = self.frame.label(unsettled.unwrap_or_default());
        let kept = (0..self.stands.len()).filter_map(|idx| {
            let (done, of) = self.stands[idx].kept().or_else(|| steps(self.frame, idx))?;
            Some(Kept { stage: self.frame.label(idx), done, of })
        });
        Err(RunError::Stopped { stage, kept: kept.collect() })
    }
}

/// Steps that are kept of a stage without tasks.
fn steps(frame: &Frame<'_>, idx: usize) -> Option<(usize, usize)> {
    let node = &frame.nodes[idx];
    let (recipe, stand) = keeper::stand(frame.pipeline.store, &node.artifact).ok()??;
    (recipe == node.recipe).then_some((stand.done as usize, stand.of as usize))
}

/// Removes what earlier runs left unfinished of artifacts that are whole now.
fn discard_drafts(frame: &Frame<'_>, stands: &[Stand<'_>]) -> Result<(), StoreError> {
    let store = frame.pipeline.store;
    for draft in store.drafts()? {
        let node = frame.nodes.iter().position(|node| node.artifact == draft);
        if !node.is_some_and(|node| matches!(stands[node], Stand::Skipped)) {
            store.discard(&draft)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
