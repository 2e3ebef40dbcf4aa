//! Exact G1 to the last bits: the vertex and the edge systems nearest to a surface.
//!
//! Moves keep the conditions up to rounding, which adds up over sweeps; the direct solves bring
//! every row back to a few units of the last place.

use crate::samples::Interior;
use isospline_artifact::kinds::{BaseMeshView, CurvatureView, NetworkView, VertexSystemsView};
use isospline_fitting::edge_rows::Edge;
use isospline_fitting::edge_system;
use isospline_fitting::net::point;
use isospline_fitting::vertex_star::Star;
use isospline_fitting::vertex_system::Solver;
use isospline_geometry::bezier_triangle::first_inner_slot;
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::{Counters, Host, map};

/// Penalty on the squared change of `nu`, beside squared shifts in chords.
const NU_WEIGHT: f64 = 1e-4;

/// What the conditions are made of.
#[derive(Clone, Copy)]
pub(crate) struct Conditions<'a> {
    pub(crate) mesh: BaseMeshView<'a>,
    pub(crate) curvature: CurvatureView<'a>,
    pub(crate) network: NetworkView<'a>,
    pub(crate) vertices: VertexSystemsView<'a>,
}

impl Conditions<'_> {
    /// Moves twists and rows of `surface` least onto the conditions; `nu` is that of the edges.
    pub(crate) fn restore(
        &self,
        host: &dyn Host,
        surface: &mut [Interior],
        nu: &[f64],
    ) -> Counters {
        let mut counters = Counters::default();
        let twist = |surface: &[Interior], h| row_point(surface, h, 1);
        let put = |surface: &mut [Interior], h: HalfEdge, twist| {
            surface[h.face() as usize][first_inner_slot(h.corner() as usize, 1)] = twist;
        };
        let weights = self.restore_twists(host, surface, twist, put, &mut counters);
        let rows = map(host, self.mesh.edge.len(), |e| self.edge(surface, &weights, nu[e], e));
        for (e, rows) in rows.into_iter().enumerate() {
            counters.max("edge_residual_max", rows.residual);
            let halves = self.mesh.edge_half[e].map(HalfEdge);
            for (h, row) in halves.into_iter().zip([rows.left, rows.right]) {
                for s in 0..3 {
                    // Rows run along the edge; the right face sees them from the other end.
                    let step = if h == halves[0] { 2 + s } else { 4 - s };
                    let slot = first_inner_slot(h.corner() as usize, step);
                    surface[h.face() as usize][slot] = point(&row, s);
                }
            }
        }
        counters
    }

    /// Moves the twists least onto the rows k = 1 and returns `[lambda0, mu0, mu1]` in star order;
    /// `twist` reads that of the face of a half-edge, of degree 7, in model units, `put` writes it.
    pub(crate) fn restore_twists(
        &self,
        host: &dyn Host,
        surface: &mut [Interior],
        twist: impl Fn(&[Interior], HalfEdge) -> Vec3 + Sync,
        put: impl Fn(&mut [Interior], HalfEdge, Vec3),
        counters: &mut Counters,
    ) -> Vec<[f64; 3]> {
        let n_vertices = self.mesh.position.len();
        let stars = map(host, n_vertices, |v| self.vertex(|h| twist(surface, h), v));
        let mut weights = self.vertices.weights.to_vec();
        for (v, star) in stars.into_iter().enumerate() {
            // Twists without a solution stay where the moves, exact up to rounding, left them.
            let Some(star) = star else {
                counters.repair("vertices_not_restored", 1);
                continue;
            };
            counters.max("vertex_residual_max", star.residual);
            let first = self.mesh.star_first[v] as usize;
            for (i, (twist, mu1)) in star.twists.into_iter().zip(star.mu1).enumerate() {
                put(surface, HalfEdge(self.mesh.star[first + i]), twist);
                weights[first + i][2] = mu1;
            }
        }
        weights
    }

    fn vertex(&self, twist: impl Fn(HalfEdge) -> Vec3, vertex: usize) -> Option<RestoredStar> {
        let star = Star::new(&self.mesh, &self.curvature, &self.network, twist, vertex);
        let mut solver = Solver::default();
        solver.solve(&star)?;
        let residual = star.residual(&solver.twists, &solver.mu1);
        let twists = solver.twists.iter().map(|t| star.origin + t).collect();
        Some(RestoredStar { twists, mu1: solver.mu1, residual })
    }

    fn edge(&self, surface: &[Interior], weights: &[[f64; 3]], nu: f64, edge: usize) -> Rows {
        let points = |h: HalfEdge| [1, 2, 3, 4, 5].map(|s| row_point(surface, h, s));
        let mut edge = Edge::new(&self.mesh, &self.network, points, weights, edge);
        edge_system::solve(&mut edge, nu, NU_WEIGHT);
        Rows {
            left: edge.model_row(&edge.p),
            right: edge.model_row(&edge.r),
            residual: edge.residual(),
        }
    }
}

/// Twists and `mu1` of a vertex, counter-clockwise.
struct RestoredStar {
    twists: Vec<Vec3>,
    mu1: Vec<f64>,
    residual: f64,
}

/// First inner rows of an edge.
struct Rows {
    left: [f64; 9],
    right: [f64; 9],
    residual: f64,
}

/// Step `s` of the first inner row along `h`.
fn row_point(surface: &[Interior], h: HalfEdge, s: usize) -> Vec3 {
    surface[h.face() as usize][first_inner_slot(h.corner() as usize, s)]
}
