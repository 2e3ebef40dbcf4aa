//! A store in memory: the same containers without files.

use crate::store::{Frozen, Partial, Publish};
use crate::{Bytes, Lock, Store, StoreError};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Artifacts of this process alone; clones share them.
#[derive(Clone, Debug, Default)]
pub struct MemoryStore {
    shelf: Arc<Mutex<Shelf>>,
}

#[derive(Debug, Default)]
struct Shelf {
    files: BTreeMap<String, Arc<Words>>,
    notes: BTreeMap<String, Vec<u8>>,
    locked: bool,
}

/// Bytes in memory aligned to 8.
#[derive(Clone, Debug)]
pub struct Words {
    words: Vec<u64>,
    length: usize,
}

impl Words {
    /// A copy of `bytes`.
    pub fn copy_of(bytes: &[u8]) -> Self {
        let mut out = Self::zeros(bytes.len());
        out.bytes_mut().copy_from_slice(bytes);
        out
    }

    fn zeros(length: usize) -> Self {
        Self { words: vec![0; length.div_ceil(8)], length }
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.words)[..self.length]
    }
}

impl Bytes for Words {
    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.length]
    }
}

impl MemoryStore {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    /// Puts a file of any bytes under `name`, as a disk could.
    pub fn put(&self, name: &str, bytes: &[u8]) {
        self.shelf().files.insert(name.to_owned(), Arc::new(Words::copy_of(bytes)));
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
        let words = Words::zeros(length as usize);
        Ok(Box::new(Growing { store: self.clone(), name: name.to_owned(), words }))
    }

    fn read(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        Ok(self.shelf().files.get(name).map(|words| Arc::clone(words) as Arc<dyn Bytes>))
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
struct Growing {
    store: MemoryStore,
    name: String,
    words: Words,
}

impl Partial for Growing {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let offset = offset as usize;
        self.words.bytes_mut()[offset..offset + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }

    fn bytes(&mut self) -> Result<&[u8], StoreError> {
        Ok(self.words.bytes())
    }

    fn freeze(self: Box<Self>) -> Result<Frozen, StoreError> {
        let words = Arc::new(self.words);
        let ready = Ready { store: self.store, name: self.name, words: Arc::clone(&words) };
        Ok(Frozen { bytes: words, publish: Box::new(ready) })
    }
}

#[derive(Debug)]
struct Ready {
    store: MemoryStore,
    name: String,
    words: Arc<Words>,
}

impl Publish for Ready {
    fn publish(self: Box<Self>) -> Result<(), StoreError> {
        self.store.shelf().files.insert(self.name, self.words);
        Ok(())
    }
}
