//! Where the parts of a container lie.
//!
//! Header | padding | section | padding | ... | checksum table | footer. Every section starts at
//! a multiple of 64 bytes, so a mapped section is aligned for any row type and for SIMD loads.

use crate::header::{Header, SectionEntry, encoded_size, read_u64};
use crate::{Damage, Key, SectionSpec};
use std::ops::Range;
use xxhash_rust::xxh3::xxh3_64;

/// Sections start at multiples of this.
pub const ALIGNMENT: u64 = 64;
/// Bytes of the footer.
pub const FOOTER: usize = 64;
/// Last bytes of every file.
pub const END_MAGIC: [u8; 8] = *b"ISOSEND\n";
/// Bytes of rows that one checksum covers, about: large enough that the table is 1/8192 of the
/// rows, small enough that a damaged place is named closely.
const BLOCK_BYTES: usize = 1 << 16;

/// Byte ranges of a container's parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Preamble and encoded header.
    pub header: u64,
    /// Rows of each section.
    pub sections: Vec<Range<u64>>,
    /// Checksum table: 8 bytes a block, section by section.
    pub table: Range<u64>,
    /// Bytes of the whole file.
    pub length: u64,
}

/// The last 64 bytes of a container.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footer {
    /// Key of the rows.
    pub content: Key,
    /// Checksum of the checksum table.
    pub table: u64,
    /// Checksum of preamble and header: ties the footer to them.
    pub header: u64,
}

/// The section table for `lengths` rows of each of `specs`.
pub(crate) fn place_sections(header: &mut Header, specs: &[SectionSpec], lengths: &[usize]) {
    header.sections = specs.iter().zip(lengths).map(|(s, &rows)| entry(s, rows)).collect();
    let mut offset = (crate::header::PREAMBLE + encoded_size(header)) as u64;
    for section in &mut header.sections {
        section.offset = offset.next_multiple_of(ALIGNMENT);
        offset = section.offset + section.rows * u64::from(section.stride);
    }
}

fn entry(spec: &SectionSpec, rows: usize) -> SectionEntry {
    SectionEntry {
        name: spec.name.to_owned(),
        stride: spec.stride as u32,
        rows: rows as u64,
        offset: 0,
        block_rows: (BLOCK_BYTES / spec.stride.max(1)).max(1) as u32,
    }
}

impl SectionEntry {
    /// Checksummed blocks.
    pub fn blocks(&self) -> u64 {
        self.rows.div_ceil(u64::from(self.block_rows))
    }

    /// Rows of one block.
    pub fn block(&self, index: u64) -> Range<u64> {
        let size = u64::from(self.block_rows);
        index * size..((index + 1) * size).min(self.rows)
    }
}

impl Layout {
    /// Computes all ranges; `header_bytes` are those of preamble and encoded header.
    ///
    /// # Errors
    /// [`Damage::Header`] if the section table is not the one that a writer makes.
    pub fn of(header: &Header, header_bytes: usize) -> Result<Self, Damage> {
        let mut offset = header_bytes as u64;
        let mut sections = Vec::with_capacity(header.sections.len());
        let mut blocks = 0_u64;
        for section in &header.sections {
            let start = offset.next_multiple_of(ALIGNMENT);
            let bytes = section.rows.checked_mul(u64::from(section.stride));
            let end = bytes.and_then(|b| start.checked_add(b)).filter(|&e| e < u64::MAX / 2);
            let whole = section.offset == start && section.stride > 0 && section.block_rows > 0;
            offset = end.filter(|_| whole).ok_or(Damage::Header)?;
            sections.push(start..offset);
            blocks += section.blocks();
        }
        let table = offset.next_multiple_of(ALIGNMENT);
        let table = table..table + 8 * blocks;
        let length = table.end + FOOTER as u64;
        Ok(Self { header: header_bytes as u64, sections, table, length })
    }

    /// Fill bytes: `(what they follow, range)`.
    pub fn paddings<'a>(&self, header: &'a Header) -> Vec<(&'a str, Range<u64>)> {
        let names = header.sections.iter().map(|s| s.name.as_str());
        let ends = std::iter::once(self.header).chain(self.sections.iter().map(|s| s.end));
        let starts = self.sections.iter().map(|s| s.start).chain([self.table.start]);
        let names = std::iter::once("header").chain(names);
        names.zip(ends.zip(starts)).map(|(name, (end, start))| (name, end..start)).collect()
    }
}

impl Footer {
    /// The footer's bytes.
    pub fn encode(&self) -> [u8; FOOTER] {
        let mut out = [0; FOOTER];
        out[..32].copy_from_slice(&self.content.0);
        out[32..40].copy_from_slice(&self.table.to_le_bytes());
        out[40..48].copy_from_slice(&self.header.to_le_bytes());
        let own = xxh3_64(&out[..48]);
        out[48..56].copy_from_slice(&own.to_le_bytes());
        out[56..].copy_from_slice(&END_MAGIC);
        out
    }

    /// Reads the footer of a file with this preamble and header.
    ///
    /// # Errors
    /// [`Damage::Footer`].
    pub fn decode(bytes: &[u8], header: &[u8]) -> Result<Self, Damage> {
        let content = bytes.get(..32).and_then(|b| b.try_into().ok()).map(Key);
        let (Some(content), FOOTER) = (content, bytes.len()) else {
            return Err(Damage::Footer);
        };
        let footer = Self { content, table: read_u64(bytes, 32), header: read_u64(bytes, 40) };
        let whole = footer.encode() == bytes && footer.header == xxh3_64(header);
        if whole { Ok(footer) } else { Err(Damage::Footer) }
    }
}
