//! Binary PLY, little-endian: positions f64, normals f32, triangles.

use crate::ExportError;
use crate::tessellation::Tessellation;
use std::io::Write;

pub(crate) fn write(mesh: &Tessellation<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment isospline\n\
         element vertex {}\n\
         property double x\nproperty double y\nproperty double z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.n_points(),
        mesh.n_triangles()
    )?;
    mesh.for_each_point(|sample| {
        for x in &sample.position {
            out.write_all(&x.to_le_bytes())?;
        }
        for &x in &sample.normal {
            out.write_all(&(x as f32).to_le_bytes())?;
        }
        Ok::<(), ExportError>(())
    })?;
    for f in 0..mesh.n_faces() {
        for triangle in mesh.triangles(f) {
            out.write_all(&[3])?;
            for v in triangle {
                out.write_all(&v.to_le_bytes())?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use crate::tessellation::Density;

    #[test]
    fn the_header_counts_what_follows() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let mesh = Tessellation::new(&view, Density::Samples(3)).unwrap();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let end = b"end_header\n";
        let data = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let (n_points, n_triangles) = (mesh.n_points() as usize, mesh.n_triangles() as usize);
        assert_eq!(bytes.len() - data, 36 * n_points + 13 * n_triangles);
        let header = std::str::from_utf8(&bytes[..data]).unwrap();
        assert!(header.contains(&format!("element vertex {n_points}\n")));
        assert!(header.contains(&format!("element face {n_triangles}\n")));
        // The first point is the first vertex, in all bits.
        assert_eq!(bytes[data..data + 8], patches.position[0][0].to_le_bytes());
    }
}
