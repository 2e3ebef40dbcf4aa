//! Threads that do what the driver hands out: jobs come through one bounded channel, what came of
//! them goes back through another, and rows go straight to the writer of their stage.

use crate::driver::Frame;
use crate::erase::{Bundle, ErasedPiece, Failure, Prepared};
use crate::host::StageHost;
use crate::prepare::{Assignment, Planned};
use crate::row_writer::Made;
use crate::trace::Lane;
use crate::{RunError, clock};
use crossbeam::channel::{Receiver, Sender, bounded};
use isospline_artifact::{Container, Hashed, StoreError, Unfinished};
use isospline_stage::{Counters, Ctx, Task};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::{Builder, Scope};
use std::time::Duration;

/// Pieces waiting for a writer, and notices for the driver, a thread: enough that no thread waits
/// for the writer's turn, few enough that pieces in flight stay small against the artifact.
pub(crate) const QUEUED_PER_THREAD: usize = 2;

/// A stage with its tasks, shared by its jobs.
pub(crate) struct Active<'f> {
    pub(crate) node: usize,
    pub(crate) prepared: Box<dyn Prepared>,
    pub(crate) inputs: Bundle,
    pub(crate) tasks: Arc<[Task]>,
    pub(crate) host: StageHost<'f>,
    /// To the stage's writer.
    pub(crate) pieces: Sender<Made>,
}

/// Something to do.
pub(crate) enum Job<'f> {
    /// Compare the rows of a fresh artifact with their checksums.
    Verify { node: usize, container: Arc<Container> },
    /// Prepare and plan a stage; if it has but one task, do it.
    Prepare(Box<Assignment>),
    /// One task.
    Task { stage: Arc<Active<'f>>, task: usize },
}

impl Job<'_> {
    fn node(&self) -> usize {
        match self {
            Self::Verify { node, .. } => *node,
            Self::Prepare(assignment) => assignment.node,
            Self::Task { stage, .. } => stage.node,
        }
    }
}

/// What came of a job.
pub(crate) enum Notice<'f> {
    /// Rows were compared with their checksums.
    Verified { node: usize, result: Result<(), StoreError> },
    /// A stage can begin with its tasks.
    Planned(Box<Planned<'f>>),
    /// The rows of a task are in their place.
    Committed { node: usize, task: usize, counters: Counters, time: Duration },
    /// All rows of a stage without tasks are in their place, and will be hashed.
    Written { node: usize, rows: Unfinished, counters: Counters, prepare: Duration, time: Duration },
    /// All rows are hashed.
    Hashed { node: usize, hashed: Hashed, time: Duration },
    /// A job failed; without an error if that of another job is the cause.
    Failed { node: usize, task: usize, error: Option<RunError> },
}

impl Notice<'_> {
    /// The notice of a hash.
    pub(crate) fn hashed(node: usize, result: Result<Hashed, StoreError>, time: Duration) -> Self {
        match result {
            Ok(hashed) => Self::Hashed { node, hashed, time },
            Err(error) => Self::Failed { node, task: 0, error: Some(error.into()) },
        }
    }
}

/// Why a task gave nothing.
#[derive(Debug)]
pub(crate) enum TaskFailure {
    Failed(Failure),
    Panicked(String),
}

/// The threads of a run, by their channels; they end when it is dropped.
pub(crate) struct Crew<'f> {
    pub(crate) jobs: Sender<Job<'f>>,
    pub(crate) notices: Receiver<Notice<'f>>,
    /// For writers.
    pub(crate) outbox: Sender<Notice<'f>>,
}

impl<'f> Crew<'f> {
    /// Starts `threads` threads.
    pub(crate) fn start<'scope>(
        scope: &'scope Scope<'scope, 'f>,
        frame: &'f Frame<'f>,
    ) -> Result<Self, RunError> {
        let threads = frame.threads();
        // One job waiting a thread: a later one may turn out to be more urgent.
        let (jobs, inbox) = bounded::<Job<'f>>(threads);
        let (outbox, notices) = bounded(QUEUED_PER_THREAD * threads);
        for k in 0..threads {
            let (inbox, outbox) = (inbox.clone(), outbox.clone());
            let builder = Builder::new().name(format!("isospline-{k}"));
            let started = builder.spawn_scoped(scope, move || work(frame, k, &inbox, &outbox));
            started.map_err(|_| RunError::Threads { threads })?;
        }
        Ok(Self { jobs, notices, outbox })
    }
}

fn work<'f>(
    frame: &'f Frame<'f>,
    number: usize,
    jobs: &Receiver<Job<'f>>,
    notices: &Sender<Notice<'f>>,
) {
    let lane = Lane::new(frame.options.trace, || format!("worker {number}"));
    for job in jobs {
        let start = clock::now();
        // A failed send means that the run is over.
        match job {
            job if frame.halted() => {
                let node = job.node();
                drop(notices.send(Notice::Failed { node, task: 0, error: None }));
            }
            Job::Verify { node, container } => {
                let result = container.verify();
                lane.note(&frame.nodes[node].label, "verify", start, None);
                drop(notices.send(Notice::Verified { node, result }));
            }
            Job::Prepare(assignment) => assignment.carry_out(frame, lane, notices),
            Job::Task { stage, task } => stage.run(frame, task, lane, notices),
        }
    }
}

impl Active<'_> {
    /// Runs one task and hands its rows to the writer, or tells that it failed.
    fn run<'f>(
        &self,
        frame: &'f Frame<'f>,
        task: usize,
        lane: Lane<'_>,
        notices: &Sender<Notice<'f>>,
    ) {
        let start = clock::now();
        let host = &self.host;
        let ctx = Ctx { field: frame.scene.field, domain: frame.scene.domain, host };
        let process = || self.prepared.process(&ctx, &self.inputs, &self.tasks[task]);
        let result: Result<ErasedPiece, _> = caught(process);
        let rows = self.tasks[task].writes.iter().map(ExactSizeIterator::len).sum();
        lane.note(host.label, "task", start, Some((task, rows)));
        let node = self.node;
        let error = match result {
            Ok(piece) => {
                let made = Made { task, piece, time: start.elapsed() };
                match self.pieces.send(made) {
                    Ok(()) => return,
                    // The writer has ended early, and has told why.
                    Err(_) => None,
                }
            }
            Err(failure) => Some(frame.failed(node, task, failure)),
        };
        drop(notices.send(Notice::Failed { node, task, error }));
    }
}

/// Calls `work`; a panic becomes a failure with its message.
pub(crate) fn caught<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, TaskFailure> {
    // Nothing that `work` may have left half-done is looked at again: the stage ends here.
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(TaskFailure::Failed),
        Err(payload) => Err(TaskFailure::Panicked(message(&*payload))),
    }
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
