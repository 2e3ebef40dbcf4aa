//! A store in memory: the same containers without files.

use crate::cells::Cells;
use crate::store::{Log, Partial, Publish};
use crate::{Bytes, Lock, Store, StoreError};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Artifacts of this process alone; clones share them.
#[derive(Clone, Debug, Default)]
pub struct MemoryStore {
    shelf: Arc<Mutex<Shelf>>,
}

#[derive(Debug, Default)]
struct Shelf {
    files: BTreeMap<String, Arc<Cells>>,
    /// Unfinished files; those of writers at work are taken out when the writer gives up.
    partials: BTreeMap<String, Arc<Cells>>,
    journals: BTreeMap<String, Vec<u8>>,
    notes: BTreeMap<String, Vec<u8>>,
    locked: bool,
}

impl MemoryStore {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    /// Puts a file of any bytes under `name`, as a disk could.
    pub fn put(&self, name: &str, bytes: &[u8]) {
        self.shelf().files.insert(name.to_owned(), Arc::new(Cells::copy_of(bytes)));
    }

    fn shelf(&self) -> MutexGuard<'_, Shelf> {
        // Every change is a single insertion, so a panic elsewhere leaves the shelf whole.
        self.shelf.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn describe(&self, name: &str) -> String {
        name.to_owned()
    }

    fn lock(&self) -> Result<Box<dyn Lock>, StoreError> {
        if std::mem::replace(&mut self.shelf().locked, true) {
            return Err(StoreError::Locked { path: "memory".into() });
        }
        Ok(Box::new(Held(self.clone())))
    }

    fn names(&self) -> Result<Vec<String>, StoreError> {
        Ok(self.shelf().files.keys().cloned().collect())
    }

    fn create(&self, name: &str, length: u64) -> Result<Box<dyn Partial>, StoreError> {
        Ok(self.growing(name, Cells::zeros(length as usize), false))
    }

    fn reopen(&self, name: &str, length: u64) -> Result<Option<Box<dyn Partial>>, StoreError> {
        // A copy: the writer that left the file may still be alive in this process.
        let found = self.read_partial(name)?.filter(|found| found.bytes().len() as u64 == length);
        Ok(found.map(|found| self.growing(name, Cells::copy_of(found.bytes()), true)))
    }

    fn read_partial(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        Ok(self.shelf().partials.get(name).map(|cells| Arc::clone(cells) as Arc<dyn Bytes>))
    }

    fn journal(&self, name: &str, keep: u64) -> Result<Box<dyn Log>, StoreError> {
        self.shelf().journals.entry(name.to_owned()).or_default().truncate(keep as usize);
        Ok(Box::new(Entries { store: self.clone(), name: name.to_owned() }))
    }

    fn read_journal(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(self.shelf().journals.get(name).cloned())
    }

    fn drafts(&self) -> Result<Vec<String>, StoreError> {
        let shelf = self.shelf();
        let names: BTreeSet<&String> = shelf.partials.keys().chain(shelf.journals.keys()).collect();
        Ok(names.into_iter().cloned().collect())
    }

    fn discard(&self, name: &str) -> Result<(), StoreError> {
        let mut shelf = self.shelf();
        shelf.partials.remove(name);
        shelf.journals.remove(name);
        Ok(())
    }

    fn read(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        Ok(self.shelf().files.get(name).map(|cells| Arc::clone(cells) as Arc<dyn Bytes>))
    }

    fn write_note(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.shelf().notes.insert(name.to_owned(), bytes.to_vec());
        Ok(())
    }

    fn read_note(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        Ok(self.shelf().notes.get(name).cloned())
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        let mut shelf = self.shelf();
        shelf.files.remove(name);
        shelf.notes.remove(name);
        Ok(())
    }

    fn sync_names(&self) -> Result<(), StoreError> {
        Ok(())
    }
}

#[derive(Debug)]
struct Held(MemoryStore);

impl Lock for Held {}

impl Drop for Held {
    fn drop(&mut self) {
        self.0.shelf().locked = false;
    }
}

#[derive(Debug)]
struct Entries {
    store: MemoryStore,
    name: String,
}

impl Log for Entries {
    fn append(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        // Gone if it was discarded, as an unlinked file would be.
        if let Some(journal) = self.store.shelf().journals.get_mut(&self.name) {
            journal.extend_from_slice(bytes);
        }
        Ok(())
    }
}

#[derive(Debug)]
struct Growing {
    store: MemoryStore,
    name: String,
    cells: Arc<Cells>,
    outlives: bool,
}

impl MemoryStore {
    fn growing(&self, name: &str, cells: Cells, outlives: bool) -> Box<dyn Partial> {
        let cells = Arc::new(cells);
        self.shelf().partials.insert(name.to_owned(), Arc::clone(&cells));
        Box::new(Growing { store: self.clone(), name: name.to_owned(), cells, outlives })
    }
}

impl Partial for Growing {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), StoreError> {
        self.cells.write_at(offset as usize, bytes);
        Ok(())
    }

    fn shared(&mut self) -> Result<Arc<dyn Bytes>, StoreError> {
        Ok(Arc::clone(&self.cells) as Arc<dyn Bytes>)
    }

    fn outlive(&mut self) {
        self.outlives = true;
    }

    fn freeze(self: Box<Self>) -> Box<dyn Publish> {
        self
    }
}

impl Publish for Growing {
    fn publish(self: Box<Self>) -> Result<(), StoreError> {
        let mut shelf = self.store.shelf();
        shelf.files.insert(self.name.clone(), Arc::clone(&self.cells));
        shelf.journals.remove(&self.name);
        Ok(())
    }
}

impl Drop for Growing {
    fn drop(&mut self) {
        let mut shelf = self.store.shelf();
        let own = |found: &Arc<Cells>| Arc::ptr_eq(found, &self.cells);
        let published = shelf.files.get(&self.name).is_some_and(own);
        if (published || !self.outlives) && shelf.partials.get(&self.name).is_some_and(own) {
            shelf.partials.remove(&self.name);
        }
    }
}
