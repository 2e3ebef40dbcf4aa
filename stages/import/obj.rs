//! Wavefront OBJ: vertices and triangles; everything else is passed over.

/// Why a text is not a triangle mesh; lines count from 1.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjError {
    /// A vertex line without three finite numbers.
    #[error("line {line}: a vertex needs three finite numbers")]
    Vertex {
        /// The line.
        line: usize,
    },
    /// A face with other than three corners.
    #[error("line {line}: a face with {corners} corners; only triangles can be read")]
    Corners {
        /// The line.
        line: usize,
        /// Corners found.
        corners: usize,
    },
    /// A corner that names no vertex read so far.
    #[error("line {line}: {text:?} names no vertex; {vertices} are known so far")]
    Index {
        /// The line.
        line: usize,
        /// The corner as written.
        text: String,
        /// Vertices read so far.
        vertices: usize,
    },
}

/// Positions, and the corners of each face numbered from 0.
pub type ObjRows = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Positions and faces of an OBJ text.
///
/// Corners may be `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count backwards.
///
/// # Errors
/// The first line that cannot be read.
pub fn parse_obj(text: &str) -> Result<ObjRows, ObjError> {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (at, content) in text.lines().enumerate() {
        let line = at + 1;
        let mut words = content.split_whitespace();
        match words.next() {
            Some("v") => positions.push(vertex(words, line)?),
            Some("f") => faces.push(face(words, line, positions.len())?),
            _ => {}
        }
    }
    Ok((positions, faces))
}

fn vertex<'a>(words: impl Iterator<Item = &'a str>, line: usize) -> Result<[f64; 3], ObjError> {
    let number = |word: &str| word.parse().ok().filter(|x: &f64| x.is_finite());
    let numbers: Option<Vec<f64>> = words.take(3).map(number).collect();
    numbers.and_then(|v| v.try_into().ok()).ok_or(ObjError::Vertex { line })
}

fn face<'a>(
    words: impl Iterator<Item = &'a str>,
    line: usize,
    vertices: usize,
) -> Result<[u32; 3], ObjError> {
    let corners: Vec<&str> = words.collect();
    let [a, b, c] = corners[..] else {
        return Err(ObjError::Corners { line, corners: corners.len() });
    };
    let corner = |text: &str| {
        index(text, vertices).ok_or_else(|| ObjError::Index { line, text: text.into(), vertices })
    };
    Ok([corner(a)?, corner(b)?, corner(c)?])
}

/// Vertex of a corner, from 0.
fn index(corner: &str, vertices: usize) -> Option<u32> {
    let written: i64 = corner.split('/').next()?.parse().ok()?;
    let known = vertices as i64;
    let from_zero = if written < 0 { known + written } else { written - 1 };
    (0..known).contains(&from_zero).then(|| u32::try_from(from_zero).ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_of_corners_are_read() {
        let text = "# comment\r\nv 0 0 0 1.0\nv 1 0 0\nv 0 1e0 -0.5\nvn 0 0 1\n\
                    f 1 2/7 3//1\nf -3/1/1 -2 -1\n";
        let (positions, faces) = parse_obj(text).unwrap();
        assert_eq!(positions[2].map(f64::to_bits), [0.0, 1.0, -0.5].map(f64::to_bits));
        assert_eq!(faces, [[0, 1, 2], [0, 1, 2]]);
    }

    #[test]
    fn errors_name_the_line() {
        let check = |text: &str, expected| assert_eq!(parse_obj(text).unwrap_err(), expected);
        check("v 0 0\n", ObjError::Vertex { line: 1 });
        check("\nv 0 nan 0\n", ObjError::Vertex { line: 2 });
        check("v 0 0 0\nf 1 1 1 1\n", ObjError::Corners { line: 2, corners: 4 });
        let index = |text: &str| ObjError::Index { line: 2, text: text.into(), vertices: 1 };
        check("v 0 0 0\nf 1 2 1\n", index("2"));
        check("v 0 0 0\nf 0 1 1\n", index("0"));
        check("v 0 0 0\nf -2 1 1\n", index("-2"));
        check("v 0 0 0\nf a 1 1\n", index("a"));
    }
}
