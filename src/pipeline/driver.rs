//! Brings every node of a graph up to date, in order.

use crate::clock;
use crate::execute::{Execution, execute};
use crate::finisher::Finisher;
use crate::freshness::{Resolved, Source, assess, resolve};
use crate::host::{Listener, Threads};
use crate::workers::Crew;
use crate::{
    Event, Graph, ModelKey, NodeReport, NodeStatus, Outcome, Reason, Registry, RunError,
    RunOptions, RunReport, Scene, State, read_provenance,
};
use isospline_artifact::{Container, Key, SectionSource, Store, StoreError};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::Scope;

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
            let (stage, artifact) = (resolved.label.clone(), resolved.artifact.clone());
            out.push(NodeStatus { node, stage, artifact, state });
        }
        Ok(out)
    }

    /// Computes what is not fresh and keeps it in the store; `events` is called from any thread.
    ///
    /// # Errors
    /// [`RunError`]; what was finished before is kept, and nothing half-made has a name.
    pub fn run(
        &self,
        scene: Scene<'a>,
        options: &RunOptions<'a>,
        events: &'a (dyn Fn(&Event) + Sync),
    ) -> Result<RunReport, RunError> {
        let start = clock::now();
        let nodes = resolve(self)?;
        let wanted = Wanted::of(self, options)?;
        let _lock = self.store.lock()?;
        let threads = options.threads.max(1);
        let pool = Threads::new(threads);
        let frame = Frame { pipeline: *self, nodes, scene, options: *options, events, pool };
        let reports = std::thread::scope(|scope| {
            let mut run = Run::new(&frame, scope, wanted);
            let result = run.all();
            let stored = run.finisher.take().map_or(Ok(()), Finisher::finish);
            // A store that fails is the cause of what follows from it.
            stored.map_err(RunError::Store).and(result).map(|()| run.reports)
        })?;
        let nodes = reports.into_iter().flatten().collect();
        Ok(RunReport { nodes, seconds: start.elapsed().as_secs_f64() })
    }
}

/// Which nodes to look at, and which to run even if fresh.
#[derive(Debug)]
struct Wanted {
    forced: Vec<bool>,
    /// The one stage to run, if not all.
    only: Option<Vec<bool>>,
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
}

/// What a run works on; outlives its threads.
pub(crate) struct Frame<'a> {
    pub(crate) pipeline: Pipeline<'a>,
    pub(crate) nodes: Vec<Resolved>,
    pub(crate) scene: Scene<'a>,
    pub(crate) options: RunOptions<'a>,
    pub(crate) events: Listener<'a>,
    pub(crate) pool: Threads,
}

impl Frame<'_> {
    pub(crate) fn stopped(&self) -> bool {
        self.options.stop.load(Ordering::Relaxed)
    }
}

/// State of a run.
struct Run<'scope, 'f> {
    frame: &'f Frame<'f>,
    scope: &'scope Scope<'scope, 'f>,
    wanted: Wanted,
    contents: Vec<Option<Key>>,
    reports: Vec<Option<NodeReport>>,
    /// Artifacts whose rows are known to be whole.
    verified: Vec<bool>,
    crew: Option<Crew<'f>>,
    finisher: Option<Finisher<'scope>>,
}

impl<'scope, 'f> Run<'scope, 'f> {
    fn new(frame: &'f Frame<'f>, scope: &'scope Scope<'scope, 'f>, wanted: Wanted) -> Self {
        let n = frame.nodes.len();
        Self {
            frame,
            scope,
            wanted,
            contents: vec![None; n],
            reports: vec![None; n],
            verified: vec![false; n],
            crew: None,
            finisher: None,
        }
    }

    fn all(&mut self) -> Result<(), RunError> {
        for idx in 0..self.frame.nodes.len() {
            if self.frame.stopped() {
                return Err(RunError::Stopped { stage: self.frame.nodes[idx].label.clone() });
            }
            self.bring_up(idx)?;
        }
        Ok(())
    }

