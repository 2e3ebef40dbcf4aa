//! Whole runs on the models of [TK, Fig. 9-15] and on fields made to fail.

use crate::{Polygonize, PolygonizeError, PolygonizeParams};
use isospline_artifact::kinds::{Mesh, TopologyProof};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{ClosureField, Field, Formula};
use isospline_stage::contract::Fixture;
use isospline_stage::{Counters, Ctx, Diagnosis, Host, Piece, Serial, Stage, Stopped, Task};
use std::collections::BTreeMap;

const TORUS: &str = "(sqrt(x^2+y^2)-5)^2+z^2-1";
const DODECAHEDRON: &str = "x^6+y^6+z^6+20*(x^4*y^2+y^4*z^2+z^4*x^2)-1";
const DOUBLE_TORUS: &str = "x^8-2*x^6+x^4+2*x^4*y^2-2*x^2*y^2+y^4+z^2-0.04";
const MCMULLEN: &str = "(x^2+1)*(y^2+1)*(z^2+1)+8*x*y*z-2";
const CHAIR: &str = "(x^2+y^2+z^2-0.95*25)^2-0.8*((z-5)^2-2*x^2)*((z+5)^2-2*y^2)";
const DECCUBE: &str = "((x^2+y^2-0.64)^2+(z^2-1)^2)*((y^2+z^2-0.64)^2+(x^2-1)^2)\
                       *((z^2+x^2-0.64)^2+(y^2-1)^2)-0.02";

fn formula(text: &str) -> Formula {
    Formula::parse(text, &BTreeMap::new()).unwrap()
}

fn cube(half: f64) -> Aabb {
    Aabb::new(Vec3::repeat(-half), Vec3::repeat(half))
}

fn run(
    field: &dyn Field,
    domain: Aabb,
    params: &PolygonizeParams,
) -> Result<Piece<Mesh>, PolygonizeError> {
    let ctx = Ctx { field, domain, host: &Serial };
    let stage = Polygonize::prepare(&ctx, params, ())?;
    stage.process(&ctx, (), (), &Task::default())
}

fn with_faces(faces: u32) -> PolygonizeParams {
    PolygonizeParams { faces, ..PolygonizeParams::default() }
}

/// A closed manifold by `Mesh::from_triangles`; here: outward, on the surface, of this topology.
fn check(text: &str, domain: Aabb, faces: u32, components: u32, euler: i64) {
    let field = formula(text);
    let Piece { rows, counters } = run(&field, domain, &with_faces(faces)).unwrap();
    let found = rows.topology[0];
    assert_eq!(found.proof, TopologyProof::Certified.code(), "{counters:?}");
    assert_eq!((found.components, found.euler_characteristic), (components, euler));
    let mesh = rows.view().to_triangles();
    assert!(mesh.volume() > 0.0);
    let ratio = rows.face.len() as f64 / f64::from(faces);
    assert!((1.5..4.0).contains(&ratio), "{ratio} triangles a face wanted");
    let scale = domain.diagonal();
    for p in &mesh.positions {
        let jet = field.gradient(*p);
        assert!(jet.value.abs() < 1e-12 * scale * jet.gradient.norm(), "{p} {jet:?}");
    }
}

#[test]
fn the_torus_is_certified_with_genus_one() {
    check(TORUS, Aabb::new(Vec3::new(-6.6, -6.6, -1.1), Vec3::new(6.6, 6.6, 1.1)), 600, 1, 0);
}

#[test]
fn the_dodecahedron_surface_is_certified_with_genus_zero() {
    check(DODECAHEDRON, cube(1.1), 1200, 1, 2);
}

#[test]
fn the_double_torus_is_certified_with_genus_two() {
    check(
        DOUBLE_TORUS,
        Aabb::new(Vec3::new(-1.2, -0.75, -0.22), Vec3::new(1.2, 0.75, 0.22)),
        1800,
        1,
        -2,
    );
}

#[test]
fn the_mcmullen_surface_is_certified_with_one_compact_part_of_genus_zero() {
    check(MCMULLEN, cube(1.94), 2000, 1, 2);
}

#[test]
fn the_chair_is_certified_with_genus_three() {
    check(CHAIR, cube(5.5), 4000, 1, -4);
}

#[test]
fn deccube_is_certified_with_genus_thirteen() {
    check(DECCUBE, cube(1.2), 5000, 1, -24);
}

#[test]
fn two_disjoint_spheres_are_two_certified_components() {
    let text = "min((x-1)^2+y^2+z^2-0.25, (x+1)^2+y^2+z^2-0.09)";
    check(text, cube(2.0), 1000, 2, 4);
}

