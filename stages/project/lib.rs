//! Stage project: mesh vertices move onto the surface.

mod error;

pub use error::ProjectError;

use isospline_artifact::kinds::{Mesh, MeshView, Topology};
use isospline_fitting::projection::project_all;
use isospline_geometry::{Aabb, Vec3};
use isospline_stage::plan::cut;
use isospline_stage::{Counters, Ctx, Params, Piece, Plan, Stage, Task, map};
use std::sync::Mutex;

/// Vertices projected together: enough for full evaluation blocks, small enough to share out.
const CHUNK: usize = 512;

/// This stage has no parameters: vertices go to the surface as near as rounding lets them.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ProjectParams {}

impl Params for ProjectParams {}

/// Moves vertices along the gradient [TK, Eq. (4)]; faces and components stay.
#[derive(Clone, Copy, Debug)]
pub struct Project;

impl Stage for Project {
    const NAME: &'static str = "project";
    const VERSION: u32 = 2;
    type Params = ProjectParams;
    type Whole<'a> = (MeshView<'a>,);
    type Rows<'a> = ();
    type Output = Mesh;
    type Error = ProjectError;

    fn prepare(_: &Ctx<'_>, _: &ProjectParams, _: (MeshView<'_>,)) -> Result<Self, ProjectError> {
        Ok(Self)
    }

    fn plan(&self, _: (MeshView<'_>,), _: usize) -> Plan {
        // The bounds need all vertices, and the mesh is small beside what follows.
        Plan::Whole
    }

    fn process(
        &self,
        ctx: &Ctx<'_>,
        (mesh,): (MeshView<'_>,),
        (): (),
        _: &Task,
    ) -> Result<Piece<Mesh>, ProjectError> {
        let diagonal = around(mesh.position).diagonal();
        let ranges: Vec<_> = cut(mesh.position.len(), CHUNK).collect();
        let farthest = Mutex::new(None);
        let chunks = map(ctx.host, ranges.len(), |k| {
            let mut points: Vec<Vec3> =
                mesh.position[ranges[k].clone()].iter().map(|&p| p.into()).collect();
            let figures = project_all(ctx.field, diagonal, &mut points);
            if figures.failed > 0 {
                note_failure(ctx, diagonal, &points, &farthest, k);
            }
            (points, figures.evaluations as u64)
        });
        if let Some((_, place, distance)) = farthest.into_inner().expect("invariant: no panic") {
            return Err(ProjectError::NotReached { place, distance });
        }
        let mut counters = Counters::default();
        counters.count("gradient_evaluations", chunks.iter().map(|c| c.1).sum());
        let position: Vec<[f64; 3]> =
            chunks.iter().flat_map(|c| c.0.iter().map(|&p| p.into())).collect();
        let bounds = around(&position);
        let (min, max) = (bounds.min.into(), bounds.max.into());
        let topology = mesh.topology.iter().map(|t| Topology { min, max, ..*t }).collect();
        let (face, component) = (mesh.face.to_vec(), mesh.component.to_vec());
        Ok(Piece { rows: Mesh { position, face, component, topology }, counters })
    }
}

fn around(position: &[[f64; 3]]) -> Aabb {
    position.iter().fold(Aabb::EMPTY, |acc, &p| acc.including(&p.into()))
}

/// Keeps the failed point of the lowest chunk: the same whatever the order of chunks.
fn note_failure(
    ctx: &Ctx<'_>,
    diagonal: f64,
    points: &[Vec3],
    farthest: &Mutex<Option<(usize, Vec3, f64)>>,
    chunk: usize,
) {
    let distance = |p: &Vec3| {
        let jet = ctx.field.gradient(*p);
        let d = jet.value.abs() / jet.gradient.norm();
        if d.is_nan() { f64::INFINITY } else { d / diagonal }
    };
    let worst = points.iter().map(|p| (distance(p), *p)).max_by(|a, b| a.0.total_cmp(&b.0));
    let (d, place) = worst.expect("invariant: a failed chunk has points");
    let mut slot = farthest.lock().expect("invariant: no panic");
    if slot.is_none_or(|(k, ..)| chunk < k) {
        *slot = Some((chunk, place, d));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_artifact::kinds::TopologyProof;
    use isospline_geometry::TriangleMesh;
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    fn octahedron(radius: f64) -> Mesh {
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let positions = [1.0, -1.0].iter().flat_map(|s| axes.map(|a| a * radius * *s)).collect();
        let faces = vec![
            [0, 1, 2],
            [1, 3, 2],
            [3, 4, 2],
            [4, 0, 2],
            [1, 0, 5],
            [3, 1, 5],
            [4, 3, 5],
            [0, 4, 5],
        ];
        Mesh::from_triangles(&TriangleMesh { positions, faces }, TopologyProof::Imported).unwrap()
    }

    fn run(field: &ClosureField, mesh: &Mesh) -> Result<Piece<Mesh>, ProjectError> {
        let domain = Aabb::new(Vec3::repeat(-2.0), Vec3::repeat(2.0));
        let ctx = Ctx { field, domain, host: &Serial };
        Project.process(&ctx, (mesh.view(),), (), &Task::default())
    }

    #[test]
    fn vertices_land_on_the_sphere_and_bounds_follow() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() - 1.0)
            .with_gradient(|p: Vec3| 2.0 * p);
        let out = run(&field, &octahedron(0.8)).unwrap().rows;
        assert!(out.position.iter().all(|&p| (Vec3::from(p).norm() - 1.0).abs() < 1e-15));
        assert!((out.topology[0].max[0] - 1.0).abs() < 1e-15);
        assert_eq!(out.topology[0].euler_characteristic, 2);
    }

    #[test]
    fn a_field_without_a_zero_is_refused_with_a_place() {
        let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() + 1.0)
            .with_gradient(|p: Vec3| 2.0 * p);
        let found = run(&field, &octahedron(0.8)).unwrap_err();
        assert!(matches!(found, ProjectError::NotReached { .. }), "{found}");
    }
}
