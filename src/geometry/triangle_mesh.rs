//! Indexed triangle meshes: adjacency, components, Euler characteristic.

use crate::{Aabb, HalfEdge, Vec3};

/// Marks a half-edge without an opposite: the border of an open mesh.
pub const BORDER: u32 = u32::MAX;

/// An indexed triangle mesh; faces are counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions in model units.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each face.
    pub faces: Vec<[u32; 3]>,
}

/// Why faces do not form an oriented manifold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// A face names a vertex that does not exist.
    MissingVertex {
        /// The face.
        face: u32,
        /// The vertex index that it names.
        vertex: u32,
    },
    /// A face names a vertex twice.
    RepeatedCorner {
        /// The face.
        face: u32,
    },
    /// Two faces run along the same directed edge: orientation or manifoldness is broken.
    DoubledHalfEdge {
        /// The second face found.
        face: u32,
        /// Origin of the directed edge.
        from: u32,
        /// Its end.
        to: u32,
    },
    /// The faces about a vertex form more than one fan.
    PinchedVertex {
        /// The vertex.
        vertex: u32,
    },
    /// No face uses the vertex.
    LooseVertex {
        /// The vertex.
        vertex: u32,
    },
}

impl TriangleMesh {
    /// Positions of the corners of `face`.
    #[inline]
    pub fn corners(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].map(|v| self.positions[v as usize])
    }

    /// The smallest box around the vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(&self.positions)
    }

    /// Origin of half-edge `h`.
    #[inline]
    pub fn origin(&self, h: HalfEdge) -> u32 {
        self.faces[h.face() as usize][h.corner() as usize]
    }

    /// Opposite of each half-edge ([`BORDER`] where there is none), length `3 F`.
    ///
    /// # Errors
    /// The first [`Defect`] in face order that keeps the faces from being oriented and manifold
    /// along their edges.
    pub fn opposites(&self) -> Result<Vec<u32>, Defect> {
        let first = self.rows_by_lowest()?;
        let mut end = first.clone();
        let mut met = vec![Met { other: BORDER, halves: [BORDER; 2] }; 3 * self.faces.len()];
        let mut opposite = vec![BORDER; 3 * self.faces.len()];
        for (f, &[a, b, c]) in (0u32..).zip(&self.faces) {
            for (h, from, to) in [(3 * f, a, b), (3 * f + 1, b, c), (3 * f + 2, c, a)] {
                let (lowest, other) = (from.min(to) as usize, from.max(to));
                let [side, across] = if from < to { [0, 1] } else { [1, 0] };
                let rows = first[lowest] as usize..end[lowest] as usize;
                if let Some(edge) = met[rows].iter_mut().find(|edge| edge.other == other) {
                    if edge.halves[side] != BORDER {
                        return Err(Defect::DoubledHalfEdge { face: f, from, to });
                    }
                    edge.halves[side] = h;
                    opposite[h as usize] = edge.halves[across];
                    opposite[edge.halves[across] as usize] = h;
                } else {
                    let edge = &mut met[end[lowest] as usize];
                    edge.other = other;
                    edge.halves[side] = h;
                    end[lowest] += 1;
                }
            }
        }
        Ok(opposite)
    }

    /// First row of each vertex when half-edges are sorted by their lower end.
    fn rows_by_lowest(&self) -> Result<Vec<u32>, Defect> {
        let n = self.positions.len();
        let mut first = vec![0u32; n + 1];
        for (f, face) in (0u32..).zip(&self.faces) {
            if let Some(&vertex) = face.iter().find(|&&v| v as usize >= n) {
                return Err(Defect::MissingVertex { face: f, vertex });
            }
            let [a, b, c] = *face;
            if a == b || b == c || c == a {
                return Err(Defect::RepeatedCorner { face: f });
            }
            for lowest in [a.min(b), b.min(c), c.min(a)] {
                first[lowest as usize + 1] += 1;
            }
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        Ok(first)
    }

    /// Checks that every vertex has exactly one fan of faces; `opposite` from [`Self::opposites`].
    ///
    /// # Errors
    /// [`Defect::PinchedVertex`] or [`Defect::LooseVertex`] with the lowest vertex.
    pub fn check_fans(&self, opposite: &[u32]) -> Result<(), Defect> {
        let mut valence = vec![0u32; self.positions.len()];
        let mut some_half = vec![BORDER; self.positions.len()];
        for h in (0..3 * self.faces.len() as u32).map(HalfEdge) {
            let v = self.origin(h) as usize;
            valence[v] += 1;
            // A fan with a border starts at the half-edge without an opposite.
            if some_half[v] == BORDER || opposite[h.row()] == BORDER {
                some_half[v] = h.0;
            }
        }
        for (v, (&n, &start)) in valence.iter().zip(&some_half).enumerate() {
            if n == 0 {
                return Err(Defect::LooseVertex { vertex: v as u32 });
            }
            if fan_length(opposite, start) != n {
                return Err(Defect::PinchedVertex { vertex: v as u32 });
            }
        }
        Ok(())
    }

    /// Connected component of each face, numbered from 0 in order of their lowest face.
    pub fn face_components(&self, opposite: &[u32]) -> Vec<u32> {
        let mut component = vec![BORDER; self.faces.len()];
        let mut n_components = 0;
        let mut stack = Vec::new();
        for seed in 0..self.faces.len() as u32 {
            if component[seed as usize] != BORDER {
                continue;
            }
            stack.push(seed);
            component[seed as usize] = n_components;
            while let Some(f) = stack.pop() {
                for k in 0..3 {
                    let o = opposite[HalfEdge::new(f, k).row()];
                    if o != BORDER && component[(o / 3) as usize] == BORDER {
                        component[(o / 3) as usize] = n_components;
                        stack.push(o / 3);
                    }
                }
            }
            n_components += 1;
        }
        component
    }

    /// `V - E + F`; border edges count once.
    pub fn euler_characteristic(&self, opposite: &[u32]) -> i64 {
        let border = opposite.iter().filter(|&&o| o == BORDER).count() as i64;
        let n_edges = i64::midpoint(opposite.len() as i64, border);
        self.positions.len() as i64 - n_edges + self.faces.len() as i64
    }

    /// Signed volume enclosed by a closed mesh; positive when faces look outward.
    pub fn volume(&self) -> f64 {
        (0..self.faces.len() as u32).map(|f| self.tetrahedron(f)).sum()
    }

    fn tetrahedron(&self, face: u32) -> f64 {
        let [a, b, c] = self.corners(face);
        a.dot(&b.cross(&c)) / 6.0
    }
}

