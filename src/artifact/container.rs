//! A whole artifact as it lies in a file or in memory.

use crate::header::{Header, SectionEntry, decode, read_u64};
use crate::layout::{FOOTER, Footer, Layout};
use crate::{Artifact, Bytes, Damage, Key, RowsError, Section, SectionSource, StoreError};
use std::ops::Range;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// An artifact whose header and footer are known to be whole.
///
/// Rows are checked by [`Container::verify`]; [`crate::Store`]'s `open` has done so.
#[derive(Clone, Debug)]
pub struct Container {
    file: String,
    bytes: Arc<dyn Bytes>,
    header: Header,
    layout: Layout,
    footer: Footer,
}

impl Container {
    /// Reads header, footer and length; `file` is what errors call it.
    ///
    /// # Errors
    /// [`StoreError::Damaged`].
    pub fn new(file: String, bytes: Arc<dyn Bytes>) -> Result<Self, StoreError> {
        match parts(bytes.bytes()) {
            Ok((header, layout, footer)) => Ok(Self { file, bytes, header, layout, footer }),
            Err(damage) => Err(StoreError::Damaged { file, damage }),
        }
    }

    /// What errors call the file.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// The header.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Key of the rows.
    pub fn content(&self) -> Key {
        self.footer.content
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.layout.length
    }

    /// Typed rows of kind `A`.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] with [`Damage::Kind`] if it holds another kind or schema.
    pub fn view<A: Artifact>(&self) -> Result<A::View<'_>, StoreError> {
        let header = &self.header;
        let damaged = |_: RowsError| StoreError::Damaged {
            file: self.file.clone(),
            damage: Damage::Kind {
                found_kind: header.kind.clone(),
                found: header.schema,
                kind: A::KIND,
                schema: A::SCHEMA,
            },
        };
        if header.kind != A::KIND || header.schema != A::SCHEMA {
            return Err(damaged(RowsError::Missing { kind: A::KIND, section: "(all)" }));
        }
        A::open(self).map_err(damaged)
    }

    /// Compares every byte of rows, padding and table with its checksum.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] with the first damage found.
    pub fn verify(&self) -> Result<(), StoreError> {
        self.find_damage().map_err(|damage| StoreError::Damaged { file: self.file.clone(), damage })
    }

    fn find_damage(&self) -> Result<(), Damage> {
        let bytes = self.bytes.bytes();
        for (after, range) in self.layout.paddings(&self.header) {
            if part(bytes, &range).iter().any(|&b| b != 0) {
                return Err(Damage::Padding { after: after.to_owned() });
            }
        }
        let table = part(bytes, &self.layout.table);
        if xxh3_64(table) != self.footer.table {
            return Err(Damage::Table);
        }
        let mut stored = (0..table.len() / 8).map(|k| read_u64(table, 8 * k));
        for (section, range) in self.header.sections.iter().zip(&self.layout.sections) {
            check_blocks(section, part(bytes, range), &mut stored)?;
        }
        Ok(())
    }
}

impl SectionSource for Container {
    fn section(&self, name: &str) -> Option<Section<'_>> {
        let found = self.header.sections.iter().position(|s| s.name == name)?;
        let bytes = part(self.bytes.bytes(), &self.layout.sections[found]);
        Some(Section { stride: self.header.sections[found].stride as usize, bytes })
    }
}

/// Checksums of the blocks of a section, in order.
pub(crate) fn block_checksums<'a>(
    section: &'a SectionEntry,
    rows: &'a [u8],
) -> impl Iterator<Item = u64> + 'a {
    rows.chunks(section.block_rows as usize * section.stride as usize).map(xxh3_64)
}

fn check_blocks(
    section: &SectionEntry,
    rows: &[u8],
    stored: &mut impl Iterator<Item = u64>,
) -> Result<(), Damage> {
    for (block, found) in (0..).zip(block_checksums(section, rows)) {
        if stored.next() != Some(found) {
            let Range { start: first, end } = section.block(block);
            return Err(Damage::Rows { section: section.name.clone(), block, first, end });
        }
    }
    Ok(())
}

fn parts(file: &[u8]) -> Result<(Header, Layout, Footer), Damage> {
    let (header, header_bytes) = decode(file)?;
    let layout = Layout::of(&header, header_bytes)?;
    let (found, expected) = (file.len() as u64, layout.length);
    if found < expected {
        return Err(Damage::Truncated { found, expected });
    }
    if found > expected {
        return Err(Damage::Trailing { extra: found - expected });
    }
    let footer = Footer::decode(&file[file.len() - FOOTER..], &file[..header_bytes])?;
    Ok((header, layout, footer))
}

