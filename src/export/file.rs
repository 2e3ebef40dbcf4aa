//! Exports as files: whole or not there.

use crate::npz_reader::{NpzError, NpzSurface, read_npz};
use crate::{ExportError, Format, Options, write};
use isospline_artifact::kinds::PatchesView;
use isospline_artifact::{Durability, write_file_atomic};
use std::io;
use std::path::{Path, PathBuf};

/// Writes `patches` to the file `path`, which is replaced only by a whole export; where `path` is
/// a symbolic link, the file that it leads to.
///
/// # Errors
/// [`ExportError`]; the file is then as it was before.
pub fn write_file(
    format: Format,
    patches: &PatchesView<'_>,
    options: &Options,
    path: &Path,
) -> Result<(), ExportError> {
    let path = replaceable(path)?;
    let mut refused = None;
    let done = write_file_atomic(&path, Durability::Fast, |out| {
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

/// Where the file itself is, links followed; devices, pipes and folders are refused.
fn replaceable(path: &Path) -> Result<PathBuf, ExportError> {
    let refuse = |what| Err(ExportError::NotRegular { what });
    match std::fs::metadata(path) {
        Ok(data) if data.is_file() => Ok(std::fs::canonicalize(path)?),
        Ok(data) if data.is_dir() => refuse("a folder"),
        Ok(_) => refuse("a device or a pipe"),
        Err(_) if path.is_symlink() => refuse("a link that leads nowhere"),
        // Whatever else is the matter, writing says it better.
        Err(_) => Ok(path.to_owned()),
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

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_what_is_no_file_is_left_alone() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let patches = sample::ball_and_ring();
        let write =
            |name: &str| write_file(Format::Npz, &patches.view(), &Options::default(), &at(name));
        write("file").unwrap();
        symlink(at("file"), at("link")).unwrap();
        symlink("/dev/null", at("device")).unwrap();
        symlink(at("nothing"), at("lost")).unwrap();
        std::fs::create_dir(at("folder")).unwrap();
        write("link").unwrap();
        assert!(at("link").is_symlink() && !at("file").is_symlink());
        for name in ["device", "lost", "folder"] {
            let refused = write(name);
            assert!(matches!(refused, Err(ExportError::NotRegular { .. })), "{name}: {refused:?}");
        }
        assert!(at("device").is_symlink() && at("lost").is_symlink());
    }

    #[test]
    fn a_missing_file_is_an_error_of_the_file_system() {
        let missing = read_npz_file(Path::new("no/such/surface.npz"));
        assert!(matches!(missing, Err(NpzError::Io(_))), "{missing:?}");
    }
}
