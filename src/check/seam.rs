//! Eight shared edges side by side: the control points next to them and derivatives along them.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::grid::bernstein;
use crate::lanes::{LANES, Lane, Triple, minus, put, weighed};
use crate::surface::Surface;
use crate::topology::Joint;
use isospline_geometry::HalfEdge;
use isospline_geometry::bezier_triangle::{DEGREE, index};

/// Points an edge at which normals are compared, ends included: `t = i / 32` and `1 - t` are
/// exact, so both patches are evaluated at the same parameter.
pub(crate) const N_EDGE_POINTS: usize = 33;
/// Those of eight edges.
pub(crate) const N_SAMPLES: usize = LANES * N_EDGE_POINTS;

/// Control points of the rows 0, 1 and 2 within an edge.
const N_ROWS: usize = 3 * DEGREE;
/// Index in the net of each, by the corner at which the edge begins.
const ROWS: [[usize; N_ROWS]; 3] = [rows(0), rows(1), rows(2)];

/// Something of both sides of an edge.
pub(crate) struct Both<T> {
    pub(crate) left: T,
    pub(crate) right: T,
}

/// The patches on both sides of eight edges.
pub(crate) type Seam = Both<Side>;

/// Eight patches along a half-edge each, in its direction.
#[repr(C, align(64))]
pub(crate) struct Side {
    rows: [Triple; N_ROWS],
}

/// First derivatives over 7 at all points of eight edges, those of a point beside each other.
#[repr(C, align(64))]
pub(crate) struct Derivatives {
    pub(crate) along: [[f64; N_SAMPLES]; 3],
    pub(crate) inward: [[f64; N_SAMPLES]; 3],
}

/// Bernstein polynomials of degree 6 at the points of an edge.
pub(crate) struct EdgeTable([Weights; N_EDGE_POINTS]);

/// Those at one point.
type Weights = [f64; DEGREE];

/// Parameter of point `i` of an edge.
pub(crate) fn parameter(i: usize) -> f64 {
    i as f64 / (N_EDGE_POINTS - 1) as f64
}

impl EdgeTable {
    pub(crate) fn new() -> Self {
        Self(std::array::from_fn(|i| bernstein(parameter(i))))
    }
}

impl Seam {
    pub(crate) fn new() -> Self {
        let side = || Side { rows: [[[0.0; LANES]; 3]; N_ROWS] };
        Self { left: side(), right: side() }
    }

    /// Becomes that of 1 to 8 other edges; idle places hold the last one.
    pub(crate) fn set(&mut self, surface: &Surface<'_>, joints: &[Joint]) {
        for k in 0..LANES {
            let joint = joints[k.min(joints.len() - 1)];
            self.left.set(k, surface, joint.left);
            self.right.set(k, surface, joint.right);
        }
    }
}

impl Side {
    fn set(&mut self, k: usize, surface: &Surface<'_>, h: HalfEdge) {
        let net = surface.net(h.face() as usize);
        for (out, &i) in self.rows.iter_mut().zip(&ROWS[h.corner() as usize]) {
            (out[0][k], out[1][k], out[2][k]) = (net[i].x, net[i].y, net[i].z);
        }
    }

    /// Control point `s` of the edge itself, 0 to 7.
    #[inline(always)]
    pub(crate) fn boundary(&self, s: usize) -> &Triple {
        &self.rows[s]
    }

    /// Control point `s` of the first row inside, 0 to 6.
    #[inline(always)]
    pub(crate) fn inner(&self, s: usize) -> &Triple {
        &self.rows[DEGREE + 1 + s]
    }

    /// Control point `s` of the second row inside, 0 to 5.
    #[inline(always)]
    pub(crate) fn second(&self, s: usize) -> &Triple {
        &self.rows[2 * DEGREE + 1 + s]
    }

    /// Difference `s` along the edge, 0 to 6.
    #[inline(always)]
    pub(crate) fn along(&self, s: usize) -> Triple {
        minus(self.boundary(s + 1), self.boundary(s))
    }

    /// Difference `s` from the edge to the first row inside, 0 to 6.
    #[inline(always)]
    pub(crate) fn inward(&self, s: usize) -> Triple {
        minus(self.inner(s), self.boundary(s))
    }

    /// Both, side by side: differences are formed before they are weighed, so that angles keep their
    /// digits on edges that are short against their distance from the origin.
    #[inline(always)]
    fn differences(&self) -> [[Lane; 6]; DEGREE] {
        let mut out = [[[0.0; LANES]; 6]; DEGREE];
        for (s, out) in out.iter_mut().enumerate() {
            put([self.along(s), self.inward(s)], out);
        }
        out
    }
}

impl Derivatives {
    pub(crate) fn new() -> Self {
        let zero = [[0.0; N_SAMPLES]; 3];
        Self { along: zero, inward: zero }
    }

    /// Become those on both sides of a seam, the points in the order of the left one.
    #[inline(always)]
    pub(crate) fn set_both(both: &mut Both<Self>, seam: &Seam, table: &EdgeTable) {
        let EdgeTable(points) = table;
        both.left.set(&seam.left, points.iter());
        both.right.set(&seam.right, points.iter().rev());
    }

    #[inline(always)]
    fn set<'a>(&mut self, side: &Side, points: impl Iterator<Item = &'a Weights>) {
        let differences = side.differences();
        for (i, weights) in points.enumerate() {
            let sum = weighed(weights.iter().copied().zip(&differences));
            for c in 0..3 {
                self.along[c][LANES * i..][..LANES].copy_from_slice(&sum[c]);
                self.inward[c][LANES * i..][..LANES].copy_from_slice(&sum[3 + c]);
            }
        }
    }
}

/// Rows 0, 1 and 2 within the edge from `corner`, one after another.
const fn rows(corner: usize) -> [usize; N_ROWS] {
    let mut out = [0; N_ROWS];
    let (mut row, mut n) = (0, 0);
    while row < 3 {
        let mut s = 0;
        while s <= DEGREE - row {
            let mut e = [0; 3];
            e[corner] = DEGREE - row - s;
            e[(corner + 1) % 3] = s;
            e[(corner + 2) % 3] = row;
            out[n] = index(e);
            s += 1;
            n += 1;
        }
        row += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::bezier_triangle::{boundary_index, first_inner_index};

    #[test]
    fn rows_stand_where_the_convention_says() {
        for corner in 0..3 {
            for s in 0..=7 {
                assert_eq!(ROWS[corner][s], boundary_index(7, corner, s));
            }
            for s in 0..=6 {
                assert_eq!(ROWS[corner][8 + s], first_inner_index(7, corner, s));
            }
            // The last points of a row lie on the other two edges.
            assert_eq!(ROWS[corner][15], boundary_index(7, (corner + 2) % 3, 5));
            assert_eq!(ROWS[corner][20], boundary_index(7, (corner + 1) % 3, 2));
        }
    }
}
