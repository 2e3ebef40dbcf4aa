//! The triangles that separate inside from outside nodes, tetrahedron by tetrahedron.
//!
//! A tetrahedron whose nodes lie on both sides holds one triangle or one quadrilateral with its
//! corners on the edges that change side. Every edge has one corner and every face of the complex
//! at most one segment, so the pieces close up to a manifold, whatever the values are.

use crate::complex::{Complex, Tetrahedron};
use crate::key_map::{KeyMap, pair};
use isospline_geometry::{TriangleMesh, Vec3};

/// Marks the missing fourth corner of a triangle.
const NONE: u32 = u32::MAX;

/// The separating surface before its corners have positions.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    /// The edge of each corner: (inside node, outside node).
    pub(crate) crossings: Vec<[u32; 2]>,
    /// Triangles and quadrilaterals, counter-clockwise seen from outside.
    polygons: Vec<[u32; 4]>,
}

impl Pieces {
    /// All pieces of a complex.
    pub(crate) fn of(complex: &Complex) -> Self {
        let mut pieces = Self { crossings: Vec::new(), polygons: Vec::new() };
        let mut corner_at = KeyMap::with_room_for(complex.n_cells());
        for cell in (0..complex.n_cells()).filter(|&c| !complex.is_one_sided(c)) {
            for t in complex.tetrahedra(cell) {
                pieces.add(complex, &mut corner_at, t);
            }
        }
        pieces
    }

    /// Triangles that the pieces of a complex are cut into.
    pub(crate) fn count(complex: &Complex) -> usize {
        let triangles = |t: Tetrahedron| match t.iter().filter(|&&n| complex.inside(n)).count() {
            0 | 4 => 0,
            2 => 2,
            _ => 1,
        };
        let cells = (0..complex.n_cells()).filter(|&c| !complex.is_one_sided(c));
        cells.map(|c| complex.tetrahedra(c).map(triangles).sum::<usize>()).sum()
    }

    /// Cuts quadrilaterals along their shorter diagonal.
    pub(crate) fn triangulate(self, positions: Vec<Vec3>) -> TriangleMesh {
        let n_quads = self.polygons.iter().filter(|p| p[3] != NONE).count();
        let mut faces = Vec::with_capacity(self.polygons.len() + n_quads);
        for &[a, b, c, d] in &self.polygons {
            let length_sq =
                |i: u32, j: u32| (positions[i as usize] - positions[j as usize]).norm_squared();
            if d == NONE {
                faces.push([a, b, c]);
            } else if length_sq(a, c) <= length_sq(b, d) {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
        TriangleMesh { positions, faces }
    }

    fn add(&mut self, complex: &Complex, corner_at: &mut KeyMap, t: Tetrahedron) {
        let sides = t.map(|n| complex.inside(n));
        let mut corner = |i: usize, o: usize| {
            let row = self.crossings.len() as u32;
            let (row, is_new) = corner_at.get_or_insert(pair(t[i], t[o]), row);
            if is_new {
                self.crossings.push([t[i], t[o]]);
            }
            row
        };
        let place = |inside: bool| sides.iter().position(|&s| s == inside);
        let polygon = match sides.iter().filter(|&&inside| inside).count() {
            1 => {
                let [a, b, c, d] = EVEN_FROM[place(true).expect("invariant: one is inside")];
                [corner(a, b), corner(a, c), corner(a, d), NONE]
            }
            3 => {
                let [a, b, c, d] = EVEN_FROM[place(false).expect("invariant: one is outside")];
                [corner(b, a), corner(d, a), corner(c, a), NONE]
            }
            2 => {
                let first = place(true).expect("invariant: two are inside");
                let second = sides.iter().rposition(|&s| s).expect("invariant: two are inside");
                let [a, b, c, d] = even_pair(first, second);
                [corner(a, c), corner(a, d), corner(b, d), corner(b, c)]
            }
            _ => return,
        };
        self.polygons.push(polygon);
    }
}

/// Even permutations of the places 0 to 3 that begin with the given one.
const EVEN_FROM: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 1, 0, 2]];

/// The even permutation that begins with `first < second`.
fn even_pair(first: usize, second: usize) -> [usize; 4] {
    match (first, second) {
        (0, 1) => [0, 1, 2, 3],
        (0, 2) => [0, 2, 3, 1],
        (0, 3) => [0, 3, 1, 2],
        (1, 2) => [1, 2, 0, 3],
        (1, 3) => [1, 3, 2, 0],
        _ => [2, 3, 0, 1],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_even(p: [usize; 4]) -> bool {
        let inversions =
            (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j))).filter(|&(i, j)| p[i] > p[j]);
        inversions.count() % 2 == 0
    }

    #[test]
    fn all_permutations_used_are_even_so_that_orientation_is_kept() {
        assert!((0..4).all(|i| is_even(EVEN_FROM[i]) && EVEN_FROM[i][0] == i));
        for i in 0..4 {
            for j in i + 1..4 {
                let p = even_pair(i, j);
                assert!(is_even(p) && p[..2] == [i, j], "{p:?}");
            }
        }
    }
}
