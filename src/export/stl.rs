//! Binary STL: a triangle soup, f32, whose shared corners agree in all bits.

use crate::ExportError;
use crate::tessellation::Tessellation;
use isospline_geometry::Vec3;
use std::io::{self, Write};

/// Must not begin with "solid": readers would take the file for text.
const HEADER: &[u8; 80] =
    b"binary STL, isospline                                                           ";

pub(crate) fn write(mesh: &Tessellation<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    out.write_all(HEADER)?;
    out.write_all(&(mesh.n_triangles() as u32).to_le_bytes())?;
    for f in 0..mesh.n_faces() {
        for [a, b, c] in mesh.triangle_positions(f) {
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            for v in [normal, a, b, c] {
                write_f32(out, &v)?;
            }
            // The attribute count, unused.
            out.write_all(&[0; 2])?;
        }
    }
    Ok(())
}

fn write_f32(out: &mut dyn Write, v: &Vec3) -> io::Result<()> {
    v.iter().try_for_each(|&x| out.write_all(&(x as f32).to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use crate::tessellation::Density;
    use std::collections::BTreeMap;

    #[test]
    fn every_directed_edge_has_its_reverse_in_all_bits() {
        let patches = sample::ball_and_ring();
        let view = patches.view();
        let mesh = Tessellation::new(&view, Density::Samples(4)).unwrap();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        let triangles = bytes[84..].as_chunks::<50>().0;
        assert_eq!(triangles.len() as u64, mesh.n_triangles());
        let mut directed: BTreeMap<([u8; 12], [u8; 12]), usize> = BTreeMap::new();
        for triangle in triangles {
            let corners = triangle[12..48].as_chunks::<12>().0;
            for k in 0..3 {
                *directed.entry((corners[k], corners[(k + 1) % 3])).or_default() += 1;
            }
        }
        for (&(a, b), &n) in &directed {
            assert_eq!((n, directed.get(&(b, a))), (1, Some(&1)));
        }
    }
}
