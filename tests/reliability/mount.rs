//! File systems of a test's own.

use crate::reliability::process::{done, is_root};
use std::path::{Path, PathBuf};

/// A mounted file system; unmounted at the end.
#[derive(Debug)]
pub(crate) struct Mount {
    path: PathBuf,
}

impl Mount {
    /// Memory of so many bytes and files: `size=20k,nr_inodes=4`.
    ///
    /// # Errors
    /// What `mount` said.
    pub(crate) fn memory(path: &Path, options: &str) -> Result<Self, String> {
        std::fs::create_dir_all(path).map_err(|error| error.to_string())?;
        let at = path.display().to_string();
        done("mount", &["-t", "tmpfs", "-o", options, "isospline-test", &at])?;
        Ok(Self { path: path.to_owned() })
    }

    /// Why nothing can be mounted here, if so: only root may, and not in every container.
    pub(crate) fn missing() -> Option<String> {
        if !is_root() {
            return Some("not root".to_owned());
        }
        let folder = tempfile::tempdir().ok()?;
        Self::memory(folder.path(), "size=8k").err()
    }

    /// An image file.
    ///
    /// # Errors
    /// What `mount` said.
    pub(crate) fn image(image: &Path, path: &Path) -> Result<Self, String> {
        std::fs::create_dir_all(path).map_err(|error| error.to_string())?;
        let (from, at) = (image.display().to_string(), path.display().to_string());
        done("mount", &["-o", "loop", &from, &at])?;
        Ok(Self { path: path.to_owned() })
    }

    /// Mounts it again with other options.
    ///
    /// # Errors
    /// What `mount` said.
    pub(crate) fn remount(&self, options: &str) -> Result<(), String> {
        let at = self.path.display().to_string();
        done("mount", &["-o", &format!("remount,{options}"), &at])
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        // Lazily, if a killed process still holds it: a test must not leave mounts behind.
        let at = self.path.display().to_string();
        if done("umount", &[&at]).is_err() {
            let _ = done("umount", &["-l", &at]);
        }
    }
}
