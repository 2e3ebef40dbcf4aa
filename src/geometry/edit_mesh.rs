//! A triangle mesh that can be edited in place: collapse, split and flip with exact topology.
//!
//! Half-edges are implicit (`3f + k`), rows of removed vertices and faces stay as holes until
//! [`EditMesh::compact`], so ids are stable while a caller edits. Borders are walked around but
//! never edited.

mod edits;

use crate::triangle_mesh::{BORDER, Defect};
use crate::{HalfEdge, TriangleMesh, Vec3};
use std::ops::Range;

/// Marks rows of removed faces and vertices.
pub const GONE: u32 = u32::MAX;

/// A triangle mesh under edit; vertex and face ids stay valid until [`Self::compact`].
#[derive(Debug)]
pub struct EditMesh {
    /// Vertex positions; rows of removed vertices keep their last value.
    pub positions: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    opposite: Vec<u32>,
    /// An outgoing half-edge of each vertex, the first counter-clockwise one at a border.
    outgoing: Vec<u32>,
    n_faces: usize,
    n_vertices: usize,
}

impl Clone for EditMesh {
    fn clone(&self) -> Self {
        let (positions, faces) = (self.positions.clone(), self.faces.clone());
        let (opposite, outgoing) = (self.opposite.clone(), self.outgoing.clone());
        Self { positions, faces, opposite, outgoing, ..*self }
    }

    // Without new memory, whose first touch costs more than the copy.
    fn clone_from(&mut self, other: &Self) {
        self.positions.clone_from(&other.positions);
        self.faces.clone_from(&other.faces);
        self.opposite.clone_from(&other.opposite);
        self.outgoing.clone_from(&other.outgoing);
        (self.n_faces, self.n_vertices) = (other.n_faces, other.n_vertices);
    }
}

impl EditMesh {
    /// Takes over a manifold mesh, open or closed.
    ///
    /// # Errors
    /// The [`Defect`] that keeps the mesh from being an oriented manifold.
    pub fn new(mesh: TriangleMesh) -> Result<Self, Defect> {
        let opposite = mesh.opposites()?;
        mesh.check_fans(&opposite)?;
        Ok(Self::with_opposites(mesh, opposite))
    }

    /// Takes over some faces of a manifold mesh. A vertex on their border may have several fans
    /// of them, of which walks about it meet one: leave such vertices and their neighbours alone,
    /// and all edits keep the whole mesh a manifold of the same topology.
    ///
    /// # Errors
    /// The [`Defect`] of an edge.
    pub fn part(mesh: TriangleMesh) -> Result<Self, Defect> {
        let opposite = mesh.opposites()?;
        Ok(Self::with_opposites(mesh, opposite))
    }

    fn with_opposites(mesh: TriangleMesh, opposite: Vec<u32>) -> Self {
        let TriangleMesh { positions, faces } = mesh;
        let mut outgoing = vec![GONE; positions.len()];
        for h in (0..3 * faces.len() as u32).map(HalfEdge) {
            let v = faces[h.face() as usize][h.corner() as usize] as usize;
            if outgoing[v] == GONE || opposite[h.row()] == BORDER {
                outgoing[v] = h.0;
            }
        }
        let (n_faces, n_vertices) = (faces.len(), positions.len());
        Self { positions, faces, opposite, outgoing, n_faces, n_vertices }
    }

    /// The mesh without holes; vertices and faces keep their order.
    pub fn compact(&self) -> TriangleMesh {
        let mut row = vec![GONE; self.positions.len()];
        let mut positions = Vec::with_capacity(self.n_vertices);
        for v in self.vertices() {
            row[v as usize] = positions.len() as u32;
            positions.push(self.positions[v as usize]);
        }
        let faces =
            self.live_faces().map(|f| self.faces[f as usize].map(|v| row[v as usize])).collect();
        TriangleMesh { positions, faces }
    }

    /// Number of faces, holes not counted.
    #[inline]
    pub fn face_count(&self) -> usize {
        self.n_faces
    }

    /// Number of vertices, holes not counted.
    #[inline]
    pub fn vertex_count(&self) -> usize {
        self.n_vertices
    }

    /// Number of face rows, holes counted: one more than the largest face id.
    #[inline]
    pub fn face_rows(&self) -> usize {
        self.faces.len()
    }

    /// Number of vertex rows, holes counted: one more than the largest vertex id.
    #[inline]
    pub fn vertex_rows(&self) -> usize {
        self.positions.len()
    }

