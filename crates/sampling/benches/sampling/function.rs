//! Functions of four degrees, in leaves of three shapes.

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use sampling::{LeafShape, Options, Sampler, Tables};
use sh::Degree;

use super::{COUNT, FRESH, degrees, draw, draw_fresh, sets};

const SHAPES: [(&str, LeafShape); 3] =
    [("flat", LeafShape::Flat), ("bilinear", LeafShape::Bilinear), ("exact", LeafShape::Exact)];

/// A light: a floor and a few soft lamps, positive everywhere.
fn light(degree: Degree, turn: f64) -> Vec<f64> {
    let mut f = vec![0.0; degree.rows()];
    for (theta, phi, sharpness, power) in
        [(0.5, 1.0, 12.0, 1.0), (1.4, 3.0, 6.0, 2.0), (2.5, 5.0, 20.0, 0.5f64)]
    {
        let axis = sphere::Direction::from_angles(theta, phi + turn);
        let zonal =
            |l: usize| [power * (-0.5 * (l * l) as f64 / sharpness).exp() * ((2 * l + 1) as f64).sqrt(); 3];
        let lamp = sh::Expansion::zonal(axis, degree, zonal);
        f.iter_mut().zip(lamp.coefficients()).for_each(|(f, rgb)| *f += rgb[0]);
    }
    f[0] += 1.0;
    f
}

pub(crate) fn sampling(criterion: &mut Criterion) {
    let sets = sets();
    let mut group = criterion.benchmark_group("sampling");
    group.throughput(Throughput::Elements(COUNT as u64)).sample_size(20);
    for (shape_name, shape) in SHAPES {
        for degree in degrees() {
            let options = Options { shape, ..Options::default() };
            let sampler = Sampler::new(&Tables::new(degree), &light(degree, 0.0), options).unwrap();
            for (set_name, points) in &sets {
                let name = format!("{shape_name}/{}/{set_name}", degree.rows());
                draw(&mut group, &name, points, |points, directions, densities| {
                    sampler.sample_into(points, directions, densities);
                });
            }
        }
    }
    group.finish();
}

pub(crate) fn build(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build");
    for (name, shape) in SHAPES {
        for degree in degrees() {
            let f = light(degree, 0.0);
            let mut sampler =
                Sampler::new(&Tables::new(degree), &f, Options { shape, ..Options::default() }).unwrap();
            group.bench_function(format!("{name}/{}", degree.rows()), |bencher| {
                bencher.iter(|| sampler.replace(black_box(&f)).unwrap());
            });
        }
    }
    group.finish();
}

pub(crate) fn fresh(criterion: &mut Criterion) {
    let degree = Degree::new(19).unwrap();
    let functions: Vec<Vec<f64>> = (0..64).map(|k| light(degree, f64::from(k) * 0.1)).collect();
    let sampler = Sampler::new(&Tables::new(degree), &functions[0], Options::default()).unwrap();
    let mut group = criterion.benchmark_group("fresh");
    group.throughput(Throughput::Elements(FRESH as u64)).sample_size(20);
    for every in [16, 64, 256] {
        draw_fresh(
            &mut group,
            "",
            every,
            || sampler.clone(),
            |sampler, k, (points, directions, densities)| {
                sampler.replace(&functions[k % functions.len()]).unwrap();
                sampler.sample_into(points, directions, densities);
            },
        );
    }
    group.finish();
}