#[test]
fn a_mesh_of_many_tiles_keeps_the_topology_and_no_short_edges_along_seams() {
    // 150 000 triangles before short edges are merged: five tiles and their seams.
    check(DECCUBE, cube(1.2), 25_000, 1, -24);
    let field = formula(DECCUBE);
    let Piece { rows, .. } = run(&field, cube(1.2), &with_faces(25_000)).unwrap();
    let mesh = rows.view().to_triangles();
    let lengths: Vec<f64> = (0..mesh.faces.len() as u32)
        .flat_map(|f| {
            let [a, b, c] = mesh.corners(f);
            [(b - a).norm(), (c - b).norm(), (a - c).norm()]
        })
        .collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let short = lengths.iter().filter(|&&l| l < 0.3 * mean).count();
    assert!(short as f64 <= 2e-3 * lengths.len() as f64, "{short} of {}", lengths.len());
}

/// The error of a field in a box with half sides of 1.3.
fn error_of(text: &str) -> PolygonizeError {
    run(&formula(text), cube(1.3), &with_faces(500)).unwrap_err()
}

#[test]
fn an_empty_level_set_tells_the_range_of_f() {
    let error = error_of("x^2+y^2+z^2+1");
    let PolygonizeError::EmptyLevelSet { min, max } = error else { panic!("{error:?}") };
    assert_eq!((min, error.code()), (1.0, "empty-level-set"));
    assert!((max - (1.0 + 3.0 * 1.69)).abs() < 1e-12);
}

#[test]
fn a_surface_that_leaves_or_touches_the_box_names_the_side() {
    for (text, name) in [("(x+0.5)^2+y^2+z^2-1", "x-"), ("x^2+y^2+(z-0.3)^2-1", "z+")] {
        let error = error_of(text);
        let PolygonizeError::LeavesBox { side, at } = error else { panic!("{error:?}") };
        assert_eq!(side.to_string(), name);
        assert!((at[side.axis].abs() - 1.3).abs() < 1e-12, "{at}");
    }
}

#[test]
fn a_field_without_intervals_that_leaves_the_box_names_the_side() {
    let field = ClosureField::new(1.0, |p: Vec3| p.y * p.y + p.z * p.z - 0.5);
    let error = run(&field, cube(1.3), &with_faces(500)).unwrap_err();
    let PolygonizeError::LeavesBox { side, .. } = error else { panic!("{error:?}") };
    assert_eq!(side.axis, 0);
}

#[test]
fn not_a_number_is_reported_with_its_point() {
    for text in ["x^2+y^2+z^2-1+1e-9*sqrt(x+0.5)", "sqrt(-1-x^2)+y"] {
        let error = error_of(text);
        let PolygonizeError::NotANumber { at } = error else { panic!("{text}: {error:?}") };
        assert!(formula(text).value(at).is_nan(), "{at}");
    }
    let holed = ClosureField::new(1.0, |p: Vec3| if p.x > 1.0 { f64::NAN } else { p.norm() - 0.9 });
    let error = run(&holed, cube(1.3), &with_faces(500)).unwrap_err();
    assert!(error.place().is_some_and(|at| at.x > 1.0), "{error}");
}

#[test]
fn singular_points_are_found_with_their_place() {
    for (text, distance) in [
        ("x^2+y^2-z^2", (|p| p.norm()) as fn(Vec3) -> f64),
        ("(x^2+y^2+z^2)^2-(x^2-y^2-z^2)", |p| p.norm()),
        ("(x^2+y^2+z^2)^2-(x^2+y^2)", |p| p.norm()),
    ] {
        let error = error_of(text);
        let PolygonizeError::SingularPoint { at, .. } = error else { panic!("{text}: {error:?}") };
        assert!(distance(at) < 1e-6, "{text}: {at}");
        assert!(error.place().is_some() && error.help().is_some());
    }
}

#[test]
fn a_field_that_touches_zero_or_is_flat_on_its_surface_is_told_from_a_singular_point() {
    for (text, code) in [
        ("(x^2+y^2+z^2-1)^2", "no-sign-change"),
        ("x^2+y^2+z^2", "no-sign-change"),
        ("(x^2+y^2+z^2-1)^3", "level-not-regular"),
    ] {
        let error = error_of(text);
        assert_eq!(error.code(), code, "{text}: {error}");
        let value = formula(text).value(error.place().unwrap());
        assert!(value.abs() < 1e-6, "{text}: {error}");
    }
}

