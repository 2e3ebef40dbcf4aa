//! Stage fairing: the three free inner points of each face, and the finished patches.

mod error;
mod params;

pub use error::FairingError;
pub use params::FairingParams;

use isospline_artifact::kinds::{
    BaseMeshView, EdgeSystemsView, NetworkView, PatchMeta, Patches, Scheme, VertexSystemsView,
};
use isospline_fitting::net::{flat_interior, needed_edges, point};
use isospline_fitting::patch_fit::{PatchFit, innermost_fit};
use isospline_fitting::projection::project_all;
use isospline_fitting::start::start_nets;
use isospline_geometry::bezier_triangle::{DEGREE, N_CONTROL, first_inner_index};
use isospline_geometry::{HalfEdge, Vec3};
use isospline_stage::plan::{Need, cut, ranges};
use isospline_stage::{Ctx, Piece, Plan, Stage, Task};
use std::ops::Range;

/// Refits (3,2,2), (2,3,2), (2,2,3) by least squares with all else fixed.
///
/// Brings the G1 surface back to the error of its boundary curves.
#[derive(Clone, Debug)]
pub struct Fairing {
    fit: PatchFit<3>,
}

impl Stage for Fairing {
    const NAME: &'static str = "fairing";
    const VERSION: u32 = 1;
    type Params = FairingParams;
    type Whole<'a> = (BaseMeshView<'a>,);
    type Rows<'a> = (NetworkView<'a>, VertexSystemsView<'a>, EdgeSystemsView<'a>);
    type Output = Patches;
    type Error = FairingError;

    fn prepare(
        _: &Ctx<'_>,
        params: &FairingParams,
        _: (BaseMeshView<'_>,),
    ) -> Result<Self, FairingError> {
        Ok(Self { fit: innermost_fit(params.grid) })
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
        ctx: &Ctx<'_>,
        (mesh,): (BaseMeshView<'_>,),
        (network, vertices, edges): Self::Rows<'_>,
        task: &Task,
    ) -> Result<Piece<Patches>, FairingError> {
        let mut piece = Piece { rows: copied(&mesh, &network, task), ..Piece::default() };
        let faces = task.writes[2].clone();
        let n_samples = self.fit.n_samples();
        let mut targets = vec![Vec3::zeros(); faces.len() * n_samples];
        let mut nets = Vec::with_capacity(faces.len());
        for (face, targets) in faces.zip(targets.chunks_exact_mut(n_samples)) {
            let (mut net, start) = start_nets(&mesh, &network, face);
            self.fit.sample(&start, targets);
            place_inner_rows(&mesh, &vertices, &edges, face, &mut net);
            nets.push(net);
        }
        let projected = project_all(ctx.field, mesh.bounds[0].diagonal, &mut targets);
        piece.counters.repair("samples_off_surface", projected.failed as u64);
        for (net, targets) in nets.iter_mut().zip(targets.chunks_exact(n_samples)) {
            self.fit.fit(net, targets);
            piece.rows.interior.push(flat_interior(net));
        }
        Ok(piece)
    }
}

fn needs(mesh: &BaseMeshView<'_>, faces: Range<usize>, copied_edges: Range<usize>) -> Vec<Need> {
    let edges = needed_edges(mesh, faces.clone());
    let star_rows = mesh.star_row[3 * faces.start..3 * faces.end].iter().map(|&r| r as usize);
    let curves = edges.iter().copied().chain(copied_edges).collect();
    let need = |input, section, rows| Need { input, section, rows: ranges(rows) };
    vec![
        need(0, "control", curves),
        need(1, "twist", star_rows.collect()),
        need(2, "left", edges.clone()),
        need(2, "right", edges),
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
    net: &mut [Vec3; N_CONTROL],
) {
    for corner in 0..3 {
        let h = HalfEdge::new(face as u32, corner as u32);
        let twist = vertices.twist[mesh.star_row[h.row()] as usize];
        net[first_inner_index(DEGREE, corner, 1)] = twist.into();
        let e = mesh.edge_of[h.row()] as usize;
        let is_left = mesh.edge_half[e][0] == h.0;
        for s in 0..3 {
            // Rows run along the edge; the right face sees them from the other end.
            let p = if is_left { point(&edges.left[e], s) } else { point(&edges.right[e], 2 - s) };
            net[first_inner_index(DEGREE, corner, 2 + s)] = p;
        }
    }
}
