//! Nets of faces put together from the rows of several stages.

use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::Vec3;
use isospline_geometry::bezier_curve::raise_quartic_to_septic;
use isospline_geometry::bezier_triangle::{
    DEGREE, N_CONTROL, N_INTERIOR, boundary_index, interior_indices,
};
use std::ops::Range;

/// The net of `face` with its boundary raised from the edges' quartics, zero inside.
///
/// Curves are raised from their lower vertex, so neighbours carry the same bits.
pub fn boundary_net(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    face: usize,
) -> [Vec3; N_CONTROL] {
    let mut net = [Vec3::zeros(); N_CONTROL];
    for corner in 0..3 {
        let h = 3 * face + corner;
        let e = mesh.edge_of[h] as usize;
        let [a, b] = mesh.edge[e].map(|v| Vec3::from(mesh.position[v as usize]));
        let c = &network.control[e];
        let inner = |k: usize| Vec3::new(c[3 * k], c[3 * k + 1], c[3 * k + 2]);
        let mut curve = raise_quartic_to_septic(&[a, inner(0), inner(1), inner(2), b]);
        if mesh.edge_half[e][0] as usize != h {
            curve.reverse();
        }
        for (s, p) in curve.into_iter().enumerate() {
            net[boundary_index(DEGREE, corner, s)] = p;
        }
    }
    net
}

/// Edges of `faces`, with repetitions.
pub fn needed_edges(mesh: &BaseMeshView<'_>, faces: Range<usize>) -> Vec<usize> {
    mesh.edge_of[3 * faces.start..3 * faces.end].iter().map(|&e| e as usize).collect()
}

/// The 15 interior points of a net as a row.
pub fn flat_interior(net: &[Vec3; N_CONTROL]) -> [f64; 3 * N_INTERIOR] {
    let mut row = [0.0; 3 * N_INTERIOR];
    for (slot, i) in interior_indices().into_iter().enumerate() {
        row[3 * slot..3 * slot + 3].copy_from_slice(net[i].as_slice());
    }
    row
}

/// Point `slot` of a row of points.
#[inline]
pub fn point(row: &[f64], slot: usize) -> Vec3 {
    Vec3::new(row[3 * slot], row[3 * slot + 1], row[3 * slot + 2])
}