#[test]
fn a_thin_part_that_no_grid_shows_is_told_with_its_thickness() {
    let text = "min(sqrt(x^2+y^2+z^2)-0.5, sqrt((x-1)^2+(y-0.3)^2+z^2)-1e-5)";
    let params = PolygonizeParams { cells: 32, ..with_faces(500) };
    let error = run(&formula(text), cube(1.3), &params).unwrap_err();
    let PolygonizeError::ThinnerThanGrid { thickness, cell, .. } = &error else {
        panic!("{error:?}")
    };
    assert!(thickness.is_none_or(|t| t < *cell), "{error}");
}

#[test]
fn components_below_a_size_are_left_out() {
    let text = "min(x^2+y^2+z^2-0.5, (x-1)^2+(y-0.5)^2+z^2-0.001)";
    let components = |drop_below: f64| {
        let params = PolygonizeParams { drop_below, ..with_faces(500) };
        run(&formula(text), cube(1.3), &params).unwrap().rows.topology[0].components
    };
    assert_eq!([components(0.0), components(0.1)], [2, 1]);
}

#[test]
fn a_box_with_kinks_is_observed_and_then_refused_for_its_sharp_edges() {
    let text = "sqrt(max(abs(x)-1,0)^2+max(abs(y)-0.7,0)^2+max(abs(z)-0.5,0)^2)\
                +min(max(abs(x)-1,max(abs(y)-0.7,abs(z)-0.5)),0)";
    let field = formula(text);
    let ctx = Ctx { field: &field, domain: cube(1.3), host: &Serial };
    let (mesh, proof) =
        crate::polygonize(&ctx, &with_faces(1000), &mut Counters::default()).unwrap();
    assert_eq!(proof, TopologyProof::Observed);
    let opposite = mesh.opposites().unwrap();
    assert_eq!(mesh.euler_characteristic(&opposite), 2);
    let error = run(&field, cube(1.3), &with_faces(1000)).unwrap_err();
    let PolygonizeError::SharpEdge { angle_deg, .. } = error else { panic!("{error:?}") };
    assert!((angle_deg - 90.0).abs() < 1.0, "{angle_deg}");
}

#[test]
fn a_closure_without_intervals_is_observed() {
    let field = ClosureField::new(1.0, |p: Vec3| {
        let ring = (p.x * p.x + p.y * p.y).sqrt() - 0.8;
        ring * ring + p.z * p.z - 0.09
    });
    let topology = run(&field, cube(1.3), &with_faces(1000)).unwrap().rows.topology[0];
    assert_eq!(topology.proof, TopologyProof::Observed.code());
    assert_eq!((topology.components, topology.euler_characteristic), (1, 0));
}

#[test]
fn a_shell_that_two_grids_see_differently_is_unresolved() {
    // Checkers that change with every grid: no two resolutions agree.
    let field = ClosureField::new(1.0, |p: Vec3| {
        let wave = |x: f64| (400.0 * x * x).sin();
        if p.norm() > 1.2 { 1.0 } else { wave(p.x) * wave(p.y) * wave(p.z) + 0.1 }
    });
    let error = run(&field, cube(1.3), &with_faces(1000)).unwrap_err();
    assert_eq!(error.code(), "topology-unresolved", "{error}");
}

#[test]
fn a_sphere_smaller_than_a_cell_of_the_first_grids_is_found_and_certified() {
    let text = "min((x-0.3)^2+(y-0.2)^2+(z-0.1)^2-1e-4, x^2+y^2+(z+0.5)^2-0.25)";
    let topology = run(&formula(text), cube(1.3), &with_faces(500)).unwrap().rows.topology[0];
    assert_eq!(topology.proof, TopologyProof::Certified.code());
    assert_eq!((topology.components, topology.euler_characteristic), (2, 4));
}

#[test]
fn a_unit_sphere_is_found_in_a_box_a_thousand_million_times_larger() {
    check("x^2+y^2+z^2-1", cube(1e9), 500, 1, 2);
}

#[test]
fn a_box_without_volume_and_a_grid_too_fine_are_errors() {
    let field = formula("x^2+y^2+z^2-1");
    let flat = Aabb::new(Vec3::zeros(), Vec3::new(1.0, 0.0, 1.0));
    assert_eq!(run(&field, flat, &with_faces(500)), Err(PolygonizeError::EmptyBox));
    let nan = Aabb::new(Vec3::zeros(), Vec3::new(1.0, f64::NAN, 1.0));
    assert_eq!(run(&field, nan, &with_faces(500)), Err(PolygonizeError::EmptyBox));
    let params = PolygonizeParams { faces: 100_000_000, max_cells: 10_000, ..with_faces(4) };
    let error = run(&field, cube(1.3), &params).unwrap_err();
    assert_eq!(error.code(), "too-many-cells");
}

