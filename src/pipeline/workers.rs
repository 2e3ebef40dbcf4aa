//! Threads that run tasks: jobs come through one bounded channel, pieces go through another.

use crate::erase::{Bundle, ErasedPiece, Failure, Prepared};
use crate::host::StageHost;
use crate::{RunError, Scene, clock};
use crossbeam::channel::{Receiver, Sender, bounded};
use isospline_stage::{Ctx, Task};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::{Builder, Scope};
use std::time::Duration;

/// Jobs and pieces waiting, a thread: enough that no thread waits for the writer's turn, few
/// enough that pieces in flight stay small against the artifact.
const QUEUED_PER_THREAD: usize = 2;

/// A stage at work, shared by its jobs.
pub(crate) struct Active<'a> {
    pub(crate) prepared: Box<dyn Prepared>,
    pub(crate) inputs: Bundle,
    pub(crate) tasks: Vec<Task>,
    pub(crate) host: StageHost<'a>,
    pub(crate) scene: Scene<'a>,
}

/// One task to run.
pub(crate) struct Job<'a> {
    pub(crate) stage: Arc<Active<'a>>,
    pub(crate) task: usize,
}

/// What came of a task.
pub(crate) struct Done {
    pub(crate) task: usize,
    pub(crate) result: Result<ErasedPiece, TaskFailure>,
    pub(crate) time: Duration,
}

/// Why a task gave nothing.
#[derive(Debug)]
pub(crate) enum TaskFailure {
    Failed(Failure),
    Panicked(String),
}

/// The threads of a run, by their channels; they end when it is dropped.
pub(crate) struct Crew<'a> {
    pub(crate) jobs: Sender<Job<'a>>,
    pub(crate) done: Receiver<Done>,
}

impl<'a> Crew<'a> {
    /// Starts `threads` threads.
    pub(crate) fn start<'scope>(
        scope: &'scope Scope<'scope, 'a>,
        threads: usize,
    ) -> Result<Self, RunError> {
        let (jobs, inbox) = bounded::<Job<'a>>(QUEUED_PER_THREAD * threads);
        let (outbox, done) = bounded(QUEUED_PER_THREAD * threads);
        for k in 0..threads {
            let (inbox, outbox) = (inbox.clone(), outbox.clone());
            let builder = Builder::new().name(format!("isospline-{k}"));
            let started = builder.spawn_scoped(scope, move || work(&inbox, &outbox));
            started.map_err(|_| RunError::Threads { threads })?;
        }
        Ok(Self { jobs, done })
    }
}

impl Active<'_> {
    /// Runs one task on the calling thread.
    pub(crate) fn run(&self, task: usize) -> Done {
        let start = clock::now();
        let host = &self.host;
        let ctx = Ctx { field: self.scene.field, domain: self.scene.domain, host };
        let process = || self.prepared.process(&ctx, &self.inputs, &self.tasks[task]);
        let result = caught(process);
        Done { task, result, time: start.elapsed() }
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

fn work(jobs: &Receiver<Job<'_>>, done: &Sender<Done>) {
    for Job { stage, task } in jobs {
        if done.send(stage.run(task)).is_err() {
            return;
        }
    }
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
