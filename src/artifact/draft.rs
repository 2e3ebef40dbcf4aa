//! What an unfinished artifact tells of itself.

use crate::header::decode;
use crate::{Header, Recorded, Store, StoreError};
use std::collections::BTreeSet;

/// Header and journal of an unfinished artifact.
#[derive(Clone, Debug)]
pub struct Draft {
    /// What its file says that it will be; its derivation is not known yet. `None` if the file is
    /// not there or does not begin as one.
    pub header: Option<Header>,
    /// Bytes of the file.
    pub length: u64,
    /// Its journal; `None` if there is none whose head is whole.
    pub recorded: Option<Recorded>,
}

impl Draft {
    /// The draft of the artifact `name`; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn read(store: &dyn Store, name: &str) -> Result<Option<Self>, StoreError> {
        let (file, journal) = (store.read_partial(name)?, store.read_journal(name)?);
        if file.is_none() && journal.is_none() {
            return Ok(None);
        }
        let header = file.as_ref().and_then(|file| decode(file.bytes()).ok());
        Ok(Some(Self {
            header: header.map(|(header, _)| header),
            length: file.map_or(0, |file| file.bytes().len() as u64),
            recorded: journal.and_then(|bytes| Recorded::decode(&bytes)),
        }))
    }

    /// Tasks that the journal calls done, and all tasks; their rows have yet to be compared with
    /// their checksums.
    pub fn tasks(&self) -> Option<(usize, usize)> {
        let recorded = self.recorded.as_ref()?;
        let done: BTreeSet<u32> = recorded.entries.iter().map(|entry| entry.task).collect();
        Some((done.len(), recorded.head.tasks as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::writer::tests::identity;
    use crate::{Artifact, Journal, JournalEntry, JournalHead, Key, MemoryStore, Writer};

    #[test]
    fn a_draft_tells_sections_and_tasks() {
        let store = MemoryStore::new();
        assert!(Draft::read(&store, "a").unwrap().is_none());
        let specs = crate::kinds::VertexSystems::SECTIONS;
        let mut writer = Writer::begin(&store, "a", &identity(), specs, &[5, 0, 7]).unwrap();
        writer.outlive();
        let head = JournalHead { recipe: identity().recipe, plan: Key([3; 32]), tasks: 4 };
        let mut journal = Journal::begin(&store, "a", &head).unwrap();
        for task in [2, 0, 2] {
            journal.append(&JournalEntry { task, rows: 0, note: Vec::new() }).unwrap();
        }
        let draft = Draft::read(&store, "a").unwrap().unwrap();
        assert_eq!(draft.header.as_ref().unwrap().sections[2].rows, 7);
        assert_eq!(draft.header.as_ref().unwrap().derivation, Key::default());
        assert_eq!(draft.tasks(), Some((2, 4)));
    }
}
