//! Versioned binary artifacts: typed rows of each kind, container files, stores.
//!
//! A stage's output is a file of fixed-size rows that is either whole or not there. The layout
//! is owned by `FORMAT.md`; [`header`] and [`layout`] are its only implementation.

mod cells;
pub mod commit;
pub mod container;
pub mod draft;
pub mod error;
pub mod exhaustion;
pub mod folder;
pub mod header;
pub mod journal;
pub mod key;
pub mod kinds;
pub mod layout;
pub mod memory;
pub mod rows;
pub mod store;
pub mod writer;

pub use commit::write_file_atomic;
pub use container::Container;
pub use draft::Draft;
pub use error::{Damage, StoreError};
pub use exhaustion::Telling;
pub use folder::FolderStore;
pub use header::Header;
pub use journal::{Journal, JournalEntry, JournalHead, Recorded};
pub use key::{Key, KeyHasher, content_key};
pub use memory::MemoryStore;
pub use rows::{Artifact, Count, Row, RowsError, Section, SectionSource, SectionSpec, View};
pub use store::{Bytes, Durability, Lock, Store};
pub use writer::{Hashed, Identity, Sealed, Unfinished, Writer};
