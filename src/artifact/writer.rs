//! Writes an artifact piece by piece; it is whole only when it is published.

use crate::container::block_checksums;
use crate::header::{HEADER_LIMIT, Header, encode, encoded_size};
use crate::layout::{Footer, Layout, place_sections};
use crate::store::{Partial, Publish};
use crate::{
    Bytes, Container, Key, Section, SectionSource, SectionSpec, Store, StoreError, content_key,
};
use std::ops::Range;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// What a header says of an artifact before its rows are made.
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
}

/// An artifact being written: rows come in any order, each once.
#[derive(Debug)]
pub struct Writer {
    partial: Box<dyn Partial>,
    rows: Unfinished,
    written: Vec<u64>,
}

/// The rows of an artifact that is being written; those that are written can be read.
#[derive(Clone, Debug)]
pub struct Unfinished {
    file: Arc<str>,
    header: Arc<Header>,
    layout: Arc<Layout>,
    bytes: Arc<dyn Bytes>,
}

/// An artifact with all its rows, which lacks the keys of what it was made from.
#[derive(Debug)]
pub struct Hashed {
    /// Key of the rows.
    pub content: Key,
    table: Vec<u8>,
    partial: Box<dyn Partial>,
    rows: Unfinished,
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
        let layout = layout_of(&file, &header)?;
        let mut partial = store.create(name, layout.length)?;
        partial.write_at(0, &encode(&header))?;
        Self::over(file, header, layout, partial)
    }

    /// Goes on with what an earlier writer left of the same artifact; `None` if it left nothing
    /// of this size. Which of the rows can be used is for the caller to know.
    ///
    /// # Errors
    /// [`StoreError::HeaderSize`], [`StoreError::Io`].
    pub fn reopen(
        store: &dyn Store,
        name: &str,
        identity: &Identity,
        specs: &[SectionSpec],
        lengths: &[usize],
    ) -> Result<Option<Self>, StoreError> {
        let file = store.describe(name);
        let header = header_of(identity, specs, lengths);
        let layout = layout_of(&file, &header)?;
        let Some(mut partial) = store.reopen(name, layout.length)? else { return Ok(None) };
        partial.write_at(0, &encode(&header))?;
        Self::over(file, header, layout, partial).map(Some)
    }

    fn over(
        file: String,
        header: Header,
        layout: Layout,
        mut partial: Box<dyn Partial>,
    ) -> Result<Self, StoreError> {
        let written = vec![0; header.sections.len()];
        let (header, layout) = (Arc::new(header), Arc::new(layout));
        let bytes = partial.shared()?;
        let rows = Unfinished { file: file.into(), header, layout, bytes };
        Ok(Self { partial, rows, written })
    }

    /// Lets the file stay if the writing is given up, for [`Writer::reopen`].
    pub fn outlive(&mut self) {
        self.partial.outlive();
    }

    /// The rows, of which those that are written can be read, now and while more are written.
    pub fn rows(&self) -> &Unfinished {
        &self.rows
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
        let entry = &self.rows.header.sections[section];
        let stride = entry.stride as usize;
        let rows = (bytes.len() / stride) as u64;
        let fits = first.checked_add(rows).is_some_and(|end| end <= entry.rows);
        if !fits || !bytes.len().is_multiple_of(stride) {
            let section = entry.name.clone();
            let file = self.rows.file.to_string();
            return Err(StoreError::OutOfSection { file, section, first, bytes: bytes.len() });
        }
        self.written[section] += rows;
        if bytes.is_empty() {
            return Ok(());
        }
        self.partial.write_at(entry.offset + first * stride as u64, bytes)
    }

    /// Counts rows as written that an earlier writer wrote.
    pub fn take_over(&mut self, section: usize, n_rows: u64) {
        self.written[section] += n_rows;
    }

    /// Ends the writing of rows and hashes them.
    ///
    /// # Errors
    /// [`StoreError::Unfinished`] if rows are missing.
    pub fn hash(self) -> Result<Hashed, StoreError> {
        self.check_all_rows_are_written()?;
        let Self { partial, rows, .. } = self;
        let (content, table) = rows.hash();
        Ok(Hashed { content, table, partial, rows })
    }

    fn check_all_rows_are_written(&self) -> Result<(), StoreError> {
        for (section, &written) in self.rows.header.sections.iter().zip(&self.written) {
            if written != section.rows {
                let (section, rows) = (section.name.clone(), section.rows);
                let file = self.rows.file.to_string();
                return Err(StoreError::Unfinished { file, section, written, rows });
            }
        }
        Ok(())
    }
}

impl Hashed {
    /// Writes header, checksum table and footer; `derivation` is the key of stage, parameters,
    /// model and the contents of the inputs.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn seal(mut self, derivation: Key) -> Result<Sealed, StoreError> {
        let Unfinished { file, header, layout, bytes } = self.rows;
        let encoded = encode(&Header { derivation, ..Header::clone(&header) });
        self.partial.write_at(0, &encoded)?;
        let (content, table) = (self.content, xxh3_64(&self.table));
        let footer = Footer { content, table, header: xxh3_64(&encoded) };
        let tail = [&self.table[..], &footer.encode()].concat();
        self.partial.write_at(layout.table.start, &tail)?;
        let publish = self.partial.freeze();
        let container = Arc::new(Container::new(file.to_string(), bytes)?);
        Ok(Sealed { container, publish })
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

impl Unfinished {
    /// The header, whose derivation is not known yet.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Bytes of rows of the section at this place of the table; `None` beyond its end.
    pub fn bytes_of(&self, section: usize, rows: Range<usize>) -> Option<&[u8]> {
        let stride = self.header.sections.get(section)?.stride as usize;
        self.section_at(section).get(rows.start * stride..rows.end * stride)
    }

