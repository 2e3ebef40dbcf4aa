//! Curve errors of all edges, computed anew only where the mesh has changed.

use crate::curve_error::{JudgedEdge, Measure};
use crate::surface_mesh::SurfaceMesh;
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
        self.own.update(
            surface,
            |_| true,
            |h| ([surface.mesh.origin(h), surface.mesh.target(h)], surface.wings(h)),
        )
    }

    /// Each edge with the error of the curve between the vertices opposite to it, at a border its
    /// own: the same edges in the same order as [`Self::edges`]. Infinite for those that are not
    /// `wanted`, unless known.
    pub(crate) fn diagonals(
        &mut self,
        surface: &SurfaceMesh<'_>,
        wanted: impl Fn(HalfEdge) -> bool,
    ) -> Vec<EdgeError> {
        self.diagonal.update(surface, wanted, |h| {
            let own = [surface.mesh.origin(h), surface.mesh.target(h)];
            match surface.wings(h) {
                // Seen from the left wing, the target of h lies to the left.
                Some(wings) => (wings, Some([own[1], own[0]])),
                None => (own, None),
            }
        })
    }
}

/// The ends of a curve and the vertices on its left and right.
type Pair = ([u32; 2], Option<[u32; 2]>);

/// Errors of the curves between pairs of vertices, one pair a half-edge row.
#[derive(Debug, Default)]
struct Rows {
    /// The vertices that the error depends on and how often they had moved.
    keys: Vec<[u32; 5]>,
    errors: Vec<f64>,
}

impl Rows {
    fn update(
        &mut self,
        surface: &SurfaceMesh<'_>,
        wanted: impl Fn(HalfEdge) -> bool,
        pair: impl Fn(HalfEdge) -> Pair,
    ) -> Vec<EdgeError> {
        let rows = 3 * surface.mesh.face_rows();
        self.keys.resize(rows, [u32::MAX; 5]);
        self.errors.resize(rows, 0.0);
        let mut edges = Vec::with_capacity(surface.mesh.face_count() * 3 / 2 + 1);
        let mut stale = Vec::new();
        let mut judged: Vec<JudgedEdge<'_>> = Vec::new();
        let moves = |v: u32| surface.moves[v as usize];
        for h in surface.mesh.edge_list() {
            let ([a, b], wings) = pair(h);
            let mut key = [a, b, u32::MAX, u32::MAX, moves(a) + moves(b)];
            // Curves of the paper leave along the chord whatever stands beside them.
            let wings = wings.filter(|_| matches!(surface.measure, Measure::Normal(_)));
            if let Some([c, d]) = wings {
                key = [a, b, c, d, key[4] + moves(c) + moves(d)];
            }
            if self.keys[h.row()] != key {
                if !wanted(h) {
                    edges.push((h, f64::INFINITY));
                    continue;
                }
                self.keys[h.row()] = key;
                stale.push(edges.len());
                let wings = wings.map(|wings| wings.map(|v| surface.at(v)));
                judged.push(JudgedEdge { ends: [surface.at(a), surface.at(b)], wings });
            }
            edges.push((h, self.errors[h.row()]));
        }
        let found = surface.measure.errors(surface.field, surface.host, &judged);
        for (at, error) in stale.into_iter().zip(found) {
            edges[at].1 = error;
            self.errors[edges[at].0.row()] = error;
        }
        edges
    }
}
