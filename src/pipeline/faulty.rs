//! A store in memory whose k-th operation fails.

use isospline_artifact::store::{Log, Partial, Publish};
use isospline_artifact::{Bytes, Lock, MemoryStore, Store, StoreError};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Operations until one fails; all before and after it succeed.
#[derive(Clone, Debug)]
struct Fuse(Arc<AtomicUsize>);

impl Fuse {
    fn burn(&self, action: &'static str, name: &str) -> Result<(), StoreError> {
        // Wraps around after the fault, and never comes to one again.
        if self.0.fetch_sub(1, Ordering::Relaxed) == 1 {
            return Err(StoreError::io(action, name)(io::Error::other("injected")));
        }
        Ok(())
    }
}

/// Wraps a [`MemoryStore`], which keeps what was stored before the fault.
#[derive(Debug)]
pub(crate) struct FaultyStore {
    inner: MemoryStore,
    fuse: Fuse,
}

impl FaultyStore {
    /// Fails at operation `k`, counted from 1.
    pub(crate) fn new(inner: MemoryStore, k: usize) -> Self {
        Self { inner, fuse: Fuse(Arc::new(AtomicUsize::new(k))) }
    }
}

impl FaultyStore {
    fn faulty<T: ?Sized>(&self, name: &str, inner: Box<T>) -> Faulty<T> {
        Faulty { name: name.to_owned(), fuse: self.fuse.clone(), inner }
    }
}

impl Store for FaultyStore {
    fn describe(&self, name: &str) -> String {
        self.inner.describe(name)
    }

    fn lock(&self) -> Result<Box<dyn Lock>, StoreError> {
        self.fuse.burn("lock", "")?;
        self.inner.lock()
    }

    fn names(&self) -> Result<Vec<String>, StoreError> {
        self.fuse.burn("list", "")?;
        self.inner.names()
    }

    fn create(&self, name: &str, length: u64) -> Result<Box<dyn Partial>, StoreError> {
        self.fuse.burn("create", name)?;
        let inner = self.inner.create(name, length)?;
        Ok(Box::new(self.faulty(name, inner)))
    }

    fn reopen(&self, name: &str, length: u64) -> Result<Option<Box<dyn Partial>>, StoreError> {
        self.fuse.burn("open", name)?;
        let inner = self.inner.reopen(name, length)?;
        Ok(inner.map(|inner| Box::new(self.faulty(name, inner)) as Box<dyn Partial>))
    }

    fn read_partial(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        self.fuse.burn("read", name)?;
        self.inner.read_partial(name)
    }

    fn journal(&self, name: &str, keep: u64) -> Result<Box<dyn Log>, StoreError> {
        self.fuse.burn("open", name)?;
        let inner = self.inner.journal(name, keep)?;
        Ok(Box::new(self.faulty(name, inner)))
    }

    fn read_journal(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.fuse.burn("read", name)?;
        self.inner.read_journal(name)
    }

    fn drafts(&self) -> Result<Vec<String>, StoreError> {
        self.fuse.burn("list", "")?;
        self.inner.drafts()
    }

    fn discard(&self, name: &str) -> Result<(), StoreError> {
        self.fuse.burn("remove", name)?;
        self.inner.discard(name)
    }

    fn read(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        self.fuse.burn("read", name)?;
        self.inner.read(name)
    }

    fn write_note(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.fuse.burn("write", name)?;
        self.inner.write_note(name, bytes)
    }

    fn read_note(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.fuse.burn("read", name)?;
        self.inner.read_note(name)
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        self.fuse.burn("remove", name)?;
        self.inner.remove(name)
    }

    fn sync_names(&self) -> Result<(), StoreError> {
        self.fuse.burn("sync", "")?;
        self.inner.sync_names()
    }
}

#[derive(Debug)]
struct Faulty<T: ?Sized> {
    name: String,
    fuse: Fuse,
    inner: Box<T>,
}

impl Partial for Faulty<dyn Partial> {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), StoreError> {
        self.fuse.burn("write", &self.name)?;
        self.inner.write_at(offset, bytes)
    }

    fn shared(&mut self) -> Result<Arc<dyn Bytes>, StoreError> {
        self.fuse.burn("map", &self.name)?;
        self.inner.shared()
    }

    fn outlive(&mut self) {
        self.inner.outlive();
    }

    fn freeze(self: Box<Self>) -> Box<dyn Publish> {
        Box::new(Faulty { name: self.name, fuse: self.fuse, inner: self.inner.freeze() })
    }
}

impl Log for Faulty<dyn Log> {
    fn append(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        self.fuse.burn("write", &self.name)?;
        self.inner.append(bytes)
    }
}

impl Publish for Faulty<dyn Publish> {
    fn publish(self: Box<Self>) -> Result<(), StoreError> {
        self.fuse.burn("rename", &self.name)?;
        self.inner.publish()
    }
}
