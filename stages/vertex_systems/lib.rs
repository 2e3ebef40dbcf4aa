//! Stage `vertex_systems`: twist points that satisfy the G1 condition at every vertex.

mod error;
mod params;
mod star;
mod tangential;

pub use error::VertexSystemsError;
pub use params::VertexSystemsParams;

use isospline_artifact::kinds::{
    BaseMeshView, CurvatureView, G0FitView, NetworkView, VertexSystems,
};
use isospline_fitting::edge_end::ccw;
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use star::Star;
use std::ops::Range;
use tangential::Solver;

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
        for vertex in task.writes[2].clone() {
            let star = Star::new(&mesh, &curvature, &network, &g0_fit, vertex);
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

/// Outgoing half-edges of a vertex, counter-clockwise.
fn spokes(mesh: &BaseMeshView<'_>, vertex: usize) -> impl Iterator<Item = HalfEdge> {
    let rows = mesh.star_first[vertex] as usize..mesh.star_first[vertex + 1] as usize;
    let halves = mesh.star[rows].to_vec();
    debug_assert!(halves.windows(2).all(|h| ccw(mesh, HalfEdge(h[0])).0 == h[1]));
    halves.into_iter().map(HalfEdge)
}

/// The tangential and the normal part of a vector in a plane frame.
#[derive(Clone, Copy, Debug)]
struct Frame {
    axes: [Vec3; 2],
    normal: Vec3,
}

impl Frame {
    fn about(normal: Vec3) -> Self {
        // The axis least along the normal keeps the cross product well away from zero.
        let k = normal.iamin();
        let e1 = normal.cross(&Vec3::ith(k, 1.0)).normalize();
        Self { axes: [e1, normal.cross(&e1)], normal }
    }

    fn flatten(&self, v: &Vec3) -> [f64; 2] {
        self.axes.map(|a| a.dot(v))
    }

    fn lift(&self, [x, y]: [f64; 2], height: f64) -> Vec3 {
        x * self.axes[0] + y * self.axes[1] + height * self.normal
    }
}
