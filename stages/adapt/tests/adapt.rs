//! Base meshes of the paper's models: the fit ones pass as they are, the others come out fit.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use isospline_adapt::{Adapt, AdaptError, AdaptParams, Improve};
use isospline_artifact::kinds::{BaseMesh, Mesh, TopologyProof};
use isospline_geometry::{TriangleMesh, Vec3};
use isospline_implicit::{ClosureField, Field, Formula};
use isospline_stage::{Ctx, Diagnosis, Piece, Serial, Stage, Task, contract, stage_contract};
use std::collections::BTreeMap;

const SPHERE: &str = "x^2 + y^2 + z^2 - 1";
const TORUS: &str = "(sqrt(x^2 + y^2) - 5)^2 + z^2 - 1";
const DODECAHEDRON: &str = "x^6 + y^6 + z^6 + 20*(x^4*y^2 + y^4*z^2 + z^4*x^2) - 1";
const DOUBLE_TORUS: &str = "x^8 - 2*x^6 + x^4 + 2*x^4*y^2 - 2*x^2*y^2 + y^4 + z^2 - 0.04";
const CHAIR: &str = "(x^2 + y^2 + z^2 - 0.95*5^2)^2 -
    0.8*((z - 5)^2 - 2*x^2)*((z + 5)^2 - 2*y^2)";
const DECCUBE: &str = "((x^2 + y^2 - 0.64)^2 + (z^2 - 1)^2)*((y^2 + z^2 - 0.64)^2 + (x^2 - 1)^2) *
    ((z^2 + x^2 - 0.64)^2 + (y^2 - 1)^2) - 0.02";

fn formula(text: &str) -> Formula {
    Formula::parse(text, &BTreeMap::new()).unwrap()
}

/// A mesh of the repository's fixtures.
fn fixture(name: &str) -> TriangleMesh {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fixtures/meshes");
    let text = std::fs::read_to_string(format!("{folder}/{name}.obj")).unwrap();
    let mut mesh = TriangleMesh::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let p: Vec<f64> = words.map(|w| w.parse().unwrap()).collect();
                mesh.positions.push(Vec3::new(p[0], p[1], p[2]));
            }
            Some("f") => {
                let v: Vec<u32> = words.map(|w| w.parse::<u32>().unwrap() - 1).collect();
                mesh.faces.push([v[0], v[1], v[2]]);
            }
            _ => {}
        }
    }
    mesh
}

fn adapt(
    field: &dyn Field,
    mesh: &TriangleMesh,
    proof: TopologyProof,
    params: &AdaptParams,
) -> Result<Piece<BaseMesh>, AdaptError> {
    let input = Mesh::from_triangles(mesh, proof).unwrap();
    let ctx = Ctx { field, domain: mesh.bounds(), host: &Serial };
    let whole = (input.view(),);
    Adapt::prepare(&ctx, params, whole)?.process(&ctx, whole, (), &Task::default())
}

fn triangles(base: &BaseMesh) -> TriangleMesh {
    let positions = base.position.iter().map(|&p| Vec3::from(p)).collect();
    TriangleMesh { positions, faces: base.face.clone() }
}

/// The faces as the bits of their corners, each from its least corner, sorted.
fn soup(mesh: &TriangleMesh) -> Vec<[[u64; 3]; 3]> {
    let corner = |v: u32| <[f64; 3]>::from(mesh.positions[v as usize]).map(f64::to_bits);
    let face = |f: &[u32; 3]| {
        let mut c = f.map(corner);
        let least = (0..3).min_by_key(|&k| c[k]).unwrap();
        c.rotate_left(least);
        c
    };
    let mut faces: Vec<_> = mesh.faces.iter().map(face).collect();
    faces.sort_unstable();
    faces
}

/// Edges turn at most 60 degrees and rise at most half their chord.
fn narrow() -> AdaptParams {
    AdaptParams { max_turning_deg: 60.0, max_slope: 0.5, ..AdaptParams::default() }
}

