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
use isospline_stage::{Ctx, Host};

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
}

impl<'a> SurfaceMesh<'a> {
    pub(crate) fn new(ctx: &Ctx<'a>, mesh: TriangleMesh) -> Result<Self, AdaptError> {
        let (field, host) = (ctx.field, ctx.host);
        let diagonal = mesh.bounds().diagonal();
        let vertices = vertices_at(field, host, &mesh.positions)?;
        let moves = vec![0; vertices.len()];
        let (measure, mesh) = (Measure::Paper, EditMesh::new(mesh)?);
        Ok(Self { field, host, measure, diagonal, mesh, vertices, moves })
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

    /// The same for few points, each unless its foot is farther away than its reach: together
    /// they cost little more than one.
    pub(crate) fn feet_within<const N: usize>(
        &self,
        points: [Vec3; N],
        reach: [f64; N],
    ) -> [Option<Vertex>; N] {
        let feet = self.feet(&points);
        let near = |i: usize| feet[i].filter(|f| (f.position - points[i]).norm() <= reach[i]);
        std::array::from_fn(near)
    }

    /// Worst of the faces about a vertex.
    pub(crate) fn fan_cost(&self, gate: &Gate, vertex: u32) -> f64 {
        let faces = self.mesh.spokes(vertex).map(HalfEdge::face);
        faces.map(|f| gate.face_with_quality(&self.corners(f))).fold(0.0, f64::max)
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
    }

    /// Worst of the two faces beside an edge, now and after a flip; `None` if it cannot flip.
    pub(crate) fn flip_cost(&self, gate: &Gate, h: HalfEdge) -> Option<[f64; 2]> {
        if !self.mesh.can_flip(h) {
            return None;
        }
        let [a, b] = self.ends(h);
        let [c, d] = self.wings(h)?.map(|v| self.at(v));
        let worst = |x, y| gate.face_with_quality(x).max(gate.face_with_quality(y));
        Some([worst(&[a, b, c], &[b, a, d]), worst(&[d, c, a], &[c, d, b])])
    }

    /// Whether the ends of `h` can become `merged` and all faces left about them would be better
    /// than `limit`. They cannot where a vertex would keep fewer than four edges.
    pub(crate) fn collapse_is_better(
        &mut self,
        gate: &Gate,
        h: HalfEdge,
        merged: &Vertex,
        limit: f64,
    ) -> bool {
        if !self.mesh.can_collapse(h) {
            return false;
        }
        let (Some(o), Some(wings)) = (self.mesh.opposite(h), self.wings(h)) else { return false };
        let ends = [self.mesh.origin(h), self.mesh.target(h)];
        let merged_valence = self.mesh.valence(ends[0]) + self.mesh.valence(ends[1]) - 4;
        if !(4..=10).contains(&merged_valence) || wings.iter().any(|&v| self.mesh.valence(v) < 5) {
            return false;
        }
        let removed = [h.face(), o.face()];
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
            gate.face_with_quality(&[moved, self.at(p), self.at(q)]) >= limit
        };
        // No face is better than 0.
        limit > 0.0 && !kept.any(is_worse)
    }
}
