//! Light rigs of an environment of 512 x 1024 texels: the masses of its texels, and 64 and 1024 lights.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a benchmark may panic")]

use std::hint::black_box;
use std::num::NonZeroU32;

use criterion::{Criterion, criterion_group, criterion_main};
use envmap::Environment;
use sampling::{LightMasses, Method, rig};
use sphere::{DVec3, LatLong};

/// A sky with clouds, a ground and a sun.
fn environment() -> Environment {
    let grid = LatLong::with_rows(512);
    let sun = DVec3::new(0.5, 0.4, 0.768).normalize();
    let texel = |index: usize| {
        let w = grid.direction(index / grid.width, index % grid.width).vector();
        let clouds = 1.0 + 0.5 * (9.0 * w.x).sin() * (7.0 * w.y).cos();
        let sky = if w.z > 0.0 { clouds } else { 0.2 };
        [if w.dot(sun) > 0.9999 { 2e4 } else { sky as f32 }; 3]
    };
    Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
}

fn rigs(criterion: &mut Criterion) {
    let environment = environment();
    let mut group = criterion.benchmark_group("rig");
    group.sample_size(20);
    group.bench_function("masses", |bencher| {
        bencher.iter(|| LightMasses::of_environment(black_box(&environment)).unwrap());
    });
    let masses = LightMasses::of_environment(&environment).unwrap();
    for (name, method) in [("median-cut", Method::MedianCut), ("warped", Method::Warped)] {
        for count in [64, 1024] {
            let count = NonZeroU32::new(count).unwrap();
            group.bench_function(format!("{name}/{count}"), |bencher| {
                bencher.iter(|| rig(black_box(&masses), count, method));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, rigs);
criterion_main!(benches);