/// Asserts the [`narrow`] gate with code of its own, and that all vertices lie on the surface.
fn assert_fit(field: &dyn Field, mesh: &TriangleMesh, name: &str) {
    let diagonal = mesh.bounds().diagonal();
    let jets: Vec<_> = mesh.positions.iter().map(|&p| field.gradient(p)).collect();
    assert!(jets.iter().all(|j| j.value.abs() / j.gradient.norm() < 1e-12 * diagonal), "{name}");
    for (f, face) in (0u32..).zip(&mesh.faces) {
        let p = mesh.corners(f);
        let normal = (p[1] - p[0]).cross(&(p[2] - p[0]));
        for k in 0..3 {
            let [n0, n1] =
                [face[k], face[(k + 1) % 3]].map(|v| jets[v as usize].gradient.normalize());
            let chord = (p[(k + 1) % 3] - p[k]).normalize();
            assert!(n0.angle(&n1).to_degrees() <= 60.0 + 1e-9, "{name}: face {f} turns");
            assert!(chord.dot(&n0).abs().max(chord.dot(&n1).abs()) <= 0.5, "{name}: {f} slopes");
            assert!(normal.dot(&n0) > 0.0, "{name}: face {f} is folded");
        }
    }
}

fn characteristic(mesh: &TriangleMesh) -> i64 {
    let opposite = mesh.opposites().unwrap();
    mesh.check_fans(&opposite).unwrap();
    mesh.euler_characteristic(&opposite)
}

#[test]
fn fit_imported_meshes_pass_in_all_bits() {
    for (name, text) in [
        ("icosphere_80", SPHERE),
        ("torus_20x10", TORUS),
        ("torus_600", TORUS),
        ("dodecahedron_1200", DODECAHEDRON),
        ("double_torus_1800", DOUBLE_TORUS),
    ] {
        let (field, mesh) = (formula(text), fixture(name));
        let piece = adapt(&field, &mesh, TopologyProof::Imported, &narrow()).unwrap();
        assert_eq!(soup(&triangles(&piece.rows)), soup(&mesh), "{name}");
        assert_eq!(piece.counters.repairs, BTreeMap::new(), "{name}");
    }
}

/// The chair was decimated blindly: 149 edges turn more than 60 degrees. Of the deccube's, 70 do.
#[test]
fn unfit_imported_meshes_are_repaired_within_their_face_count() {
    for (name, text, genus) in [("chair_4000", CHAIR, 3), ("deccube_5000", DECCUBE, 13)] {
        let (field, mesh) = (formula(text), fixture(name));
        let piece = adapt(&field, &mesh, TopologyProof::Imported, &narrow()).unwrap();
        let fit = triangles(&piece.rows);
        assert_fit(&field, &fit, name);
        assert_eq!(characteristic(&fit), 2 - 2 * genus, "{name}");
        assert!(fit.faces.len() <= mesh.faces.len(), "{name}");
        assert!(piece.counters.repairs["edges_flipped"] > 0, "{name}");
        assert!(piece.counters.repairs["edges_split"] > 0, "{name}");
        assert!(piece.counters.counts["unfit_faces_in"] > 100, "{name}");
        assert!(!piece.counters.repairs.contains_key("faces_over_target"), "{name}");
    }
}

#[test]
fn a_mesh_of_our_own_is_improved_at_the_same_number_of_faces() {
    for (name, text, chi) in [("torus_600", TORUS, 0), ("dodecahedron_1200", DODECAHEDRON, 2)] {
        let (field, mesh) = (formula(text), fixture(name));
        let piece = adapt(&field, &mesh, TopologyProof::Observed, &narrow()).unwrap();
        let better = triangles(&piece.rows);
        assert_fit(&field, &better, name);
        assert_eq!(characteristic(&better), chi, "{name}");
        let (n_before, n_after) = (mesh.faces.len(), better.faces.len());
        assert!(n_after <= n_before && 100 * n_after >= 98 * n_before, "{name}: {n_after}");
        let maxima = &piece.counters.maxima;
        let gain = maxima["curve_error_rel_in"] / maxima["curve_error_rel"];
        assert!(gain > 5.0, "{name}: the worst curve became {gain} times better");
    }
}

