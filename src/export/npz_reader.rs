//! Surfaces from numpy archives: our own exports, or what Python wrote with `np.savez`.

use crate::zip_archive::{CENTRAL, END, LOCAL};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL};
use isospline_geometry::degree_change::{N_SEXTIC, raise_sextic};
use std::io::Read;

/// The arrays of an archive.
#[derive(Clone, Debug, PartialEq)]
pub struct NpzSurface {
    /// Vertex positions, (V, 3).
    pub vertices: Vec<Vec3>,
    /// Corners of each face, (F, 3).
    pub faces: Vec<[u32; 3]>,
    /// Control points of each face, (F, 36, 3), in storage order; raised where they are of degree 6.
    pub control_points: Vec<[Vec3; N_CONTROL]>,
}

/// Why an archive holds no surface.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// The file cannot be read.
    #[error("cannot read the npz file: {0}")]
    Io(#[from] std::io::Error),
    /// It is no zip archive, or a truncated one.
    #[error("not an npz file: {0}")]
    NotAnArchive(&'static str),
    /// An array is not there.
    #[error("the npz file has no array {0:?}")]
    Missing(&'static str),
    /// An entry is compressed.
    #[error("array {0:?} is compressed; write the file with np.savez, not np.savez_compressed")]
    Compressed(&'static str),
    /// An entry's bytes are not those that were written.
    #[error("array {0:?} is damaged: its checksum does not match")]
    Checksum(&'static str),
    /// An entry is not in numpy's format, version 1 to 3, or cut short.
    #[error("array {array:?} is not in numpy's format: {defect}")]
    Malformed {
        /// The array.
        array: &'static str,
        /// What is wrong.
        defect: &'static str,
    },
    /// An array has another element type.
    #[error("array {array:?} has elements {found}; {expected} are expected")]
    ElementType {
        /// The array.
        array: &'static str,
        /// Type found, as numpy writes it.
        found: String,
        /// Types that are read.
        expected: &'static str,
    },
    /// An array has another shape.
    #[error("array {array:?} has shape {found:?}; {expected} is expected")]
    Shape {
        /// The array.
        array: &'static str,
        /// Shape found.
        found: Vec<usize>,
        /// Shape that is read.
        expected: &'static str,
    },
    /// The patches have another degree.
    #[error("patches of degree {0} cannot be read, only of degree 6 or 7")]
    Degree(i64),
    /// A vertex index is negative or too large for 32 bits.
    #[error("face {face} names vertex {vertex}")]
    Vertex {
        /// The face.
        face: usize,
        /// The index.
        vertex: i64,
    },
}

/// Reads the surface of an archive. `degree` may be absent; it is 7 then.
///
/// # Errors
/// [`NpzError`].
pub fn read_npz(input: &mut dyn Read) -> Result<NpzSurface, NpzError> {
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes)?;
    let directory = Directory::of(&bytes)?;
    let degree = match directory.find("degree") {
        None => DEGREE,
        Some(entry) => match Array::parse("degree", entry?)?.integers()?.as_slice() {
            [6] => 6,
            [7] => DEGREE,
            other => return Err(NpzError::Degree(other.first().copied().unwrap_or(-1))),
        },
    };
    let vertices = directory.array("vertices")?.shaped("(V, 3)", &[3])?.floats()?;
    let faces = directory.array("faces")?.shaped("(F, 3)", &[3])?.integers()?;
    let (n_control, shape) =
        if degree == 6 { (N_SEXTIC, "(F, 28, 3)") } else { (N_CONTROL, "(F, 36, 3)") };
    let nets = directory.array("control_points")?.shaped(shape, &[n_control, 3])?.floats()?;
    let point = |p: &[f64]| Vec3::new(p[0], p[1], p[2]);
    let net = |row: &[f64]| match degree {
        6 => raise_sextic(&std::array::from_fn(|q| point(&row[3 * q..3 * q + 3]))),
        _ => std::array::from_fn(|q| point(&row[3 * q..3 * q + 3])),
    };
    Ok(NpzSurface {
        vertices: vertices.chunks_exact(3).map(point).collect(),
        faces: vertex_indices(&faces)?,
        control_points: nets.chunks_exact(3 * n_control).map(net).collect(),
    })
}

fn vertex_indices(flat: &[i64]) -> Result<Vec<[u32; 3]>, NpzError> {
    let index = |(at, &vertex): (usize, &i64)| {
        u32::try_from(vertex).map_err(|_| NpzError::Vertex { face: at / 3, vertex })
    };
    let flat = flat.iter().enumerate().map(index).collect::<Result<Vec<u32>, _>>()?;
    Ok(flat.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect())
}

/// The entries of an archive, by the directory at its end.
struct Directory<'a> {
    bytes: &'a [u8],
    /// Name and place of the central record of each entry.
    records: Vec<(&'a [u8], usize)>,
}

impl<'a> Directory<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, NpzError> {
        const END_SIZE: usize = 22;
        const TRUNCATED: NpzError = NpzError::NotAnArchive("its directory is cut short");
        // A comment of up to 65 535 bytes may follow the end record.
        let is_end = |at: &usize| u32_at(bytes, *at) == Some(END);
        let candidates = bytes.len().saturating_sub(END_SIZE + 0xffff)..bytes.len();
        let end = candidates.rev().find(is_end);
        let end = end.ok_or(NpzError::NotAnArchive("no zip directory at its end"))?;
        let n_entries = u16_at(bytes, end + 10).ok_or(TRUNCATED)?;
        let mut at = u32_at(bytes, end + 16).ok_or(TRUNCATED)? as usize;
        let mut records = Vec::new();
        for _ in 0..n_entries {
            if u32_at(bytes, at) != Some(CENTRAL) {
                return Err(NpzError::NotAnArchive("its directory is damaged"));
            }
            let [name, extra, comment] =
                [28, 30, 32].map(|k| u16_at(bytes, at + k).map(usize::from));
            let (Some(name), Some(extra), Some(comment)) = (name, extra, comment) else {
                return Err(TRUNCATED);
            };
            records.push((bytes.get(at + 46..at + 46 + name).ok_or(TRUNCATED)?, at));
            at += 46 + name + extra + comment;
        }
        Ok(Self { bytes, records })
    }

    fn array(&self, name: &'static str) -> Result<Array<'a>, NpzError> {
        Array::parse(name, self.find(name).ok_or(NpzError::Missing(name))??)
    }

    /// The bytes of an entry, verified.
    fn find(&self, name: &'static str) -> Option<Result<&'a [u8], NpzError>> {
        let file = format!("{name}.npy");
        let &(_, at) = self.records.iter().find(|(n, _)| *n == file.as_bytes())?;
        Some(self.entry(name, at))
    }

    fn entry(&self, name: &'static str, at: usize) -> Result<&'a [u8], NpzError> {
        let malformed = |defect| NpzError::Malformed { array: name, defect };
        if u16_at(self.bytes, at + 10) != Some(0) {
            return Err(NpzError::Compressed(name));
        }
        let [checksum, _, size] = [16, 20, 24].map(|k| u32_at(self.bytes, at + k));
        let local = u32_at(self.bytes, at + 42).map(|x| x as usize);
        let (Some(checksum), Some(size), Some(local)) = (checksum, size, local) else {
            return Err(malformed("its record is cut short"));
        };
        if u32_at(self.bytes, local) != Some(LOCAL) {
            return Err(malformed("its record points astray"));
        }
        let lengths = [26, 28].map(|k| u16_at(self.bytes, local + k).map_or(0, usize::from));
        let start = local + 30 + lengths[0] + lengths[1];
        let data = self.bytes.get(start..start.saturating_add(size as usize));
        let data = data.ok_or(malformed("its data is cut short"))?;
        if crc32fast::hash(data) != checksum {
            return Err(NpzError::Checksum(name));
        }
        Ok(data)
    }
}

/// One array in numpy's format.
struct Array<'a> {
    name: &'static str,
    dtype: &'a str,
    shape: Vec<usize>,
    data: &'a [u8],
}

impl<'a> Array<'a> {
    fn parse(name: &'static str, bytes: &'a [u8]) -> Result<Self, NpzError> {
        let malformed = |defect| NpzError::Malformed { array: name, defect };
        if !bytes.starts_with(b"\x93NUMPY") {
            return Err(malformed("its magic bytes are missing"));
        }
        // Version 1 counts the header in 16 bits, later ones in 32.
        let (start, length) = match bytes.get(6) {
            Some(1) => (10, u16_at(bytes, 8).map(usize::from)),
            Some(2 | 3) => (12, u32_at(bytes, 8).map(|x| x as usize)),
            _ => return Err(malformed("its version is unknown")),
        };
        let end = start + length.ok_or(malformed("its header is cut short"))?;
        let header = bytes.get(start..end).and_then(|h| std::str::from_utf8(h).ok());
        let header = header.ok_or(malformed("its header is cut short"))?;
        if after(header, "'fortran_order':").is_none_or(|rest| !rest.starts_with("False")) {
            return Err(malformed("its order is not rows first"));
        }
        let dtype = after(header, "'descr':").and_then(|rest| rest.split('\'').nth(1));
        let shape = after(header, "'shape':").and_then(parse_shape);
        let (Some(dtype), Some(shape)) = (dtype, shape) else {
            return Err(malformed("its header has no type or shape"));
        };
        Ok(Self { name, dtype, shape, data: &bytes[end..] })
    }

    /// The array itself if all its dimensions but the first are `row`.
    fn shaped(self, expected: &'static str, row: &[usize]) -> Result<Self, NpzError> {
        if self.shape.len() == row.len() + 1 && self.shape[1..] == *row {
            return Ok(self);
        }
        Err(NpzError::Shape { array: self.name, found: self.shape, expected })
    }

    fn floats(&self) -> Result<Vec<f64>, NpzError> {
        match self.dtype {
            "<f8" => self.elements(f64::from_le_bytes),
            found => Err(self.element_type(found, "<f8")),
        }
    }

    fn integers(&self) -> Result<Vec<i64>, NpzError> {
        match self.dtype {
            "<u4" => self.elements(|b| i64::from(u32::from_le_bytes(b))),
            "<i4" => self.elements(|b| i64::from(i32::from_le_bytes(b))),
            // Above i64::MAX the value turns negative and is refused as a vertex index.
            "<i8" | "<u8" => self.elements(i64::from_le_bytes),
            found => Err(self.element_type(found, "<u4, <i4, <u8 or <i8")),
        }
    }

    fn elements<T, const N: usize>(
        &self,
        decode: impl Fn([u8; N]) -> T,
    ) -> Result<Vec<T>, NpzError> {
        let count = self.shape.iter().try_fold(1_usize, |acc, &n| acc.checked_mul(n));
        if count.and_then(|n| n.checked_mul(N)) != Some(self.data.len()) {
            let defect = "its data does not fill its shape";
            return Err(NpzError::Malformed { array: self.name, defect });
        }
        Ok(self.data.as_chunks::<N>().0.iter().map(|&chunk| decode(chunk)).collect())
    }

    fn element_type(&self, found: &str, expected: &'static str) -> NpzError {
        NpzError::ElementType { array: self.name, found: found.to_owned(), expected }
    }
}

fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    header.split_once(key).map(|(_, rest)| rest.trim_start())
}

/// `(12, 3)`, `(12,)` or `()`.
fn parse_shape(rest: &str) -> Option<Vec<usize>> {
    let inside = rest.strip_prefix('(')?.split_once(')')?.0;
    let numbers = inside.split(',').map(str::trim).filter(|n| !n.is_empty());
    numbers.map(|n| n.parse().ok()).collect()
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Format, Options, sample, write};

    fn archive() -> Vec<u8> {
        let mut out = Vec::new();
        let patches = sample::ball_and_ring();
        write(Format::Npz, &patches.view(), &Options::default(), &mut out).unwrap();
        out
    }

    fn refused(bytes: &[u8]) -> String {
        read_npz(&mut &bytes[..]).unwrap_err().to_string()
    }

    /// Replaces the first occurrence and mends the checksums of nothing.
    fn replaced(from: &[u8], to: &[u8]) -> Vec<u8> {
        let mut bytes = archive();
        let at = bytes.windows(from.len()).position(|w| w == from).unwrap();
        bytes.splice(at..at + from.len(), to.iter().copied());
        bytes
    }

    #[test]
    fn what_was_written_is_read_back_in_all_bits() {
        let patches = sample::ball_and_ring();
        let found = read_npz(&mut &archive()[..]).unwrap();
        assert_eq!(found.faces, patches.face);
        let vertices: Vec<Vec3> = patches.position.iter().map(|&p| Vec3::from(p)).collect();
        assert_eq!(found.vertices, vertices);
        for (f, net) in found.control_points.iter().enumerate() {
            assert_eq!(*net, patches.view().net(f));
        }
    }

    #[test]
    fn patches_of_degree_6_are_read_back_raised() {
        let patches = sample::of_degree_six(sample::ball_and_ring());
        let mut bytes = Vec::new();
        write(Format::Npz, &patches.view(), &Options::default(), &mut bytes).unwrap();
        let shape = b"(200, 28, 3)";
        assert!(bytes.windows(shape.len()).any(|w| w == shape));
        let found = read_npz(&mut &bytes[..]).unwrap();
        for (f, net) in found.control_points.iter().enumerate() {
            for (a, b) in net.iter().zip(patches.view().net(f)) {
                assert!((a - b).norm() < 1e-14, "face {f}");
            }
        }
    }

    #[test]
    fn each_way_to_be_no_surface_has_its_own_message() {
        let whole = archive();
        assert!(refused(b"").contains("no zip directory"));
        assert!(refused(&whole[..whole.len() / 2]).contains("no zip directory"));
        let mut flipped = whole.clone();
        flipped[whole.len() / 2] ^= 1;
        assert!(refused(&flipped).contains("\"control_points\" is damaged"));
        let array = |header: &str| {
            let bytes = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..]].concat();
            let bytes = [&bytes, header.as_bytes(), &[0; 24]].concat();
            let found = Array::parse("vertices", &bytes);
            found.and_then(|a| a.shaped("(V, 3)", &[3])?.floats()).err().map(|e| e.to_string())
        };
        let header = |descr: &str, order: &str, shape: &str| {
            format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n")
        };
        assert_eq!(array(&header("<f8", "False", "(1, 3)")), None);
        assert!(array(&header("<f4", "False", "(1, 3)")).unwrap().contains("<f4"));
        assert!(array(&header("<f8", "True", "(1, 3)")).unwrap().contains("rows first"));
        assert!(array(&header("<f8", "False", "(3,)")).unwrap().contains("[3]"));
        assert!(array(&header("<f8", "False", "(2, 3)")).unwrap().contains("fill"));
    }

    #[test]
    fn a_renamed_array_is_missing() {
        let bytes = replaced(b"faces.npy", b"facet.npy");
        // The directory still knows the old name; rename there too.
        let at = bytes.windows(9).position(|w| w == b"faces.npy").unwrap();
        let mut bytes = bytes;
        bytes[at + 4] = b't';
        assert!(refused(&bytes).contains("no array \"faces\""));
    }

    #[test]
    fn no_cut_makes_the_reader_panic() {
        let whole = archive();
        for length in (0..whole.len()).step_by(97) {
            refused(&whole[..length]);
        }
    }

    #[test]
    fn an_index_that_is_none_is_refused() {
        let refused = vertex_indices(&[0, 1, 2, 3, -4, 5]).unwrap_err().to_string();
        assert_eq!(refused, "face 1 names vertex -4");
    }
}