    /// Finds node `idx` fresh or runs it.
    fn bring_up(&mut self, idx: usize) -> Result<(), RunError> {
        let frame = self.frame;
        let node = &frame.nodes[idx];
        let (mut state, container) = assess(&frame.pipeline, node, &self.contents)?;
        if let (true, Some(container)) = (frame.options.verify, &container) {
            state = container.verify().map_or_else(damaged, |()| Ok(State::Fresh))?;
            self.verified[idx] = state == State::Fresh;
        }
        let may_run = self.wanted.only.as_ref().is_none_or(|only| only[idx]);
        let forced = self.wanted.forced[idx] && may_run;
        match (state, container) {
            (State::Fresh, Some(container)) if !forced => self.keep(idx, container),
            _ if !may_run => Ok(()),
            (State::Fresh, _) => self.execute(idx, vec![Reason::Asked]),
            (State::Stale(reasons), _) => self.execute(idx, reasons),
            (State::Missing, _) => self.execute(idx, vec![Reason::Missing]),
            (State::Damaged(reason), _) => self.rebuild(idx, reason),
        }
    }

    /// Takes a fresh artifact as it is.
    fn keep(&mut self, idx: usize, container: Container) -> Result<(), RunError> {
        let node = &self.frame.nodes[idx];
        let content = container.content();
        let provenance = read_provenance(self.frame.pipeline.store, &node.artifact)?;
        self.contents[idx] = Some(content);
        self.reports[idx] = Some(NodeReport {
            node: idx,
            stage: node.label.clone(),
            artifact: node.artifact.clone(),
            outcome: Outcome::Fresh,
            content,
            bytes: container.length(),
            provenance: provenance.filter(|p| p.recipe == container.header().recipe),
            container: Some(Arc::new(container)),
        });
        (self.frame.events)(&Event::Fresh { node: idx, stage: node.label.clone() });
        Ok(())
    }

    /// Computes again what is damaged.
    fn rebuild(&mut self, idx: usize, reason: String) -> Result<(), RunError> {
        let stage = self.frame.nodes[idx].label.clone();
        (self.frame.events)(&Event::Damaged { node: idx, stage, reason });
        self.execute(idx, vec![Reason::Damaged])
    }

    /// Computes node `idx` from its inputs, which are verified, and rebuilt if they are damaged.
    fn execute(&mut self, idx: usize, reasons: Vec<Reason>) -> Result<(), RunError> {
        let frame = self.frame;
        let node = &frame.nodes[idx];
        let mut inputs = Vec::with_capacity(node.inputs.len());
        for input in &node.inputs {
            let rows: Arc<dyn SectionSource> = match input.source {
                Source::Node(source) => self.open_input(idx, source)?,
                Source::Given(k, _) => Arc::clone(&frame.pipeline.graph.nodes[idx].given[k].rows),
            };
            inputs.push((input.kind, rows));
        }
        let execution = Execution { frame, idx, reasons, inputs, contents: &self.contents };
        let crew = match &mut self.crew {
            Some(crew) => crew,
            none => none.insert(Crew::start(self.scope, frame.options.threads.max(1))?),
        };
        let (report, finished) = execute(execution, crew)?;
        self.contents[idx] = Some(report.content);
        self.reports[idx] = Some(report);
        self.verified[idx] = true;
        let finisher = match &mut self.finisher {
            Some(finisher) => finisher,
            none => none.insert(Finisher::start(self.scope, frame.pipeline.store, frame.events)?),
        };
        if finisher.take_over(finished) && !finisher.has_failed() {
            return Ok(());
        }
        self.store_failure()
    }

    /// The store fails: its error tells why.
    fn store_failure(&mut self) -> Result<(), RunError> {
        let stored = self.finisher.take().map_or(Ok(()), Finisher::finish);
        stored.map_err(RunError::Store)
    }

    /// The artifact of node `source` with whole rows, for node `reader`.
    fn open_input(&mut self, reader: usize, source: usize) -> Result<Arc<Container>, RunError> {
        let label = |idx: usize| self.frame.nodes[idx].label.clone();
        let Some(container) = self.container(source) else {
            let reason = format!("{} is not fresh", label(source));
            return Err(RunError::NotReady { stage: label(reader), reason });
        };
        if self.verified[source] {
            return Ok(container);
        }
        match container.verify() {
            Ok(()) => {
                self.verified[source] = true;
                Ok(container)
            }
            Err(StoreError::Damaged { damage, .. }) if self.wanted.only.is_none() => {
                self.rebuild(source, damage.to_string())?;
                Ok(self.container(source).expect("invariant: computed just now"))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn container(&self, idx: usize) -> Option<Arc<Container>> {
        self.reports[idx].as_ref().and_then(|r| r.container.clone())
    }
}

fn damaged(error: StoreError) -> Result<State, RunError> {
    match error {
        StoreError::Damaged { damage, .. } => Ok(State::Damaged(damage.to_string())),
        other => Err(other.into()),
    }
}

#[cfg(test)]
mod tests;
