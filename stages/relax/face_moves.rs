//! How the moves of the exact space reach the control points of one face.

#![expect(clippy::inline_always, reason = "kernels are compiled for several processors")]

use crate::functionals::LANES;
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

/// Columns of the matrices that moves act on: one a coordinate and one for a right-hand side, filled
/// up to whole vectors.
pub(crate) const WIDTH: usize = 5 * LANES;
/// A row of a matrix, zero where it is filled up.
pub(crate) type Row = [f64; WIDTH];

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
pub(crate) const fn column(k: usize, c: usize) -> usize {
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
    #[inline(always)]
    pub(crate) fn transposed_times(&self, m: &[Row; OUTER], out: &mut [Row; REACHING]) {
        *out = [[0.0; WIDTH]; REACHING];
        // Columns come first: compilers otherwise gather lanes from distant places.
        for first in (0..WIDTH).step_by(LANES) {
            for k in 0..3 {
                let rows: [_; 9] = std::array::from_fn(|r| lanes(&m[9 * k + r], first));
                for c in 0..BESIDE {
                    let weights = self.edges[k].each_ref().map(|row| row[c]);
                    add(&mut out[column(k, c)], first, &weights, &rows);
                }
                let rows: [_; 3] = std::array::from_fn(|r| lanes(&m[27 + 3 * k + r], first));
                for (c, shift) in self.twists[k].iter().enumerate() {
                    add(&mut out[twist_column(k) + c], first, &(*shift).into(), &rows);
                }
            }
        }
    }
}

/// Eight columns of a row.
#[inline(always)]
pub(crate) fn lanes(row: &Row, first: usize) -> [f64; LANES] {
    std::array::from_fn(|lane| row[first + lane])
}

/// `sum += weights . rows` in eight columns.
#[inline(always)]
pub(crate) fn add<const N: usize>(
    sum: &mut Row,
    first: usize,
    weights: &[f64; N],
    rows: &[[f64; LANES]; N],
) {
    let mut part = lanes(sum, first);
    for (w, row) in weights.iter().zip(rows) {
        for lane in 0..LANES {
            part[lane] += w * row[lane];
        }
    }
    sum[first..first + LANES].copy_from_slice(&part);
}