#[test]
fn a_mesh_is_left_alone_or_improved_as_the_user_says() {
    let (field, mesh) = (formula(TORUS), fixture("torus_600"));
    let with = |improve, proof| {
        let params = AdaptParams { improve, ..narrow() };
        triangles(&adapt(&field, &mesh, proof, &params).unwrap().rows)
    };
    assert_ne!(soup(&with(Improve::Always, TopologyProof::Imported)), soup(&mesh));
    assert_eq!(soup(&with(Improve::Never, TopologyProof::Certified)), soup(&mesh));
}

/// Four vertices on the unit sphere; normals turn 109 degrees along every edge.
fn tetrahedron() -> TriangleMesh {
    let corner = |x: f64, y: f64, z: f64| Vec3::new(x, y, z) / 3f64.sqrt();
    let positions = vec![
        corner(1.0, 1.0, 1.0),
        corner(1.0, -1.0, -1.0),
        corner(-1.0, 1.0, -1.0),
        corner(-1.0, -1.0, 1.0),
    ];
    TriangleMesh { positions, faces: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]] }
}

#[test]
fn faces_that_the_gate_needs_are_added_and_counted() {
    let field = formula(SPHERE);
    let params = narrow();
    let piece = adapt(&field, &tetrahedron(), TopologyProof::Imported, &params).unwrap();
    let fit = triangles(&piece.rows);
    assert_fit(&field, &fit, "tetrahedron");
    assert_eq!(characteristic(&fit), 2);
    let excess = piece.counters.repairs["faces_over_target"];
    assert_eq!(fit.faces.len() as u64, 4 + excess);
    assert!(excess < 60, "{excess}");
}

#[test]
fn a_mesh_that_rounds_do_not_make_fit_is_refused_with_its_worst_edge() {
    let field = formula(SPHERE);
    let params = AdaptParams { max_rounds: 1, ..narrow() };
    let error = adapt(&field, &tetrahedron(), TopologyProof::Imported, &params).unwrap_err();
    assert_eq!(error.code(), "base-mesh-unfit");
    assert!(error.help().unwrap().contains("target.faces"));
    let AdaptError::Unfit { unfit_faces, place, turning_deg, slope } = error else {
        panic!("{error}")
    };
    assert!(unfit_faces > 0 && place.norm() < 1.0);
    assert!(turning_deg > 60.0 || slope > 0.5, "{turning_deg} {slope}");
}

#[test]
fn a_vertex_without_a_normal_is_named_with_its_place() {
    let field = ClosureField::new(2.0, |p: Vec3| p.norm_squared() * (p.x - 3.0))
        .with_gradient(|p| 2.0 * (p.x - 3.0) * p + p.norm_squared() * Vec3::x());
    let mut mesh = tetrahedron();
    let apex = mesh.positions[2];
    mesh.positions.iter_mut().for_each(|p| *p -= apex);
    let error = adapt(&field, &mesh, TopologyProof::Imported, &narrow()).unwrap_err();
    assert_eq!(error, AdaptError::SingularPoint { place: Vec3::zeros() });
    assert_eq!(error.code(), "singular-point");
}

fn contract_fixture() -> contract::Fixture<Adapt> {
    let mesh = fixture("torus_600");
    let input = Mesh::from_triangles(&mesh, TopologyProof::Observed).unwrap();
    contract::Fixture::new(formula(TORUS), mesh.bounds()).with_input(input)
}

stage_contract!(Adapt, contract_fixture);
