//! Stage import: a triangle mesh from outside takes the place of polygonize and decimate.
//!
//! The stage opens no file: the caller reads the OBJ ([`parse_obj`]) and gives the rows.

mod error;
mod obj;

pub use error::ImportError;
pub use obj::{ObjError, ObjRows, parse_obj};

use isospline_artifact::kinds::{Mesh, MeshView, TopologyProof};
use isospline_geometry::TriangleMesh;
use isospline_geometry::triangle_mesh::BORDER;
use isospline_stage::{Counters, Ctx, Params, Piece, Plan, Stage, Task};

/// This stage has no parameters.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImportParams {}

impl Params for ImportParams {}

/// Checks that a mesh is closed and manifold, turns it outward and numbers its components.
#[derive(Clone, Copy, Debug)]
pub struct Import;

impl Stage for Import {
    const NAME: &'static str = "import";
    const VERSION: u32 = 1;
    type Params = ImportParams;
    type Whole<'a> = (MeshView<'a>,);
    type Rows<'a> = ();
    type Output = Mesh;
    type Error = ImportError;

    fn prepare(_: &Ctx<'_>, _: &ImportParams, _: (MeshView<'_>,)) -> Result<Self, ImportError> {
        Ok(Self)
    }

    fn plan(&self, _: (MeshView<'_>,), _: usize) -> Plan {
        Plan::Whole
    }

    fn process(
        &self,
        _: &Ctx<'_>,
        (given,): (MeshView<'_>,),
        (): (),
        _: &Task,
    ) -> Result<Piece<Mesh>, ImportError> {
        let mut mesh = given.to_triangles();
        if mesh.faces.is_empty() {
            return Err(ImportError::Empty);
        }
        let opposite = mesh.opposites().map_err(|d| ImportError::not_manifold(&mesh, d))?;
        mesh.check_fans(&opposite).map_err(|d| ImportError::not_manifold(&mesh, d))?;
        if let Some(h) = opposite.iter().position(|&o| o == BORDER) {
            return Err(ImportError::open(&mesh, h as u32));
        }
        let mut counters = Counters::default();
        if volume(&mesh) < 0.0 {
            turn_inside_out(&mut mesh);
            counters.repair("faces_turned_outward", mesh.faces.len() as u64);
        }
        let rows = Mesh::from_triangles(&mesh, TopologyProof::Imported)
            .map_err(|d| ImportError::not_manifold(&mesh, d))?;
        Ok(Piece { rows, counters })
    }
}

/// Signed volume, about a vertex: far from the origin the plain sum loses its sign.
fn volume(mesh: &TriangleMesh) -> f64 {
    let origin = mesh.positions[0];
    let positions = mesh.positions.iter().map(|p| p - origin).collect();
    TriangleMesh { positions, faces: mesh.faces.clone() }.volume()
}

fn turn_inside_out(mesh: &mut TriangleMesh) {
    mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
}

#[cfg(test)]
mod tests {
    use super::*;
    use isospline_geometry::{Aabb, Vec3};
    use isospline_implicit::ClosureField;
    use isospline_stage::Serial;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n\
                               f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

    fn import(text: &str) -> Result<Piece<Mesh>, ImportError> {
        let (position, face) = parse_obj(text).unwrap();
        let given = Mesh { position, face, ..Mesh::default() };
        let field = ClosureField::new(1.0, |p: Vec3| p.norm() - 1.0);
        let domain = Aabb::new(Vec3::repeat(-1.0), Vec3::repeat(1.0));
        let ctx = Ctx { field: &field, domain, host: &Serial };
        Import.process(&ctx, (given.view(),), (), &Task::default())
    }

    #[test]
    fn a_closed_mesh_passes_with_its_topology() {
        let piece = import(TETRAHEDRON).unwrap();
        let topology = piece.rows.topology[0];
        assert_eq!((topology.components, topology.euler_characteristic), (1, 2));
        assert!(piece.counters.repairs.is_empty());
    }

    #[test]
    fn an_inward_mesh_is_turned_and_counted() {
        let inward = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n";
        let piece = import(inward).unwrap();
        assert_eq!(piece.counters.repairs["faces_turned_outward"], 4);
        assert!(piece.rows.view().to_triangles().volume() > 0.0);
    }

    #[test]
    fn a_mesh_with_a_hole_is_refused_at_the_hole() {
        let open = TETRAHEDRON.lines().take(7).collect::<Vec<_>>().join("\n");
        let found = import(&open).unwrap_err();
        assert!(matches!(found, ImportError::Open { .. }), "{found}");
    }

    #[test]
    fn a_doubled_face_is_refused() {
        let found = import(&format!("{TETRAHEDRON}f 1 3 2\n")).unwrap_err();
        assert!(matches!(found, ImportError::NotManifold { .. }), "{found}");
    }

    #[test]
    fn a_file_without_faces_is_refused() {
        assert_eq!(import("v 0 0 0\n").unwrap_err(), ImportError::Empty);
    }

    #[test]
    fn an_inward_mesh_far_from_the_origin_is_turned() {
        let far = "v -1e9 -1e9 -2e9\nv -999999999 -1e9 -2e9\nv -1e9 -999999999 -2e9\n\
                   v -1e9 -1e9 -1999999999\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 1 3 4\n";
        let (position, face) = parse_obj(far).unwrap();
        let positions = position.into_iter().map(Vec3::from).collect();
        let mesh = TriangleMesh { positions, faces: face };
        // The plain sum has lost even the sign of the sixth that the tetrahedron holds.
        assert!(mesh.volume() > 0.0);
        assert_eq!(import(far).unwrap().counters.repairs["faces_turned_outward"], 4);
    }

    macro_rules! fixture {
        ($name:literal) => {
            include_str!(concat!("../../tests/fixtures/meshes/", $name, ".obj"))
        };
    }

    #[test]
    fn every_fixture_mesh_has_its_faces_and_its_genus() {
        for (text, n_faces, euler) in [
            (fixture!("icosphere_80"), 80, 2),
            (fixture!("icosphere_320"), 320, 2),
            (fixture!("icosphere_1280"), 1280, 2),
            (fixture!("torus_20x10"), 400, 0),
            (fixture!("torus_600"), 600, 0),
            (fixture!("dodecahedron_1200"), 1200, 2),
            (fixture!("double_torus_1800"), 1800, -2),
            (fixture!("deccube_5000"), 5000, -24),
            (fixture!("chair_4000"), 4000, -4),
        ] {
            let Piece { rows, counters } = import(text).unwrap();
            let topology = rows.topology[0];
            assert_eq!((rows.face.len(), topology.euler_characteristic), (n_faces, euler));
            assert_eq!((topology.components, topology.proof), (1, TopologyProof::Imported.code()));
            assert!(counters.repairs.is_empty());
        }
    }
}
