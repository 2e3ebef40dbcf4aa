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
