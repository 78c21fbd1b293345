//! The transform of a 1024x512 image at three degrees: 30 (lighting), 255 (Fejér's weights exact) and 511
//! (rows resampled).

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sh::{Degree, Transform};
use sphere::LatLong;

const DEGREES: [usize; 3] = [30, 255, 511];

fn grid() -> LatLong {
    LatLong { width: 1024, height: 512 }
}

/// Noise: the time does not depend on the values.
fn image() -> Vec<[f32; 3]> {
    let mut state = 1u32;
    (0..grid().len())
        .map(|_| {
            std::array::from_fn(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / (1 << 24) as f32
            })
        })
        .collect()
}

fn plans() -> impl Iterator<Item = (usize, Transform)> {
    DEGREES.into_iter().filter_map(|l| Some((l, Transform::new(grid(), Degree::new(l).ok()?).ok()?)))
}

fn analysis(criterion: &mut Criterion) {
    let image = image();
    let mut group = criterion.benchmark_group("sht_analysis");
    for (l, transform) in plans() {
        group.bench_function(format!("1024x512/{l}"), |bencher| {
            bencher.iter(|| transform.analyse(black_box(&image)));
        });
    }
    group.finish();
}

fn synthesis(criterion: &mut Criterion) {
    let mut pixels = image();
    let mut group = criterion.benchmark_group("sht_synthesis");
    for (l, transform) in plans() {
        let expansion = transform.analyse(&pixels);
        group.bench_function(format!("1024x512/{l}"), |bencher| {
            bencher.iter(|| transform.synthesise_into(black_box(&expansion), &mut pixels));
        });
    }
    group.finish();
}

criterion_group!(benches, analysis, synthesis);
criterion_main!(benches);
