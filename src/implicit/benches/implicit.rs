//! Nanoseconds a point of deccube: value, gradient, Hessian, enclosures; batches of 15 to 4096.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isospline_geometry::Vec3;
use isospline_implicit::{Field, Formula, Interval, Jet1, Jet2};
use std::collections::BTreeMap;
use std::hint::black_box;

const DECCUBE: &str = "((x^2+y^2-a^2)^2+(z^2-1)^2)*((y^2+z^2-a^2)^2+(x^2-1)^2)\
                       *((z^2+x^2-a^2)^2+(y^2-1)^2)-b";

fn deccube() -> Formula {
    let parameters = BTreeMap::from([("a".to_owned(), 0.8), ("b".to_owned(), 0.02)]);
    Formula::parse(DECCUBE, &parameters).expect("deccube is a formula")
}

/// The same function by hand, as the unit of the ratios.
fn by_hand(p: &Vec3) -> f64 {
    let (a2, [x, y, z]) = (0.64, [p.x * p.x, p.y * p.y, p.z * p.z]);
    let part = |u: f64, v: f64, w: f64| (u + v - a2) * (u + v - a2) + (w - 1.0) * (w - 1.0);
    part(x, y, z) * part(y, z, x) * part(z, x, y) - 0.02
}

fn points(n: usize) -> Vec<Vec3> {
    // A low-discrepancy walk through [-1.1, 1.1]^3.
    let at = |i: usize, step: f64| 2.2 * (i as f64 * step).fract() - 1.1;
    (0..n).map(|i| Vec3::new(at(i, 0.819), at(i, 0.671), at(i, 0.549))).collect()
}

fn bench_points(c: &mut Criterion) {
    let field = deccube();
    let mut group = c.benchmark_group("deccube");
    for n in [1, 15, 45, 4096] {
        let points = points(n);
        let jet = Jet1 { value: 0.0, gradient: Vec3::zeros() };
        let mut values = vec![0.0; n];
        let mut gradients = vec![jet; n];
        let mut hessians = vec![Jet2 { value: 0.0, gradient: Vec3::zeros(), hessian: [0.0; 6] }; n];
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("value by hand", n), |b| {
            b.iter(|| points.iter().zip(&mut values).for_each(|(p, f)| *f = by_hand(black_box(p))));
        });
        group.bench_function(BenchmarkId::new("value", n), |b| {
            b.iter(|| field.values(black_box(&points), &mut values));
        });
        group.bench_function(BenchmarkId::new("gradient", n), |b| {
            b.iter(|| field.gradients(black_box(&points), &mut gradients));
        });
        group.bench_function(BenchmarkId::new("hessian", n), |b| {
            b.iter(|| field.hessians(black_box(&points), &mut hessians));
        });
    }
    group.finish();
}

fn bench_boxes(c: &mut Criterion) {
    let field = deccube();
    let domain = [Interval::new(0.1, 0.2), Interval::new(-0.1, 0.1), Interval::new(0.7, 0.8)];
    c.bench_function("deccube/value enclosure", |b| {
        b.iter(|| field.value_enclosure(black_box(domain)));
    });
    c.bench_function("deccube/gradient enclosure", |b| {
        b.iter(|| field.gradient_enclosure(black_box(domain)));
    });
}

criterion_group!(benches, bench_points, bench_boxes);
criterion_main!(benches);
