//! Where artifacts live: a folder of files, or memory.
//!
//! A store knows names and bytes and nothing of what they mean: [`crate::Writer`] and
//! [`crate::Container`] work on any store alike, and a store that fails on purpose can stand in
//! for a faulty disk.

use crate::{Container, StoreError};
use std::fmt::Debug;
use std::sync::Arc;

/// Whether a file must survive a power cut before it counts as written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Durability {
    /// Synced to the disk: survives a power cut.
    #[default]
    Durable,
    /// Handed to the operating system: survives a kill, not a power cut.
    Fast,
}

/// A file's bytes, mapped or in memory.
///
/// What was written before the bytes were asked for is never changed while they are held; of a
/// file that is still being written, the rest may change under the reader and means nothing.
pub trait Bytes: Send + Sync + Debug {
    /// All bytes, aligned to 8.
    fn bytes(&self) -> &[u8];
}

/// Held while a store is written to; freed when dropped, or by the system if the process dies.
pub trait Lock: Send + Debug {}

/// A file being written, of known length, not yet visible under its name.
///
/// Dropped, it leaves nothing behind unless it was told to [outlive](Partial::outlive) its writer.
pub trait Partial: Send + Debug {
    /// Writes at an offset; pieces come in any order and never overlap.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), StoreError>;

    /// All bytes, for readers in this process, now and while the writing goes on.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn shared(&mut self) -> Result<Arc<dyn Bytes>, StoreError>;

    /// Lets the file stay if the writing is given up: its journal says what of it can be used.
    fn outlive(&mut self);

    /// Ends the writing: the handle that makes the file visible to all.
    fn freeze(self: Box<Self>) -> Box<dyn Publish>;
}

/// A file to which entries are appended.
pub trait Log: Send + Debug {
    /// Adds bytes at the end.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn append(&mut self, bytes: &[u8]) -> Result<(), StoreError>;
}

/// A file that is whole but not yet visible.
pub trait Publish: Send + Debug {
    /// Syncs the file as the store's [`Durability`] asks, gives it its name and removes its
    /// journal. Durable only after [`Store::sync_names`].
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn publish(self: Box<Self>) -> Result<(), StoreError>;
}

/// Named files that are whole or not there.
pub trait Store: Send + Sync + Debug {
    /// How messages call the file of this name.
    fn describe(&self, name: &str) -> String;

    /// Takes the store for writing.
    ///
    /// # Errors
    /// [`StoreError::Locked`] if another has it, [`StoreError::Io`].
    fn lock(&self) -> Result<Box<dyn Lock>, StoreError>;

    /// Names of all whole artifacts, sorted.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn names(&self) -> Result<Vec<String>, StoreError>;

    /// Starts a file of `length` zero bytes, with the space set aside.
    ///
    /// # Errors
    /// [`StoreError::Io`], among others for a full disk.
    fn create(&self, name: &str, length: u64) -> Result<Box<dyn Partial>, StoreError>;

    /// Goes on with the unfinished file that an earlier writer left under this name; `None` if
    /// there is none, or one of another length.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn reopen(&self, name: &str, length: u64) -> Result<Option<Box<dyn Partial>>, StoreError>;

    /// The bytes of an unfinished file as they stand, for looking at; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn read_partial(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError>;

    /// Opens the journal of an unfinished file after its first `keep` bytes; makes one where
    /// there is none.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn journal(&self, name: &str, keep: u64) -> Result<Box<dyn Log>, StoreError>;

    /// The journal of an unfinished file; `None` if there is none.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn read_journal(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// Names of artifacts of which there is an unfinished file or a journal, sorted.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn drafts(&self) -> Result<Vec<String>, StoreError>;

    /// Removes the unfinished file of this name and its journal, where they are.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn discard(&self, name: &str) -> Result<(), StoreError>;

    /// The bytes of a whole file; `None` if there is none of that name.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn read(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError>;

    /// Writes a small file beside the artifacts, whole or not at all.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn write_note(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError>;

    /// Reads a small file; `None` if there is none of that name.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn read_note(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// Removes a file if it is there.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn remove(&self, name: &str) -> Result<(), StoreError>;

    /// Makes all names given so far durable.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    fn sync_names(&self) -> Result<(), StoreError>;
}

impl dyn Store + '_ {
    /// Header and footer of an artifact, its rows unread; `None` if there is none of that name.
    ///
    /// # Errors
    /// [`StoreError::Damaged`], [`StoreError::Io`].
    pub fn peek(&self, name: &str) -> Result<Option<Container>, StoreError> {
        let bytes = self.read(name)?;
        bytes.map(|b| Container::new(self.describe(name), b)).transpose()
    }

    /// An artifact with all its rows verified.
    ///
    /// # Errors
    /// [`StoreError::Missing`], [`StoreError::Damaged`], [`StoreError::Io`].
    pub fn open(&self, name: &str) -> Result<Arc<Container>, StoreError> {
        let missing = || StoreError::Missing { file: self.describe(name) };
        let container = self.peek(name)?.ok_or_else(missing)?;
        container.verify()?;
        Ok(Arc::new(container))
    }
}
