//! A mesh under edit together with what the field says at its vertices.
//!
//! `*_cost` tells how bad the faces that an edit touches would be after it, on the scale of the
//! [`Gate`], `*_is_better` whether they would be less bad than a limit; the edit is a second call.

use crate::AdaptError;
use crate::curve_error::Measure;
use crate::gate::{Gate, quality};
use crate::vertex::{Vertex, feet, vertices_at};
use isospline_geometry::{EditMesh, HalfEdge, TriangleMesh, Vec3};
use isospline_implicit::Field;
use isospline_stage::{Ctx, Host, Serial};

/// A mesh on a surface.
#[derive(Clone)]
pub(crate) struct SurfaceMesh<'a> {
    pub(crate) field: &'a dyn Field,
    pub(crate) host: &'a dyn Host,
    /// How curves will be fitted: what edges are judged by.
    pub(crate) measure: Measure,
    /// Diagonal of the bounding box of the input: the unit of relative lengths.
    pub(crate) diagonal: f64,
    pub(crate) mesh: EditMesh,
    pub(crate) vertices: Vec<Vertex>,
    /// How often each vertex has moved.
    pub(crate) moves: Vec<u32>,
    /// When each face was last edited, or a corner of it moved.
    edited: Vec<u32>,
    /// The last of those times of the faces about each vertex.
    fan_edited: Vec<u32>,
    /// Edits so far, and one.
    now: u32,
}

impl<'a> SurfaceMesh<'a> {
    pub(crate) fn new(ctx: &Ctx<'a>, mesh: TriangleMesh) -> Result<Self, AdaptError> {
        let (field, host) = (ctx.field, ctx.host);
        let diagonal = mesh.bounds().diagonal();
        let vertices = vertices_at(field, host, &mesh.positions)?;
        let moves = vec![0; vertices.len()];
        let (measure, mesh) = (Measure::Paper, EditMesh::new(mesh)?);
        let (edited, fan_edited) = (vec![1; mesh.face_rows()], vec![1; mesh.vertex_rows()]);
        let now = 1;
        Ok(Self { field, host, measure, diagonal, mesh, vertices, moves, edited, fan_edited, now })
    }

    /// Keeps what `other` is now: without new memory, whose first touch costs more than the copy.
    pub(crate) fn keep(&mut self, other: &Self) {
        self.mesh.clone_from(&other.mesh);
        self.vertices.clone_from(&other.vertices);
        self.moves.clone_from(&other.moves);
        self.edited.clone_from(&other.edited);
        self.fan_edited.clone_from(&other.fan_edited);
        self.now = other.now;
    }

    /// Goes back to what was kept; all faces count as edited.
    pub(crate) fn go_back_to(&mut self, kept: Self) {
        let now = self.now + 1;
        *self = kept;
        self.now = now;
        self.edited.fill(now);
        self.fan_edited.fill(now);
    }

    /// The present as a time; later edits come after it.
    pub(crate) fn now(&self) -> u32 {
        self.now
    }

    /// Whether a face and the places of its corners are as they were at a time.
    pub(crate) fn is_as_at(&self, time: u32, face: u32) -> bool {
        self.edited[face as usize] <= time
    }

    /// The same of all faces about a vertex.
    pub(crate) fn fan_is_as_at(&self, time: u32, vertex: u32) -> bool {
        self.fan_edited[vertex as usize] <= time
    }

    pub(crate) fn at(&self, vertex: u32) -> &Vertex {
        &self.vertices[vertex as usize]
    }

    pub(crate) fn corners(&self, face: u32) -> [&Vertex; 3] {
        self.mesh.face(face).map(|v| self.at(v))
    }

    /// Number of faces of less quality.
    pub(crate) fn slivers(&self, min_quality: f64) -> u64 {
        let is_sliver = |&f: &u32| quality(&self.corners(f)) < min_quality;
        self.mesh.live_faces().filter(is_sliver).count() as u64
    }

    /// The two ends of `h`.
    pub(crate) fn ends(&self, h: HalfEdge) -> [&Vertex; 2] {
        [self.at(self.mesh.origin(h)), self.at(self.mesh.target(h))]
    }

    /// The vertices opposite to an inner edge: of the face of `h`, then of its opposite.
    pub(crate) fn wings(&self, h: HalfEdge) -> Option<[u32; 2]> {
        let o = self.mesh.opposite(h)?;
        Some([self.mesh.origin(h.prev()), self.mesh.origin(o.prev())])
    }

    pub(crate) fn middle(&self, h: HalfEdge) -> Vec3 {
        let [p, q] = self.ends(h);
        0.5 * (p.position + q.position)
    }

    /// The points of the surface at `points`; `None` where that fails.
    pub(crate) fn feet(&self, points: &[Vec3]) -> Vec<Option<Vertex>> {
        feet(self.field, self.host, self.diagonal, points)
    }

    /// The same on this thread, each unless its foot is farther away than its reach.
    pub(crate) fn feet_within(
        &self,
        tries: impl IntoIterator<Item = (Vec3, f64)>,
    ) -> Vec<Option<Vertex>> {
        let (points, reach): (Vec<Vec3>, Vec<f64>) = tries.into_iter().unzip();
        let mut feet = feet(self.field, &Serial, self.diagonal, &points);
        for ((foot, point), reach) in feet.iter_mut().zip(points).zip(reach) {
            *foot = foot.filter(|f| (f.position - point).norm() <= reach);
        }
        feet
    }

