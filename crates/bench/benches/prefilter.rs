//! `prefilter`: a prefiltered cube of 256^2 and six levels from a 1k HDR on two threads, whole and in its
//! steps; `babylon-whole` has the nine levels of Babylon.js. `sharp-series` and `sharp-quadrature` are one
//! level that needs degree 539, of an image whose own is 511. The folder of environments is named by
//! `SPECULA_CORPUS`; without it nothing runs.

use criterion::{Criterion, criterion_group, criterion_main};
use envmap::{Environment, Layout};
use sh::{Degree, Stop, Transform};
use shrm::{Distribution, MethodChoice, PrefilterKernel, prefilter, prefilter_series};
use sphere::Cube;

/// The roughness of each level in three.js: 1 - sqrt(1 - l / 5).
fn roughness() -> Vec<f64> {
    (0..6).map(|level| 1.0 - (1.0 - f64::from(level) / 5.0).sqrt()).collect()
}

fn read(bytes: &[u8]) -> Environment {
    let image = containers::read_image(bytes, &containers::ReadOptions::default()).expect("an image");
    Environment::from_image(image.image, Layout::LatLong, None).expect("an environment")
}

fn benches_of(criterion: &mut Criterion) {
    let Some(corpus) = test_data::folder("prefilter", "SPECULA_CORPUS") else { return };
    let bytes = std::fs::read(corpus.join("env/cc0/sunrise.hdr")).expect("the environment");
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().expect("the first use of threads");
    let mut group = criterion.benchmark_group("prefilter");
    group.sample_size(20);
    let roughness = roughness();
    let environment = read(&bytes);
    group.bench_function("whole", |bencher| {
        bencher.iter(|| {
            let environment = read(&bytes);
            prefilter(&environment, None, Distribution::Ggx, &roughness, 256, MethodChoice::Auto, Stop::NEVER)
                .expect("levels")
        });
    });
    group.bench_function("read", |bencher| bencher.iter(|| read(&bytes)));
    group.bench_function("mirror", |bencher| bencher.iter(|| environment.cube_map(Cube { edge: 256 })));
    let kernel = |level: usize| PrefilterKernel::new(Distribution::Ggx, roughness[level]).expect("a kernel");
    let degree = Degree::new(kernel(1).degree()).expect("a degree");
    group.bench_function("series", |bencher| {
        bencher.iter(|| {
            let transform = Transform::new(environment.grid(), degree).expect("a transform");
            transform.analyse(environment.pixels())
        });
    });
    let transform = Transform::new(environment.grid(), degree).expect("a transform");
    let series = transform.analyse(environment.pixels());
    for level in 1..6 {
        let cube = Cube { edge: 256 >> level };
        group.bench_function(format!("level{level}"), |bencher| {
            bencher.iter(|| prefilter_series(&series, &kernel(level), cube).expect("texels"));
        });
    }
    // The second level of Babylon.js, sharper than the image's own degree.
    let sharp = (1.25_f64.exp2() / 256.0).sqrt();
    for (name, choice) in
        [("sharp-series", MethodChoice::Series), ("sharp-quadrature", MethodChoice::Quadrature)]
    {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                prefilter(&environment, None, Distribution::Ggx, &[sharp], 128, choice, Stop::NEVER)
                    .expect("a level")
            });
        });
    }
    let babylon: Vec<f64> = std::iter::once(0.0)
        .chain((1..9).map(|level| ((f64::from(level) / 0.8).exp2().min(256.0) / 256.0).sqrt()))
        .collect();
    group.bench_function("babylon-whole", |bencher| {
        bencher.iter(|| {
            let environment = read(&bytes);
            prefilter(&environment, None, Distribution::Ggx, &babylon, 256, MethodChoice::Auto, Stop::NEVER)
                .expect("levels")
        });
    });
    group.finish();
}

criterion_group!(benches, benches_of);
criterion_main!(benches);
