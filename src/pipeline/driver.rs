//! What is to be done, and whether anything is: keys, the lock, the hand-over to the dataflow.

use crate::clock;
use crate::dataflow::Dataflow;
use crate::erase::Failure;
use crate::freshness::{Resolved, assess, begun, resolve};
use crate::host::{Listener, Threads};
use crate::workers::TaskFailure;
use crate::{
    Event, Graph, ModelKey, NodeReport, NodeStatus, Outcome, Registry, RunError, RunOptions,
    RunReport, Scene, State, read_provenance,
};
use isospline_artifact::{Container, Store, StoreError};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is to be computed and where it is kept.
#[derive(Clone, Copy, Debug)]
pub struct Pipeline<'a> {
    /// The stages.
    pub registry: &'a Registry,
    /// Their order.
    pub graph: &'a Graph,
    /// The model.
    pub model: &'a ModelKey,
    /// The artifacts.
    pub store: &'a dyn Store,
}

impl<'a> Pipeline<'a> {
    /// State of every node, in graph order; reads headers and footers only.
    ///
    /// # Errors
    /// [`RunError::Graph`], [`RunError::Params`], [`RunError::Store`].
    pub fn status(&self) -> Result<Vec<NodeStatus>, RunError> {
        let nodes = resolve(self)?;
        let mut contents = vec![None; nodes.len()];
        let mut out = Vec::with_capacity(nodes.len());
        for (node, resolved) in nodes.iter().enumerate() {
            let (state, container) = assess(self, resolved, &contents)?;
            contents[node] = container.map(|c| c.content());
            let begun = begun(self, resolved)?;
            let (stage, artifact) = (resolved.label.clone(), resolved.artifact.clone());
            out.push(NodeStatus { node, stage, artifact, state, begun });
        }
        Ok(out)
    }

    /// Computes what is not fresh and keeps it in the store; `events` is called from any thread.
    ///
    /// Where nothing is to be computed, nothing is written and no lock is taken.
    ///
    /// # Errors
    /// [`RunError`]; what was finished before is kept under its name, and what was not as a draft
    /// that the next run goes on with.
    pub fn run(
        &self,
        scene: Scene<'a>,
        options: &RunOptions<'a>,
        events: &'a (dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        let start = clock::now();
        let nodes = resolve(self)?;
        let wanted = Wanted::of(self, options)?;
        let pool = Threads::new(options.threads.max(1));
        let (pipeline, options, failed) = (*self, *options, AtomicBool::new(false));
        let frame = Frame { pipeline, nodes, scene, options, events, pool, failed };
        let reports = if let Some(reports) = all_fresh(&frame, &wanted)? {
            reports
        } else {
            // What another process made meanwhile is looked at again under the lock.
            let _lock = self.store.lock()?;
            std::thread::scope(|scope| Dataflow::start(&frame, scope, wanted)?.run())?
        };
        let nodes = reports.into_iter().flatten().collect();
        Ok(RunReport { nodes, seconds: start.elapsed().as_secs_f64() })
    }
}

/// Which nodes to look at, and which to run even if fresh.
#[derive(Debug)]
pub(crate) struct Wanted {
    pub(crate) forced: Vec<bool>,
    /// The one stage to run, if not all.
    pub(crate) only: Option<Vec<bool>>,
}

impl Wanted {
    fn of(pipeline: &Pipeline<'_>, options: &RunOptions<'_>) -> Result<Self, RunError> {
        let nodes = &pipeline.graph.nodes;
        let named = |name: &str| -> Result<Vec<bool>, RunError> {
            let hits: Vec<bool> =
                nodes.iter().map(|n| n.stage == name || n.label() == name).collect();
            if hits.contains(&true) {
                return Ok(hits);
            }
            let known: Vec<String> = nodes.iter().map(crate::Node::label).collect();
            Err(RunError::NoSuchStage { stage: name.to_owned(), known: known.join(", ") })
        };
        let mut forced = options.from.map(named).transpose()?;
        for (idx, node) in nodes.iter().enumerate() {
            let forced = forced.iter_mut();
            forced.for_each(|f| f[idx] = f[idx] || node.inputs.iter().any(|&i| f[i]));
        }
        let forced = forced.unwrap_or_else(|| vec![false; nodes.len()]);
        Ok(Self { forced, only: options.only.map(named).transpose()? })
    }

