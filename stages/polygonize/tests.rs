//! Whole runs on the models of [TK, Fig. 9-15] and on fields made to fail.

use crate::{Polygonize, PolygonizeError, PolygonizeParams};
use isospline_artifact::kinds::{Mesh, TopologyProof};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::{ClosureField, Field, Formula};
use isospline_stage::{Ctx, Diagnosis, Piece, Serial, Stage, Task};
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
    println!("{text:.30}: {:?} {} triangles {counters:?}", rows.topology[0], rows.face.len());
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
