//! Collapses that were refused, kept until something near them changes.
//!
//! Edges are queued again and again, since what is refused may be allowed later. Where a mesh has
//! come to its end, as a thousand small spheres have long before they are few enough, nearly all
//! would be looked at in vain.

use isospline_geometry::{EditMesh, HalfEdge};

/// When collapses were refused and vertices changed; of the same time, the change came first.
#[derive(Debug)]
pub(crate) struct Refusals {
    now: u32,
    /// When the collapse of each half-edge was refused; 0 is never.
    refused: Vec<u32>,
    /// When a vertex, one that an edge joins it to, or an edge about it changed last.
    changed: Vec<u32>,
}

impl Refusals {
    /// Nothing has been refused yet.
    pub(crate) fn new(mesh: &EditMesh) -> Self {
        let (refused, changed) = (vec![0; 3 * mesh.face_rows()], vec![0; mesh.vertex_rows()]);
        Self { now: 1, refused, changed }
    }

    /// Other guards apply from now on.
    pub(crate) fn forget(&mut self) {
        self.refused.fill(0);
    }

    /// The collapse of `h` was refused.
    pub(crate) fn note(&mut self, h: HalfEdge) {
        self.refused[h.row()] = self.now;
    }

    /// An edge was merged into `vertex`.
    pub(crate) fn note_change(&mut self, mesh: &EditMesh, vertex: u32) {
        self.now += 1;
        self.changed[vertex as usize] = self.now;
        for v in mesh.neighbours(vertex) {
            self.changed[v as usize] = self.now;
        }
    }

    /// Whether the collapse of `h` was refused and would be again. The guards look at the fans of its
    /// ends and count the edges of the vertices opposite to it.
    pub(crate) fn still_hold(&self, mesh: &EditMesh, h: HalfEdge) -> bool {
        let refused = self.refused[h.row()];
        let Some(o) = mesh.opposite(h).filter(|_| refused > 0) else { return false };
        let about = [h, o].map(|h| [mesh.origin(h), mesh.origin(h.prev())]);
        about.as_flattened().iter().all(|&v| self.changed[v as usize] <= refused)
    }
}
