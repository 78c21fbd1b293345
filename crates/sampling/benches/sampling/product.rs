//! Products of functions of four degrees with an environment of 512 x 1024 texels. The rotation of a new
//! function is counted.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput};
use envmap::Environment;
use sampling::{
    ProductMasses, ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight, weigh,
};
use sh::{Degree, Expansion, rotate, rotate_into};
use sphere::{Direction, LatLong, Rotation};

use super::{COUNT, FRESH, degrees, draw, draw_fresh, pools, sets};

/// A sky, a ground, clouds and a sun.
fn environment() -> TexelLight {
    let grid = LatLong::with_rows(512);
    let texel = |index: usize| {
        let direction = grid.direction(index / grid.width, index % grid.width).vector();
        let cloud = (9.0 * direction.x + 3.0 * (5.0 * direction.y).sin()).sin() * (7.0 * direction.z).cos();
        let sky = if direction.z > 0.0 { 1.0 + cloud.max(0.0) } else { 0.2 };
        let sun = direction.dot(Direction::from_angles(0.8, 1.0).vector()) > 0.9999;
        [if sun { 2e4 } else { sky as f32 }; 3]
    };
    let pixels = (0..grid.len()).map(texel).collect();
    TexelLight::new(&Environment::new(grid, pixels).unwrap(), SUM).unwrap()
}

/// A lobe about +Z, with what it rings at its degree.
fn lobe(degree: Degree) -> Expansion {
    let sharpness = (degree.get() + 1) as f64;
    Expansion::zonal(Direction::Z, degree, |l| {
        [(-(l as f64 / sharpness).powi(2)).exp() * ((2 * l + 1) as f64).sqrt(); 3]
    })
}

/// Turned from view to view.
fn turn(index: usize) -> Rotation {
    Rotation::from_yaw_pitch_roll(0.1 * index as f64, 0.4 + 0.003 * index as f64, 0.2)
}

fn sampler(light: &TexelLight, degree: Degree, masses: ProductMasses) -> ProductSampler {
    let tables: Arc<_> = ProductTables::new(light, &Tables::new(degree));
    let f = weigh(&rotate(&lobe(degree), turn(1)), SUM);
    ProductSampler::new(&tables, &f, ProductOptions { masses, ..Default::default() }).unwrap()
}

pub(crate) fn sampling(criterion: &mut Criterion) {
    let (light, sets) = (environment(), sets());
    let mut group = criterion.benchmark_group("sampling");
    group.throughput(Throughput::Elements(COUNT as u64)).sample_size(20);
    let mut run = |name: &str, sampler: &ProductSampler, points: &[[f32; 2]]| {
        draw(&mut group, name, points, |points, directions, densities| {
            sampler.sample_into(points, directions, densities);
        });
    };
    for degree in degrees() {
        let sampler = sampler(&light, degree, ProductMasses::Leaves);
        for (name, points) in &sets {
            run(&format!("product/{}/{name}", degree.rows()), &sampler, points);
        }
    }
    let sampler = sampler(&light, Degree::new(19).unwrap(), ProductMasses::BilinearTexels);
    run("product-texels/400/random", &sampler, &sets[0].1);
    group.finish();
}

pub(crate) fn build(criterion: &mut Criterion) {
    let light = environment();
    let mut group = criterion.benchmark_group("build");
    group.sample_size(20);
    for degree in degrees() {
        let mut sampler = sampler(&light, degree, ProductMasses::Leaves);
        let f = lobe(degree);
        let coefficients = weigh(&rotate(&f, turn(1)), SUM);
        group.bench_function(format!("product/{}", degree.rows()), |bencher| {
            bencher.iter(|| sampler.replace(black_box(&coefficients)).unwrap());
        });
        group.bench_function(format!("product-rotated/{}", degree.rows()), |bencher| {
            bencher.iter(|| sampler.replace(&weigh(&rotate(black_box(&f), turn(1)), SUM)).unwrap());
        });
    }
    let degree = Degree::new(19).unwrap();
    let mut texels = sampler(&light, degree, ProductMasses::BilinearTexels);
    let coefficients = weigh(&rotate(&lobe(degree), turn(1)), SUM);
    for (threads, pool) in pools() {
        group.bench_function(format!("product-texels/400/{threads}"), |bencher| {
            bencher.iter(|| pool.install(|| texels.replace(black_box(&coefficients)).unwrap()));
        });
    }
    group.bench_function("product-light/400", |bencher| {
        let tables = Tables::new(degree);
        bencher.iter(|| ProductTables::new(&light, &tables));
    });
    group.finish();
}

pub(crate) fn fresh(criterion: &mut Criterion) {
    let degree = Degree::new(19).unwrap();
    let (f, sampler) = (lobe(degree), sampler(&environment(), degree, ProductMasses::Leaves));
    let mut group = criterion.benchmark_group("fresh");
    group.throughput(Throughput::Elements(FRESH as u64)).sample_size(20);
    for every in [16, 64, 256] {
        draw_fresh(
            &mut group,
            "product/",
            every,
            || (sampler.clone(), Expansion::zero(degree)),
            |(sampler, turned), k, (points, directions, densities)| {
                rotate_into(&f, turn(k), turned);
                sampler.replace(&weigh(turned, SUM)).unwrap();
                sampler.sample_into(points, directions, densities);
            },
        );
    }
    group.finish();
}
