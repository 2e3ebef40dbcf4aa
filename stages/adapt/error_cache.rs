//! Curve errors of edges, computed anew only where the mesh has changed.

use crate::curve_error::{JudgedEdge, Measure};
use crate::known_merges::KnownMerges;
use crate::surface_mesh::SurfaceMesh;
use isospline_geometry::HalfEdge;
use isospline_stage::{Serial, map};

/// An edge with the error of its curve, in model units.
pub(crate) type EdgeError = (HalfEdge, f64);

/// Edges looked at in a task.
const EDGES_A_TASK: usize = 256;
/// Diagonals judged in a task.
const DIAGONALS_A_TASK: usize = 128;

/// Errors of the curves of a mesh's edges, of the diagonals that flips would give and of what merging
/// edges would.
///
/// It follows one mesh through its edits, also back to an earlier state, but not from there to
/// other edits: how often a vertex has moved tells its places apart only along one history.
#[derive(Debug, Default)]
pub(crate) struct ErrorCache {
    own: Rows,
    /// When the errors of all edges were known; 0 is before all.
    complete: u32,
    diagonal: Rows,
    pub(crate) merges: KnownMerges,
}

impl ErrorCache {
    /// Each edge with the error of its own curve.
    pub(crate) fn edges(&mut self, surface: &SurfaceMesh<'_>) -> Vec<EdgeError> {
        self.own.grow(surface);
        let open = edges_edited_since(surface, self.complete);
        let tasks: Vec<_> = open.chunks(EDGES_A_TASK).collect();
        let rows = &self.own;
        let found = map(surface.host, tasks.len(), |task| {
            rows.look(surface, tasks[task].iter().copied(), |_| true, own_pair)
        });
        for look in found {
            self.own.take(surface, look);
        }
        self.complete = surface.now();
        let edges = surface.mesh.edge_list(0..surface.mesh.face_rows());
        edges.into_iter().map(|h| (h, self.own.errors[h.row()])).collect()
    }

    /// Those of some edges, with the errors of their own curves, for which it `is_better` to have
    /// the curve between the vertices opposite to them, of which it is told both errors; at a border
    /// that is their own. Curves that are not `wanted` have infinite errors, unless known.
    pub(crate) fn better_flips(
        &mut self,
        surface: &SurfaceMesh<'_>,
        edges: &[EdgeError],
        wanted: impl Fn(HalfEdge) -> bool + Sync,
        is_better: impl Fn(HalfEdge, [f64; 2]) -> bool + Sync,
    ) -> Vec<HalfEdge> {
        self.diagonal.grow(surface);
        let tasks: Vec<_> = edges.chunks(DIAGONALS_A_TASK).collect();
        let rows = &self.diagonal;
        let found = map(surface.host, tasks.len(), |task| {
            let halves = tasks[task].iter().map(|&(h, _)| h);
            let look = rows.look(surface, halves, &wanted, diagonal_pair);
            let both = tasks[task].iter().zip(&look.edges);
            let is_better =
                |&(&(h, now), &(_, then)): &(&EdgeError, &EdgeError)| is_better(h, [now, then]);
            let better: Vec<HalfEdge> = both.filter(is_better).map(|(&(h, _), _)| h).collect();
            (look, better)
        });
        let mut all = Vec::new();
        for (look, better) in found {
            all.extend(better);
            self.diagonal.take(surface, look);
        }
        all
    }

    /// What [`Self::better_flips`] found of an edge, if nothing beside it has changed since.
    pub(crate) fn known_diagonal(&self, surface: &SurfaceMesh<'_>, h: HalfEdge) -> Option<f64> {
        self.diagonal.known(surface, h)
    }
}

/// The edges beside faces that were edited after a time, one half-edge each: the lower.
fn edges_edited_since(surface: &SurfaceMesh<'_>, time: u32) -> Vec<HalfEdge> {
    let mut edges = Vec::new();
    for face in surface.mesh.live_faces().filter(|&f| !surface.is_as_at(time, f)) {
        for h in [0, 1, 2].map(|k| HalfEdge::new(face, k)) {
            let other = surface.mesh.opposite(h);
            // The lower one comes by itself if its face was edited too.
            match other.filter(|&o| o < h) {
                Some(o) if surface.is_as_at(time, o.face()) => edges.push(o),
                Some(_) => {}
                None => edges.push(h),
            }
        }
    }
    edges
}

