//! Triangles a second into the decimation, on a torus with its exact derivatives.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use isospline_artifact::kinds::{Mesh, TopologyProof};
use isospline_decimate::{Decimate, DecimateParams};
use isospline_geometry::{TriangleMesh, Vec3};
use isospline_implicit::ClosureField;
use isospline_stage::{Ctx, Serial, Stage, Task};

const TAU: f64 = std::f64::consts::TAU;

fn torus(n: u32, m: u32) -> TriangleMesh {
    let id = |i: u32, j: u32| (i % n) * m + j % m;
    let mut mesh = TriangleMesh::default();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
            let r = 2.0 + v.cos();
            mesh.positions.push(Vec3::new(r * u.cos(), r * u.sin(), v.sin()));
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// `(x^2 + y^2 + z^2 + 3)^2 - 16 (x^2 + y^2)`.
fn field() -> ClosureField {
    let sum = |p: Vec3| p.norm_squared() + 3.0;
    ClosureField::new(6.0, move |p| sum(p) * sum(p) - 16.0 * (p.x * p.x + p.y * p.y))
        .with_gradient(move |p| 4.0 * sum(p) * p - 32.0 * Vec3::new(p.x, p.y, 0.0))
        .with_hessian(move |p| {
            let (s, q) = (4.0 * sum(p), 8.0 * p);
            let planar = s - 32.0;
            let [xx, yy, zz] = [q.x * p.x + planar, q.y * p.y + planar, q.z * p.z + s];
            [xx, q.x * p.y, q.x * p.z, yy, q.y * p.z, zz]
        })
}

fn decimation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("decimate");
    group.sample_size(20);
    for (n, m) in [(142, 71), (448, 224)] {
        let fine = torus(n, m);
        let input = Mesh::from_triangles(&fine, TopologyProof::Observed).expect("closed torus");
        let field = field();
        let ctx = Ctx { field: &field, domain: fine.bounds(), host: &Serial };
        let params = DecimateParams { faces: 5000, ..DecimateParams::default() };
        group.throughput(Throughput::Elements(fine.faces.len() as u64));
        group.bench_function(format!("{} to 5000 faces", fine.faces.len()), |bencher| {
            bencher.iter(|| {
                let stage = Decimate::prepare(&ctx, &params, (input.view(),)).expect("valid");
                stage.process(&ctx, (input.view(),), (), &Task::default()).expect("decimates")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, decimation);
criterion_main!(benches);
