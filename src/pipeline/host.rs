//! The pipeline's side of [`Host`]: threads for whole stages, progress, the stop flag.

use crate::Event;
use crate::keeper::{Keeper, Steps};
use isospline_stage::{Host, Stopped};
use rayon::prelude::*;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Listener to events.
pub(crate) type Listener<'a> = &'a (dyn Fn(&Event) + Sync);

/// Threads to lend, started when first used.
#[derive(Debug)]
pub struct Threads {
    threads: usize,
    pool: OnceLock<Option<rayon::ThreadPool>>,
}

impl Threads {
    /// As many threads; one means the caller's.
    pub fn new(threads: usize) -> Self {
        Self { threads, pool: OnceLock::new() }
    }

    /// Runs `work` on one of the threads. What it shares out then begins at once on that thread;
    /// from outside, each share would wait for a thread to wake, and its end for the caller to.
    pub fn within<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match self.get() {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Runs `body(0) .. body(n - 1)`, in any order and on any of the threads.
    pub fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        match self.get() {
            // One by one: a long part holds up no others.
            Some(pool) if n > 1 => {
                pool.install(|| (0..n).into_par_iter().with_max_len(1).for_each(body));
            }
            _ => (0..n).for_each(body),
        }
    }

    /// `None` where one thread does, or where the system gives no more: the caller's thread then
    /// does all, with the same results.
    fn get(&self) -> Option<&rayon::ThreadPool> {
        let build = || rayon::ThreadPoolBuilder::new().num_threads(self.threads).build().ok();
        if self.threads < 2 { None } else { self.pool.get_or_init(build).as_ref() }
    }
}

/// What one node sees of the run.
#[derive(Clone, Copy)]
pub(crate) struct StageHost<'a> {
    pub(crate) node: usize,
    pub(crate) label: &'a str,
    pub(crate) pool: &'a Threads,
    pub(crate) stop: &'a AtomicBool,
    pub(crate) events: Listener<'a>,
    /// For a stage without tasks.
    pub(crate) keeper: Option<&'a Keeper<'a>>,
}

impl Host for StageHost<'_> {
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        self.pool.for_each(n, body);
    }

    fn progress(&self, done: u64, of: u64) -> Result<(), Stopped> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        (self.events)(&Event::Progress { node: self.node, stage: self.label.to_owned(), done, of });
        Ok(())
    }

    fn kept(&self) -> Option<Vec<u8>> {
        let (Steps { done, of }, state) = self.keeper?.kept()?;
        (self.events)(&Event::Resumed { node: self.node, stage: self.label.to_owned(), done, of });
        Some(state)
    }

    fn keep(&self, done: u64, of: u64, state: &dyn Fn() -> Vec<u8>) {
        if let Some(keeper) = self.keeper {
            keeper.keep(Steps { done, of }, state);
        }
    }
}