    /// Ids of the faces, ascending.
    pub fn live_faces(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.faces.len() as u32).filter(|&f| self.is_face(f))
    }

    /// Ids of the vertices, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.outgoing.len() as u32).filter(|&v| self.is_vertex(v))
    }

    /// One half-edge an edge, ascending: the lower of the two, or the only one at a border.
    pub fn edges(&self) -> impl Iterator<Item = HalfEdge> + '_ {
        // Half-edges of removed faces have the opposite 0.
        (0..self.opposite.len() as u32).map(HalfEdge).filter(|&h| h.0 < self.opposite[h.row()])
    }

    /// Those of [`Self::edges`] that some face rows hold, as a list. Every other half-edge passes,
    /// and which is random: without a branch that costs a fifth of the time.
    pub fn edge_list(&self, faces: Range<usize>) -> Vec<HalfEdge> {
        let mut edges = vec![HalfEdge(0); 3 * faces.len() + 1];
        let mut n_edges = 0;
        for (h, &opposite) in
            (3 * faces.start as u32..).zip(&self.opposite[3 * faces.start..3 * faces.end])
        {
            edges[n_edges] = HalfEdge(h);
            n_edges += usize::from(h < opposite);
        }
        edges.truncate(n_edges);
        edges
    }

    /// Whether the face has not been removed.
    #[inline]
    pub fn is_face(&self, face: u32) -> bool {
        self.faces[face as usize][0] != GONE
    }

    /// Whether the vertex has not been removed.
    #[inline]
    pub fn is_vertex(&self, vertex: u32) -> bool {
        self.outgoing[vertex as usize] != GONE
    }

    /// Corners of a face.
    #[inline]
    pub fn face(&self, face: u32) -> [u32; 3] {
        self.faces[face as usize]
    }

    /// Positions of the corners of a face.
    #[inline]
    pub fn corners(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].map(|v| self.positions[v as usize])
    }

    /// The vertex that `h` leaves.
    #[inline]
    pub fn origin(&self, h: HalfEdge) -> u32 {
        self.faces[h.face() as usize][h.corner() as usize]
    }

    /// The vertex that `h` reaches.
    #[inline]
    pub fn target(&self, h: HalfEdge) -> u32 {
        self.origin(h.next())
    }

    /// The other half-edge of the edge, `None` at a border.
    #[inline]
    pub fn opposite(&self, h: HalfEdge) -> Option<HalfEdge> {
        let o = self.opposite[h.row()];
        (o != BORDER).then_some(HalfEdge(o))
    }

    /// Outgoing half-edges of a vertex, counter-clockwise: one a face about it.
    ///
    /// At a border the neighbour that only the last face reaches has no outgoing half-edge here.
    #[inline]
    pub fn spokes(&self, vertex: u32) -> Spokes<'_> {
        let start = self.outgoing[vertex as usize];
        Spokes { mesh: self, start, at: start }
    }

    /// The vertices joined to `vertex` by an edge, counter-clockwise.
    pub fn neighbours(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let first = HalfEdge(self.outgoing[vertex as usize]);
        let border = self.opposite[first.row()] == BORDER;
        let last = if border { self.spokes(vertex).last() } else { None };
        self.spokes(vertex).map(|h| self.target(h)).chain(last.map(|h| self.origin(h.prev())))
    }

    /// Number of edges at a vertex.
    #[inline]
    pub fn valence(&self, vertex: u32) -> usize {
        self.spokes(vertex).count() + usize::from(self.on_border(vertex))
    }

    /// Whether a border runs through the vertex.
    #[inline]
    pub fn on_border(&self, vertex: u32) -> bool {
        self.opposite[self.outgoing[vertex as usize] as usize] == BORDER
    }

    /// The half-edge from `from` to `to`, if a face runs along it.
    pub fn half_edge(&self, from: u32, to: u32) -> Option<HalfEdge> {
        self.spokes(from).find(|&h| self.target(h) == to)
    }

    /// `V - E + F` over all components.
    pub fn euler_characteristic(&self) -> i64 {
        self.n_vertices as i64 - self.edges().count() as i64 + self.n_faces as i64
    }
}

/// Iterator of [`EditMesh::spokes`].
#[derive(Clone, Debug)]
pub struct Spokes<'a> {
    mesh: &'a EditMesh,
    start: u32,
    at: u32,
}

impl Iterator for Spokes<'_> {
    type Item = HalfEdge;

    #[inline]
    fn next(&mut self) -> Option<HalfEdge> {
        if self.at == BORDER {
            return None;
        }
        let here = HalfEdge(self.at);
        let turned = self.mesh.opposite[here.prev().row()];
        self.at = if turned == self.start { BORDER } else { turned };
        Some(here)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles that share the edge 1-2.
    fn kite() -> EditMesh {
        let positions = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.0)];
        EditMesh::new(TriangleMesh { positions, faces: vec![[0, 1, 2], [1, 3, 2]] }).unwrap()
    }

    #[test]
    fn at_a_border_all_neighbours_are_met_once() {
        let mesh = kite();
        let sorted = |v| {
            let mut n: Vec<u32> = mesh.neighbours(v).collect();
            n.sort_unstable();
            n
        };
        assert_eq!(sorted(0), [1, 2]);
        assert_eq!(sorted(1), [0, 2, 3]);
        assert_eq!(mesh.valence(1), 3);
        assert_eq!(mesh.edges().count(), 5);
        assert_eq!(mesh.euler_characteristic(), 1);
    }

    #[test]
    fn an_unedited_mesh_compacts_to_itself() {
        let mesh = kite().compact();
        assert_eq!(EditMesh::new(mesh.clone()).unwrap().compact(), mesh);
    }

    #[test]
    fn border_edges_and_vertices_are_not_edited() {
        let mut mesh = kite();
        let inner = mesh.half_edge(1, 2).unwrap();
        assert!(!mesh.can_collapse(inner));
        let border = mesh.half_edge(0, 1).unwrap();
        assert!(!mesh.can_flip(border));
        assert_eq!(mesh.split(border, Vec3::zeros()), None);
    }
}
