//! numpy archives: `np.load(file)["control_points"]` is all of the surface.
//!
//! `vertices` (V, 3) f64, `faces` (F, 3) u32, `control_points` (F, 36, 3) f64 in storage order,
//! of degree 6 (F, 28, 3), `degree` i32 scalar. All little-endian, rows first.

use crate::ExportError;
use crate::zip_archive::{self, Content};
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::n_control;
use std::io::{self, Write};

pub(crate) fn write(patches: &PatchesView<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    let (n_vertices, n_faces) = (patches.position.len(), patches.face.len());
    let vertices: Content<'_> = &|out| {
        array_header(out, "<f8", &format!("({n_vertices}, 3)"))?;
        write_floats(out, patches.position.iter().flatten())
    };
    let faces: Content<'_> = &|out| {
        array_header(out, "<u4", &format!("({n_faces}, 3)"))?;
        for face in patches.face {
            for v in face {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        Ok(())
    };
    let control_points: Content<'_> = &|out| {
        let n_points = n_control(patches.degree());
        array_header(out, "<f8", &format!("({n_faces}, {n_points}, 3)"))?;
        for f in 0..n_faces {
            write_floats(out, patches.own_net(f).iter().flatten())?;
        }
        Ok(())
    };
    let degree: Content<'_> = &|out| {
        array_header(out, "<i4", "()")?;
        out.write_all(&(patches.degree() as i32).to_le_bytes())
    };
    let entries = [
        ("vertices.npy", vertices),
        ("faces.npy", faces),
        ("control_points.npy", control_points),
        ("degree.npy", degree),
    ];
    zip_archive::write("npz", &entries, out)
}

fn write_floats<'a>(out: &mut dyn Write, values: impl Iterator<Item = &'a f64>) -> io::Result<()> {
    for x in values {
        out.write_all(&x.to_le_bytes())?;
    }
    Ok(())
}

/// Header of version 1.0 of numpy's format, padded so that the data stands at a multiple of 64.
fn array_header(out: &mut dyn Write, dtype: &str, shape: &str) -> io::Result<()> {
    const PREFIX: usize = 10;
    let mut dict = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}");
    while !(PREFIX + dict.len() + 1).is_multiple_of(64) {
        dict.push(' ');
    }
    dict.push('\n');
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&(dict.len() as u16).to_le_bytes())?;
    out.write_all(dict.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_data_stands_at_a_multiple_of_sixty_four() {
        for shape in ["()", "(12345, 3)", "(1234567, 36, 3)"] {
            let mut header = Vec::new();
            array_header(&mut header, "<f8", shape).unwrap();
            assert_eq!(header.len() % 64, 0);
            assert_eq!(header.last(), Some(&b'\n'));
        }
    }
}
