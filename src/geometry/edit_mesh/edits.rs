//! The three edits. Each keeps the mesh an oriented manifold with the same components and the
//! same Euler characteristic, or refuses.

use super::{EditMesh, GONE};
use crate::triangle_mesh::BORDER;
use crate::{HalfEdge, Vec3};

/// Neighbours of a vertex that are compared in one go.
const FEW: usize = 16;

impl EditMesh {
    /// Whether [`Self::collapse`] keeps the topology (the link condition): origin and target of
    /// `h` share exactly the two vertices opposite to the edge, and no border or tetrahedron is
    /// touched.
    pub fn can_collapse(&self, h: HalfEdge) -> bool {
        let Some(o) = self.opposite(h) else { return false };
        let (a, b) = (self.origin(h), self.target(h));
        if self.on_border(a) || self.on_border(b) {
            return false;
        }
        let (c, d) = (self.origin(h.prev()), self.origin(o.prev()));
        let (mut ring, mut valence_a) = ([GONE; FEW], 0);
        for s in self.spokes(a) {
            if let Some(place) = ring.get_mut(valence_a) {
                *place = self.target(s);
            }
            valence_a += 1;
        }
        let is_about_a = |w: u32| match valence_a {
            // Without an early end, so that the compiler compares many at once.
            ..=FEW => ring.iter().filter(|&&x| x == w).count() > 0,
            _ => self.spokes(a).any(|s| self.target(s) == w),
        };
        let mut valence_b = 0;
        for s in self.spokes(b) {
            let w = self.target(s);
            valence_b += 1;
            if w != c && w != d && is_about_a(w) {
                return false;
            }
        }
        // Two ends of valence 3 are a tetrahedron, or two triangles glued along all edges.
        c != d && (valence_a > 3 || valence_b > 3)
    }

    /// Merges the target of `h` into its origin, which stays where it is; two faces go.
    ///
    /// The caller has asked [`Self::can_collapse`] and sets the position of the origin.
    pub fn collapse(&mut self, h: HalfEdge) {
        let o = HalfEdge(self.opposite[h.row()]);
        let (a, b) = (self.origin(h), self.target(h));
        let (c, d) = (self.origin(h.prev()), self.origin(o.prev()));
        self.rename(b, a);
        let outer = |mesh: &Self, at: HalfEdge| mesh.opposite[at.row()];
        // In the order that leaves `outgoing` on live faces: a -> c, c -> a, a -> d, d -> a.
        let (a_to_c, c_to_a) = (outer(self, h.prev()), outer(self, h.next()));
        let (d_to_a, a_to_d) = (outer(self, o.next()), outer(self, o.prev()));
        self.join(a_to_c, c_to_a);
        self.join(a_to_d, d_to_a);
        self.outgoing[a as usize] = a_to_c;
        self.lead_from(c, c_to_a);
        self.lead_from(d, d_to_a);
        self.outgoing[b as usize] = GONE;
        for removed in [h.face(), o.face()] {
            self.faces[removed as usize] = [GONE; 3];
            let first = 3 * removed as usize;
            self.opposite[first..first + 3].fill(0);
        }
        self.n_faces -= 2;
        self.n_vertices -= 1;
    }

    /// Whether [`Self::flip`] keeps the topology: an inner edge whose opposite vertices are not
    /// joined yet, and both ends keep at least three edges.
    pub fn can_flip(&self, h: HalfEdge) -> bool {
        let Some(o) = self.opposite(h) else { return false };
        let (a, b) = (self.origin(h), self.target(h));
        let (c, d) = (self.origin(h.prev()), self.origin(o.prev()));
        let spare = |v| self.on_border(v) || self.valence(v) > 3;
        c != d && spare(a) && spare(b) && self.neighbours(c).all(|w| w != d)
    }

