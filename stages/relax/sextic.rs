//! Patches of degree 6: from those of degree 7 that the stages before made, back onto the exact
//! conditions, and raised to degree 7 at the end.
//!
//! A patch of degree 6 and the same one raised to degree 7 have one mixed derivative at a corner, so
//! the systems of the vertices, which are those of degree 7, serve both.
//
// symbols: t5 = b'(4, 1, 1) and t6 = b(5, 1, 1), the twists of degree 6 and 7

use crate::degree::{Degree, sextic_step};
use crate::moves::Moves;
use crate::progress::Start;
use crate::restore::Conditions;
use crate::samples::Interior;
use crate::ties::close;
use isospline_fitting::edge_end::{ccw, cw, outgoing_curve, outgoing_tangent};
use isospline_fitting::net::{boundary_net_sextic, flat_interior, point};
use isospline_fitting::sextic_edge::SexticEdge;
use isospline_geometry::bezier_triangle::{N_CONTROL, first_inner_slot, interior_indices};
use isospline_geometry::degree_change::{lower_to_sextic, raise_sextic};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::{Counters, Host, map};

/// Gaps, without unit, that are rounding.
const CLOSED: f64 = 1e-15;
/// Times that gaps are closed: the second removes what the rounding of the first left.
const CLOSINGS: usize = 3;

