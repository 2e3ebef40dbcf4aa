//! A store in a folder: one file an artifact, mapped for reading.

#![expect(clippy::disallowed_methods, reason = "artifact files are opened here")]

mod growing;

use crate::commit::{replace_file, sync_folder};
use crate::store::{Log, Partial};
use crate::{Bytes, Durability, Lock, Store, StoreError};
use growing::{Draft, Entries, Growing, set_aside};
use memmap2::Mmap;
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Suffix of artifact files.
pub const SUFFIX: &str = ".isos";
/// Appended to the name of a file that is being written.
const PARTIAL: &str = ".partial";
/// Appended to its name for the journal of its rows.
const JOURNAL: &str = ".journal";
const LOCK: &str = ".lock";

/// Artifacts of one model in one folder.
#[derive(Clone, Debug)]
pub struct FolderStore {
    folder: PathBuf,
    durability: Durability,
}

impl FolderStore {
    /// The store in `folder`; the folder is made when the store is first locked.
    pub fn new(folder: impl Into<PathBuf>, durability: Durability) -> Self {
        Self { folder: folder.into(), durability }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of this name.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }
}

impl Store for FolderStore {
    fn describe(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    fn lock(&self) -> Result<Box<dyn Lock>, StoreError> {
        let made = std::fs::create_dir_all(&self.folder);
        made.map_err(StoreError::io("create", &self.folder))?;
        let path = self.path(LOCK);
        let mut options = OpenOptions::new();
        let file = options.create(true).truncate(false).write(true).open(&path);
        let file = file.map_err(StoreError::io("open", &path))?;
        match file.try_lock() {
            Ok(()) => Ok(Box::new(Held { _file: file })),
            Err(TryLockError::WouldBlock) => Err(StoreError::Locked { path: self.folder.clone() }),
            Err(TryLockError::Error(e)) => Err(StoreError::io("lock", path)(e)),
        }
    }

    fn names(&self) -> Result<Vec<String>, StoreError> {
        let all = self.entries()?.into_iter();
        Ok(all.filter(|name| name.ends_with(SUFFIX)).collect())
    }

    fn create(&self, name: &str, length: u64) -> Result<Box<dyn Partial>, StoreError> {
        let path = self.draft(name, PARTIAL);
        let mut options = OpenOptions::new();
        let file = options.create(true).truncate(true).read(true).write(true).open(&path);
        let file = file.map_err(StoreError::io("create", &path))?;
        let growing = self.growing(name, file);
        set_aside(&growing.file, length).map_err(StoreError::io("set aside space for", path))?;
        Ok(Box::new(growing))
    }

    fn reopen(&self, name: &str, length: u64) -> Result<Option<Box<dyn Partial>>, StoreError> {
        let path = self.draft(name, PARTIAL);
        let file = match OpenOptions::new().read(true).write(true).open(&path) {
            Ok(file) => file,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(StoreError::io("open", path)(e)),
        };
        if file.metadata().map_err(StoreError::io("read", path))?.len() != length {
            return Ok(None);
        }
        let mut growing = self.growing(name, file);
        growing.draft.outlives = true;
        Ok(Some(Box::new(growing)))
    }

    fn read_partial(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        mapped(&self.draft(name, PARTIAL))
    }

    fn journal(&self, name: &str, keep: u64) -> Result<Box<dyn Log>, StoreError> {
        let path = self.draft(name, JOURNAL);
        let mut options = OpenOptions::new();
        let file = options.create(true).append(true).open(&path);
        let file = file.map_err(StoreError::io("open", &path))?;
        file.set_len(keep).map_err(StoreError::io("cut", &path))?;
        Ok(Box::new(Entries { file, path }))
    }

    fn read_journal(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        read_if_there(&self.draft(name, JOURNAL))
    }

    fn drafts(&self) -> Result<Vec<String>, StoreError> {
        let name = |entry: String| {
            let stem = entry.strip_suffix(PARTIAL).or_else(|| entry.strip_suffix(JOURNAL));
            stem.filter(|stem| stem.ends_with(SUFFIX)).map(str::to_owned)
        };
        let names: BTreeSet<String> = self.entries()?.into_iter().filter_map(name).collect();
        Ok(names.into_iter().collect())
    }

    fn discard(&self, name: &str) -> Result<(), StoreError> {
        self.remove(&format!("{name}{JOURNAL}"))?;
        self.remove(&format!("{name}{PARTIAL}"))
    }

    fn read(&self, name: &str) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
        mapped(&self.path(name))
    }

