//! Puts right the checksums of a changed artifact, as FORMAT.md has them, so that a defect is seen
//! by what reads the rows and not by what guards them.

use xxhash_rust::xxh3::xxh3_64;

const PREAMBLE: usize = 24;
const FOOTER: usize = 64;

/// A section as the header of a file tells of it.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    pub(crate) name: String,
    pub(crate) stride: usize,
    pub(crate) rows: usize,
    pub(crate) offset: usize,
    pub(crate) block_rows: usize,
}

impl Place {
    /// Bytes after the last row.
    pub(crate) fn end(&self) -> usize {
        self.offset + self.stride * self.rows
    }
}

/// The section table of a sound file.
pub(crate) fn places(file: &[u8]) -> Vec<Place> {
    let mut at = Reader { file, at: PREAMBLE };
    at.text();
    at.number(4);
    at.text();
    at.number(4 + 32 + 32);
    let n = at.number(8);
    (0..n)
        .map(|_| Place {
            name: at.text(),
            stride: at.number(4),
            rows: at.number(8),
            offset: at.number(8),
            block_rows: at.number(4),
        })
        .collect()
}

/// Makes all checksums but those of the header agree with the bytes; `places` are those of the
/// file before it was changed.
pub(crate) fn seal_rows(file: &mut [u8], places: &[Place]) {
    let table_at = places.last().map_or(0, |last| last.end().next_multiple_of(64));
    let mut table = Vec::new();
    for place in places {
        let rows = &file[place.offset..place.end()];
        let blocks = rows.chunks(place.block_rows * place.stride);
        table.extend(blocks.flat_map(|block| xxh3_64(block).to_le_bytes()));
    }
    file[table_at..table_at + table.len()].copy_from_slice(&table);
    let footer = file.len() - FOOTER;
    file[footer + 32..footer + 40].copy_from_slice(&xxh3_64(&table).to_le_bytes());
    seal_footer(file);
}

/// Makes the checksums of header and footer agree with the bytes, where there is room for both.
pub(crate) fn seal_header(file: &mut [u8]) {
    if file.len() < PREAMBLE + FOOTER {
        return;
    }
    let length = u32::from_le_bytes([file[12], file[13], file[14], file[15]]) as usize;
    let Some(body) = file.get(PREAMBLE..PREAMBLE.saturating_add(length)) else { return };
    let sum = xxh3_64(&[&file[8..16], body].concat());
    file[16..24].copy_from_slice(&sum.to_le_bytes());
    let header = xxh3_64(&file[..PREAMBLE + length]);
    let footer = file.len() - FOOTER;
    file[footer + 40..footer + 48].copy_from_slice(&header.to_le_bytes());
    seal_footer(file);
}

fn seal_footer(file: &mut [u8]) {
    let footer = file.len() - FOOTER;
    let sum = xxh3_64(&file[footer..footer + 48]);
    file[footer + 48..footer + 56].copy_from_slice(&sum.to_le_bytes());
}

struct Reader<'a> {
    file: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    /// A number of up to eight bytes; more are passed over.
    fn number(&mut self, bytes: usize) -> usize {
        let mut word = [0; 8];
        let kept = bytes.min(8);
        word[..kept].copy_from_slice(&self.file[self.at..self.at + kept]);
        self.at += bytes;
        u64::from_le_bytes(word) as usize
    }

    fn text(&mut self) -> String {
        let length = self.number(8);
        let text = String::from_utf8_lossy(&self.file[self.at..self.at + length]).into_owned();
        self.at += length;
        text
    }
}
