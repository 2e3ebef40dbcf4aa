//! Stage fairing: the three free inner points of each face, and the finished patches.

mod error;
mod params;

pub use error::FairingError;
pub use params::FairingParams;

use isospline_artifact::kinds::{
    BaseMeshView, EdgeSystemsView, G0FitView, NetworkView, PatchMeta, Patches, Scheme,
    VertexSystemsView,
};
use isospline_fitting::innermost::Innermost;
use isospline_fitting::net::{flat_interior, needed_edges, point};
use isospline_geometry::bezier_triangle::{DEGREE, N_INTERIOR, first_inner_slot};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use std::ops::Range;

/// Refits (3,2,2), (2,3,2), (2,2,3) by least squares with all else fixed.
///
/// Brings the G1 surface back to the error of its boundary curves.
#[derive(Clone, Debug)]
pub struct Fairing {
    innermost: Innermost,
}

impl Stage for Fairing {
    const NAME: &'static str = "fairing";
    const VERSION: u32 = 2;
    type Params = FairingParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (NetworkView<'a>, G0FitView<'a>, VertexSystemsView<'a>, EdgeSystemsView<'a>);
    type Output = Patches;
    type Error = FairingError;

    fn prepare(
        _: &Ctx<'_>,
        params: &FairingParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, FairingError> {
        Ok(Self { innermost: Innermost::new(params.grid) })
    }

    fn plan(&self, (mesh,): (BaseMeshView<'_>,), rows_per_task: usize) -> Plan {
        let (n_faces, n_edges) = (mesh.face.len(), mesh.edge.len());
        let n_vertices = mesh.position.len();
        let faces: Vec<_> = cut(n_faces, rows_per_task).collect();
        let n_tasks = faces.len();
        // Copied sections are shared out evenly among the tasks.
        let share = |n: usize, k: usize| n * k / n_tasks..n * (k + 1) / n_tasks;
        let task = |(k, faces): (usize, Range<usize>)| {
            let halves = 3 * faces.start..3 * faces.end;
            let (vertices, edges) = (share(n_vertices, k), share(n_edges, k));
            let needs = needs(&mesh, faces.clone(), edges.clone());
            let meta = if k == 0 { 0..1 } else { 1..1 };
            Task { writes: vec![meta, vertices, faces.clone(), halves, edges, faces], needs }
        };
        Plan::Rows {
            lengths: vec![1, n_vertices, n_faces, 3 * n_faces, n_edges, n_faces],
            tasks: faces.into_iter().enumerate().map(task).collect(),
        }
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (network, g0_fit, vertices, edges): Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<Patches>, FairingError> {
        let mut piece = Piece { rows: copied(&mesh, &network, task), ..Piece::default() };
        for face in task.writes[5].clone() {
            let before = std::array::from_fn(|slot| point(&g0_fit.interior[face], slot));
            let mut interior = before;
            place_inner_rows(&mesh, &vertices, &edges, face, &mut interior);
            self.innermost.place(&before, &mut interior);
            piece.rows.interior.push(flat_interior(&interior));
        }
        Ok(piece)
    }
}

fn needs(mesh: &BaseMeshView<'_>, faces: Range<usize>, copied_edges: Range<usize>) -> Vec<Need> {
    let edges = needed_edges(mesh, faces.clone());
    let star_rows = mesh.star_row[3 * faces.start..3 * faces.end].iter().map(|&r| r as usize);
    let need = |input, section, rows| Need { input, section, rows: ranges(rows) };
    vec![
        need(0, "control", copied_edges.collect()),
        need(1, "interior", faces.collect()),
        need(2, "twist", star_rows.collect()),
        need(3, "left", edges.clone()),
        need(3, "right", edges),
    ]
}

/// The rows of `task` that are copies.
fn copied(mesh: &BaseMeshView<'_>, network: &NetworkView<'_>, task: &Task) -> Patches {
    let rows = |section: usize| task.writes[section].clone();
    let meta = PatchMeta {
        scheme: Scheme::TongKim.code(),
        degree: DEGREE as u32,
        boundary_degree: 4,
        rational: 0,
    };
    Patches {
        meta: vec![meta; rows(0).len()],
        position: mesh.position[rows(1)].to_vec(),
        face: mesh.face[rows(2)].to_vec(),
        edge_of: mesh.edge_of[rows(3)].to_vec(),
        boundary: network.control[rows(4)].to_vec(),
        interior: Vec::with_capacity(rows(5).len()),
    }
}

/// Twist points and first inner rows of a face.
fn place_inner_rows(
    mesh: &BaseMeshView<'_>,
    vertices: &VertexSystemsView<'_>,
    edges: &EdgeSystemsView<'_>,
    face: usize,
    interior: &mut [Vec3; N_INTERIOR],
) {
    for corner in 0..3 {
        let h = HalfEdge::new(face as u32, corner as u32);
        let twist = vertices.twist[mesh.star_row[h.row()] as usize];
        interior[first_inner_slot(corner, 1)] = twist.into();
        let e = mesh.edge_of[h.row()] as usize;
        let is_left = mesh.edge_half[e][0] == h.0;
        for s in 0..3 {
            // Rows run along the edge; the right face sees them from the other end.
            let p = if is_left { point(&edges.left[e], s) } else { point(&edges.right[e], 2 - s) };
            interior[first_inner_slot(corner, 2 + s)] = p;
        }
    }
}