/// An edge with what has been met of it, kept with its lower end.
#[derive(Clone, Copy, Debug)]
struct Met {
    /// Its higher end.
    other: u32,
    /// The half-edges up and down, [`BORDER`] where none was met.
    halves: [u32; 2],
}

/// Faces met going counter-clockwise about the origin of `start` until the border or `start`.
fn fan_length(opposite: &[u32], start: u32) -> u32 {
    let mut n_faces = 1;
    let mut h = opposite[HalfEdge(start).prev().row()];
    while h != BORDER && h != start {
        n_faces += 1;
        h = opposite[HalfEdge(h).prev().row()];
    }
    n_faces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> TriangleMesh {
        TriangleMesh {
            positions: vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()],
            faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        }
    }

    #[test]
    fn a_tetrahedron_is_closed_with_characteristic_two_and_volume_a_sixth() {
        let mesh = tetrahedron();
        let opposite = mesh.opposites().unwrap();
        assert!(opposite.iter().all(|&o| o != BORDER));
        mesh.check_fans(&opposite).unwrap();
        assert_eq!(mesh.euler_characteristic(&opposite), 2);
        assert_eq!(mesh.face_components(&opposite), [0; 4]);
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
    }

    #[test]
    fn a_single_triangle_has_a_border_and_characteristic_one() {
        let mut mesh = tetrahedron();
        mesh.faces.truncate(1);
        mesh.positions.truncate(3);
        let opposite = mesh.opposites().unwrap();
        assert_eq!(opposite, [BORDER; 3]);
        mesh.check_fans(&opposite).unwrap();
        assert_eq!(mesh.euler_characteristic(&opposite), 1);
    }

    #[test]
    fn a_flipped_face_is_a_doubled_half_edge() {
        let mut mesh = tetrahedron();
        mesh.faces[3] = [0, 2, 3];
        let found = mesh.opposites().unwrap_err();
        assert!(matches!(found, Defect::DoubledHalfEdge { .. }), "{found:?}");
    }

    #[test]
    fn two_cones_on_one_apex_are_pinched() {
        let mut mesh = tetrahedron();
        let shifted = tetrahedron();
        mesh.positions.extend(shifted.positions[1..].iter().map(|p| -p));
        let relabel = |v: u32| if v == 0 { 0 } else { v + 3 };
        mesh.faces.extend(shifted.faces.iter().map(|&[a, b, c]| [a, c, b].map(relabel)));
        let opposite = mesh.opposites().unwrap();
        assert_eq!(mesh.check_fans(&opposite), Err(Defect::PinchedVertex { vertex: 0 }));
        assert_eq!(mesh.face_components(&opposite).iter().max(), Some(&1));
    }
}
