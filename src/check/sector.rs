//! The weight `lambda0` at both ends of every edge, from the nets.
#![expect(clippy::inline_always, reason = "kernels must be compiled for the widest vectors whole")]

use crate::lanes::{LANES, Lane, Triple, cross, dot, minus, vector};
use crate::report::worse;
use crate::seam::{Seam, Side};
use isospline_geometry::bezier_triangle::DEGREE;

/// Extremes of `lambda0` over half-edge ends.
#[derive(Debug)]
pub(crate) struct Weights {
    pub(crate) out_of_range: u64,
    pub(crate) min: f64,
    pub(crate) max: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { out_of_range: 0, min: 1.0, max: 0.0 }
    }
}

/// `lambda0` at one end of eight edges, and a one where it is in its range.
#[derive(Clone, Copy)]
pub(crate) struct Ends {
    lambda: Lane,
    in_range: Lane,
}

impl Weights {
    /// Takes in the first `n` of eight edges at one end.
    pub(crate) fn enter(&mut self, ends: &Ends, n: usize) {
        for k in 0..n {
            self.out_of_range += u64::from(ends.in_range[k] < 0.5);
            self.min = -worse(-self.min, -ends.lambda[k]);
            self.max = worse(self.max, ends.lambda[k]);
        }
    }

    /// Takes in other edges.
    pub(crate) fn append(&mut self, other: &Self) {
        self.out_of_range += other.out_of_range;
        self.min = -worse(-self.min, -other.min);
        self.max = worse(self.max, other.max);
    }
}

/// `lambda0` at the origins of the half-edges on the left and on the right, with the `normals` there
/// (outward, any length).
#[inline(always)]
pub(crate) fn both_ends(seam: &Seam, [at_left, at_right]: &[Triple; 2]) -> [Ends; 2] {
    let Seam { left, right } = seam;
    [Ends::of(left, right, at_left), Ends::of(right, left, at_right)]
}

impl Ends {
    /// Those at the origins of the half-edges of `side`.
    ///
    /// `lambda0 = [P,Q] / ([P,Q] - [R,Q])`, row k = 0 of [TK, Table 2] crossed with Q, where
    /// `[a,b] = (a x b) . N` and Q, P and R leave the vertex along the edge and along its
    /// counter-clockwise and clockwise neighbours. It
    /// lies in (0, 1) exactly if both sectors turn by less than half a turn, that is if `[P,Q] < 0`
    /// and `[R,Q] > 0`; only that is asked, because two wrong signs give a quotient in range.
    #[inline(always)]
    fn of(side: &Side, opposite: &Side, normals: &Triple) -> Self {
        // The first inner rows begin and end on the edges beside this one.
        let vertex = side.boundary(0);
        let (p, q) = (minus(side.inner(0), vertex), minus(side.boundary(1), vertex));
        let r = minus(opposite.inner(DEGREE - 1), vertex);
        let mut out = Self { lambda: [0.0; LANES], in_range: [0.0; LANES] };
        for k in 0..LANES {
            let q = vector(&q, k);
            let against_q = |a: &Triple| dot(cross(vector(a, k), q), vector(normals, k));
            let (pq, rq) = (against_q(&p), against_q(&r));
            out.lambda[k] = pq / (pq - rq);
            out.in_range[k] = if pq < 0.0 && rq > 0.0 { 1.0 } else { 0.0 };
        }
        out
    }
}
