//! The header of a container: the only module that knows its encoding.

use crate::{Damage, Key};
use serde::{Deserialize, Serialize};

/// First bytes of every file; the line ends and the control byte catch text-mode transfers.
pub const MAGIC: [u8; 8] = *b"\x89ISOS\r\n\x1a";
/// Version of the container; raised when a reader of the old one would misread the new one.
pub const CONTAINER_VERSION: u32 = 1;
/// Bytes before the encoded header: magic, version, length, checksum.
pub const PREAMBLE: usize = 24;
/// Most bytes of an encoded header.
pub const HEADER_LIMIT: usize = 4096;

/// What a file holds and what it was made from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Kind of the artifact.
    pub kind: String,
    /// Schema version of the kind.
    pub schema: u32,
    /// Stage that made it.
    pub stage: String,
    /// Version of that stage.
    pub stage_version: u32,
    /// Key of stage, parameters, model and the recipes of the inputs.
    pub recipe: Key,
    /// Key of stage, parameters, model and the contents of the inputs.
    pub derivation: Key,
    /// The sections, in file order.
    pub sections: Vec<SectionEntry>,
}

/// Where a section lies.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SectionEntry {
    /// Name, unique in the file.
    pub name: String,
    /// Bytes a row.
    pub stride: u32,
    /// Rows.
    pub rows: u64,
    /// First byte in the file, a multiple of 64.
    pub offset: u64,
    /// Rows a checksum covers; the last block may have fewer.
    pub block_rows: u32,
}

type Codec = bincode::config::Configuration<
    bincode::config::LittleEndian,
    bincode::config::Fixint,
    bincode::config::Limit<HEADER_LIMIT>,
>;

const CODEC: Codec =
    bincode::config::standard().with_fixed_int_encoding().with_limit::<HEADER_LIMIT>();

/// Bytes that `header` takes when encoded, without the preamble.
pub fn encoded_size(header: &Header) -> usize {
    let text = |s: &str| 8 + s.len();
    let section = |s: &SectionEntry| text(&s.name) + 4 + 8 + 8 + 4;
    let sections: usize = header.sections.iter().map(section).sum();
    text(&header.kind) + 4 + text(&header.stage) + 4 + 32 + 32 + 8 + sections
}

/// Preamble and encoded header.
pub(crate) fn encode(header: &Header) -> Vec<u8> {
    let body = bincode::serde::encode_to_vec(header, CODEC)
        .expect("invariant: the size was checked against the limit");
    assert_eq!(body.len(), encoded_size(header), "invariant: the encoding is the one of FORMAT.md");
    let mut out = Vec::with_capacity(PREAMBLE + body.len());
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&CONTAINER_VERSION.to_le_bytes());
    out.extend_from_slice(&(body.len() as u32).to_le_bytes());
    out.extend_from_slice(&checksum(&out[8..16], &body).to_le_bytes());
    out.extend_from_slice(&body);
    out
}

/// Reads preamble and header; also gives the number of bytes they take.
///
/// # Errors
/// [`Damage::Foreign`], [`Damage::Version`], [`Damage::Truncated`] or [`Damage::Header`].
pub(crate) fn decode(file: &[u8]) -> Result<(Header, usize), Damage> {
    let found = file.len() as u64;
    let n_magic = file.len().min(MAGIC.len());
    if file[..n_magic] != MAGIC[..n_magic] {
        return Err(Damage::Foreign);
    }
    let Some((preamble, rest)) = file.split_at_checked(PREAMBLE) else {
        return Err(Damage::Truncated { found, expected: PREAMBLE as u64 });
    };
    let version = read_u32(preamble, 8);
    if version != CONTAINER_VERSION {
        return Err(Damage::Version { found: version, reads: CONTAINER_VERSION });
    }
    let length = read_u32(preamble, 12) as usize;
    if length > HEADER_LIMIT {
        return Err(Damage::Header);
    }
    let Some(body) = rest.get(..length) else {
        return Err(Damage::Truncated { found, expected: (PREAMBLE + length) as u64 });
    };
    if read_u64(preamble, 16) != checksum(&preamble[8..16], body) {
        return Err(Damage::Header);
    }
    match bincode::serde::decode_from_slice::<Header, _>(body, CODEC) {
        Ok((header, used)) if used == length => Ok((header, PREAMBLE + length)),
        _ => Err(Damage::Header),
    }
}

/// Little-endian number at `offset`, which must lie in `bytes`.
pub(crate) fn read_u64(bytes: &[u8], offset: usize) -> u64 {
    let field = bytes[offset..offset + 8].try_into().expect("invariant: eight bytes");
    u64::from_le_bytes(field)
}

/// Little-endian number at `offset`, which must lie in `bytes`.
pub(crate) fn read_u32(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(bytes[offset..offset + 4].try_into().expect("invariant: four bytes"))
}

fn checksum(version_and_length: &[u8], body: &[u8]) -> u64 {
    let mut hasher = xxhash_rust::xxh3::Xxh3::new();
    hasher.update(version_and_length);
    hasher.update(body);
    hasher.digest()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Header {
        Header {
            kind: "toy".into(),
            schema: 2,
            stage: "make".into(),
            stage_version: 3,
            recipe: Key([0xaa; 32]),
            derivation: Key([0xbb; 32]),
            sections: vec![SectionEntry {
                name: "x".into(),
                stride: 24,
                rows: 5,
                offset: 256,
                block_rows: 7,
            }],
        }
    }

    #[test]
    fn encoded_bytes_are_those_of_the_format_document() {
        let mut body = Vec::new();
        body.extend([3, 0, 0, 0, 0, 0, 0, 0, b't', b'o', b'y', 2, 0, 0, 0]);
        body.extend([4, 0, 0, 0, 0, 0, 0, 0, b'm', b'a', b'k', b'e', 3, 0, 0, 0]);
        body.extend([0xaa; 32]);
        body.extend([0xbb; 32]);
        body.extend([1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, b'x', 24, 0, 0, 0]);
        body.extend([5, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0]);
        let mut expected = b"\x89ISOS\r\n\x1a\x01\x00\x00\x00".to_vec();
        expected.extend([body.len() as u8, 0, 0, 0]);
        expected.extend([0x72, 0xcc, 0xe4, 0xed, 0x97, 0x2b, 0xa5, 0x52]);
        expected.extend(body);
        assert_eq!(encode(&sample()), expected);
    }

    #[test]
    fn a_header_survives_a_round_trip() {
        let bytes = encode(&sample());
        assert_eq!(decode(&bytes), Ok((sample(), bytes.len())));
    }

    #[test]
    fn a_length_beyond_the_limit_is_refused_before_it_is_read() {
        let mut bytes = encode(&sample());
        bytes[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(decode(&bytes), Err(Damage::Header));
    }
}
