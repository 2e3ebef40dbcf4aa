//! Exports as files: whole or not there.

use crate::npz_reader::{NpzError, NpzSurface, read_npz};
use crate::{ExportError, Format, Options, write};
use isospline_artifact::kinds::PatchesView;
use isospline_artifact::{Durability, write_file_atomic};
use std::io;
use std::path::Path;

/// Writes `patches` to the file `path`, which is replaced only by a whole export.
///
/// # Errors
/// [`ExportError`]; the file is then as it was before.
pub fn write_file(
    format: Format,
    patches: &PatchesView<'_>,
    options: &Options,
    path: &Path,
) -> Result<(), ExportError> {
    let mut refused = None;
    let done = write_file_atomic(path, Durability::Fast, |out| {
        write(format, patches, options, out).map_err(|error| match error {
            ExportError::Io(io) => io,
            other => {
                let stop = io::Error::other(other.to_string());
                refused = Some(other);
                stop
            }
        })
    });
    match refused {
        Some(error) => Err(error),
        None => Ok(done?),
    }
}

/// Reads the surface of an npz file that [`write_file`] or numpy wrote.
///
/// # Errors
/// [`NpzError`].
#[expect(clippy::disallowed_methods, reason = "export owns the files of foreign formats")]
pub fn read_npz_file(path: &Path) -> Result<NpzSurface, NpzError> {
    let mut file = std::fs::OpenOptions::new().read(true).open(path)?;
    read_npz(&mut file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn a_refused_export_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("surface.npz");
        let patches = sample::ball_and_ring();
        write_file(Format::Npz, &patches.view(), &Options::default(), &path).unwrap();
        let mut broken = patches.clone();
        broken.face[0][0] = 999;
        let refused = write_file(Format::Npz, &broken.view(), &Options::default(), &path);
        assert!(matches!(refused, Err(ExportError::Incoherent { row: 0, .. })), "{refused:?}");
        assert_eq!(read_npz_file(&path).unwrap().faces, patches.face);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_file_is_an_error_of_the_file_system() {
        let missing = read_npz_file(Path::new("no/such/surface.npz"));
        assert!(matches!(missing, Err(NpzError::Io(_))), "{missing:?}");
    }
}
