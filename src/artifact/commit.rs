//! Files that are whole or not there: temporary file beside the target, sync, rename.

use crate::{Durability, StoreError};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file through `write`; at every moment `path` holds the old file, the new one, or, if
/// there was none, nothing.
///
/// # Errors
/// [`StoreError::Io`] with the path; nothing is left behind.
pub fn write_file_atomic(
    path: &Path,
    durability: Durability,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), StoreError> {
    replace_file(path, durability, write)?;
    if durability == Durability::Durable {
        sync_folder(&folder_of(path))?;
    }
    Ok(())
}

/// [`write_file_atomic`] without the sync of the folder: many files can share one.
pub(crate) fn replace_file(
    path: &Path,
    durability: Durability,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), StoreError> {
    let folder = folder_of(path);
    let failed = |action| StoreError::io(action, path);
    let mut temporary = temporary_beside(&folder).map_err(StoreError::io("write to", &folder))?;
    let mut buffer = BufWriter::with_capacity(1 << 16, temporary.as_file_mut());
    write(&mut buffer).map_err(failed("write"))?;
    buffer.flush().map_err(failed("write"))?;
    drop(buffer);
    if durability == Durability::Durable {
        temporary.as_file().sync_all().map_err(failed("sync"))?;
    }
    temporary.persist(path).map_err(|e| failed("replace")(e.error))?;
    Ok(())
}

/// Syncs a folder, so that the names in it survive a power cut.
///
/// # Errors
/// [`StoreError::Io`].
pub fn sync_folder(folder: &Path) -> Result<(), StoreError> {
    // Only unix can open a folder; elsewhere the rename itself is as durable as it gets.
    if cfg!(unix) {
        let synced = File::open(folder).and_then(|f| f.sync_all());
        synced.map_err(StoreError::io("sync", folder))?;
    }
    Ok(())
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

fn temporary_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".isospline-").suffix(".tmp");
    // A temporary file is private by default; what is kept gets the user's usual mode.
    #[cfg(unix)]
    let mode = <std::fs::Permissions as std::os::unix::fs::PermissionsExt>::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(mode);
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_file_atomic(&path, Durability::Durable, |out| out.write_all(b"old")).unwrap();
        let failed = write_file_atomic(&path, Durability::Durable, |out| {
            out.write_all(b"new")?;
            Err(io::Error::other("no more"))
        });
        assert!(failed.unwrap_err().to_string().contains("a.txt"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("none").join("a.txt");
        let failed = write_file_atomic(&path, Durability::Fast, |_| Ok(()));
        assert!(failed.unwrap_err().to_string().contains("none"));
    }
}
