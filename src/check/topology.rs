//! Neighbours, edges, fans and components, found from the face list alone.

use crate::nesting;
use crate::report::{Component, EdgeDefects};
use crate::surface::Surface;
use isospline_geometry::HalfEdge;

/// Marks a half-edge that has no single, oppositely directed partner.
const ALONE: u32 = u32::MAX;

/// Two half-edges that run along the same edge in opposite directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joint {
    /// Runs from the lower to the higher vertex.
    pub(crate) left: HalfEdge,
    pub(crate) right: HalfEdge,
}

/// What the face list says about the shape of the surface.
#[derive(Debug)]
pub(crate) struct Topology {
    pub(crate) joints: Vec<Joint>,
    pub(crate) n_edges: usize,
    pub(crate) defects: EdgeDefects,
    /// In order of their lowest face, volumes left open.
    pub(crate) components: Vec<Component>,
    /// The faces of each.
    pub(crate) faces_of: Vec<Vec<u32>>,
}

impl Topology {
    pub(crate) fn of(surface: &Surface<'_>) -> Self {
        let mut topology = Self {
            joints: Vec::new(),
            n_edges: 0,
            defects: EdgeDefects::default(),
            components: Vec::new(),
            faces_of: Vec::new(),
        };
        let mut opposite = vec![ALONE; 3 * surface.faces().len()];
        let edge_list = sorted_half_edges(surface);
        for group in edge_list.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            topology.n_edges += 1;
            topology.enter_edge(surface, group, &mut opposite);
        }
        let repeats = |f: &&[u32; 3]| f[0] == f[1] || f[1] == f[2] || f[2] == f[0];
        topology.defects.repeated_corners = surface.faces().iter().filter(repeats).count() as u64;
        topology.count_fans(surface, &opposite);
        (topology.components, topology.faces_of) = components(surface, &opposite);
        topology
    }

    /// `V - E + F`.
    pub(crate) fn euler_characteristic(&self, surface: &Surface<'_>) -> i64 {
        surface.vertices().len() as i64 - self.n_edges as i64 + surface.faces().len() as i64
    }

    /// Sets the volume of each component to that under its faces.
    pub(crate) fn enter_volumes(&mut self, volume: impl Fn(&[u32]) -> f64) {
        for (component, faces) in self.components.iter_mut().zip(&self.faces_of) {
            component.volume = volume(faces);
        }
    }

    /// Sorts one edge, given by all half-edges along it, into joints and defects.
    fn enter_edge(
        &mut self,
        surface: &Surface<'_>,
        group: &[(u32, u32, u32)],
        opposite: &mut [u32],
    ) {
        match *group {
            [_] => self.defects.border += 1,
            [(low, _, a), (_, _, b)] => {
                let (a, b) = (HalfEdge(a), HalfEdge(b));
                let a_is_left = surface.origin(a) == low;
                if a_is_left == (surface.origin(b) == low) {
                    self.defects.misoriented += 1;
                    return;
                }
                let (left, right) = if a_is_left { (a, b) } else { (b, a) };
                self.joints.push(Joint { left, right });
                opposite[left.row()] = right.0;
                opposite[right.row()] = left.0;
            }
            _ => self.defects.non_manifold += 1,
        }
    }

    /// Counts vertices without faces and vertices with more than one fan.
    fn count_fans(&mut self, surface: &Surface<'_>, opposite: &[u32]) {
        let mut valence = vec![0; surface.vertices().len()];
        let mut start = vec![ALONE; surface.vertices().len()];
        for h in (0..opposite.len() as u32).map(HalfEdge) {
            let v = surface.origin(h) as usize;
            valence[v] += 1;
            // An open fan is walked from the end that has nothing clockwise of it.
            if start[v] == ALONE || opposite[h.row()] == ALONE {
                start[v] = h.0;
            }
        }
        for (&n, &start) in valence.iter().zip(&start) {
            if n == 0 {
                self.defects.loose_vertices += 1;
            } else if fan_length(opposite, start) != n {
                self.defects.pinched_vertices += 1;
            }
        }
    }
}

/// `(lower vertex, higher vertex, half-edge)` of all half-edges, sorted.
fn sorted_half_edges(surface: &Surface<'_>) -> Vec<(u32, u32, u32)> {
    let mut out: Vec<_> = (0..3 * surface.faces().len() as u32)
        .map(|h| {
            let (a, b) = (surface.origin(HalfEdge(h)), surface.origin(HalfEdge(h).next()));
            (a.min(b), a.max(b), h)
        })
        .collect();
    out.sort_unstable();
    out
}

