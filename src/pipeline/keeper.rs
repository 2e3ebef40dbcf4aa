//! The state of a stage without tasks, kept beside its artifact while it works: a run that is
//! ended goes on from there. A note of the store, replaced as a whole; `FORMAT.md` describes it.

use crate::clock;
use crate::driver::Frame;
use isospline_artifact::{Key, Store, StoreError};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_64;

/// First bytes of a kept state; another version is another state.
const MAGIC: [u8; 8] = *b"\x89ISOK\r\n1";
/// Bytes before the stage's own: magic, recipe, steps done, all steps, checksum of what follows
/// and precedes.
const HEAD: usize = 64;
/// Appended to the name of the artifact.
const SUFFIX: &str = ".state";
/// Least time between two states: what a kill costs, against what keeping costs.
const EVERY: Duration = Duration::from_secs(1);

/// Steps of a stage that are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Steps {
    pub(crate) done: u64,
    pub(crate) of: u64,
}

/// Keeps the states of one node.
#[derive(Debug)]
pub(crate) struct Keeper<'a> {
    store: &'a dyn Store,
    name: String,
    recipe: Key,
    every: Duration,
    /// When the next state is due; `None` once one could not be written.
    due: Mutex<Option<Instant>>,
}

impl<'a> Keeper<'a> {
    /// The keeper of a node; `None` for a closure, which has no recipe to know its work by.
    pub(crate) fn of(frame: &Frame<'a>, idx: usize) -> Option<Self> {
        let (pipeline, node) = (frame.pipeline, &frame.nodes[idx]);
        let new = || Self::new(pipeline.store, &node.artifact, node.recipe, EVERY);
        pipeline.model.hashable.then(new)
    }

    fn new(store: &'a dyn Store, artifact: &str, recipe: Key, every: Duration) -> Self {
        let due = Mutex::new(Some(clock::now() + every));
        Self { store, name: name_of(artifact), recipe, every, due }
    }

    /// The state that an earlier run of the same work kept.
    pub(crate) fn kept(&self) -> Option<(Steps, Vec<u8>)> {
        // A state saves work and nothing else: one that cannot be read is done without.
        let bytes = self.store.read_note(&self.name).ok()??;
        let (recipe, steps) = head(&bytes)?;
        let own = bytes.get(HEAD..).filter(|_| recipe == self.recipe)?;
        Some((steps, own.to_vec()))
    }

    /// Keeps a state, if one is due.
    pub(crate) fn keep(&self, steps: Steps, state: &dyn Fn() -> Vec<u8>) {
        let mut due = self.due.lock().expect("invariant: no keeper panics");
        if due.is_none_or(|due| clock::now() < due) {
            return;
        }
        let written = self.store.write_note(&self.name, &encode(self.recipe, steps, &state()));
        // A disk that is full now may be too full for the artifact, which then tells of it.
        *due = written.is_ok().then(|| clock::now() + self.every);
    }
}

/// The steps that are kept of the artifact, and the recipe that they belong to.
///
/// # Errors
/// [`StoreError::Io`].
pub(crate) fn stand(store: &dyn Store, artifact: &str) -> Result<Option<(Key, Steps)>, StoreError> {
    Ok(store.read_note(&name_of(artifact))?.and_then(|bytes| head(&bytes)))
}

/// Removes what was kept of an artifact.
///
/// # Errors
/// [`StoreError::Io`].
pub(crate) fn discard(store: &dyn Store, artifact: &str) -> Result<(), StoreError> {
    store.remove(&name_of(artifact))
}

fn name_of(artifact: &str) -> String {
    format!("{artifact}{SUFFIX}")
}

fn encode(recipe: Key, steps: Steps, own: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEAD + own.len());
    out.extend(MAGIC);
    out.extend(recipe.0);
    out.extend(steps.done.to_le_bytes());
    out.extend(steps.of.to_le_bytes());
    out.extend([0; 8]);
    out.extend(own);
    let checksum = xxh3_64(&out);
    out[HEAD - 8..HEAD].copy_from_slice(&checksum.to_le_bytes());
    out
}

/// Recipe and steps of a state that is whole.
fn head(bytes: &[u8]) -> Option<(Key, Steps)> {
    let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let recipe = Key(bytes.get(8..40)?.try_into().ok()?);
    let steps = Steps { done: number(40)?, of: number(48)? };
    (encode(recipe, steps, bytes.get(HEAD..)?) == bytes).then_some((recipe, steps))
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_artifact::MemoryStore;

    const STEPS: Steps = Steps { done: 3, of: 7 };

    fn keeper(store: &MemoryStore, recipe: u8, every: Duration) -> Keeper<'_> {
        Keeper::new(store, "a.isos", Key([recipe; 32]), every)
    }

    #[test]
    fn a_state_comes_back_for_the_same_recipe_alone() {
        let store = MemoryStore::new();
        let first = keeper(&store, 1, Duration::ZERO);
        assert_eq!(first.kept(), None);
        first.keep(STEPS, &|| b"state".to_vec());
        assert_eq!(keeper(&store, 1, EVERY).kept(), Some((STEPS, b"state".to_vec())));
        assert_eq!(keeper(&store, 2, EVERY).kept(), None);
        assert_eq!(stand(&store, "a.isos").unwrap(), Some((Key([1; 32]), STEPS)));
        discard(&store, "a.isos").unwrap();
        assert_eq!(first.kept(), None);
    }

    #[test]
    fn states_are_not_asked_for_more_often_than_they_are_due() {
        let store = MemoryStore::new();
        keeper(&store, 1, Duration::from_hours(1)).keep(STEPS, &|| panic!("asked for"));
        assert_eq!(stand(&store, "a.isos").unwrap(), None);
    }

    #[test]
    fn every_changed_bit_and_every_length_is_found() {
        let whole = encode(Key([5; 32]), STEPS, b"own");
        assert!(head(&whole).is_some());
        for at in 0..8 * whole.len() {
            let mut damaged = whole.clone();
            damaged[at / 8] ^= 1 << (at % 8);
            assert_eq!(head(&damaged), None, "bit {at}");
        }
        for length in 0..whole.len() {
            assert_eq!(head(&whole[..length]), None, "{length} bytes");
        }
    }
}