    /// Whether the node may be run.
    pub(crate) fn may_run(&self, idx: usize) -> bool {
        self.only.as_ref().is_none_or(|only| only[idx])
    }
}

/// The reports of all nodes, if none of them is to be run.
fn all_fresh(
    frame: &Frame<'_>,
    wanted: &Wanted,
) -> Result<Option<Vec<Option<NodeReport>>>, RunError> {
    let mut contents = vec![None; frame.nodes.len()];
    let mut reports = vec![None; frame.nodes.len()];
    for (idx, node) in frame.nodes.iter().enumerate() {
        let (state, container) = assess(&frame.pipeline, node, &contents)?;
        let forced = wanted.forced[idx] && wanted.may_run(idx);
        match (state, container) {
            (State::Fresh, Some(container)) if !forced => {
                if frame.options.verify && container.verify().is_err() {
                    return Ok(None);
                }
                contents[idx] = Some(container.content());
                reports[idx] = Some(fresh_report(frame, idx, &Arc::new(container))?);
            }
            _ if wanted.may_run(idx) => return Ok(None),
            _ => {}
        }
    }
    for report in reports.iter().flatten() {
        (frame.events)(&Event::Fresh { node: report.node, stage: report.stage.clone() });
    }
    Ok(Some(reports))
}

/// The report of a node whose artifact is taken as it is.
pub(crate) fn fresh_report(
    frame: &Frame<'_>,
    idx: usize,
    container: &Arc<Container>,
) -> Result<NodeReport, StoreError> {
    let node = &frame.nodes[idx];
    let provenance = read_provenance(frame.pipeline.store, &node.artifact)?;
    Ok(NodeReport {
        node: idx,
        stage: node.label.clone(),
        artifact: node.artifact.clone(),
        outcome: Outcome::Fresh,
        content: container.content(),
        bytes: container.length(),
        provenance: provenance.filter(|p| p.recipe == container.header().recipe),
        container: Some(Arc::clone(container)),
    })
}

/// What a run works on; outlives its threads.
pub(crate) struct Frame<'a> {
    pub(crate) pipeline: Pipeline<'a>,
    pub(crate) nodes: Vec<Resolved>,
    pub(crate) scene: Scene<'a>,
    pub(crate) options: RunOptions<'a>,
    pub(crate) events: Listener<'a>,
    pub(crate) pool: Threads,
    /// Raised when something has failed: what is not begun is not to be.
    pub(crate) failed: AtomicBool,
}

impl Frame<'_> {
    pub(crate) fn stopped(&self) -> bool {
        self.options.stop.load(Ordering::Relaxed)
    }

    /// Whether nothing new is to be begun.
    pub(crate) fn halted(&self) -> bool {
        self.stopped() || self.failed.load(Ordering::Relaxed)
    }

    pub(crate) fn threads(&self) -> usize {
        self.options.threads.max(1)
    }

    pub(crate) fn label(&self, idx: usize) -> String {
        self.nodes[idx].label.clone()
    }

    /// The run's error for a failed task; a stage that fails after the stop flag was raised did
    /// so because of it.
    pub(crate) fn failed(&self, idx: usize, task: usize, failure: TaskFailure) -> RunError {
        let stage = self.label(idx);
        match failure {
            TaskFailure::Panicked(message) => RunError::Panicked { stage, task, message },
            TaskFailure::Failed(_) if self.stopped() => {
                RunError::Stopped { stage, kept: Vec::new() }
            }
            TaskFailure::Failed(Failure::Stage(source)) => RunError::Stage { stage, source },
            TaskFailure::Failed(Failure::Rows(source)) => RunError::Rows { stage, source },
            TaskFailure::Failed(Failure::Params(source)) => RunError::Params { stage, source },
        }
    }

    /// The error of a node that was to run alone and reads what is not fresh.
    pub(crate) fn not_ready(&self, idx: usize, source: usize) -> RunError {
        let reason = format!("{} is not fresh", self.label(source));
        RunError::NotReady { stage: self.label(idx), reason }
    }
}

#[cfg(test)]
mod tests;
