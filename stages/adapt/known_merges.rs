//! What merging an edge would give, kept from one round to the next while nothing about it changes.

use crate::surface_mesh::SurfaceMesh;
use crate::vertex::Vertex;
use isospline_geometry::HalfEdge;

/// An edge that may be merged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merge {
    /// The edge.
    pub(crate) h: HalfEdge,
    /// The vertex that its ends become; `None` if there is none that the gate bears.
    pub(crate) merged: Option<Vertex>,
    /// Error of the longest curve about that vertex, once judged.
    pub(crate) longest: Option<f64>,
    /// Largest error of all curves about it, once judged.
    pub(crate) whole: Option<f64>,
}

/// The merges that one round looked at.
#[derive(Debug, Default)]
pub(crate) struct KnownMerges {
    /// When that was; 0 is before all.
    time: u32,
    /// In the order of their edges.
    merges: Vec<Merge>,
}

impl KnownMerges {
    /// Keeps what a round has found, and forgets those before it.
    pub(crate) fn keep(&mut self, time: u32, mut merges: Vec<Merge>) {
        merges.sort_unstable_by_key(|merge| merge.h);
        *self = Self { time, merges };
    }

    /// What is known of an edge, if all faces about its ends are as they were.
    pub(crate) fn get(&self, surface: &SurfaceMesh<'_>, h: HalfEdge) -> Option<Merge> {
        let at = self.merges.binary_search_by_key(&h, |merge| merge.h).ok()?;
        let is_same = |v: u32| surface.fan_is_as_at(self.time, v);
        let ends = [surface.mesh.origin(h), surface.mesh.target(h)];
        ends.into_iter().all(is_same).then(|| self.merges[at])
    }
}
