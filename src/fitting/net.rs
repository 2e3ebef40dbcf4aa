//! Nets of faces put together from the rows of several stages.

use crate::edge_end::outgoing_curve;
use isospline_artifact::kinds::{BaseMeshView, NetworkView};
use isospline_geometry::bezier_curve::{raise_quartic_to_septic, raise_quartic_to_sextic};
use isospline_geometry::bezier_triangle::{N_CONTROL, N_INTERIOR, net_of_boundary};
use isospline_geometry::degree_change::N_SEXTIC;
use isospline_geometry::{HalfEdge, Vec3};
use std::ops::Range;

/// The net of `face` with its boundary raised from the edges' quartics, zero inside.
///
/// Curves are raised from their lower vertex, so neighbours carry the same bits.
pub fn boundary_net(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    face: usize,
) -> [Vec3; N_CONTROL] {
    net_of_boundary(&curves(mesh, network, face, raise_quartic_to_septic))
}

/// The same of degree 6.
pub fn boundary_net_sextic(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    face: usize,
) -> [Vec3; N_SEXTIC] {
    net_of_boundary(&curves(mesh, network, face, raise_quartic_to_sextic))
}

/// The raised curves of a face, counter-clockwise.
fn curves<const N: usize>(
    mesh: &BaseMeshView<'_>,
    network: &NetworkView<'_>,
    face: usize,
    raise: impl Fn(&[Vec3; 5]) -> [Vec3; N],
) -> [[Vec3; N]; 3] {
    [0, 1, 2].map(|corner| {
        let h = 3 * face + corner;
        let e = mesh.edge_of[h] as usize;
        let lower = HalfEdge(mesh.edge_half[e][0]);
        let mut curve = raise(&outgoing_curve(mesh, network, lower));
        if lower.row() != h {
            curve.reverse();
        }
        curve
    })
}

/// Edges of `faces`, with repetitions.
pub fn needed_edges(mesh: &BaseMeshView<'_>, faces: Range<usize>) -> Vec<usize> {
    mesh.edge_of[3 * faces.start..3 * faces.end].iter().map(|&e| e as usize).collect()
}

/// Interior points as a row.
pub fn flat_interior(interior: &[Vec3; N_INTERIOR]) -> [f64; 3 * N_INTERIOR] {
    let mut row = [0.0; 3 * N_INTERIOR];
    for (place, point) in row.chunks_exact_mut(3).zip(interior) {
        place.copy_from_slice(point.as_slice());
    }
    row
}

/// Point `slot` of a row of points.
#[inline]
pub fn point(row: &[f64], slot: usize) -> Vec3 {
    Vec3::new(row[3 * slot], row[3 * slot + 1], row[3 * slot + 2])
}
