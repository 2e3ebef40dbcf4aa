//! The journal of an unfinished artifact: which tasks are done, and what their rows must be.
//!
//! Entries are appended and never synced. A torn or stale tail ends the reading, and the rows of
//! every entry are compared with its checksum before they are trusted: whatever a kill or a power
//! cut leaves, at most some tasks are done again. `FORMAT.md` describes the bytes.

use crate::header::{read_u32, read_u64};
use crate::store::Log;
use crate::{Key, Store, StoreError};
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// First bytes of every journal.
pub const JOURNAL_MAGIC: [u8; 8] = *b"\x89ISOJ\r\n\x1a";
/// Version of the journal; another one is discarded, since it saves work and nothing else.
pub const JOURNAL_VERSION: u32 = 1;
/// Bytes of the head.
pub const HEAD: usize = 88;
/// Bytes of an entry before its note.
pub const ENTRY: usize = 24;
/// Most bytes of a note.
pub const NOTE_LIMIT: usize = 1 << 16;

/// What the artifact is to become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JournalHead {
    /// Recipe of the artifact.
    pub recipe: Key,
    /// Key over row counts and tasks: entries name tasks by number.
    pub plan: Key,
    /// Tasks of the plan.
    pub tasks: u32,
}

/// A task whose rows are written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalEntry {
    /// Its number.
    pub task: u32,
    /// xxh3-64 of its rows, section by section.
    pub rows: u64,
    /// What the writer wants back with it.
    pub note: Vec<u8>,
}

/// A journal as it was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Its head.
    pub head: JournalHead,
    /// Whole entries in order; a later one of the same task replaces an earlier one.
    pub entries: Vec<JournalEntry>,
    /// Bytes of head and whole entries; what follows is torn.
    pub length: u64,
}

/// A journal being written.
#[derive(Debug)]
pub struct Journal {
    log: Box<dyn Log>,
    seed: u64,
}

impl Journal {
    /// Starts the journal of the artifact `name`, in place of an earlier one.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn begin(store: &dyn Store, name: &str, head: &JournalHead) -> Result<Self, StoreError> {
        let mut log = store.journal(name, 0)?;
        let bytes = encode_head(head);
        log.append(&bytes)?;
        Ok(Self { log, seed: seed_of(&bytes) })
    }

    /// Goes on after the whole entries of `recorded`.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn resume(store: &dyn Store, name: &str, recorded: &Recorded) -> Result<Self, StoreError> {
        let log = store.journal(name, recorded.length)?;
        Ok(Self { log, seed: seed_of(&encode_head(&recorded.head)) })
    }

    /// Adds an entry.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    ///
    /// # Panics
    /// If the note is longer than [`NOTE_LIMIT`].
    pub fn append(&mut self, entry: &JournalEntry) -> Result<(), StoreError> {
        self.log.append(&encode_entry(entry, self.seed))
    }
}

impl Recorded {
    /// The journal of the artifact `name`; `None` if there is none whose head is whole.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn read(store: &dyn Store, name: &str) -> Result<Option<Self>, StoreError> {
        Ok(store.read_journal(name)?.and_then(|bytes| Self::decode(&bytes)))
    }

    /// Head and whole entries; `None` if the head is not whole.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let head = decode_head(bytes)?;
        let seed = seed_of(&bytes[..HEAD]);
        let mut entries = Vec::new();
        let mut rest = &bytes[HEAD..];
        while let Some((entry, after)) = decode_entry(rest, seed) {
            if entry.task >= head.tasks {
                break;
            }
            entries.push(entry);
            rest = after;
        }
        Some(Self { head, entries, length: (bytes.len() - rest.len()) as u64 })
    }
}

/// xxh3-64 of the rows of a task, section after section, as [`JournalEntry::rows`] holds it.
pub fn rows_checksum<'a>(sections: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let mut hasher = xxhash_rust::xxh3::Xxh3::new();
    sections.into_iter().for_each(|bytes| hasher.update(bytes));
    hasher.digest()
}

fn encode_head(head: &JournalHead) -> [u8; HEAD] {
    let mut out = [0; HEAD];
    out[..8].copy_from_slice(&JOURNAL_MAGIC);
    out[8..12].copy_from_slice(&JOURNAL_VERSION.to_le_bytes());
    out[12..16].copy_from_slice(&head.tasks.to_le_bytes());
    out[16..48].copy_from_slice(&head.recipe.0);
    out[48..80].copy_from_slice(&head.plan.0);
    let own = xxh3_64(&out[..80]);
    out[80..].copy_from_slice(&own.to_le_bytes());
    out
}

fn decode_head(bytes: &[u8]) -> Option<JournalHead> {
    let bytes = bytes.get(..HEAD)?;
    let key = |at: usize| bytes[at..at + 32].try_into().ok().map(Key);
    let head = JournalHead { recipe: key(16)?, plan: key(48)?, tasks: read_u32(bytes, 12) };
    (encode_head(&head) == bytes).then_some(head)
}