    fn write_note(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        replace_file(&self.path(name), self.durability, |out| out.write_all(bytes))
    }

    fn read_note(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        read_if_there(&self.path(name))
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        let path = self.path(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(StoreError::io("remove", path)(e)),
            _ => Ok(()),
        }
    }

    fn sync_names(&self) -> Result<(), StoreError> {
        match self.durability {
            Durability::Durable => sync_folder(&self.folder),
            Durability::Fast => Ok(()),
        }
    }
}

impl FolderStore {
    /// Names of all files, sorted; none if there is no folder.
    fn entries(&self) -> Result<Vec<String>, StoreError> {
        let failed = || StoreError::io("list", &self.folder);
        let entries = match read_folder(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(failed()(e)),
        };
        let mut names = Vec::new();
        for entry in entries {
            let name = entry.map_err(failed())?.file_name();
            names.extend(name.to_str().map(str::to_owned));
        }
        names.sort();
        Ok(names)
    }

    fn draft(&self, name: &str, suffix: &str) -> PathBuf {
        self.path(&format!("{name}{suffix}"))
    }

    fn growing(&self, name: &str, file: File) -> Growing {
        let draft = Draft {
            path: self.draft(name, PARTIAL),
            journal: self.draft(name, JOURNAL),
            target: self.path(name),
            durability: self.durability,
            outlives: false,
        };
        Growing { file, draft, map: None }
    }
}

/// Opens a folder; the library tries again after a signal for files, but not for folders.
fn read_folder(path: &Path) -> std::io::Result<std::fs::ReadDir> {
    loop {
        match std::fs::read_dir(path) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}

fn mapped(path: &Path) -> Result<Option<Arc<dyn Bytes>>, StoreError> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(StoreError::io("open", path)(e)),
    };
    Ok(Some(Arc::new(map(&file, path)?)))
}

fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>, StoreError> {
    match std::fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(StoreError::io("read", path)(e)),
    }
}

/// The lock is the open file: the system frees it when the process ends, however it ends.
#[derive(Debug)]
struct Held {
    _file: File,
}

impl Lock for Held {}

/// A mapped file; `None` for an empty one, which cannot be mapped.
#[derive(Debug)]
struct Mapped(Option<Mmap>);

impl Bytes for Mapped {
    fn bytes(&self) -> &[u8] {
        self.0.as_deref().unwrap_or(&[])
    }
}

