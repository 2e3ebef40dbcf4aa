//! Decimation of closed forms: topology, number of faces, fitness, errors.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use isospline_artifact::kinds::{Mesh, TopologyProof};
use isospline_decimate::{Decimate, DecimateError, DecimateParams};
use isospline_geometry::{TriangleMesh, Vec3};
use isospline_implicit::{ClosureField, Field};
use isospline_stage::{Ctx, Host, Piece, Serial, Stage, Stopped, Task, contract, stage_contract};

const TAU: f64 = std::f64::consts::TAU;

/// A torus about the z axis: `n` by `m` quads, each cut in two.
fn torus_mesh(n: u32, m: u32, center: Vec3) -> TriangleMesh {
    let id = |i: u32, j: u32| (i % n) * m + j % m;
    let mut mesh = TriangleMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
            let r = 2.0 + v.cos();
            mesh.positions.push(center + Vec3::new(r * u.cos(), r * u.sin(), v.sin()));
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn torus_value(p: Vec3) -> f64 {
    let ring = p.x.hypot(p.y) - 2.0;
    ring.hypot(p.z) - 1.0
}

fn torus_field() -> ClosureField {
    ClosureField::new(6.0, torus_value)
}

/// Two tori side by side, 8 apart along x.
fn two_tori() -> (TriangleMesh, ClosureField) {
    let shift = 4.0 * Vec3::x();
    let (mut mesh, other) = (torus_mesh(60, 30, -shift), torus_mesh(60, 30, shift));
    let offset = mesh.positions.len() as u32;
    mesh.positions.extend(other.positions);
    mesh.faces.extend(other.faces.iter().map(|f| f.map(|v| v + offset)));
    let field =
        ClosureField::new(14.0, move |p: Vec3| torus_value(p + shift).min(torus_value(p - shift)));
    (mesh, field)
}

fn decimate_with(
    host: &dyn Host,
    field: &dyn Field,
    mesh: &TriangleMesh,
    params: &DecimateParams,
) -> Result<Piece<Mesh>, DecimateError> {
    let input = Mesh::from_triangles(mesh, TopologyProof::Certified).unwrap();
    let ctx = Ctx { field, domain: mesh.bounds(), host };
    let whole = (input.view(),);
    let stage = Decimate::prepare(&ctx, params, whole)?;
    stage.process(&ctx, whole, (), &Task::default())
}

/// Edges that turn and rise as little as the paper's patches need.
fn narrow(faces: u32) -> DecimateParams {
    DecimateParams { faces, max_turning_deg: 50.0, max_slope: 0.42, ..DecimateParams::default() }
}

fn decimate(
    field: &dyn Field,
    mesh: &TriangleMesh,
    faces: u32,
) -> Result<Piece<Mesh>, DecimateError> {
    decimate_with(&Serial, field, mesh, &narrow(faces))
}

/// Largest angle between normals along an edge [deg], least quality, largest `|f| / |grad f|` at
/// vertices and face centres.
fn figures(field: &dyn Field, mesh: &TriangleMesh) -> (f64, f64, f64) {
    let jets: Vec<_> = mesh.positions.iter().map(|&p| field.gradient(p)).collect();
    let (mut turning, mut quality, mut distance) = (0f64, 1f64, 0f64);
    for (f, face) in (0u32..).zip(&mesh.faces) {
        let p = mesh.corners(f);
        let sides_sq: f64 = (0..3).map(|k| (p[(k + 1) % 3] - p[k]).norm_squared()).sum();
        let twice_area = (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
        quality = quality.min(2.0 * 3f64.sqrt() * twice_area / sides_sq);
        let center = field.gradient((p[0] + p[1] + p[2]) / 3.0);
        distance = distance.max(center.value.abs() / center.gradient.norm());
        for k in 0..3 {
            let [a, b] = [face[k], face[(k + 1) % 3]].map(|v| jets[v as usize]);
            turning = turning.max(a.gradient.angle(&b.gradient));
            distance = distance.max(a.value.abs() / a.gradient.norm());
        }
    }
    (turning.to_degrees(), quality, distance)
}

#[test]
fn a_torus_keeps_its_genus_and_gets_the_faces_wanted() {
    let (field, fine) = (torus_field(), torus_mesh(120, 60, Vec3::zeros()));
    for faces in [3000, 1001, 600, 400] {
        let piece = decimate(&field, &fine, faces).unwrap();
        let n_faces = piece.rows.face.len() as u32;
        assert!(n_faces <= faces && n_faces >= faces - 1, "{n_faces} of {faces}");
        let topology = piece.rows.topology[0];
        assert_eq!((topology.components, topology.euler_characteristic), (1, 0));
        assert_eq!(topology.proof, TopologyProof::Certified.code());
        assert_eq!(piece.counters.repairs.len(), 0);
        let (turning, quality, distance) = figures(&field, &piece.rows.view().to_triangles());
        assert!(turning <= 60.0, "{faces} faces: turns by {turning}");
        assert!(quality >= 0.1, "{faces} faces: quality {quality}");
        // An edge of length h stays within about h^2 / 8 of a surface of curvature 1; the area
        // 8 pi^2 makes h^2 = 182 / faces for equilateral faces, and the mesh is not that even.
        assert!(distance <= 3.0 * 182.0 / 8.0 / f64::from(faces), "{faces} faces: {distance}");
    }
}

#[test]
fn a_large_mesh_goes_through_tiles_and_comes_out_as_good() {
    let (field, fine) = (torus_field(), torus_mesh(340, 170, Vec3::zeros()));
    let piece = decimate(&field, &fine, 1000).unwrap();
    assert!(piece.counters.counts["collapses_in_tiles"] > 40_000, "{:?}", piece.counters);
    let topology = piece.rows.topology[0];
    assert_eq!((topology.components, topology.euler_characteristic), (1, 0));
    assert_eq!(piece.rows.face.len(), 1000);
    let (turning, quality, distance) = figures(&field, &piece.rows.view().to_triangles());
    assert!(turning <= 60.0 && quality >= 0.1, "{turning} {quality}");
    // As of the meshes above.
    assert!(distance <= 3.0 * 182.0 / 8.0 / 1000.0, "{distance}");
}

#[test]
fn components_are_kept_apart() {
    let (fine, field) = two_tori();
    let piece = decimate(&field, &fine, 800).unwrap();
    let topology = piece.rows.topology[0];
    assert_eq!((topology.components, topology.euler_characteristic), (2, 0));
    assert_eq!(piece.rows.face.len(), 800);
}

#[test]
fn too_few_faces_are_refused_with_the_least_that_works() {
    let (field, fine) = (torus_field(), torus_mesh(24, 12, Vec3::zeros()));
    let error = decimate(&field, &fine, 6).unwrap_err();
    let DecimateError::TooFewFaces { wanted: 6, least } = error else { panic!("{error}") };
    // A torus has no simple triangulation of fewer than 14 faces.
    assert!((14..200).contains(&least), "{least}");
    let piece = decimate(&field, &fine, least).unwrap();
    assert_eq!(piece.rows.face.len() as u32, least);
    assert!(piece.counters.repairs["collapses_past_guards"] > 0);
}

#[test]
fn a_mesh_that_is_coarse_enough_passes_unchanged() {
    let (field, coarse) = (torus_field(), torus_mesh(12, 8, Vec3::zeros()));
    let piece = decimate(&field, &coarse, 192).unwrap();
    assert_eq!(piece.rows.view().to_triangles(), coarse);
}

#[test]
fn a_model_far_from_the_origin_is_decimated_alike() {
    let far = Vec3::new(4096.0, -8192.0, 1024.0);
    let field = ClosureField::new(6.0, move |p: Vec3| torus_value(p - far));
    let fine = torus_mesh(120, 60, far);
    let piece = decimate(&field, &fine, 600).unwrap();
    let (turning, quality, distance) = figures(&field, &piece.rows.view().to_triangles());
    assert!(turning <= 60.0 && quality >= 0.1, "{turning} {quality}");
    assert!(distance <= 3.0 * 182.0 / 8.0 / 600.0, "{distance}");
}

#[test]
fn a_vertex_that_is_not_a_number_is_named() {
    let (field, mut fine) = (torus_field(), torus_mesh(12, 8, Vec3::zeros()));
    fine.positions[5].y = f64::NAN;
    let error = decimate(&field, &fine, 50).unwrap_err();
    assert_eq!(error, DecimateError::NotFinite { vertex: 5 });
}

/// Asks every stage to stop at its first report.
struct Impatient;

impl Host for Impatient {
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(body);
    }

    fn progress(&self, _: u64, _: u64) -> Result<(), Stopped> {
        Err(Stopped)
    }
}

#[test]
fn a_stop_signal_ends_the_work() {
    let (field, fine) = (torus_field(), torus_mesh(24, 12, Vec3::zeros()));
    let params = narrow(100);
    let error = decimate_with(&Impatient, &field, &fine, &params).unwrap_err();
    assert_eq!(error, DecimateError::Stopped(Stopped));
}

fn contract_fixture() -> contract::Fixture<Decimate> {
    let mesh = torus_mesh(40, 20, Vec3::zeros());
    let input = Mesh::from_triangles(&mesh, TopologyProof::Observed).unwrap();
    let params = narrow(300);
    contract::Fixture::new(torus_field(), mesh.bounds()).with_params(params).with_input(input)
}

stage_contract!(Decimate, contract_fixture);
