//! What a stage may ask of the outside: threads, progress, the stop signal.

use std::sync::OnceLock;

/// The run was asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// Implemented by the pipeline only.
pub trait Host: Sync {
    /// Runs `body(0) .. body(n - 1)`, in any order and on any thread.
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync));

    /// Reports progress.
    ///
    /// # Errors
    /// [`Stopped`] if the stage is to give up.
    fn progress(&self, done: u64, of: u64) -> Result<(), Stopped>;

    /// The state that an earlier run of the same work [kept](Host::keep) before it was ended; for
    /// a stage without tasks.
    fn kept(&self) -> Option<Vec<u8>> {
        None
    }

    /// Keeps a state to go on from after `done` of `of` steps, in place of an earlier one; how
    /// often `state` is asked for is the host's matter. For a stage without tasks.
    fn keep(&self, _done: u64, _of: u64, _state: &dyn Fn() -> Vec<u8>) {}
}

/// Results of `make(0) .. make(n - 1)`, by index.
pub fn map<T: Send + Sync>(host: &dyn Host, n: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let slots: Vec<OnceLock<T>> = (0..n).map(|_| OnceLock::new()).collect();
    host.for_each(n, &|i| {
        // A host calls each index once; a second call would compute the same value.
        let _ = slots[i].set(make(i));
    });
    slots.into_iter().map(|s| s.into_inner().expect("invariant: each index ran")).collect()
}

/// The calling thread alone, never stopped: for tests and small jobs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Host for Serial {
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(body);
    }

    fn progress(&self, _: u64, _: u64) -> Result<(), Stopped> {
        Ok(())
    }
}
