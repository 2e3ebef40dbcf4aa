//! How the moves of the exact space reach the control points of one face.

use crate::moves::Moves;
use isospline_artifact::kinds::BaseMeshView;
use isospline_fitting::edge_end::{ccw, cw};
use isospline_geometry::bezier_triangle::{INNERMOST_SLOTS, N_INTERIOR, first_inner_slot};
use isospline_geometry::{HalfEdge, Vec3};

/// Coordinates of the points on first inner rows.
pub(crate) const OUTER: usize = 36;
/// Coordinates of the innermost points.
pub(crate) const INNER: usize = 9;
/// Moves of an edge that are not its spokes'; the last is that of `nu`.
pub(crate) const OWN: usize = 7;
/// Moves that reach a face: those of its edges, and four spokes of each corner.
pub(crate) const REACHING: usize = 3 * OWN + 12;
/// Moves that reach the row beside an edge: its own, and three spokes of each end.
const BESIDE: usize = OWN + 6;

/// Places among the interior points: the rows beside the edges, the twists, the innermost three.
pub(crate) fn elimination_order() -> [usize; N_INTERIOR] {
    let mut out = [0; N_INTERIOR];
    for k in 0..3 {
        for s in 0..3 {
            out[3 * k + s] = first_inner_slot(k, s + 2);
        }
        out[9 + k] = first_inner_slot(k, 1);
        out[12 + k] = INNERMOST_SLOTS[k];
    }
    out
}

/// Half-edges whose spoke moves reach `face`, in the order of its moves from 21 on: of each
/// corner those clockwise of the face's half-edge, that one, and two counter-clockwise.
pub(crate) fn reaching_spokes(mesh: &BaseMeshView<'_>, face: usize) -> [HalfEdge; 12] {
    let mut out = [HalfEdge(0); 12];
    for corner in 0..3 {
        let h = HalfEdge::new(face as u32, corner as u32);
        let next = ccw(mesh, h);
        let spokes = [cw(mesh, h), h, next, ccw(mesh, next)];
        out[4 * corner..4 * corner + 4].copy_from_slice(&spokes);
    }
    out
}

/// The four faces that the move of spoke `h` reaches.
pub(crate) fn reached_faces(mesh: &BaseMeshView<'_>, h: HalfEdge) -> [u32; 4] {
    let before = cw(mesh, h);
    [h, ccw(mesh, h), before, cw(mesh, before)].map(HalfEdge::face)
}

/// The map from the 33 moves to the 36 coordinates of the outer points.
#[derive(Clone, Debug)]
pub(crate) struct FaceMoves {
    /// Coordinates of the row beside each edge under the 13 moves of [`column`].
    edges: [[[f64; BESIDE]; 9]; 3],
    /// Twist of each corner under the spokes on both sides of the face.
    twists: [[Vec3; 2]; 3],
}

/// Which of the face's moves is number `c` of those that reach the row beside edge `k`.
#[inline]
const fn column(k: usize, c: usize) -> usize {
    if c < OWN {
        OWN * k + c
    } else if c < OWN + 3 {
        3 * OWN + 4 * k + (c - OWN)
    } else {
        3 * OWN + 4 * ((k + 1) % 3) + (c - OWN - 2)
    }
}

/// Which of the face's moves is the first of the two that shift the twist of `corner`.
#[inline]
const fn twist_column(corner: usize) -> usize {
    3 * OWN + 4 * corner + 1
}

impl FaceMoves {
    pub(crate) fn new(mesh: &BaseMeshView<'_>, moves: &Moves, face: usize) -> Self {
        let mut out = Self { edges: [[[0.0; BESIDE]; 9]; 3], twists: [[Vec3::zeros(); 2]; 3] };
        for k in 0..3 {
            let h = HalfEdge::new(face as u32, k as u32);
            let e = mesh.edge_of[h.row()] as usize;
            let edge = &moves.edges[e];
            let is_left = mesh.edge_half[e][0] == h.0;
            let (near, far) = if is_left { (0, 1) } else { (1, 0) };
            for s in 0..3 {
                // Rows run along the edge; the right face sees them from the other end.
                let i = if is_left { 2 * s } else { 5 - 2 * s };
                for x in 0..3 {
                    let row = &mut out.edges[k][3 * s + x];
                    row[x] = edge.free[0][i];
                    row[3 + x] = edge.free[1][i];
                    row[6] = edge.nu[i][x];
                    for c in 0..3 {
                        row[OWN + c] = edge.ends[near][c][i][x];
                        row[OWN + 3 + c] = edge.ends[far][c][i][x];
                    }
                }
            }
            let next = ccw(mesh, h);
            out.twists[k] = [moves.spokes[h.row()].left, moves.spokes[next.row()].right];
        }
        out
    }

    /// Shift of the outer points under these amounts of the moves.
    pub(crate) fn apply(&self, amounts: &[f64; REACHING]) -> [f64; OUTER] {
        let mut out = [0.0; OUTER];
        for k in 0..3 {
            for (r, row) in self.edges[k].iter().enumerate() {
                let part = |(c, w): (usize, &f64)| w * amounts[column(k, c)];
                out[9 * k + r] = row.iter().enumerate().map(part).sum();
            }
            let at = twist_column(k);
            let twist = amounts[at] * self.twists[k][0] + amounts[at + 1] * self.twists[k][1];
            out[27 + 3 * k..30 + 3 * k].copy_from_slice(twist.as_slice());
        }
        out
    }

    /// `Z^T m` for the map `Z` and 36 rows `m`.
    pub(crate) fn transposed_times<const N: usize>(
        &self,
        m: &[[f64; N]; OUTER],
    ) -> [[f64; N]; REACHING] {
        let mut out = [[0.0; N]; REACHING];
        for k in 0..3 {
            for c in 0..BESIDE {
                let sum = &mut out[column(k, c)];
                for r in 0..9 {
                    add(sum, self.edges[k][r][c], &m[9 * k + r]);
                }
            }
            for (c, shift) in self.twists[k].iter().enumerate() {
                let sum = &mut out[twist_column(k) + c];
                for x in 0..3 {
                    add(sum, shift[x], &m[27 + 3 * k + x]);
                }
            }
        }
        out
    }

    /// `m Z` for rows `m` of 36.
    pub(crate) fn times(&self, m: &[[f64; OUTER]; REACHING]) -> [[f64; REACHING]; REACHING] {
        let mut out = [[0.0; REACHING]; REACHING];
        for (row, sums) in m.iter().zip(&mut out) {
            for k in 0..3 {
                let mut beside = [0.0; BESIDE];
                for r in 0..9 {
                    add(&mut beside, row[9 * k + r], &self.edges[k][r]);
                }
                for (c, x) in beside.into_iter().enumerate() {
                    sums[column(k, c)] += x;
                }
                let own = &row[27 + 3 * k..30 + 3 * k];
                for (c, shift) in self.twists[k].iter().enumerate() {
                    sums[twist_column(k) + c] +=
                        own[0] * shift.x + own[1] * shift.y + own[2] * shift.z;
                }
            }
        }
        out
    }
}

/// `sum += weight * row`.
#[inline]
fn add<const N: usize>(sum: &mut [f64; N], weight: f64, row: &[f64; N]) {
    for (s, x) in sum.iter_mut().zip(row) {
        *s += weight * x;
    }
}
