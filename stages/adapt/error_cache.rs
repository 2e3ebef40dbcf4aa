//! Curve errors of all edges, computed anew only where the mesh has changed.

use crate::curve_error::curve_errors;
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;

/// An edge with the error of its curve, in model units.
pub(crate) type EdgeError = (HalfEdge, f64);

/// Errors of the curves between pairs of vertices, one pair a half-edge row.
#[derive(Debug, Default)]
pub(crate) struct ErrorCache {
    /// The two vertices of the pair and how often each had moved.
    keys: Vec<[u32; 4]>,
    errors: Vec<f64>,
}

impl ErrorCache {
    /// Each edge with the error of its own curve.
    pub(crate) fn edges(&mut self, surface: &SurfaceMesh<'_>) -> Vec<EdgeError> {
        self.update(surface, |h| [surface.mesh.origin(h), surface.mesh.target(h)])
    }

    /// Each edge with the error of the curve between the vertices opposite to it, at a border its
    /// own: the same edges in the same order as [`Self::edges`].
    pub(crate) fn diagonals(&mut self, surface: &SurfaceMesh<'_>) -> Vec<EdgeError> {
        self.update(surface, |h| {
            let own = [surface.mesh.origin(h), surface.mesh.target(h)];
            surface.wings(h).unwrap_or(own)
        })
    }

    fn update(
        &mut self,
        surface: &SurfaceMesh<'_>,
        pair: impl Fn(HalfEdge) -> [u32; 2],
    ) -> Vec<EdgeError> {
        let rows = 3 * surface.mesh.face_rows();
        self.keys.resize(rows, [u32::MAX; 4]);
        self.errors.resize(rows, 0.0);
        let mut stale = Vec::new();
        let mut ends: Vec<[&Vertex; 2]> = Vec::new();
        for h in surface.mesh.edges() {
            let [a, b] = pair(h);
            let key = [a, b, surface.moves[a as usize], surface.moves[b as usize]];
            if self.keys[h.row()] != key {
                self.keys[h.row()] = key;
                stale.push(h);
                ends.push([surface.at(a), surface.at(b)]);
            }
        }
        for (h, error) in stale.iter().zip(curve_errors(surface.field, &ends)) {
            self.errors[h.row()] = error;
        }
        surface.mesh.edges().map(|h| (h, self.errors[h.row()])).collect()
    }
}