#[expect(unsafe_code, reason = "mapping a file is unsafe: others could change it")]
fn map(file: &File, path: &Path) -> Result<Mapped, StoreError> {
    let length = file.metadata().map_err(StoreError::io("read", path))?.len();
    if length == 0 {
        return Ok(Mapped(None));
    }
    // SAFETY: a file with its final name is never written again, only replaced by rename, which
    // leaves the mapped inode as it is. A partial file keeps its length, is written only through
    // `Growing::write_at`, by one writer, and the model folder's lock keeps other processes away;
    // of its rows a reader looks only at those whose writing happened before it was given them:
    // the pipeline starts a task when the tasks that write the rows it names have reported, through
    // a channel, that they did, and the contract suite of stages poisons all other rows. Every bit
    // pattern is a valid row. Gain: rows are read from the page cache without a copy, a stage runs
    // behind the one before it, and artifacts larger than memory can be used.
    let map = unsafe { Mmap::map(file) };
    map.map(|m| Mapped(Some(m))).map_err(StoreError::io("map", path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MemoryStore;
    use crate::kinds::VertexSystems;
    use crate::writer::tests::{counting, identity, stored, write};

    fn folder() -> (tempfile::TempDir, FolderStore) {
        let folder = tempfile::tempdir().unwrap();
        let store = FolderStore::new(folder.path().join("a model"), Durability::Durable);
        drop(store.lock().unwrap());
        (folder, store)
    }

    fn files(store: &FolderStore) -> Vec<String> {
        let entries = std::fs::read_dir(store.folder()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn folder_and_memory_hold_the_same_bytes() {
        let (_folder, store) = folder();
        let rows = counting(100);
        let sealed = write(&store, "a.isos", &identity(), &rows);
        assert!(store.names().unwrap().is_empty(), "not visible before it is published");
        sealed.publish().unwrap();
        store.sync_names().unwrap();
        let found = store.read("a.isos").unwrap().unwrap();
        assert_eq!(found.bytes(), stored(&rows).1);
        assert_eq!(store.names().unwrap(), ["a.isos"]);
        assert_eq!(files(&store), [".lock", "a.isos"]);
    }

    #[test]
    fn a_writer_that_is_dropped_leaves_nothing() {
        let (_folder, store) = folder();
        drop(write(&store, "a.isos", &identity(), &counting(3)));
        assert_eq!(files(&store), [".lock"]);
    }

    #[test]
    fn a_partial_file_of_a_killed_run_is_not_taken_for_whole() {
        let (_folder, store) = folder();
        let killed = write(&store, "a.isos", &identity(), &counting(3));
        std::mem::forget(killed);
        assert_eq!(files(&store), [".lock", "a.isos.partial"]);
        assert!(store.names().unwrap().is_empty());
        assert!((&store as &dyn Store).peek("a.isos").unwrap().is_none());
        write(&store, "a.isos", &identity(), &counting(9)).publish().unwrap();
        assert_eq!(files(&store), [".lock", "a.isos"]);
        let container = (&store as &dyn Store).open("a.isos").unwrap();
        assert_eq!(container.view::<VertexSystems>().unwrap().twist.len(), 9);
    }

    #[test]
    fn readers_keep_the_file_that_a_new_one_replaces() {
        let (_folder, store) = folder();
        write(&store, "a.isos", &identity(), &counting(3)).publish().unwrap();
        let old = (&store as &dyn Store).open("a.isos").unwrap();
        write(&store, "a.isos", &identity(), &counting(9)).publish().unwrap();
        old.verify().unwrap();
        assert_eq!(old.view::<VertexSystems>().unwrap().twist.len(), 3);
    }

    #[test]
    fn a_store_has_one_owner_at_a_time() {
        let (_folder, store) = folder();
        let memory = MemoryStore::new();
        for store in [&store as &dyn Store, &memory] {
            let held = store.lock().unwrap();
            let second = store.lock().unwrap_err();
            assert!(matches!(second, StoreError::Locked { .. }), "{second}");
            drop(held);
            store.lock().unwrap();
        }
    }

    #[test]
    fn notes_are_replaced_as_a_whole() {
        let (_folder, store) = folder();
        let memory = MemoryStore::new();
        for store in [&store as &dyn Store, &memory] {
            assert_eq!(store.read_note("a.json").unwrap(), None);
            store.write_note("a.json", b"long text").unwrap();
            store.write_note("a.json", b"text").unwrap();
            assert_eq!(store.read_note("a.json").unwrap().unwrap(), b"text");
            store.remove("a.json").unwrap();
            store.remove("a.json").unwrap();
            assert_eq!(store.read_note("a.json").unwrap(), None);
        }
    }

    #[test]
    fn what_is_not_a_file_is_an_error_with_its_path() {
        let (_folder, store) = folder();
        std::fs::create_dir(store.path("a.isos")).unwrap();
        let failed = (&store as &dyn Store).open("a.isos").unwrap_err();
        assert!(failed.to_string().contains("a.isos"), "{failed}");
        let sealed = write(&store, "a.isos", &identity(), &counting(3));
        let failed = sealed.publish().unwrap_err();
        assert!(failed.to_string().contains("cannot rename"), "{failed}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn space_is_set_aside_before_the_first_row() {
        use std::os::unix::fs::MetadataExt;
        let (_folder, store) = folder();
        let partial = store.create("big.isos", 1 << 20).unwrap();
        let metadata = std::fs::metadata(store.path("big.isos.partial")).unwrap();
        assert_eq!(metadata.len(), 1 << 20);
        assert!(512 * metadata.blocks() >= 1 << 20, "{} blocks", metadata.blocks());
        drop(partial);
    }
}