    /// Turns the edge of `h` to the other diagonal of its two faces and returns the half-edge
    /// that now runs from the vertex opposite to `opp(h)` to the vertex opposite to `h`.
    ///
    /// The caller has asked [`Self::can_flip`].
    pub fn flip(&mut self, h: HalfEdge) -> HalfEdge {
        let o = HalfEdge(self.opposite[h.row()]);
        let (a, b) = (self.origin(h), self.target(h));
        let (c, d) = (self.origin(h.prev()), self.origin(o.prev()));
        let [c_to_a, b_to_c, a_to_d, d_to_b] =
            [h.prev(), h.next(), o.next(), o.prev()].map(|at| self.opposite[at.row()]);
        let (f, g) = (h.face(), o.face());
        self.faces[f as usize] = [d, c, a];
        self.faces[g as usize] = [c, d, b];
        self.join(3 * f, 3 * g);
        self.join(3 * f + 1, c_to_a);
        self.join(3 * f + 2, a_to_d);
        self.join(3 * g + 1, d_to_b);
        self.join(3 * g + 2, b_to_c);
        for (v, half) in [(a, 3 * f + 2), (b, 3 * g + 2), (c, 3 * f + 1), (d, 3 * g + 1)] {
            self.lead_from(v, half);
        }
        HalfEdge(3 * f)
    }

    /// Puts a new vertex at `position` on the inner edge of `h` and returns its id; two faces are
    /// added. `None` at a border.
    ///
    /// `h` then runs from its old origin to the new vertex.
    pub fn split(&mut self, h: HalfEdge, position: Vec3) -> Option<u32> {
        let o = self.opposite(h)?;
        let (b, c, d) = (self.target(h), self.origin(h.prev()), self.origin(o.prev()));
        let m = self.positions.len() as u32;
        self.positions.push(position);
        let (outer_bc, outer_db) = (self.opposite[h.next().row()], self.opposite[o.prev().row()]);
        // f = (a, b, c) keeps (a, m, c), n0 = (m, b, c); g = (b, a, d) keeps (m, a, d),
        // n1 = (b, m, d).
        let (n0, n1) = (self.faces.len() as u32, self.faces.len() as u32 + 1);
        self.faces[h.face() as usize][h.next().corner() as usize] = m;
        self.faces[o.face() as usize][o.corner() as usize] = m;
        self.faces.push([m, b, c]);
        self.faces.push([b, m, d]);
        self.opposite.extend([BORDER; 6]);
        self.join(3 * n0, 3 * n1);
        self.join(3 * n0 + 1, outer_bc);
        self.join(3 * n0 + 2, h.next().0);
        self.join(3 * n1 + 1, o.prev().0);
        self.join(3 * n1 + 2, outer_db);
        self.outgoing.push(3 * n0);
        self.lead_from(b, 3 * n0 + 1);
        self.lead_from(d, 3 * n1 + 2);
        self.n_faces += 2;
        self.n_vertices += 1;
        Some(m)
    }

    fn rename(&mut self, from: u32, to: u32) {
        let start = self.outgoing[from as usize];
        let mut at = start;
        loop {
            let h = HalfEdge(at);
            self.faces[h.face() as usize][h.corner() as usize] = to;
            at = self.opposite[h.prev().row()];
            if at == start {
                return;
            }
        }
    }

    fn join(&mut self, p: u32, q: u32) {
        if p != BORDER {
            self.opposite[p as usize] = q;
        }
        if q != BORDER {
            self.opposite[q as usize] = p;
        }
    }

