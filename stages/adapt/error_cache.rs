//! Curve errors of all edges, computed anew only where the mesh has changed.

use crate::curve_error::curve_errors;
use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;

/// An edge with the error of its curve, in model units.
pub(crate) type EdgeError = (HalfEdge, f64);

/// Errors of the curves of a mesh's edges and of the diagonals that flips would give.
///
/// It follows one mesh through its edits, also back to an earlier state, but not from there to
/// other edits: how often a vertex has moved tells its places apart only along one history.
#[derive(Debug, Default)]
pub(crate) struct ErrorCache {
    own: Rows,
    diagonal: Rows,
}

impl ErrorCache {
    /// Each edge with the error of its own curve.
    pub(crate) fn edges(&mut self, surface: &SurfaceMesh<'_>) -> Vec<EdgeError> {
        self.own.update(surface, |h| [surface.mesh.origin(h), surface.mesh.target(h)])
    }

    /// Each edge with the error of the curve between the vertices opposite to it, at a border its
    /// own: the same edges in the same order as [`Self::edges`].
    pub(crate) fn diagonals(&mut self, surface: &SurfaceMesh<'_>) -> Vec<EdgeError> {
        self.diagonal.update(surface, |h| {
            let own = [surface.mesh.origin(h), surface.mesh.target(h)];
            surface.wings(h).unwrap_or(own)
        })
    }
}

/// Errors of the curves between pairs of vertices, one pair a half-edge row.
#[derive(Debug, Default)]
struct Rows {
    /// The two vertices of the pair and how often both had moved.
    keys: Vec<[u32; 3]>,
    errors: Vec<f64>,
}

impl Rows {
    fn update(
        &mut self,
        surface: &SurfaceMesh<'_>,
        pair: impl Fn(HalfEdge) -> [u32; 2],
    ) -> Vec<EdgeError> {
        let rows = 3 * surface.mesh.face_rows();
        self.keys.resize(rows, [u32::MAX; 3]);
        self.errors.resize(rows, 0.0);
        let mut edges = Vec::with_capacity(surface.mesh.face_count() * 3 / 2 + 1);
        let mut stale = Vec::new();
        let mut ends: Vec<[&Vertex; 2]> = Vec::new();
        for h in surface.mesh.edge_list() {
            let [a, b] = pair(h);
            let key = [a, b, surface.moves[a as usize] + surface.moves[b as usize]];
            if self.keys[h.row()] != key {
                self.keys[h.row()] = key;
                stale.push(edges.len());
                ends.push([surface.at(a), surface.at(b)]);
            }
            edges.push((h, self.errors[h.row()]));
        }
        let found = curve_errors(surface.field, surface.host, &ends);
        for (at, error) in stale.into_iter().zip(found) {
            edges[at].1 = error;
            self.errors[edges[at].0.row()] = error;
        }
        edges
    }
}
