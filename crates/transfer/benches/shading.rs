//! The time of a frame at the vertices of a knot, 152,413 of them as in [KSS02, tab. 1]: a grey table of
//! degree 4 under coloured light.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark may panic")]

use std::time::Duration;

use brdf::{AshikhminShirley, Material, tabulate};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use mesh::Mesh;
use rayon::prelude::*;
use sh::{Degree, Expansion, Stop};
use sphere::Direction;
use transfer::{
    Directions, FixedLight, FixedView, Frames, HalfTransfer, Occluders, Transfer, TransferDegrees, Viewer,
    Visibility, precompute, shade, shade_with_transfer,
};

/// The vertices of the teapot of [KSS02, tab. 1].
const VERTICES: usize = 152_413;

/// Vertices of the built-in knot, repeated up to the number; no triangles.
fn knot(count: usize) -> Mesh {
    let knot = mesh::shape("torus-knot").unwrap();
    let of = |vertex: usize| vertex % knot.positions().len();
    Mesh::new(
        (0..count).map(|vertex| knot.positions()[of(vertex)]).collect(),
        (0..count).map(|vertex| knot.normals()[of(vertex)]).collect(),
        (0..count).map(|vertex| knot.tangents()[of(vertex)]).collect(),
        None,
        Vec::new(),
    )
    .unwrap()
}

fn shading(criterion: &mut Criterion) {
    let degree = Degree::new(4).unwrap();
    let metal = AshikhminShirley::new([24.0, 8.0], [0.0; 3], [0.9; 3]).unwrap();
    let (table, _) = tabulate(&Material::AshikhminShirley(metal), degree, 128, Stop::NEVER).unwrap();
    let rows = (0..25).map(|row| [1.0 / (1.0 + f64::from(row)), 0.5, 0.25]).collect();
    let light = Expansion::from_coefficients(degree, rows).unwrap();
    let frames = Frames::of(&knot(VERTICES)).unwrap();
    let viewer = Viewer::Distant(Direction::from_angles(1.0, 0.3));
    let mut group = criterion.benchmark_group("table");
    group.bench_function("both_move", |bencher| bencher.iter(|| shade(&frames, &table, viewer, &light)));
    let fixed = FixedLight::new(&frames, &light);
    group.bench_function("fixed_light", |bencher| bencher.iter(|| fixed.shade(&frames, &table, viewer)));
    let fixed = FixedView::new(&frames, &table, viewer);
    group.bench_function("fixed_view", |bencher| bencher.iter(|| fixed.shade(&light)));
    // The other meshes of [KSS02, tab. 1].
    group.sample_size(10).measurement_time(Duration::from_secs(1)).warm_up_time(Duration::from_millis(200));
    for count in [50_060, 49_990, 48_668, 100_000] {
        let frames = Frames::of(&knot(count)).unwrap();
        group.bench_function(BenchmarkId::new("both_move", count), |bencher| {
            bencher.iter(|| shade(&frames, &table, viewer, &light));
        });
        let fixed = FixedLight::new(&frames, &light);
        group.bench_function(BenchmarkId::new("fixed_light", count), |bencher| {
            bencher.iter(|| fixed.shade(&frames, &table, viewer));
        });
        let fixed = FixedView::new(&frames, &table, viewer);
        group.bench_function(BenchmarkId::new("fixed_view", count), |bencher| {
            bencher.iter(|| fixed.shade(&light));
        });
    }
    group.finish();
    let matrix: Vec<f32> = (0..625).map(|entry| if entry % 26 == 0 { 1.0 } else { 0.01 }).collect();
    let transfer = Transfer::new(degree, degree, matrix.repeat(VERTICES)).unwrap();
    let mut group = criterion.benchmark_group("transfer");
    group.bench_function("f32", |bencher| {
        bencher.iter(|| shade_with_transfer(&frames, &table, viewer, &transfer, &light));
    });
    let half = HalfTransfer::of(&transfer);
    group.bench_function("f16", |bencher| bencher.iter(|| half.shade(&frames, &table, viewer, &light)));
    let visible: Vec<f32> = (0..81).map(|k| if k == 0 { 3.0 } else { 0.01 }).collect();
    let visibility = Visibility::new(degree, degree, visible.repeat(VERTICES)).unwrap();
    group.bench_function("visibility", |bencher| {
        bencher.iter(|| visibility.shade(&frames, &table, viewer, &light));
    });
    // What memory allows: the matrices are read, and no more.
    group.bench_function("memory", |bencher| {
        bencher.iter(|| {
            let parts = transfer.values().par_chunks(1 << 16);
            parts
                .map(|part| part.iter().fold(0u32, |bits, value| bits ^ value.to_bits()))
                .reduce(|| 0, |a, b| a ^ b)
        });
    });
    group.finish();
}

fn baking(criterion: &mut Criterion) {
    let knot = mesh::shape("torus-knot").unwrap();
    let (degree, frames, occluders) =
        (Degree::new(4).unwrap(), Frames::of(&knot).unwrap(), Occluders::of(&knot));
    let directions = Directions::new(1024, Degree::new(8).unwrap()).unwrap();
    let mut group = criterion.benchmark_group("bake");
    group.sample_size(10);
    group.bench_function("knot", |bencher| {
        bencher.iter(|| {
            precompute(
                &frames,
                &occluders,
                &directions,
                TransferDegrees { output: degree, input: degree },
                Stop::NEVER,
            )
            .unwrap()
        });
    });
    group.finish();
}

criterion_group!(benches, shading, baking);
criterion_main!(benches);
