//! Stage `edge_systems`: first inner rows that satisfy the G1 condition along every edge.

mod error;
mod params;

pub use error::EdgeSystemsError;
pub use params::EdgeSystemsParams;

use isospline_artifact::kinds::{
    BaseMeshView, EdgeSystems, EdgeWeights, G0FitView, NetworkView, VertexSystemsView,
};
use isospline_fitting::edge_rows::Edge;
use isospline_fitting::edge_system::solve;
use isospline_fitting::net::point;
use isospline_geometry::HalfEdge;
use isospline_geometry::bezier_triangle::first_inner_slot;
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use std::ops::Range;

/// Solves rows k = 2 .. 5 of the G1 condition on each edge, in the uniformly regular form.
#[derive(Clone, Copy, Debug)]
pub struct EdgeSystemsStage {
    nu_weight: f64,
}

impl Stage for EdgeSystemsStage {
    const NAME: &'static str = "edge_systems";
    const VERSION: u32 = 1;
    type Params = EdgeSystemsParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (NetworkView<'a>, G0FitView<'a>, VertexSystemsView<'a>);
    type Output = EdgeSystems;
    type Error = EdgeSystemsError;

    fn prepare(
        _: &Ctx<'_>,
        params: &EdgeSystemsParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, EdgeSystemsError> {
        Ok(Self { nu_weight: params.nu_weight })
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let n_edges = mesh.edge.len();
        let tasks = cut(n_edges, rows_per_task).map(|edges| task(&mesh, edges));
        Plan::Rows { lengths: vec![n_edges; 3], tasks: tasks.collect() }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (network, g0_fit, vertices): Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<EdgeSystems>, EdgeSystemsError> {
        let mut piece = Piece::<EdgeSystems>::default();
        let points = |h: HalfEdge| {
            let twist = |h: HalfEdge| vertices.twist[mesh.star_row[h.row()] as usize].into();
            let slot = |s| first_inner_slot(h.corner() as usize, s);
            let inner = |s| point(&g0_fit.interior[h.face() as usize], slot(s));
            [twist(h), inner(2), inner(3), inner(4), twist(h.next())]
        };
        for e in task.writes[0].clone() {
            let mut edge = Edge::new(&mesh, &network, points, vertices.weights, e);
            let nu = solve(&mut edge, 0.0, self.nu_weight);
            let residual = edge.residual();
            piece.rows.left.push(edge.model_row(&edge.p));
            piece.rows.right.push(edge.model_row(&edge.r));
            piece.rows.weights.push(EdgeWeights { nu, mu2: edge.mu[2], residual });
            piece.counters.max("edge_residual_max", residual);
            let excess = edge.mu[2] - edge.paper_mu2();
            piece.counters.max("mu2_excess_max", excess.abs());
        }
        Ok(piece)
    }
}

fn task(mesh: &BaseMeshView<'_>, edges: Range<usize>) -> Task {
    let halves = || edges.clone().flat_map(|e| mesh.edge_half[e]).map(HalfEdge);
    let around = |h: HalfEdge| [h, h.next(), h.prev()];
    let curves = halves().flat_map(around).map(|h| mesh.edge_of[h.row()] as usize).collect();
    let faces = halves().map(|h| h.face() as usize).collect();
    let twists =
        halves().flat_map(|h| [h, h.next()]).map(|h| mesh.star_row[h.row()] as usize).collect();
    let weights = halves().map(|h| mesh.star_row[h.row()] as usize).collect();
    let need = |input, section, rows| Need { input, section, rows: ranges(rows) };
    Task {
        needs: vec![
            need(0, "control", curves),
            need(1, "interior", faces),
            need(2, "twist", twists),
            need(2, "weights", weights),
        ],
        writes: vec![edges; 3],
    }
}
