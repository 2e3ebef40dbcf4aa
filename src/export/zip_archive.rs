//! Zip archives of stored (uncompressed) entries, which npz and 3mf are.
//!
//! Sizes and checksums stand before the data, so each entry's content is made twice: once to be
//! measured, once to be written. Nothing is buffered and the output needs no seek.

use crate::ExportError;
use std::io::{self, Write};

/// Writes the content of an entry; called twice, with equal results.
pub(crate) type Content<'a> = &'a dyn Fn(&mut dyn Write) -> io::Result<()>;

/// Signatures of the parts of an archive.
pub(crate) const LOCAL: u32 = 0x0403_4b50;
pub(crate) const CENTRAL: u32 = 0x0201_4b50;
pub(crate) const END: u32 = 0x0605_4b50;

/// Version 2.0 of the format: all that stored entries need.
const VERSION: u16 = 20;
/// 1 January 1980, the first day of the format: archives must not depend on the clock.
const DATE: u16 = 0x0021;

/// Writes an archive of these entries; `format` is what errors call it.
pub(crate) fn write(
    format: &'static str,
    entries: &[(&str, Content<'_>)],
    out: &mut dyn Write,
) -> Result<(), ExportError> {
    let mut central = Vec::new();
    let mut offset = 0;
    for &(name, content) in entries {
        let mut meter = Meter::default();
        content(&mut meter)?;
        let record = Record::new(format, name, meter, offset)?;
        out.write_all(&record.local())?;
        content(out)?;
        central.extend(record.central());
        offset += record.local().len() as u64 + u64::from(record.size);
    }
    let start = addressable(format, offset)?;
    out.write_all(&central)?;
    let mut end = Vec::new();
    let n_entries = entries.len() as u16;
    end.extend(END.to_le_bytes());
    for field in [0, 0, n_entries, n_entries] {
        end.extend(u16::to_le_bytes(field));
    }
    end.extend((central.len() as u32).to_le_bytes());
    end.extend(start.to_le_bytes());
    end.extend(0_u16.to_le_bytes());
    out.write_all(&end)?;
    Ok(())
}

/// Size and checksum of what is written to it.
#[derive(Default)]
struct Meter {
    checksum: crc32fast::Hasher,
    size: u64,
}

impl Write for Meter {
    fn write(&mut self, chunk: &[u8]) -> io::Result<usize> {
        self.checksum.update(chunk);
        self.size += chunk.len() as u64;
        Ok(chunk.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct Record<'a> {
    name: &'a str,
    checksum: u32,
    size: u32,
    offset: u32,
}

impl<'a> Record<'a> {
    fn new(
        format: &'static str,
        name: &'a str,
        meter: Meter,
        offset: u64,
    ) -> Result<Self, ExportError> {
        let (size, offset) = (addressable(format, meter.size)?, addressable(format, offset)?);
        Ok(Self { name, checksum: meter.checksum.finalize(), size, offset })
    }

    fn local(&self) -> Vec<u8> {
        let mut out = LOCAL.to_le_bytes().to_vec();
        out.extend(self.shared());
        out.extend(self.name.as_bytes());
        out
    }

    fn central(&self) -> Vec<u8> {
        let mut out = CENTRAL.to_le_bytes().to_vec();
        out.extend(VERSION.to_le_bytes());
        out.extend(self.shared());
        // No comment, first disk, no attributes.
        out.extend([0; 10]);
        out.extend(self.offset.to_le_bytes());
        out.extend(self.name.as_bytes());
        out
    }

    /// The fields that both headers carry, from the version needed to the length of extras.
    fn shared(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let (flags, stored, time, extras) = (0, 0, 0, 0_u16);
        for field in [VERSION, flags, stored, time, DATE] {
            out.extend(field.to_le_bytes());
        }
        for field in [self.checksum, self.size, self.size] {
            out.extend(field.to_le_bytes());
        }
        out.extend((self.name.len() as u16).to_le_bytes());
        out.extend(extras.to_le_bytes());
        out
    }
}

/// Archives count bytes in 32 bits; their 64-bit form is not written.
fn addressable(format: &'static str, count: u64) -> Result<u32, ExportError> {
    let limit = u64::from(u32::MAX) - 1;
    let too_large = ExportError::TooLarge { format, what: "bytes", count, limit };
    u32::try_from(count).ok().filter(|&n| u64::from(n) <= limit).ok_or(too_large)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_record_points_to_a_directory_that_points_to_the_entries() {
        let mut bytes = Vec::new();
        let contents: [(&str, Content<'_>); 2] =
            [("a", &|out| out.write_all(b"first")), ("bc", &|out| out.write_all(b"second"))];
        write("npz", &contents, &mut bytes).unwrap();
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let end = bytes.len() - 22;
        assert_eq!(u32_at(end), END);
        let directory = u32_at(end + 16) as usize;
        assert_eq!(u32_at(directory), CENTRAL);
        let second = directory + 46 + 1;
        assert_eq!(u32_at(second), CENTRAL);
        let entry = u32_at(second + 42) as usize;
        assert_eq!(u32_at(entry), LOCAL);
        assert_eq!(&bytes[entry + 30..entry + 38], b"bcsecond");
        assert_eq!(u32_at(entry + 14), crc32fast::hash(b"second"));
    }

    #[test]
    fn four_gibibytes_are_too_many() {
        assert!(addressable("npz", 1 << 32).is_err());
        assert!(addressable("npz", u64::from(u32::MAX)).is_err());
        assert_eq!(addressable("npz", 7).unwrap(), 7);
    }
}
