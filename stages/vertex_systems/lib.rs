//! Stage `vertex_systems`: twist points that satisfy the G1 condition at every vertex.

mod error;
mod params;

pub use error::VertexSystemsError;
pub use params::VertexSystemsParams;

use isospline_artifact::kinds::{
    BaseMeshView, CurvatureView, G0FitView, NetworkView, VertexSystems,
};
use isospline_fitting::net::point;
use isospline_fitting::vertex_star::Star;
use isospline_fitting::vertex_system::Solver;
use isospline_geometry::HalfEdge;
use isospline_geometry::bezier_triangle::first_inner_slot;
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use std::ops::Range;

/// Solves rows k = 0 and k = 1 of the G1 condition about each vertex [TK, Eq. (14)-(19)].
#[derive(Clone, Copy, Debug)]
pub struct VertexSystemsStage;

impl Stage for VertexSystemsStage {
    const NAME: &'static str = "vertex_systems";
    const VERSION: u32 = 1;
    type Params = VertexSystemsParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (CurvatureView<'a>, NetworkView<'a>, G0FitView<'a>);
    type Output = VertexSystems;
    type Error = VertexSystemsError;

    fn prepare(
        _: &Ctx<'_>,
        _: &VertexSystemsParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, VertexSystemsError> {
        Ok(Self)
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let n_vertices = mesh.position.len();
        let tasks = cut(n_vertices, rows_per_task).map(|vertices| task(&mesh, vertices));
        let n_half_edges = mesh.star.len();
        Plan::Rows { lengths: vec![n_half_edges, n_half_edges, n_vertices], tasks: tasks.collect() }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (curvature, network, g0_fit): Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<VertexSystems>, VertexSystemsError> {
        let mut piece = Piece::<VertexSystems>::default();
        let mut solver = Solver::default();
        let start = |h: HalfEdge| {
            let slot = first_inner_slot(h.corner() as usize, 1);
            point(&g0_fit.interior[h.face() as usize], slot)
        };
        for vertex in task.writes[2].clone() {
            let star = Star::new(&mesh, &curvature, &network, start, vertex);
            let repaired = solver.solve(&star).ok_or(VertexSystemsError::Degenerate {
                vertex: vertex as u32,
                place: star.origin,
            })?;
            for (spoke, twist) in star.spokes.iter().zip(&solver.twists) {
                piece.rows.twist.push((star.origin + twist).into());
                piece.rows.weights.push([spoke.lambda0, spoke.mu0, 0.0]);
            }
            let first = piece.rows.weights.len() - star.spokes.len();
            for (row, mu1) in piece.rows.weights[first..].iter_mut().zip(&solver.mu1) {
                row[2] = *mu1;
            }
            let residual = star.residual(&solver.twists, &solver.mu1);
            piece.counters.max("vertex_residual_max", residual);
            piece.counters.repair("vertex_systems_regularised", u64::from(repaired));
            piece.rows.status.push(u8::from(repaired));
        }
        Ok(piece)
    }
}

fn task(mesh: &BaseMeshView<'_>, vertices: Range<usize>) -> Task {
    let star_rows =
        mesh.star_first[vertices.start] as usize..mesh.star_first[vertices.end] as usize;
    let half_edges = || mesh.star[star_rows.clone()].iter().map(|&h| HalfEdge(h));
    let sectors = half_edges().map(|h| mesh.sector[h.row()] as usize).collect();
    // The weights at the far ends need the curves that leave the neighbours inside the ring.
    let ring = |h: HalfEdge| [mesh.edge_of[h.row()], mesh.edge_of[h.next().row()]];
    let edges = half_edges().flat_map(ring).map(|e| e as usize).collect();
    let faces = half_edges().map(|h| h.face() as usize).collect();
    let need = |input, section, rows| Need { input, section, rows: ranges(rows) };
    Task {
        needs: vec![
            need(0, "shape", sectors),
            need(1, "control", edges),
            need(2, "interior", faces),
        ],
        writes: vec![star_rows.clone(), star_rows, vertices],
    }
}
