//! A thread that makes finished artifacts durable while the next stage is at work.
//!
//! A sync takes milliseconds in which the processor is idle. Order does not matter to
//! correctness: a later artifact that survives a power cut alone is found fresh once the earlier
//! one is computed again with equal bytes.

use crate::host::Listener;
use crate::provenance::note_name;
use crate::{Event, Provenance, RunError};
use crossbeam::channel::{Receiver, Sender, unbounded};
use isospline_artifact::{Sealed, Store, StoreError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

/// A finished artifact on its way to its name.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) node: usize,
    pub(crate) label: String,
    pub(crate) artifact: String,
    pub(crate) sealed: Sealed,
    pub(crate) provenance: Provenance,
}

/// The thread and its inbox.
pub(crate) struct Finisher<'scope> {
    inbox: Sender<Finished>,
    thread: ScopedJoinHandle<'scope, Result<(), StoreError>>,
}

impl<'scope> Finisher<'scope> {
    pub(crate) fn start<'a>(
        scope: &'scope Scope<'scope, 'a>,
        store: &'a dyn Store,
        events: Listener<'a>,
    ) -> Result<Self, RunError> {
        // Unbounded, but never longer than the graph: one entry a node.
        let (inbox, arrivals) = unbounded();
        let builder = Builder::new().name("isospline-store".to_owned());
        let thread = builder.spawn_scoped(scope, move || serve(store, events, &arrivals));
        Ok(Self { inbox, thread: thread.map_err(|_| RunError::Threads { threads: 1 })? })
    }

    /// Hands over an artifact; false if the thread has given up.
    pub(crate) fn take_over(&self, finished: Finished) -> bool {
        self.inbox.send(finished).is_ok()
    }

    /// Waits until all is stored.
    pub(crate) fn finish(self) -> Result<(), StoreError> {
        drop(self.inbox);
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

/// Stores what arrives; what has piled up shares one sync of the folder.
fn serve(
    store: &dyn Store,
    events: Listener<'_>,
    arrivals: &Receiver<Finished>,
) -> Result<(), StoreError> {
    while let Ok(first) = arrivals.recv() {
        let mut stored = Vec::new();
        for finished in std::iter::once(first).chain(arrivals.try_iter()) {
            stored.push(publish(store, finished)?);
        }
        store.sync_names()?;
        stored.iter().for_each(events);
    }
    Ok(())
}

fn publish(store: &dyn Store, finished: Finished) -> Result<Event, StoreError> {
    let Finished { node, label, artifact, sealed, provenance } = finished;
    // The record comes first: a whole artifact without its counters would hide repairs.
    store.write_note(&note_name(&artifact), &provenance.to_json())?;
    sealed.publish()?;
    Ok(Event::Stored { node, stage: label, artifact })
}
