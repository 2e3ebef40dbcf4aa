//! Files of a folder that are being written: an artifact before it has its name, and its journal.

use super::{Mapped, map};
use crate::store::{Log, Partial, Publish};
use crate::{Bytes, Durability, StoreError};
use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Debug)]
pub(super) struct Entries {
    pub(super) file: File,
    pub(super) path: PathBuf,
}

impl Log for Entries {
    fn append(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        self.file.write_all(bytes).map_err(StoreError::io("write", &self.path))
    }
}

/// Names of a file in the making; removes it if it is dropped before it got its final name.
#[derive(Debug)]
pub(super) struct Draft {
    pub(super) path: PathBuf,
    pub(super) journal: PathBuf,
    pub(super) target: PathBuf,
    pub(super) durability: Durability,
    /// Stays when dropped, or has its final name.
    pub(super) outlives: bool,
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.outlives {
            // What cannot be removed is overwritten by the next run and never taken for whole.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[derive(Debug)]
pub(super) struct Growing {
    pub(super) file: File,
    pub(super) draft: Draft,
    pub(super) map: Option<Arc<Mapped>>,
}

impl Partial for Growing {
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), StoreError> {
        write_all_at(&self.file, bytes, offset).map_err(StoreError::io("write", &self.draft.path))
    }

    fn shared(&mut self) -> Result<Arc<dyn Bytes>, StoreError> {
        let map = match &self.map {
            Some(map) => map,
            None => self.map.insert(Arc::new(map(&self.file, &self.draft.path)?)),
        };
        Ok(Arc::clone(map) as Arc<dyn Bytes>)
    }

    fn outlive(&mut self) {
        self.draft.outlives = true;
    }

    fn freeze(self: Box<Self>) -> Box<dyn Publish> {
        self
    }
}

impl Publish for Growing {
    fn publish(mut self: Box<Self>) -> Result<(), StoreError> {
        if self.draft.durability == Durability::Durable {
            self.file.sync_all().map_err(StoreError::io("sync", &self.draft.path))?;
        }
        let renamed = std::fs::rename(&self.draft.path, &self.draft.target);
        renamed.map_err(StoreError::io("rename", &self.draft.path))?;
        self.draft.outlives = true;
        // A journal without its file says nothing; the next run removes it.
        let _ = std::fs::remove_file(&self.draft.journal);
        Ok(())
    }
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], offset: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::write_all_at(file, bytes, offset)
}

#[cfg(not(unix))]
fn write_all_at(mut file: &File, bytes: &[u8], offset: u64) -> std::io::Result<()> {
    use std::io::{Seek, SeekFrom, Write};
    file.seek(SeekFrom::Start(offset))?;
    file.write_all(bytes)
}

/// Reserves the file's blocks, so that a full disk shows before the work and not after it.
pub(super) fn set_aside(file: &File, length: u64) -> std::io::Result<()> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{FallocateFlags, fallocate};
        use rustix::io::Errno;
        loop {
            match fallocate(file, FallocateFlags::empty(), 0, length) {
                Err(Errno::INTR) => {}
                Err(Errno::OPNOTSUPP | Errno::NOSYS) => break,
                done => return Ok(done?),
            }
        }
    }
    file.set_len(length)
}