fn part<'a>(file: &'a [u8], range: &Range<u64>) -> &'a [u8] {
    &file[range.start as usize..range.end as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::writer::tests::{counting, identity, stored, write};
    use crate::{MemoryStore, Store};

    fn damage(file: &[u8]) -> Option<Damage> {
        let store = MemoryStore::new();
        store.put("a.isos", file);
        match (&store as &dyn Store).open("a.isos") {
            Ok(_) => None,
            Err(StoreError::Damaged { file, damage }) => {
                assert_eq!(file, "a.isos");
                Some(damage)
            }
            Err(other) => panic!("{other}"),
        }
    }

    /// What must be said of a changed byte at `offset`.
    fn expected(layout: &Layout, header: &Header, offset: u64) -> Damage {
        if let Some((k, range)) = (0..).zip(&layout.sections).find(|(_, r)| r.contains(&offset)) {
            let section: &SectionEntry = &header.sections[k];
            let row = (offset - range.start) / u64::from(section.stride);
            let block = row / u64::from(section.block_rows);
            let Range { start: first, end } = section.block(block);
            return Damage::Rows { section: section.name.clone(), block, first, end };
        }
        let paddings = layout.paddings(header);
        if let Some((after, _)) = paddings.into_iter().find(|(_, r)| r.contains(&offset)) {
            return Damage::Padding { after: after.to_owned() };
        }
        match offset {
            0..8 => Damage::Foreign,
            o if o < layout.header => Damage::Header,
            o if layout.table.contains(&o) => Damage::Table,
            _ => Damage::Footer,
        }
    }

    #[test]
    fn every_changed_byte_is_found_and_its_place_named() {
        let (container, file) = stored(&counting(5));
        for offset in 0..file.len() {
            for change in [0x01, 0x80, 0xff, 0x55, 0x10] {
                let mut changed = file.clone();
                changed[offset] ^= change;
                let found = damage(&changed).expect("the change is found");
                let expected = expected(&container.layout, &container.header, offset as u64);
                match found {
                    Damage::Version { found, reads: 1 } if (8..12).contains(&offset) => {
                        assert_ne!(found, 1);
                    }
                    // A changed length of the header may point beyond the end of the file.
                    Damage::Truncated { .. } if (12..16).contains(&offset) => {}
                    found => assert_eq!(found, expected, "byte {offset} ^ {change:#x}"),
                }
            }
        }
    }

    #[test]
    fn every_truncation_and_every_tail_is_found() {
        let (_, file) = stored(&counting(5));
        for length in 0..file.len() {
            let found = damage(&file[..length]).expect("the truncation is found");
            assert!(matches!(found, Damage::Truncated { .. }), "{length}: {found}");
        }
        for extra in [1, 8, 64, 4096] {
            let longer = [&file[..], &vec![0; extra]].concat();
            assert_eq!(damage(&longer), Some(Damage::Trailing { extra: extra as u64 }));
        }
        assert_eq!(damage(&file), None);
    }

    #[test]
    fn a_damaged_row_names_its_block() {
        let (container, mut file) = stored(&counting(10_000));
        let start = container.layout.sections[0].start as usize;
        file[start + 24 * 9_000] ^= 4;
        let block_rows = u64::from(container.header.sections[0].block_rows);
        assert_eq!(block_rows, 2730);
        let expected = Damage::Rows { section: "twist".into(), block: 3, first: 8190, end: 10_000 };
        assert_eq!(damage(&file), Some(expected));
    }

    #[test]
    fn a_footer_of_another_file_is_refused() {
        let (_, first) = stored(&counting(5));
        let store = MemoryStore::new();
        let other = crate::Identity { stage: "mako".to_owned(), ..identity() };
        write(&store, "b", &other, &counting(5)).publish().unwrap();
        let second = store.read("b").unwrap().unwrap().bytes().to_vec();
        let tail = first.len() - FOOTER;
        let spliced = [&second[..tail], &first[tail..]].concat();
        assert_eq!(damage(&spliced), Some(Damage::Footer));
    }

    #[test]
    fn other_files_and_other_versions_are_refused_by_name() {
        assert_eq!(damage(b"%PDF-1.7 and so on"), Some(Damage::Foreign));
        assert_eq!(damage(b""), Some(Damage::Truncated { found: 0, expected: 24 }));
        let (container, mut file) = stored(&counting(1));
        file[8] = 9;
        assert_eq!(damage(&file), Some(Damage::Version { found: 9, reads: 1 }));
        let text = container.view::<crate::kinds::Mesh>().unwrap_err().to_string();
        assert_eq!(text, "a.isos: holds \"vertex_systems\" schema 1, expected \"mesh\" schema 1");
    }
}
