//! VTK unstructured grids: one cell of type 76, `VTK_BEZIER_TRIANGLE`, a face, exact.
//!
//! Points are merged: the vertices, six a raised edge, fifteen a face (five and ten of degree 6); so
//! neighbouring cells share the points of their edge. Arrays follow the XML as raw bytes.

use crate::ExportError;
use crate::node_order::corners_edges_inside;
use isospline_artifact::kinds::PatchesView;
use isospline_geometry::bezier_triangle::{boundary_index, exponents, index, n_control};
use std::io::{self, Write};

const VTK_BEZIER_TRIANGLE: u8 = 76;

pub(crate) fn write(patches: &PatchesView<'_>, out: &mut dyn Write) -> Result<(), ExportError> {
    let (n_vertices, n_edges) = (patches.position.len(), patches.boundary.len());
    let (n_faces, degree) = (patches.face.len(), patches.degree());
    let n_points = n_vertices + (degree - 1) * n_edges + interior(degree).len() * n_faces;
    let n_control = n_control(degree);
    let sizes = [24 * n_points, 8 * n_control * n_faces, 8 * n_faces, n_faces];
    write_head(out, n_points, n_faces, sizes)?;
    begin_array(out, sizes[0])?;
    write_points(patches, out)?;
    begin_array(out, sizes[1])?;
    let order = corners_edges_inside(degree);
    for f in 0..n_faces {
        let numbers = point_numbers(patches, f);
        for &q in &order {
            out.write_all(&(numbers[q] as i64).to_le_bytes())?;
        }
    }
    begin_array(out, sizes[2])?;
    for f in 1..=n_faces {
        out.write_all(&((n_control * f) as i64).to_le_bytes())?;
    }
    begin_array(out, sizes[3])?;
    for _ in 0..n_faces {
        out.write_all(&[VTK_BEZIER_TRIANGLE])?;
    }
    out.write_all(b"\n  </AppendedData>\n</VTKFile>\n")?;
    Ok(())
}

fn write_head(
    out: &mut dyn Write,
    n_points: usize,
    n_faces: usize,
    sizes: [usize; 4],
) -> io::Result<()> {
    // Each array is preceded by its size in 8 bytes.
    let offset = |k: usize| sizes[..k].iter().map(|n| n + 8).sum::<usize>();
    let (points, connectivity, offsets, types) = (offset(0), offset(1), offset(2), offset(3));
    let data = r#"format="appended" offset"#;
    write!(
        out,
        r#"<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="2.2" byte_order="LittleEndian" header_type="UInt64">
  <UnstructuredGrid>
    <Piece NumberOfPoints="{n_points}" NumberOfCells="{n_faces}">
      <Points>
        <DataArray type="Float64" Name="Points" NumberOfComponents="3" {data}="{points}"/>
      </Points>
      <Cells>
        <DataArray type="Int64" Name="connectivity" {data}="{connectivity}"/>
        <DataArray type="Int64" Name="offsets" {data}="{offsets}"/>
        <DataArray type="UInt8" Name="types" {data}="{types}"/>
      </Cells>
    </Piece>
  </UnstructuredGrid>
  <AppendedData encoding="raw">
   _"#
    )
}

fn begin_array(out: &mut dyn Write, size: usize) -> io::Result<()> {
    out.write_all(&(size as u64).to_le_bytes())
}

/// Vertices, then the inner points of raised edges from the lower vertex, then those of faces.
fn write_points(patches: &PatchesView<'_>, out: &mut dyn Write) -> io::Result<()> {
    let mut put = |p: &[f64]| p.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()));
    for p in patches.position {
        put(p)?;
    }
    let degree = patches.degree();
    for half in halves_from_the_lower_vertex(patches) {
        let net = patches.own_net(half / 3);
        for s in 1..degree {
            put(net[boundary_index(degree, half % 3, s)].as_slice())?;
        }
    }
    let interior = interior(degree);
    for f in 0..patches.face.len() {
        let net = patches.own_net(f);
        interior.iter().try_for_each(|&q| put(net[q].as_slice()))?;
    }
    Ok(())
}