    fn section_at(&self, section: usize) -> &[u8] {
        let range = &self.layout.sections[section];
        &self.bytes.bytes()[range.start as usize..range.end as usize]
    }

    /// Content key and checksum table.
    fn hash(&self) -> (Key, Vec<u8>) {
        let sections = self.header.sections.iter().enumerate();
        let named = sections.clone().map(|(k, s)| {
            (s.name.as_str(), Section { stride: s.stride as usize, bytes: self.section_at(k) })
        });
        let content = content_key(named);
        let checksums = sections.flat_map(|(k, s)| block_checksums(s, self.section_at(k)));
        (content, checksums.flat_map(u64::to_le_bytes).collect())
    }
}

impl SectionSource for Unfinished {
    fn section(&self, name: &str) -> Option<Section<'_>> {
        let found = self.header.sections.iter().position(|s| s.name == name)?;
        let stride = self.header.sections[found].stride as usize;
        Some(Section { stride, bytes: self.section_at(found) })
    }
}

fn header_of(identity: &Identity, specs: &[SectionSpec], lengths: &[usize]) -> Header {
    let mut header = Header {
        kind: identity.kind.to_owned(),
        schema: identity.schema,
        stage: identity.stage.clone(),
        stage_version: identity.stage_version,
        recipe: identity.recipe,
        derivation: Key::default(),
        sections: Vec::new(),
    };
    place_sections(&mut header, specs, lengths);
    header
}

fn layout_of(file: &str, header: &Header) -> Result<Layout, StoreError> {
    let bytes = encoded_size(header);
    if bytes > HEADER_LIMIT {
        let file = file.to_owned();
        return Err(StoreError::HeaderSize { file, bytes, limit: HEADER_LIMIT });
    }
    let preamble = crate::header::PREAMBLE;
    Ok(Layout::of(header, preamble + bytes).expect("invariant: placed just now"))
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
        }
    }

    pub(crate) const DERIVATION: Key = Key([2; 32]);

    fn sealed(writer: Writer) -> Sealed {
        writer.hash().unwrap().seal(DERIVATION).unwrap()
    }

    pub(crate) fn write(store: &dyn Store, name: &str, identity: &Identity, rows: &Rows) -> Sealed {
        let lengths = [rows.twist.len(), rows.weights.len(), rows.status.len()];
        let mut writer = Writer::begin(store, name, identity, Rows::SECTIONS, &lengths).unwrap();
        for (k, section) in rows.sections().into_iter().enumerate() {
            writer.write_rows(k, 0, section.bytes).unwrap();
        }
        sealed(writer)
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
        sealed(writer).publish().unwrap();
        let bytes = store.read("a.isos").unwrap().unwrap();
        assert_eq!(bytes.bytes(), stored(&rows).1);
    }

    #[test]
    fn rows_that_are_written_are_read_while_others_are_not() {
        let rows = counting(5);
        let store = MemoryStore::new();
        let mut writer =
            Writer::begin(&store, "a.isos", &identity(), Rows::SECTIONS, &[5, 0, 7]).unwrap();
        let seen = writer.rows().clone();
        let seen = Rows::open(&seen).unwrap();
        assert_eq!(seen.twist.len(), 5);
        writer.write_rows(0, 3, bytemuck::cast_slice(&rows.twist[3..])).unwrap();
        let row = writer.rows().bytes_of(0, 3..4).unwrap();
        assert_eq!(row, bytemuck::cast_slice::<_, u8>(&rows.twist[3..4]));
        assert_eq!(writer.rows().bytes_of(0, 5..6), None);
    }

    #[test]
    fn an_abandoned_file_is_taken_up_again_where_it_was_to_outlive_its_writer() {
        let (rows, lengths) = (counting(5), [5, 0, 7]);
        let store = MemoryStore::new();
        let reopened = |store: &MemoryStore, lengths: &[usize]| {
            Writer::reopen(store, "a.isos", &identity(), Rows::SECTIONS, lengths).unwrap()
        };
        for outlives in [false, true] {
            let mut writer =
                Writer::begin(&store, "a.isos", &identity(), Rows::SECTIONS, &lengths).unwrap();
            writer.write_rows(2, 0, &rows.status).unwrap();
            if outlives {
                writer.outlive();
            }
            drop(writer);
            assert_eq!(reopened(&store, &lengths).is_some(), outlives);
        }
        assert!(reopened(&store, &[6, 0, 7]).is_none(), "another size");
        let mut writer = reopened(&store, &lengths).unwrap();
        writer.take_over(2, 7);
        writer.write_rows(0, 0, bytemuck::cast_slice(&rows.twist)).unwrap();
        sealed(writer).publish().unwrap();
        assert_eq!(store.read("a.isos").unwrap().unwrap().bytes(), stored(&rows).1);
        assert_eq!(store.drafts().unwrap(), [""; 0]);
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
        let unfinished = writer.hash().unwrap_err();
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
