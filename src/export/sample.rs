//! A surface to export in tests: a ball of eight patches and, apart from it, a ring.

use isospline_artifact::kinds::{PatchMeta, Patches};
use isospline_geometry::bezier_triangle::{DEGREE, grid, interior_indices};
use isospline_geometry::degree_change::raise_sextic;
use isospline_geometry::{TriangleMesh, Vec3};

/// Genus 0 and genus 1: Euler characteristic 2, two components, 8 + 192 faces.
pub(crate) fn ball_and_ring() -> Patches {
    let mut mesh = octahedron();
    let ring = ring(12, 8);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(ring.positions);
    mesh.faces.extend(ring.faces.iter().map(|face| face.map(|v| v + first)));
    bulged(&mesh)
}

/// The same with a hole in the ball, its shape scaled by -0.4: a third component, Euler
/// characteristic 4.
pub(crate) fn hollow_ball_and_ring() -> Patches {
    const SCALE: f64 = -0.4;
    const BALL_FACES: usize = 8;
    let solid = ball_and_ring();
    let n_edges = solid.boundary.len() as u32;
    let mut hollow = solid.clone();
    // The point reflection of a negative scale turns the faces inside out.
    let scaled = |x: &f64| SCALE * x;
    let inner = |p: &[f64; 45]| p.each_ref().map(scaled);
    hollow.position.extend(solid.position[..6].iter().map(|p| p.each_ref().map(scaled)));
    hollow.interior.extend(solid.interior[..BALL_FACES].iter().map(inner));
    // The edges of the ball in the order of its half-edges, each once.
    let mut edges: Vec<u32> = solid.edge_of[..3 * BALL_FACES].to_vec();
    edges.sort_unstable();
    edges.dedup();
    hollow.boundary.extend(edges.iter().map(|&e| {
        let curve = &solid.boundary[e as usize];
        curve.each_ref().map(scaled)
    }));
    let moved = |e: &u32| n_edges + edges.binary_search(e).expect(EDGE) as u32;
    hollow.edge_of.extend(solid.edge_of[..3 * BALL_FACES].iter().map(moved));
    let n_vertices = solid.position.len() as u32;
    hollow.face.extend(solid.face[..BALL_FACES].iter().map(|face| face.map(|v| v + n_vertices)));
    hollow
}

/// The same with patches of degree 6: those with the same twists.
pub(crate) fn of_degree_six(mut patches: Patches) -> Patches {
    patches.meta[0].degree = 6;
    let view = patches.view();
    let lowered = |f: usize| {
        let net: Vec<Vec3> = view.own_net(f);
        let raised = raise_sextic(&net.try_into().expect("invariant: 28 points"));
        flat(interior_indices().map(|i| raised[i]))
    };
    patches.interior = (0..view.face.len()).map(lowered).collect();
    patches
}

const EDGE: &str = "invariant: a closed mesh has both directions of an edge";

/// Eight flat patches: the octahedron itself, its control points where degree elevation puts them.
pub(crate) fn flat_octahedron() -> Patches {
    patches_over(&octahedron(), |p| p)
}

/// Patches over the faces of a mesh whose control points all go through one polynomial map, so
/// that no two agree by accident.
fn bulged(mesh: &TriangleMesh) -> Patches {
    patches_over(mesh, bulge)
}

fn patches_over(mesh: &TriangleMesh, bulge: fn(Vec3) -> Vec3) -> Patches {
    let mut edges: Vec<[u32; 2]> = mesh
        .faces
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .filter(|[a, b]| a < b)
        .collect();
    edges.sort_unstable();
    let edge_of = |a: u32, b: u32| {
        let row = edges.binary_search(&[a.min(b), a.max(b)]);
        row.expect(EDGE) as u32
    };
    let at = |v: u32| mesh.positions[v as usize];
    let curve = |&[a, b]: &[u32; 2]| {
        flat([1.0, 2.0, 3.0].map(|k| bulge(at(a) + 0.25 * k * (at(b) - at(a)))))
    };
    let inner = |f: usize| {
        let corners = mesh.corners(f as u32);
        let net: Vec<Vec3> = grid(DEGREE)
            .map(|[u, v, w]| bulge(u * corners[0] + v * corners[1] + w * corners[2]))
            .collect();
        flat(interior_indices().map(|i| net[i]))
    };
    Patches {
        meta: vec![PatchMeta { scheme: 0, degree: 7, boundary_degree: 4, rational: 0 }],
        position: mesh.positions.iter().map(|&p| bulge(p).into()).collect(),
        face: mesh.faces.clone(),
        edge_of: mesh
            .faces
            .iter()
            .flat_map(|&[a, b, c]| [edge_of(a, b), edge_of(b, c), edge_of(c, a)])
            .collect(),
        boundary: edges.iter().map(curve).collect(),
        interior: (0..mesh.faces.len()).map(inner).collect(),
    }
}

/// Rounds what is flat, then shears it so that no symmetry hides an exchange of points.
fn bulge(p: Vec3) -> Vec3 {
    let p = if p.norm() < 2.0 { p.normalize() } else { rounded_ring(p) };
    p + 0.03 * Vec3::new(p.y * p.z, p.z * p.x - 0.3 * p.y * p.y, 0.2 * p.x * p.x * p.y)
}

/// The nearest point of the torus that [`ring`] is inscribed in.
fn rounded_ring(p: Vec3) -> Vec3 {
    let radius = p.xy().norm();
    let core = Vec3::new(p.x, p.y, 0.0) * (RING_RADIUS / radius);
    core + (p - core).normalize()
}

const RING_RADIUS: f64 = 4.0;

fn flat<const N: usize, const M: usize>(points: [Vec3; N]) -> [f64; M] {
    std::array::from_fn(|i| points[i / 3][i % 3])
}

fn octahedron() -> TriangleMesh {
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    TriangleMesh {
        positions: vec![x, -x, y, -y, z, -z],
        faces: vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    }
}

fn ring(n: usize, m: usize) -> TriangleMesh {
    let turn = |k: usize, n: usize| std::f64::consts::TAU * k as f64 / n as f64;
    let mut mesh = TriangleMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (phi, theta) = (turn(i, n), turn(j, m));
            let radius = RING_RADIUS + theta.cos();
            mesh.positions.push(Vec3::new(radius * phi.cos(), radius * phi.sin(), theta.sin()));
            let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
            mesh.faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}
