//! Writes an artifact piece by piece; it is whole only when it is published.

use crate::container::block_checksums;
use crate::header::{HEADER_LIMIT, Header, encode, encoded_size};
use crate::layout::{Footer, Layout, place_sections};
use crate::store::{Frozen, Partial, Publish};
use crate::{Container, Key, Section, SectionSpec, Store, StoreError, content_key};
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// Everything that a header says of an artifact but its section table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Kind of the artifact.
    pub kind: &'static str,
    /// Schema version of the kind.
    pub schema: u32,
    /// Stage that makes it.
    pub stage: String,
    /// Version of that stage.
    pub stage_version: u32,
    /// Key of stage, parameters, model and the recipes of the inputs.
    pub recipe: Key,
    /// Key of stage, parameters, model and the contents of the inputs.
    pub derivation: Key,
}

/// An artifact being written: rows come in any order, each once.
#[derive(Debug)]
pub struct Writer {
    file: String,
    partial: Box<dyn Partial>,
    header: Header,
    encoded: Vec<u8>,
    layout: Layout,
    written: Vec<u64>,
}

/// A whole artifact that others do not see yet.
#[derive(Debug)]
pub struct Sealed {
    /// The artifact, readable in this process; its rows need no further verification.
    pub container: Arc<Container>,
    publish: Box<dyn Publish>,
}

impl Writer {
    /// Sets aside the space of an artifact with `lengths` rows of each section of `specs`.
    ///
    /// # Errors
    /// [`StoreError::HeaderSize`], [`StoreError::Io`], among others for a full disk.
    pub fn begin(
        store: &dyn Store,
        name: &str,
        identity: &Identity,
        specs: &[SectionSpec],
        lengths: &[usize],
    ) -> Result<Self, StoreError> {
        let file = store.describe(name);
        let header = header_of(identity, specs, lengths);
        let bytes = encoded_size(&header);
        if bytes > HEADER_LIMIT {
            return Err(StoreError::HeaderSize { file, bytes, limit: HEADER_LIMIT });
        }
        let encoded = encode(&header);
        let layout = Layout::of(&header, encoded.len()).expect("invariant: placed just now");
        let mut partial = store.create(name, layout.length)?;
        partial.write_at(0, &encoded)?;
        Ok(Self { file, partial, written: vec![0; lengths.len()], header, encoded, layout })
    }

    /// Writes whole rows of the section at this place of the table, from `first` on.
    ///
    /// # Errors
    /// [`StoreError::OutOfSection`], [`StoreError::Io`].
    pub fn write_rows(
        &mut self,
        section: usize,
        first: u64,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let entry = &self.header.sections[section];
        let stride = entry.stride as usize;
        let rows = (bytes.len() / stride) as u64;
        let fits = first.checked_add(rows).is_some_and(|end| end <= entry.rows);
        if !fits || !bytes.len().is_multiple_of(stride) {
            let section = entry.name.clone();
            let file = self.file.clone();
            return Err(StoreError::OutOfSection { file, section, first, bytes: bytes.len() });
        }
        self.written[section] += rows;
        if bytes.is_empty() {
            return Ok(());
        }
        self.partial.write_at(entry.offset + first * stride as u64, bytes)
    }

    /// Ends the writing: hashes the rows, writes checksum table and footer.
    ///
    /// # Errors
    /// [`StoreError::Unfinished`] if rows are missing, [`StoreError::Io`].
    pub fn seal(mut self) -> Result<Sealed, StoreError> {
        self.check_all_rows_are_written()?;
        let (content, table) = hash_rows(&self.header, &self.layout, self.partial.bytes()?);
        let footer = Footer { content, table: xxh3_64(&table), header: xxh3_64(&self.encoded) };
        let tail = [&table[..], &footer.encode()].concat();
        self.partial.write_at(self.layout.table.start, &tail)?;
        let Frozen { bytes, publish } = self.partial.freeze()?;
        let container = Arc::new(Container::new(self.file, bytes)?);
        Ok(Sealed { container, publish })
    }

    fn check_all_rows_are_written(&self) -> Result<(), StoreError> {
        for (section, &written) in self.header.sections.iter().zip(&self.written) {
            if written != section.rows {
                let (file, section, rows) = (self.file.clone(), section.name.clone(), section.rows);
                return Err(StoreError::Unfinished { file, section, written, rows });
            }
        }
        Ok(())
    }
}

impl Sealed {
    /// Makes the artifact visible under its name; durable after [`Store::sync_names`].
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn publish(self) -> Result<(), StoreError> {
        self.publish.publish()
    }
}

fn header_of(identity: &Identity, specs: &[SectionSpec], lengths: &[usize]) -> Header {
    let mut header = Header {
        kind: identity.kind.to_owned(),
        schema: identity.schema,
        stage: identity.stage.clone(),
        stage_version: identity.stage_version,
        recipe: identity.recipe,
        derivation: identity.derivation,
        sections: Vec::new(),
    };
    place_sections(&mut header, specs, lengths);
    header
}

/// Content key and checksum table of the rows in `file`.
fn hash_rows(header: &Header, layout: &Layout, file: &[u8]) -> (Key, Vec<u8>) {
    let rows = |k: usize| {
        let range = &layout.sections[k];
        &file[range.start as usize..range.end as usize]
    };
    let sections = header.sections.iter().enumerate();
    let named = sections
        .clone()
        .map(|(k, s)| (s.name.as_str(), Section { stride: s.stride as usize, bytes: rows(k) }));
    let content = content_key(named);
    let checksums = sections.flat_map(|(k, s)| block_checksums(s, rows(k)));
    (content, checksums.flat_map(u64::to_le_bytes).collect())
}
