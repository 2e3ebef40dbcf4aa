//! The weight `lambda0` at both ends of every edge, from the nets.

use crate::report::worse;
use crate::surface::Surface;
use crate::topology::{Joint, Topology};
use isospline_geometry::bezier_triangle::{DEGREE, boundary_index};
use isospline_geometry::{HalfEdge, Vec3};

/// Extremes of `lambda0` over all half-edge ends.
#[derive(Debug)]
pub(crate) struct Weights {
    pub(crate) out_of_range: u64,
    pub(crate) min: f64,
    pub(crate) max: f64,
}

/// Measures `lambda0` with `normals` (one a vertex, outward, any length).
///
/// `lambda0 = [P,Q] / ([P,Q] - [R,Q])`, row k = 0 of [TK, Table 2] crossed with Q, where
/// `[a,b] = (a x b) . N` and Q, P and R leave the vertex along the edge and along its
/// counter-clockwise and clockwise neighbours. It
/// lies in (0, 1) exactly if both sectors turn by less than half a turn, that is if `[P,Q] < 0`
/// and `[R,Q] > 0`; only that is asked, because two wrong signs give a quotient in range.
pub(crate) fn measure(surface: &Surface<'_>, topology: &Topology, normals: &[Vec3]) -> Weights {
    let mut out = Weights { out_of_range: 0, min: 1.0, max: 0.0 };
    for &joint in &topology.joints {
        for (h, opposite) in both_ends(joint) {
            let normal = normals[surface.origin(h) as usize];
            let [p, q, r] = spokes(surface, h, opposite);
            let (pq, rq) = (p.cross(&q).dot(&normal), r.cross(&q).dot(&normal));
            let lambda = pq / (pq - rq);
            out.out_of_range += u64::from(!(pq < 0.0 && rq > 0.0));
            out.min = -worse(-out.min, -lambda);
            out.max = worse(out.max, lambda);
        }
    }
    out
}

fn both_ends(joint: Joint) -> [(HalfEdge, HalfEdge); 2] {
    [(joint.left, joint.right), (joint.right, joint.left)]
}

/// First control points along the ccw neighbour of `h`, `h` itself and its cw neighbour, relative
/// to the vertex that they leave.
fn spokes(surface: &Surface<'_>, h: HalfEdge, opposite: HalfEdge) -> [Vec3; 3] {
    let from = |h: HalfEdge, s: usize| {
        surface.net(h.face() as usize)[boundary_index(DEGREE, h.corner() as usize, s)]
    };
    let vertex = from(h, 0);
    let clockwise = opposite.next();
    [from(h.prev(), DEGREE - 1) - vertex, from(h, 1) - vertex, from(clockwise, 1) - vertex]
}