/// The ends of a curve and the vertices on its left and right.
type Pair = ([u32; 2], Option<[u32; 2]>);

fn own_pair(surface: &SurfaceMesh<'_>, h: HalfEdge) -> Pair {
    ([surface.mesh.origin(h), surface.mesh.target(h)], surface.wings(h))
}

fn diagonal_pair(surface: &SurfaceMesh<'_>, h: HalfEdge) -> Pair {
    let own = [surface.mesh.origin(h), surface.mesh.target(h)];
    match surface.wings(h) {
        // Seen from the left wing, the target of h lies to the left.
        Some(wings) => (wings, Some([own[1], own[0]])),
        None => (own, None),
    }
}

/// The vertices that an error depends on and how often they had moved.
type Key = [u32; 5];

/// The key of what is not known.
const NO_KEY: Key = [u32::MAX; 5];

/// Errors of the curves between pairs of vertices, one pair a half-edge row.
#[derive(Debug, Default)]
struct Rows {
    keys: Vec<Key>,
    errors: Vec<f64>,
    /// When each row was looked at last; 0 is before all.
    seen: Vec<u32>,
}

/// What was found of some edges.
struct Look {
    edges: Vec<EdgeError>,
    /// Places in the list of those that are new, with their keys.
    new: Vec<(u32, Key)>,
}

impl Rows {
    fn grow(&mut self, surface: &SurfaceMesh<'_>) {
        let rows = 3 * surface.mesh.face_rows();
        self.keys.resize(rows, NO_KEY);
        self.errors.resize(rows, 0.0);
        self.seen.resize(rows, 0);
    }

    /// The error of a row, if the faces on both sides are as they were.
    fn known(&self, surface: &SurfaceMesh<'_>, h: HalfEdge) -> Option<f64> {
        let seen = *self.seen.get(h.row())?;
        let is_same = |h: HalfEdge| surface.is_as_at(seen, h.face());
        (is_same(h) && surface.mesh.opposite(h).is_none_or(is_same)).then(|| self.errors[h.row()])
    }

    fn look(
        &self,
        surface: &SurfaceMesh<'_>,
        edges: impl ExactSizeIterator<Item = HalfEdge>,
        wanted: impl Fn(HalfEdge) -> bool,
        pair: impl Fn(&SurfaceMesh<'_>, HalfEdge) -> Pair,
    ) -> Look {
        let mut look = Look { edges: Vec::with_capacity(edges.len()), new: Vec::new() };
        let (mut judged, mut places) = (Vec::new(), Vec::new());
        for (h, place) in edges.zip(0u32..) {
            if let Some(error) = self.known(surface, h) {
                look.edges.push((h, error));
                continue;
            }
            let (ends, wings) = pair(surface, h);
            // Curves of the paper leave along the chord whatever stands beside them.
            let wings = wings.filter(|_| matches!(surface.measure, Measure::Normal(_)));
            let key = key(surface, ends, wings);
            if self.keys[h.row()] == key {
                look.edges.push((h, self.errors[h.row()]));
                look.new.push((place, key));
            } else if wanted(h) {
                let at = |pair: [u32; 2]| pair.map(|v| surface.at(v));
                judged.push(JudgedEdge { ends: at(ends), wings: wings.map(at) });
                places.push(place);
                look.edges.push((h, 0.0));
                look.new.push((place, key));
            } else {
                look.edges.push((h, f64::INFINITY));
                look.new.push((place, NO_KEY));
            }
        }
        let found = surface.measure.errors(surface.field, &Serial, &judged);
        for (place, error) in places.into_iter().zip(found) {
            look.edges[place as usize].1 = error;
        }
        look
    }

    fn take(&mut self, surface: &SurfaceMesh<'_>, look: Look) {
        for (place, key) in look.new {
            let (h, error) = look.edges[place as usize];
            self.keys[h.row()] = key;
            self.errors[h.row()] = error;
            self.seen[h.row()] = surface.now();
        }
    }
}

fn key(surface: &SurfaceMesh<'_>, [a, b]: [u32; 2], wings: Option<[u32; 2]>) -> Key {
    let moves = |v: u32| surface.moves[v as usize];
    let ends = moves(a) + moves(b);
    match wings {
        Some([c, d]) => [a, b, c, d, ends + moves(c) + moves(d)],
        None => [a, b, u32::MAX, u32::MAX, ends],
    }
}