/// Faces met counter-clockwise about the origin of `start`.
fn fan_length(opposite: &[u32], start: u32) -> usize {
    let mut n_faces = 1;
    let mut h = opposite[HalfEdge(start).prev().row()];
    while h != ALONE && h != start {
        n_faces += 1;
        h = opposite[HalfEdge(h).prev().row()];
    }
    n_faces
}

/// Components in order of their lowest face, and the faces of each.
fn components(surface: &Surface<'_>, opposite: &[u32]) -> (Vec<Component>, Vec<Vec<u32>>) {
    let mut seen = vec![false; surface.faces().len()];
    let mut out = Vec::new();
    let mut faces_of = Vec::new();
    for seed in 0..seen.len() as u32 {
        if !seen[seed as usize] {
            let (component, faces) = component(surface, opposite, seed, &mut seen);
            out.push(component);
            faces_of.push(faces);
        }
    }
    for (component, depth) in out.iter_mut().zip(nesting::depths(surface, &faces_of)) {
        component.depth = depth;
    }
    (out, faces_of)
}

/// The component that holds a face, and its faces.
fn component(
    surface: &Surface<'_>,
    opposite: &[u32],
    seed: u32,
    seen: &mut [bool],
) -> (Component, Vec<u32>) {
    let (mut faces, mut n_alone, mut n_paired) = (vec![seed], 0, 0);
    seen[seed as usize] = true;
    let mut next = 0;
    while next < faces.len() {
        for k in 0..3 {
            let o = opposite[HalfEdge::new(faces[next], k).row()];
            if o == ALONE {
                n_alone += 1;
                continue;
            }
            n_paired += 1;
            if !std::mem::replace(&mut seen[(o / 3) as usize], true) {
                faces.push(o / 3);
            }
        }
        next += 1;
    }
    let mut vertices: Vec<u32> = faces.iter().flat_map(|&f| surface.faces()[f as usize]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let n_edges = n_alone + n_paired / 2;
    let euler_characteristic = vertices.len() as i64 - n_edges + faces.len() as i64;
    let is_closed = n_alone == 0 && euler_characteristic % 2 == 0;
    let component = Component {
        faces: faces.len() as u64,
        vertices: vertices.len() as u64,
        euler_characteristic,
        genus: is_closed.then_some(1 - euler_characteristic / 2),
        volume: f64::NAN,
        depth: 0,
    };
    (component, faces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::Vec3;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn topology(n_vertices: usize, faces: &[[u32; 3]]) -> Topology {
        let nets = vec![[Vec3::zeros(); 36]; faces.len()];
        let vertices = vec![Vec3::zeros(); n_vertices];
        Topology::of(&Surface::new(vertices, faces.to_vec(), nets).unwrap())
    }

    #[test]
    fn two_tetrahedra_are_two_spheres() {
        let second = TETRAHEDRON.map(|f| f.map(|v| v + 4));
        let found = topology(8, &[TETRAHEDRON, second].concat());
        assert_eq!(found.defects, EdgeDefects::default());
        assert_eq!(found.components.len(), 2);
        assert!(found.components.iter().all(|c| c.genus == Some(0) && c.vertices == 4));
        assert_eq!((found.joints.len(), found.n_edges), (12, 12));
    }

    #[test]
    fn each_kind_of_defect_is_counted_as_what_it_is() {
        let missing = topology(4, &TETRAHEDRON[..3]);
        assert_eq!(missing.defects.border, 3);
        assert_eq!(missing.components[0].genus, None);

        let mut flipped = TETRAHEDRON;
        flipped[0].swap(0, 1);
        assert_eq!(topology(4, &flipped).defects.misoriented, 3);

        let doubled = topology(4, &[TETRAHEDRON.as_slice(), &TETRAHEDRON[..1]].concat());
        assert_eq!(doubled.defects.non_manifold, 3);

        assert_eq!(topology(5, &TETRAHEDRON).defects.loose_vertices, 1);

        let on_one_apex = TETRAHEDRON.map(|f| f.map(|v| if v == 0 { 0 } else { v + 3 }));
        let pinched = topology(7, &[TETRAHEDRON, on_one_apex].concat());
        assert_eq!(pinched.defects, EdgeDefects { pinched_vertices: 1, ..EdgeDefects::default() });

        let needle = topology(4, &[TETRAHEDRON.as_slice(), &[[0, 0, 1]]].concat());
        assert_eq!(needle.defects.repeated_corners, 1);
    }
}