/// Entries are tied to their head: what an earlier journal left on the disk does not pass.
fn seed_of(head: &[u8]) -> u64 {
    read_u64(head, HEAD - 8)
}

fn encode_entry(entry: &JournalEntry, seed: u64) -> Vec<u8> {
    assert!(entry.note.len() <= NOTE_LIMIT, "invariant: notes of tasks are short");
    let mut out = Vec::with_capacity(ENTRY + entry.note.len());
    out.extend_from_slice(&(entry.note.len() as u32).to_le_bytes());
    out.extend_from_slice(&entry.task.to_le_bytes());
    out.extend_from_slice(&entry.rows.to_le_bytes());
    out.extend_from_slice(&[0; 8]);
    out.extend_from_slice(&entry.note);
    let own = xxh3_64_with_seed(&out, seed);
    out[16..24].copy_from_slice(&own.to_le_bytes());
    out
}

fn decode_entry(bytes: &[u8], seed: u64) -> Option<(JournalEntry, &[u8])> {
    let (fixed, rest) = bytes.split_at_checked(ENTRY)?;
    let length = read_u32(fixed, 0) as usize;
    let (note, after) = rest.split_at_checked(length).filter(|_| length <= NOTE_LIMIT)?;
    let entry =
        JournalEntry { task: read_u32(fixed, 4), rows: read_u64(fixed, 8), note: note.to_vec() };
    let whole = encode_entry(&entry, seed) == bytes[..ENTRY + length];
    whole.then_some((entry, after))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemoryStore;

    fn head(recipe: u8) -> JournalHead {
        JournalHead { recipe: Key([recipe; 32]), plan: Key([2; 32]), tasks: 3 }
    }

    fn entry(task: u32, note: &[u8]) -> JournalEntry {
        JournalEntry { task, rows: 7 + u64::from(task), note: note.to_vec() }
    }

    fn written(head: &JournalHead, entries: &[JournalEntry]) -> Vec<u8> {
        let store = MemoryStore::new();
        let mut journal = Journal::begin(&store, "a", head).unwrap();
        for entry in entries {
            journal.append(entry).unwrap();
        }
        store.read_journal("a").unwrap().unwrap()
    }

    #[test]
    fn every_truncation_and_every_changed_byte_keeps_whole_entries_alone() {
        let entries = [entry(2, b"ab"), entry(0, b""), entry(1, b"abc")];
        let bytes = written(&head(1), &entries);
        let ends = [HEAD, HEAD + 26, HEAD + 50, HEAD + 77];
        assert_eq!(bytes.len(), ends[3]);
        for length in 0..=bytes.len() {
            let found = Recorded::decode(&bytes[..length]);
            let Some(n) = ends.iter().rposition(|&end| end <= length) else {
                assert_eq!(found, None, "{length}");
                continue;
            };
            let found = found.unwrap();
            assert_eq!((found.length, &found.entries[..]), (ends[n] as u64, &entries[..n]));
        }
        for place in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[place] ^= 0x10;
            let found = Recorded::decode(&changed).map(|r| r.entries);
            let n = ends.iter().rposition(|&end| end <= place);
            assert_eq!(found.as_deref(), n.map(|n| &entries[..n]), "{place}");
        }
    }

    #[test]
    fn entries_of_an_earlier_journal_do_not_pass() {
        let old = written(&head(1), &[entry(0, b"old"), entry(1, b"old")]);
        let new = written(&head(9), &[entry(0, b"new")]);
        let stale = [&new[..], &old[new.len()..]].concat();
        assert_eq!(Recorded::decode(&stale).unwrap().entries, [entry(0, b"new")]);
    }

    #[test]
    fn a_task_that_the_plan_does_not_have_ends_the_journal() {
        let bytes = written(&head(1), &[entry(1, b""), entry(3, b""), entry(2, b"")]);
        assert_eq!(Recorded::decode(&bytes).unwrap().entries, [entry(1, b"")]);
    }

    #[test]
    fn a_resumed_journal_drops_its_torn_tail() {
        let store = MemoryStore::new();
        let mut journal = Journal::begin(&store, "a", &head(1)).unwrap();
        journal.append(&entry(0, b"")).unwrap();
        store.journal("a", 112).unwrap().append(b"torn").unwrap();
        let found = Recorded::read(&store, "a").unwrap().unwrap();
        Journal::resume(&store, "a", &found).unwrap().append(&entry(2, b"x")).unwrap();
        let found = Recorded::read(&store, "a").unwrap().unwrap();
        assert_eq!(found.entries, [entry(0, b""), entry(2, b"x")]);
    }
}