    /// The same for one point.
    pub(crate) fn foot_within(&self, point: Vec3, reach: f64) -> Option<Vertex> {
        self.feet_within([(point, reach)]).pop().flatten()
    }

    /// Worst of the faces about a vertex.
    pub(crate) fn fan_cost(&self, gate: &Gate, vertex: u32) -> f64 {
        self.mesh.spokes(vertex).fold(0.0, |worst: f64, h| {
            let corners = self.corners(h.face());
            let is_less = gate.is_clearly_below(&corners, worst);
            if is_less { worst } else { worst.max(gate.face_with_quality(&corners)) }
        })
    }

    /// Whether all faces about a vertex would be better than `limit` if it were `moved`.
    pub(crate) fn move_is_better(
        &self,
        gate: &Gate,
        vertex: u32,
        moved: &Vertex,
        limit: f64,
    ) -> bool {
        self.fan_is_better(gate, (vertex, [u32::MAX; 2]), moved, limit)
    }

    pub(crate) fn place(&mut self, vertex: u32, moved: Vertex) {
        self.vertices[vertex as usize] = moved;
        self.moves[vertex as usize] += 1;
        self.mesh.positions[vertex as usize] = moved.position;
        self.note_fan(vertex);
    }

    /// The faces about a vertex are edited now.
    fn note_fan(&mut self, vertex: u32) {
        self.now += 1;
        let Self { mesh, edited, fan_edited, now, .. } = self;
        for h in mesh.spokes(vertex) {
            edited[h.face() as usize] = *now;
            for v in mesh.face(h.face()) {
                fan_edited[v as usize] = *now;
            }
        }
    }

    /// Turns an edge; the caller has asked [`EditMesh::can_flip`]. The half-edge that it is now.
    pub(crate) fn flip(&mut self, h: HalfEdge) -> HalfEdge {
        let turned = self.mesh.flip(h);
        let other = self.mesh.opposite(turned).expect("invariant: it has two faces");
        self.now += 1;
        for face in [turned.face(), other.face()] {
            self.edited[face as usize] = self.now;
            for v in self.mesh.face(face) {
                self.fan_edited[v as usize] = self.now;
            }
        }
        turned
    }

    /// The two faces beside an edge, now and after a flip.
    pub(crate) fn faces_of_flip(&self, h: HalfEdge) -> Option<[[[&Vertex; 3]; 2]; 2]> {
        let [a, b] = self.ends(h);
        let [c, d] = self.wings(h)?.map(|v| self.at(v));
        Some([[[a, b, c], [b, a, d]], [[d, c, a], [c, d, b]]])
    }

    /// Whether the ends of `h` can become `merged` and all faces left about them would be better
    /// than `limit`.
    pub(crate) fn collapse_is_better(
        &self,
        gate: &Gate,
        h: HalfEdge,
        merged: &Vertex,
        limit: f64,
    ) -> bool {
        self.can_collapse(h) && self.faces_left_are_better(gate, h, merged, limit)
    }

    /// Whether the ends of `h` can become one vertex. They cannot where a vertex would keep fewer
    /// than four edges.
    pub(crate) fn can_collapse(&self, h: HalfEdge) -> bool {
        let Some(wings) = self.wings(h) else { return false };
        let ends = [self.mesh.origin(h), self.mesh.target(h)];
        let sum = self.mesh.valence(ends[0]) + self.mesh.valence(ends[1]);
        (8..=14).contains(&sum)
            && wings.iter().all(|&v| self.mesh.valence(v) >= 5)
            && self.mesh.can_collapse(h)
    }

    /// Whether all faces left about the ends of `h` would be better than `limit` if those were
    /// `merged`.
    pub(crate) fn faces_left_are_better(
        &self,
        gate: &Gate,
        h: HalfEdge,
        merged: &Vertex,
        limit: f64,
    ) -> bool {
        let Some(o) = self.mesh.opposite(h) else { return false };
        let removed = [h.face(), o.face()];
        let ends = [self.mesh.origin(h), self.mesh.target(h)];
        ends.iter().all(|&v| self.fan_is_better(gate, (v, removed), merged, limit))
    }

    /// The caller has asked [`Self::collapse_is_better`].
    pub(crate) fn collapse(&mut self, h: HalfEdge, merged: Vertex) {
        let kept = self.mesh.origin(h);
        self.mesh.collapse(h);
        self.place(kept, merged);
    }

    /// Puts `middle` on the edge; `None` at a border.
    pub(crate) fn split(&mut self, h: HalfEdge, middle: Vertex) -> Option<u32> {
        let vertex = self.mesh.split(h, middle.position)?;
        self.vertices.push(middle);
        self.moves.push(0);
        self.edited.resize(self.mesh.face_rows(), 0);
        self.fan_edited.push(0);
        self.note_fan(vertex);
        Some(vertex)
    }

    /// Whether the faces about a vertex, but for those that are `removed`, would all be better than
    /// `limit` if it were `moved`. The first that is not ends it: most edits are tried in vain.
    fn fan_is_better(
        &self,
        gate: &Gate,
        (vertex, removed): (u32, [u32; 2]),
        moved: &Vertex,
        limit: f64,
    ) -> bool {
        let mut kept = self.mesh.spokes(vertex).filter(|h| !removed.contains(&h.face()));
        let is_worse = |h: HalfEdge| {
            let (p, q) = (self.mesh.target(h), self.mesh.origin(h.prev()));
            !gate.is_below(&[moved, self.at(p), self.at(q)], limit)
        };
        // No face is better than 0.
        limit > 0.0 && !kept.any(is_worse)
    }
}
