//! Rotation of an RGB expansion, by degree.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sh::{Degree, Expansion, rotate_into};
use sphere::Rotation;
use std::hint::black_box;

fn sh_rotation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sh_rotation");
    for degree in [4, 16, 64, 256] {
        let Ok(degree) = Degree::new(degree) else { continue };
        let rows = (0..degree.rows()).map(|row| [1.0, 0.5, (row % 7) as f64]).collect();
        let Some(lighting) = Expansion::from_coefficients(degree, rows) else { continue };
        let mut turned = Expansion::zero(degree);
        let rotation = Rotation::from_yaw_pitch_roll(0.4, -0.7, 1.9);
        group.bench_function(BenchmarkId::from_parameter(degree.get()), |bencher| {
            bencher.iter(|| rotate_into(black_box(&lighting), black_box(rotation), &mut turned));
        });
    }
    group.finish();
}

criterion_group!(benches, sh_rotation);
criterion_main!(benches);
