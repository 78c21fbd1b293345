//! The nearest non-negative function to lobes that ring, by degree.

#![allow(clippy::unwrap_used, reason = "a benchmark may panic")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sh::{Degree, Expansion, Mean, Stop, nearest_non_negative};
use sphere::Direction;

fn nearest(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("nearest_non_negative");
    group.sample_size(10);
    for degree in [4, 8, 12, 16] {
        let degree = Degree::new(degree).unwrap();
        // Two small suns.
        let sun = |theta, phi| {
            Expansion::zonal(Direction::from_angles(theta, phi), degree, |l| {
                [1.0, 0.9, 0.7].map(|channel| channel * ((2 * l + 1) as f64).sqrt())
            })
        };
        let (first, second) = (sun(0.7, 0.3), sun(1.9, 2.0));
        let rows = first.coefficients().iter().zip(second.coefficients());
        let rows = rows.map(|(a, b)| std::array::from_fn(|k| a[k] + 0.5 * b[k])).collect();
        let lighting = Expansion::from_coefficients(degree, rows).unwrap();
        group.bench_function(BenchmarkId::from_parameter(degree.get()), |bencher| {
            bencher.iter(|| nearest_non_negative(black_box(&lighting), Mean::Free, Stop::NEVER).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, nearest);
criterion_main!(benches);