impl Conditions<'_> {
    /// The exact surface of degree 6 nearest to these septic patches in its twists and rows.
    pub(crate) fn lowered(&self, host: &dyn Host, moves: &Moves, septic: &[[f64; 45]]) -> Start {
        let interior = map(host, septic.len(), |f| self.lowered_face(&septic[f], f));
        let n_edges = self.mesh.edge.len();
        let mut start = Start { interior, nu: vec![0.0; n_edges], gap: vec![0.0; n_edges] };
        self.restore_sextic(host, moves, &mut start.interior, &mut start.nu);
        start
    }

    /// Interior points, in their septic slots, of the patch of degree 6 with the same twists.
    fn lowered_face(&self, septic: &[f64; 45], face: usize) -> Interior {
        let boundary = boundary_net_sextic(&self.mesh, &self.network, face);
        let net = lower_to_sextic(boundary, &std::array::from_fn(|i| point(septic, i)));
        let mut by_slot = [Vec3::zeros(); N_CONTROL];
        Degree::Six.slots().into_iter().zip(net).for_each(|(slot, p)| by_slot[slot] = p);
        interior_indices().map(|i| by_slot[i])
    }

    /// Moves twists, `nu` and rows of `surface` least onto the conditions.
    pub(crate) fn restore_sextic(
        &self,
        host: &dyn Host,
        moves: &Moves,
        surface: &mut [Interior],
        nu: &mut [f64],
    ) -> Counters {
        let mut counters = Counters::default();
        let mut weights = self.restore_sextic_twists(host, surface, &mut counters);
        for _ in 0..CLOSINGS {
            let gap = map(host, nu.len(), |e| self.sextic_edge(surface, &weights, nu[e], e).gap());
            if gap.iter().all(|g| g.abs() <= CLOSED) {
                break;
            }
            let amounts = close(&self.mesh, &moves.ties, &gap);
            self.shift_twists(surface, moves, &amounts.spokes);
            for (e, amount) in amounts.nu.iter().enumerate() {
                nu[e] += amount * moves.edges[e].nu_scale;
            }
            counters = Counters::default();
            weights = self.restore_sextic_twists(host, surface, &mut counters);
        }
        let edges = map(host, nu.len(), |e| {
            let mut edge = self.sextic_edge(surface, &weights, nu[e], e);
            edge.solve();
            edge
        });
        for (e, edge) in edges.into_iter().enumerate() {
            counters.max("edge_gap_max", edge.gap().abs());
            counters.max("edge_residual_max", edge.residual());
            let [h, g] = self.mesh.edge_half[e].map(HalfEdge);
            let origin = outgoing_curve(&self.mesh, &self.network, h)[0];
            for (h, row) in [(h, [edge.p[2], edge.p[3]]), (g, [edge.r[3], edge.r[2]])] {
                for (s, p) in [2, 3].into_iter().zip(row) {
                    *at_mut(surface, h, s) = origin + p;
                }
            }
        }
        counters
    }

    /// Moves the twists least onto the rows k = 1; `[lambda0, mu0, mu1]` of degree 7 in star order.
    fn restore_sextic_twists(
        &self,
        host: &dyn Host,
        surface: &mut [Interior],
        counters: &mut Counters,
    ) -> Vec<[f64; 3]> {
        let twist = |surface: &[Interior], h| self.septic_twist(h, at(surface, h, 1));
        let put = |surface: &mut [Interior], h, twist| {
            *at_mut(surface, h, 1) = self.sextic_twist(h, twist);
        };
        self.restore_twists(host, surface, twist, put, counters)
    }

    fn shift_twists(&self, surface: &mut [Interior], moves: &Moves, amounts: &[f64]) {
        for (h, &amount) in amounts.iter().enumerate() {
            let (spoke, h) = (&moves.spokes[h], HalfEdge(h as u32));
            let right = cw(&self.mesh, h);
            *at_mut(surface, h, 1) += amount * spoke.left;
            *at_mut(surface, right, 1) += amount * spoke.right;
        }
    }

    fn sextic_edge(
        &self,
        surface: &[Interior],
        weights: &[[f64; 3]],
        nu: f64,
        edge: usize,
    ) -> SexticEdge {
        let [h, g] = self.mesh.edge_half[edge].map(HalfEdge);
        let curve = outgoing_curve(&self.mesh, &self.network, h);
        let row = |h| self.sextic_row(surface, h).map(|p| p - curve[0]);
        let mut r = row(g);
        r.reverse();
        let [lower, higher] = [h, g].map(|h| weights[self.mesh.star_row[h.row()] as usize]);
        let ([a0, a1], [b0, b1]) = (sextic_mu(lower), sextic_mu(higher));
        SexticEdge {
            q: curve.map(|q| q - curve[0]),
            p: row(h),
            r,
            lambda: [lower[0], 1.0 - higher[0]],
            mu: [a0, a1, 1.0 - b1, 1.0 - b0],
            nu,
        }
    }

    /// First inner row of the face of `h`, along `h`: its ends lie on the neighbouring curves.
    fn sextic_row(&self, surface: &[Interior], h: HalfEdge) -> [Vec3; 6] {
        let (mesh, network) = (&self.mesh, &self.network);
        let on_curve = |h: HalfEdge| {
            let q = outgoing_curve(mesh, network, h);
            q[0] + (q[1] - q[0]) * (4.0 / 6.0)
        };
        let [p1, p2, p3, p4] = [1, 2, 3, 4].map(|s| at(surface, h, s));
        [on_curve(ccw(mesh, h)), p1, p2, p3, p4, on_curve(h.next())]
    }

    /// Twist of degree 7 at the origin of `h` with the mixed derivative of this one of degree 6:
    /// `7 t6 = 5 t5 + b'(5,1,0) + b'(5,0,1)`.
    fn septic_twist(&self, h: HalfEdge, sextic: Vec3) -> Vec3 {
        (5.0 * sextic + self.beside_twist(h)) / 7.0
    }

    fn sextic_twist(&self, h: HalfEdge, septic: Vec3) -> Vec3 {
        (7.0 * septic - self.beside_twist(h)) / 5.0
    }

    fn beside_twist(&self, h: HalfEdge) -> Vec3 {
        let (mesh, network) = (&self.mesh, &self.network);
        let origin = outgoing_curve(mesh, network, h)[0];
        let tangent = |h| outgoing_tangent(mesh, network, h);
        2.0 * origin + (4.0 / 6.0) * (tangent(h) + tangent(ccw(mesh, h)))
    }

    /// Interior points of the patch raised to degree 7.
    pub(crate) fn raised(&self, interior: &Interior, face: usize) -> [f64; 45] {
        let mut net = boundary_net_sextic(&self.mesh, &self.network, face);
        let slots = interior_indices();
        for (p, slot) in net.iter_mut().zip(Degree::Six.slots()) {
            if let Some(i) = slots.iter().position(|&inner| inner == slot) {
                *p = interior[i];
            }
        }
        let raised = raise_sextic(&net);
        flat_interior(&slots.map(|i| raised[i]))
    }
}

/// `mu0` and `mu1` of degree 6 from `[lambda0, mu0, mu1]` of degree 7: a row of degree 7 is 6/7 of
/// that of degree 6 and 1/7 of the curve, so that `mu = 6/7 mu' + t/7`.
fn sextic_mu([_, mu0, mu1]: [f64; 3]) -> [f64; 2] {
    let first = 7.0 / 6.0 * mu0;
    [first, ((14.0 / 3.0) * (mu1 - 1.0 / 28.0) - first) / 3.0]
}

/// Step `s` (1..=4) of the first inner row along `h`.
fn at(surface: &[Interior], h: HalfEdge, s: usize) -> Vec3 {
    surface[h.face() as usize][first_inner_slot(h.corner() as usize, sextic_step(s))]
}

fn at_mut(surface: &mut [Interior], h: HalfEdge, s: usize) -> &mut Vec3 {
    &mut surface[h.face() as usize][first_inner_slot(h.corner() as usize, sextic_step(s))]
}