    /// Makes `half` the outgoing half-edge of `vertex`, turned clockwise to the border if the
    /// vertex has one.
    fn lead_from(&mut self, vertex: u32, half: u32) {
        let mut at = half;
        while self.opposite[at as usize] != BORDER {
            at = HalfEdge(self.opposite[at as usize]).next().0;
            if at == half {
                break;
            }
        }
        self.outgoing[vertex as usize] = at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use proptest::prelude::*;

    /// A torus grid of `n` by `m` quads cut in two.
    fn torus(n: u32, m: u32) -> TriangleMesh {
        let id = |i: u32, j: u32| (i % n) * m + j % m;
        let mut mesh = TriangleMesh::default();
        for i in 0..n {
            for j in 0..m {
                mesh.positions.push(Vec3::new(f64::from(i), f64::from(j), 0.0));
                let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    fn octahedron() -> TriangleMesh {
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let positions = axes.into_iter().flat_map(|a| [a, -a]).collect();
        let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
        let lower = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
        TriangleMesh { positions, faces: [upper, lower].concat() }
    }

    /// Applies the edits that are allowed; returns how many were.
    fn apply(mesh: &mut EditMesh, edits: &[(u8, u32)]) -> usize {
        let mut done = 0;
        for &(kind, pick) in edits {
            let halves: Vec<HalfEdge> = mesh.edges().collect();
            let h = halves[pick as usize % halves.len()];
            let h = if kind >= 3 { mesh.opposite(h).unwrap() } else { h };
            match kind % 3 {
                0 if mesh.can_collapse(h) => mesh.collapse(h),
                1 if mesh.can_flip(h) => drop(mesh.flip(h)),
                2 => drop(mesh.split(h, Vec3::zeros())),
                _ => continue,
            }
            done += 1;
        }
        done
    }

    fn check_manifold(mesh: &EditMesh, characteristic: i64) {
        assert_eq!(mesh.euler_characteristic(), characteristic);
        let compact = mesh.compact();
        let opposite = compact.opposites().unwrap();
        compact.check_fans(&opposite).unwrap();
        assert!(opposite.iter().all(|&o| o != BORDER));
        assert_eq!(compact.faces.len(), mesh.face_count());
        assert_eq!(compact.positions.len(), mesh.vertex_count());
        assert_eq!(compact.euler_characteristic(&opposite), characteristic);
        assert_eq!(compact.face_components(&opposite).iter().max(), Some(&0));
        let middle = mesh.face_rows() / 2;
        let lists = [mesh.edge_list(0..middle), mesh.edge_list(middle..mesh.face_rows())];
        assert_eq!(lists.concat(), mesh.edges().collect::<Vec<_>>());
        assert!(mesh.edges().all(|h| mesh.is_face(h.face())));
        for v in mesh.vertices() {
            assert!(mesh.spokes(v).all(|h| mesh.origin(h) == v));
            assert!(mesh.valence(v) >= 3);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..Default::default() })]

        #[test]
        fn random_edits_keep_manifold_and_genus(
            edits in prop::collection::vec((0u8..6, any::<u32>()), 1..120)
        ) {
            let mut mesh = EditMesh::new(torus(5, 4)).unwrap();
            apply(&mut mesh, &edits);
            check_manifold(&mesh, 0);
            let mut mesh = EditMesh::new(octahedron()).unwrap();
            apply(&mut mesh, &edits);
            check_manifold(&mesh, 2);
        }

        #[test]
        fn collapses_alone_stop_at_a_simple_mesh_of_the_same_genus(
            picks in prop::collection::vec(any::<u32>(), 200)
        ) {
            let mut mesh = EditMesh::new(torus(6, 5)).unwrap();
            let edits: Vec<_> = picks.iter().map(|&p| (0, p)).collect();
            prop_assert!(apply(&mut mesh, &edits) > 0);
            check_manifold(&mesh, 0);
            // A simple triangulation of the torus has at least 7 vertices.
            prop_assert!(mesh.vertex_count() >= 7);
        }
    }

    #[test]
    fn a_tetrahedron_does_not_collapse() {
        let mut mesh = EditMesh::new(octahedron()).unwrap();
        let edits: Vec<(u8, u32)> = (0..50).map(|k| (0, 7 * k)).collect();
        assert_eq!(apply(&mut mesh, &edits), 2);
        assert_eq!(mesh.face_count(), 4);
        check_manifold(&mesh, 2);
    }

    #[test]
    fn flipping_an_edge_there_and_back_gives_the_same_edges() {
        let mut mesh = EditMesh::new(torus(6, 6)).unwrap();
        let h = mesh.half_edge(0, 7).unwrap();
        let turned = mesh.flip(h);
        assert_eq!(mesh.half_edge(0, 7), None);
        assert!(mesh.can_flip(turned));
        mesh.flip(turned);
        assert!(mesh.half_edge(0, 7).is_some());
        check_manifold(&mesh, 0);
    }

    #[test]
    fn a_split_edge_runs_to_the_new_vertex() {
        let mut mesh = EditMesh::new(octahedron()).unwrap();
        let h = mesh.half_edge(0, 2).unwrap();
        let m = mesh.split(h, Vec3::new(0.5, 0.5, 0.0)).unwrap();
        assert_eq!((mesh.origin(h), mesh.target(h)), (0, m));
        assert_eq!(mesh.valence(m), 4);
        check_manifold(&mesh, 2);
    }
}
