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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::kinds::VertexSystems as Rows;
    use crate::{Artifact, MemoryStore, SectionSource};

    /// `n` rows of 24 bytes, none of the second section and `n + 2` of one byte.
    pub(crate) fn counting(n: usize) -> Rows {
        let twist = (0..n).map(|i| [i as f64, 0.5, -1.0]).collect();
        let status = (0..n + 2).map(|i| i as u8).collect();
        Rows { twist, weights: Vec::new(), status }
    }

    pub(crate) fn identity() -> Identity {
        Identity {
            kind: Rows::KIND,
            schema: Rows::SCHEMA,
            stage: "make".to_owned(),
            stage_version: 1,
            recipe: Key([1; 32]),
            derivation: Key([2; 32]),
        }
    }

    pub(crate) fn write(store: &dyn Store, name: &str, identity: &Identity, rows: &Rows) -> Sealed {
        let lengths = [rows.twist.len(), rows.weights.len(), rows.status.len()];
        let mut writer = Writer::begin(store, name, identity, Rows::SECTIONS, &lengths).unwrap();
        for (k, section) in rows.sections().into_iter().enumerate() {
            writer.write_rows(k, 0, section.bytes).unwrap();
        }
        writer.seal().unwrap()
    }

    /// The artifact as the writer gives it, and its bytes.
    pub(crate) fn stored(rows: &Rows) -> (Arc<Container>, Vec<u8>) {
        let store = MemoryStore::new();
        let sealed = write(&store, "a.isos", &identity(), rows);
        let container = Arc::clone(&sealed.container);
        sealed.publish().unwrap();
        let bytes = store.read("a.isos").unwrap().unwrap();
        (container, bytes.bytes().to_vec())
    }

    #[test]
    fn pieces_in_any_order_give_the_file_of_one_piece() {
        let rows = counting(5);
        let store = MemoryStore::new();
        let mut writer =
            Writer::begin(&store, "a.isos", &identity(), Rows::SECTIONS, &[5, 0, 7]).unwrap();
        writer.write_rows(2, 3, &rows.status[3..]).unwrap();
        writer.write_rows(0, 4, bytemuck::cast_slice(&rows.twist[4..])).unwrap();
        writer.write_rows(2, 0, &rows.status[..3]).unwrap();
        writer.write_rows(0, 0, bytemuck::cast_slice(&rows.twist[..4])).unwrap();
        writer.seal().unwrap().publish().unwrap();
        let bytes = store.read("a.isos").unwrap().unwrap();
        assert_eq!(bytes.bytes(), stored(&rows).1);
    }

    #[test]
    fn what_is_read_is_what_was_written() {
        let rows = counting(300);
        let (container, _) = stored(&rows);
        container.verify().unwrap();
        let view = container.view::<Rows>().unwrap();
        assert_eq!(view.to_owned_rows(), rows);
        let address = container.section("status").unwrap().bytes.as_ptr() as usize;
        assert_eq!(address % 8, 0);
        assert_eq!(container.header().sections[2].offset % 64, 0);
    }

    #[test]
    fn empty_sections_are_whole() {
        let rows = Rows::default();
        let store = MemoryStore::new();
        write(&store, "a.isos", &identity(), &rows).publish().unwrap();
        let container = (&store as &dyn Store).open("a.isos").unwrap();
        assert_eq!(container.view::<Rows>().unwrap().to_owned_rows(), rows);
    }

    #[test]
    fn the_content_key_sees_rows_alone() {
        let store = MemoryStore::new();
        let other = Identity { recipe: Key([9; 32]), ..identity() };
        let key = |identity: &Identity, rows: &Rows| {
            write(&store, "a.isos", identity, rows).container.content()
        };
        let rows = counting(5);
        assert_eq!(key(&identity(), &rows), key(&other, &rows));
        assert_ne!(key(&identity(), &rows), key(&identity(), &counting(6)));
        let named = Rows::SECTIONS.iter().map(|s| s.name).zip(rows.sections());
        assert_eq!(key(&identity(), &rows), content_key(named));
    }

    #[test]
    fn missing_and_misplaced_rows_are_refused() {
        let store = MemoryStore::new();
        let mut writer =
            Writer::begin(&store, "a.isos", &identity(), Rows::SECTIONS, &[2, 0, 4]).unwrap();
        let beyond = writer.write_rows(2, 3, &[0; 2]).unwrap_err();
        assert_eq!(beyond.to_string(), "a.isos: rows 3.. (2 bytes) do not fit section \"status\"");
        assert!(writer.write_rows(0, 0, &[0; 23]).is_err());
        writer.write_rows(2, 0, &[0; 4]).unwrap();
        let unfinished = writer.seal().unwrap_err();
        assert_eq!(unfinished.to_string(), "a.isos: section \"twist\" has 0 of 2 rows");
        assert!(store.names().unwrap().is_empty());
    }

    #[test]
    fn a_header_too_long_is_refused() {
        let store = MemoryStore::new();
        let long = Identity { stage: "x".repeat(5000), ..identity() };
        let failed = Writer::begin(&store, "a", &long, Rows::SECTIONS, &[0, 0, 0]).unwrap_err();
        assert!(matches!(failed, StoreError::HeaderSize { limit: 4096, .. }), "{failed}");
    }
}
