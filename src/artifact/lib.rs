//! Versioned binary artifacts: typed rows of each kind, container files, stores.

pub mod kinds;
pub mod rows;

pub use rows::{Artifact, Count, Row, RowsError, Section, SectionSource, SectionSpec, View};
