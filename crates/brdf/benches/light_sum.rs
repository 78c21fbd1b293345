//! What a material reflects of the points of 43 lamps toward a view, as at a pixel of a picture under a
//! studio: batches that are turned into the frame of the surface, compared with one direction after another.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark may panic")]

use brdf::{KajiyaKay, LightSum, Material, Standard, StandardParameters};
use criterion::{Criterion, criterion_group, criterion_main};
use sphere::{DMat3, Direction, spiral};

const POINTS: usize = 43 * 7;

fn sums(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("light-sum");
    let metal = StandardParameters { metallic: 1.0, roughness: 0.5, ..StandardParameters::default() };
    let materials = [
        ("standard", 1, Material::Standard(Standard::new(metal).unwrap())),
        ("kajiya-kay-turned", 25, Material::KajiyaKay(KajiyaKay::new(16.0, [0.2; 3]).unwrap())),
    ];
    let points: Vec<Direction> = (0..POINTS).map(|index| spiral(index, POINTS)).collect();
    let frame = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(1.1);
    let (view, flux) = (Direction::from_angles(0.6, 0.3), [1.0, 0.8, 0.6]);
    for (name, turns, material) in &materials {
        group.bench_function(format!("{name}/batched"), |bencher| {
            bencher.iter(|| {
                let mut sum = LightSum::turned(material, *turns, view, frame);
                points.iter().for_each(|point| sum.add(*point, flux));
                sum.total()
            });
        });
        group.bench_function(format!("{name}/one-by-one"), |bencher| {
            bencher.iter(|| {
                let mut sum = [0.0; 3];
                for point in &points {
                    let incident = Direction::normalised(frame * point.vector());
                    let rho = material.mean_over_turns(*turns, incident, view);
                    (0..3).for_each(|channel| sum[channel] += flux[channel] * rho[channel]);
                }
                sum
            });
        });
    }
    group.finish();
}

criterion_group!(benches, sums);
criterion_main!(benches);