/// For each edge, a half-edge that runs from its lower to its higher vertex.
fn halves_from_the_lower_vertex(patches: &PatchesView<'_>) -> Vec<usize> {
    let mut out = vec![0; patches.boundary.len()];
    for (half, &edge) in patches.edge_of.iter().enumerate() {
        if runs_upward(patches, half) {
            out[edge as usize] = half;
        }
    }
    out
}

fn runs_upward(patches: &PatchesView<'_>, half: usize) -> bool {
    let (face, corner) = (patches.face[half / 3], half % 3);
    face[corner] < face[(corner + 1) % 3]
}

/// Numbers of the points of face `f`, in storage order.
fn point_numbers(patches: &PatchesView<'_>, f: usize) -> Vec<usize> {
    let (n_vertices, n_edges) = (patches.position.len(), patches.boundary.len());
    let degree = patches.degree();
    let (n_edge, interior) = (degree - 1, interior(degree));
    let mut numbers = vec![0; n_control(degree)];
    for corner in 0..3 {
        numbers[boundary_index(degree, corner, 0)] = patches.face[f][corner] as usize;
        let half = 3 * f + corner;
        let first = n_vertices + n_edge * patches.edge_of[half] as usize;
        for s in 1..degree {
            let step = if runs_upward(patches, half) { s } else { degree - s };
            numbers[boundary_index(degree, corner, s)] = first + step - 1;
        }
    }
    let first = n_vertices + n_edge * n_edges + interior.len() * f;
    for (slot, q) in interior.into_iter().enumerate() {
        numbers[q] = first + slot;
    }
    numbers
}

/// Indices of the control points on no edge, in storage order.
fn interior(degree: usize) -> Vec<usize> {
    exponents(degree).filter(|e| e.iter().all(|&x| x > 0)).map(index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;
    use isospline_geometry::Vec3;

    #[test]
    fn points_by_number_are_the_nets_in_all_bits() {
        let septic = sample::ball_and_ring();
        for patches in [sample::of_degree_six(septic.clone()), septic] {
            let view = patches.view();
            let mut bytes = Vec::new();
            write_points(&view, &mut bytes).unwrap();
            let coordinates: Vec<f64> =
                bytes.as_chunks::<8>().0.iter().map(|&b| f64::from_le_bytes(b)).collect();
            for f in 0..view.face.len() {
                for (number, p) in point_numbers(&view, f).into_iter().zip(view.own_net(f)) {
                    let found = Vec3::from_column_slice(&coordinates[3 * number..3 * number + 3]);
                    assert_eq!(found.map(f64::to_bits), p.map(f64::to_bits));
                }
            }
        }
    }

    #[test]
    fn arrays_stand_where_the_head_says() {
        let septic = sample::ball_and_ring();
        for (patches, n) in [(sample::of_degree_six(septic.clone()), 28), (septic, 36)] {
            let mut bytes = Vec::new();
            write(&patches.view(), &mut bytes).unwrap();
            let start = bytes.windows(2).position(|w| w == b" _").unwrap() + 2;
            let head = std::str::from_utf8(&bytes[..start]).unwrap();
            let n_faces = patches.face.len() as u64;
            let wanted = [n_faces * n * 8, n_faces * 8, n_faces];
            for (name, size) in ["connectivity", "offsets", "types"].into_iter().zip(wanted) {
                let tag = head.split_once(name).unwrap().1.split_once("offset=\"").unwrap().1;
                let offset: usize = tag.split_once('"').unwrap().0.parse().unwrap();
                let at = start + offset;
                assert_eq!(bytes[at..at + 8], size.to_le_bytes(), "{name}");
            }
            assert!(bytes.ends_with(b"\x4c\n  </AppendedData>\n</VTKFile>\n"));
        }
    }
}
