//! Directions and densities from a million points of three kinds, the points made beforehand, on one thread
//! and on two; building a sampler; and a new function every 16, 64 or 256 points, its build counted.

#![allow(missing_docs, clippy::unwrap_used, clippy::disallowed_methods, reason = "a benchmark may panic")]

mod function;
mod product;

use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, criterion_group, criterion_main};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use sampling::Points;
use sh::Degree;

const COUNT: usize = 1 << 20;

/// The points after which `fresh` ends, in tasks of a sixteenth.
const FRESH: usize = COUNT / 16;

/// A part of the [`FRESH`] points, and room for directions and densities.
type Task<'a> = (&'a [[f32; 2]], &'a mut [[f32; 3]], &'a mut [f32]);

fn sets() -> [(&'static str, Vec<[f32; 2]>); 3] {
    let filled = |set: Points<'_>| {
        let mut points = vec![[0.0; 2]; COUNT];
        set.fill(0, &mut points);
        points
    };
    [
        ("random", filled(Points::Random { seed: 1 })),
        ("halton", filled(Points::Halton)),
        ("sobol", filled(Points::Sobol { seed: Some(1) })),
    ]
}

fn pools() -> [(usize, ThreadPool); 2] {
    [1, 2].map(|threads| (threads, ThreadPoolBuilder::new().num_threads(threads).build().unwrap()))
}

fn degrees() -> [Degree; 4] {
    [2, 4, 9, 19].map(|l| Degree::new(l).unwrap())
}

/// Draws all points.
fn draw(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    points: &[[f32; 2]],
    sample_into: impl Fn(&[[f32; 2]], &mut [[f32; 3]], &mut [f32]) + Sync,
) {
    let (mut directions, mut densities) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
    for (threads, pool) in pools() {
        group.bench_function(format!("{name}/{threads}"), |bencher| {
            bencher.iter(|| {
                pool.install(|| sample_into(points, &mut directions, &mut densities));
                black_box(&directions);
            });
        });
    }
}

/// Draws [`FRESH`] points in sixteen tasks. `renew` has the state of a task take its k-th function and draws
/// `every` points of it.
fn draw_fresh<S>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    every: usize,
    start: impl Fn() -> S + Sync,
    renew: impl Fn(&mut S, usize, Task<'_>) + Sync,
) {
    let [(_, points), ..] = sets();
    let (mut directions, mut densities) = (vec![[0.0; 3]; FRESH], vec![0.0; FRESH]);
    for (threads, pool) in pools() {
        group.bench_function(format!("{name}{every}/{threads}"), |bencher| {
            bencher.iter(|| {
                let outputs = directions.par_chunks_mut(FRESH / 16).zip(densities.par_chunks_mut(FRESH / 16));
                let tasks = points[..FRESH].par_chunks(FRESH / 16).zip(outputs);
                pool.install(|| {
                    tasks.for_each_init(&start, |state, (points, (directions, densities))| {
                        let outputs = directions.chunks_mut(every).zip(densities.chunks_mut(every));
                        for (k, (points, (directions, densities))) in
                            points.chunks(every).zip(outputs).enumerate()
                        {
                            renew(state, k, (points, directions, densities));
                        }
                    });
                });
                black_box(&directions);
            });
        });
    }
}

criterion_group!(
    benches,
    function::sampling,
    function::build,
    function::fresh,
    product::sampling,
    product::build,
    product::fresh
);
criterion_main!(benches);
