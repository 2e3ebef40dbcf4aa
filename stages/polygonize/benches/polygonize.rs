//! Triangles a second of deccube at the resolution of 5 000 and 50 000 faces, one thread.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use isospline_geometry::{Aabb, Vec3};
use isospline_implicit::Formula;
use isospline_polygonize::{Polygonize, PolygonizeParams};
use isospline_stage::{Ctx, Serial, Stage, Task};
use std::collections::BTreeMap;

const DECCUBE: &str = "((x^2+y^2-a^2)^2+(z^2-1)^2)*((y^2+z^2-a^2)^2+(x^2-1)^2)\
                       *((z^2+x^2-a^2)^2+(y^2-1)^2)-b";

fn polygonize(criterion: &mut Criterion) {
    let parameters = BTreeMap::from([("a".to_owned(), 0.8), ("b".to_owned(), 0.02)]);
    let field = Formula::parse(DECCUBE, &parameters).expect("the formula is right");
    let domain = Aabb::new(Vec3::repeat(-1.2), Vec3::repeat(1.2));
    let ctx = Ctx { field: &field, domain, host: &Serial };
    let mut group = criterion.benchmark_group("polygonize deccube");
    group.sample_size(10);
    for faces in [5_000, 50_000] {
        let params = PolygonizeParams { faces, ..PolygonizeParams::default() };
        let stage = Polygonize::prepare(&ctx, &params, ()).expect("nothing to prepare");
        let run = || stage.process(&ctx, (), (), &Task::default()).expect("deccube is regular");
        group.throughput(Throughput::Elements(run().rows.face.len() as u64));
        group.bench_function(format!("{faces} faces"), |bencher| bencher.iter(run));
    }
    group.finish();
}

criterion_group!(benches, polygonize);
criterion_main!(benches);