#[test]
fn the_number_of_cells_can_be_set() {
    let params = PolygonizeParams { cells: 40, ..with_faces(500) };
    let piece = run(&formula("x^2+y^2+z^2-1"), cube(1.3), &params).unwrap();
    assert!((piece.counters.maxima["cells_a_side"] - 40.0).abs() < 0.5);
    assert!(piece.rows.face.len() > 4000, "{}", piece.rows.face.len());
}

/// Half sides of a box, wanted faces.
fn mesh_of(text: &str, half: [f64; 3], faces: u32) -> Piece<Mesh> {
    let half = Vec3::from(half);
    run(&formula(text), Aabb::new(-half, half), &with_faces(faces)).unwrap()
}

#[test]
fn thin_surfaces_are_found_with_their_topology() {
    for (text, half, euler) in [
        ("x^2+y^2+(z/0.03)^2-1", [1.2, 1.2, 0.0354], 2),
        ("x^2+y^2+(z/0.03)^2-1", [1.2, 1.2, 1.3], 2),
        ("(x/10)^8+(y/10)^8+(z/0.2)^2-1", [11.0, 11.0, 0.3], 2),
        ("(sqrt(x^2+y^2)-1)^2+z^2-1e-4", [1.2, 1.2, 1.2], 0),
        ("(sqrt(x^2+y^2)-1)^2+z^2-1e-4", [1.2, 1.2, 0.013], 0),
    ] {
        let piece = mesh_of(text, half, 1000);
        assert!(piece.rows.face.len() >= 1050, "{text}: {}", piece.rows.face.len());
        let rows = piece.rows;
        let found = (rows.topology[0].components, rows.topology[0].euler_characteristic);
        assert_eq!(found, (1, euler), "{text} in {half:?}");
    }
}

#[test]
fn small_parts_are_meshed_or_refused_with_their_place_but_never_lost() {
    for (text, place) in [
        ("(x^2+y^2+z^2-1)*((x-1.5)^2+y^2+z^2-1e-8)", [1.5, 0.0, 0.0]),
        ("min(sqrt(x^2+y^2+z^2)-1, sqrt((x-1.5)^2+(y-0.3)^2+z^2)-0.001)", [1.5, 0.3, 0.0]),
        ("max(sqrt(x^2+y^2+z^2)-1, 0.001-sqrt((x-0.5)^2+(y-0.3)^2+z^2))", [0.5, 0.3, 0.0]),
    ] {
        match run(&formula(text), cube(2.0), &with_faces(1000)) {
            Ok(piece) => assert_eq!(piece.rows.topology[0].components, 2, "{text}"),
            Err(error) => {
                assert_eq!(error.code(), "thinner-than-grid", "{text}: {error}");
                let at = error.place().unwrap();
                assert!((at - Vec3::from(place)).norm() < 0.1, "{text}: {at}");
            }
        }
    }
}

#[test]
fn metaballs_with_poles_inside_are_meshed() {
    let text = "1-0.2/((x-0.4)^2+y^2+z^2)-0.2/((x+0.4)^2+y^2+z^2)";
    let topology = mesh_of(text, [2.0; 3], 1000).rows.topology[0];
    assert_eq!((topology.components, topology.euler_characteristic), (1, 2));
}

#[test]
fn small_surfaces_in_a_large_box_get_the_faces_wanted() {
    for (text, components) in
        [("((x-1)^2+y^2+z^2)*((x+1)^2+y^2+z^2)-1e-4", 2), ("((x^2+y^2+z^2+1)^2-4*x^2)-0.0001", 2)]
    {
        let rows = mesh_of(text, [2.2, 1.2, 1.2], 2000).rows;
        assert_eq!(rows.topology[0].components, components);
        assert!(rows.face.len() >= 2000, "{text}: {}", rows.face.len());
    }
}

fn small_chair() -> Fixture<Polygonize> {
    Fixture::new(formula(CHAIR), cube(5.5)).with_params(with_faces(1000))
}

isospline_stage::stage_contract!(Polygonize, small_chair);

/// Asks to stop at the first report.
struct Stopping;

impl Host for Stopping {
    fn for_each(&self, n: usize, body: &(dyn Fn(usize) + Sync)) {
        (0..n).for_each(body);
    }

    fn progress(&self, _: u64, _: u64) -> Result<(), Stopped> {
        Err(Stopped)
    }
}

#[test]
fn a_stop_is_obeyed() {
    let field = formula(DECCUBE);
    let ctx = Ctx { field: &field, domain: cube(1.2), host: &Stopping };
    let stage = Polygonize::prepare(&ctx, &with_faces(1000), ()).unwrap();
    let stopped = stage.process(&ctx, (), (), &Task::default());
    assert_eq!(stopped, Err(PolygonizeError::Stopped(Stopped)));
}
