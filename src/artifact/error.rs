//! What can go wrong with a stored artifact.

use std::io;
use std::path::PathBuf;

/// Why a store cannot do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The operating system refused.
    #[error("cannot {action} {path:?}: {source}")]
    Io {
        /// What was tried, as a verb.
        action: &'static str,
        /// On which file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another process works on the folder.
    #[error("{path:?} is in use by another isospline")]
    Locked {
        /// The folder.
        path: PathBuf,
    },
    /// There is no such artifact.
    #[error("{file}: no such artifact")]
    Missing {
        /// The file.
        file: String,
    },
    /// The file is not what was written.
    #[error("{file}: {damage}")]
    Damaged {
        /// The file.
        file: String,
        /// What is wrong with it.
        damage: Damage,
    },
    /// The header is too long to be stored.
    #[error("{file}: the header takes {bytes} bytes, {limit} are the most")]
    HeaderSize {
        /// The file.
        file: String,
        /// Its encoded size.
        bytes: usize,
        /// The limit.
        limit: usize,
    },
    /// Rows that do not fit into their section.
    #[error("{file}: rows {first}.. ({bytes} bytes) do not fit section {section:?}")]
    OutOfSection {
        /// The file.
        file: String,
        /// The section.
        section: String,
        /// First row of the piece.
        first: u64,
        /// Its size.
        bytes: usize,
    },
    /// An artifact was to be finished before all its rows were there.
    #[error("{file}: section {section:?} has {written} of {rows} rows")]
    Unfinished {
        /// The file.
        file: String,
        /// The section.
        section: String,
        /// Rows written.
        written: u64,
        /// Rows that it must have.
        rows: u64,
    },
}

impl StoreError {
    /// Wraps a system error: `result.map_err(StoreError::io("open", path))`.
    pub fn io(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}

/// How a file differs from what was written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// Another kind of file.
    #[error("not an isospline artifact")]
    Foreign,
    /// A container of another version.
    #[error("container version {found}, this program reads version {reads}")]
    Version {
        /// Version of the file.
        found: u32,
        /// Version of this program.
        reads: u32,
    },
    /// The end is missing.
    #[error("cut off after {found} bytes of {expected}")]
    Truncated {
        /// Bytes found.
        found: u64,
        /// Bytes that the file must have, or at least must have if its header is cut.
        expected: u64,
    },
    /// There is more than was written.
    #[error("{extra} bytes follow the end")]
    Trailing {
        /// Bytes too many.
        extra: u64,
    },
    /// The header does not agree with its checksum or makes no sense.
    #[error("the header is damaged")]
    Header,
    /// The footer does not agree with its checksum or belongs to another header.
    #[error("the footer is damaged")]
    Footer,
    /// The table of block checksums does not agree with its own checksum.
    #[error("the checksum table is damaged")]
    Table,
    /// Fill bytes that are not zero.
    #[error("the padding after {after:?} is damaged")]
    Padding {
        /// The section before, or `header`.
        after: String,
    },
    /// Rows do not agree with their checksum.
    #[error("section {section:?} is damaged in block {block} (rows {first}..{end})")]
    Rows {
        /// The section.
        section: String,
        /// Number of the block in its section.
        block: u64,
        /// First row of the block.
        first: u64,
        /// Row after the last.
        end: u64,
    },
    /// The artifact is of another kind or schema than was asked for.
    #[error("holds {found_kind:?} schema {found}, expected {kind:?} schema {schema}")]
    Kind {
        /// Kind of the file.
        found_kind: String,
        /// Schema of the file.
        found: u32,
        /// Kind asked for.
        kind: &'static str,
        /// Schema of this program.
        schema: u32,
    },
}
