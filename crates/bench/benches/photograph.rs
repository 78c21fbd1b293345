//! `photograph`: what a photograph of 2048 x 1024 pixels costs on all threads, from the bytes of its file to
//! the artifact of its environment, and from there to spherical harmonics. It is made here, with noise.

use containers::{Precision, ReadOptions, read_image, tensors, write_exr, write_rgbe};
use criterion::{Criterion, criterion_group, criterion_main};
use envmap::{Environment, Image, Layout};
use sh::{Degree, Stop, Transform};

const ROWS: usize = 1024;

/// Gradients under noise of about one percent.
fn picture() -> Image {
    let mut state = 1_u64;
    let mut noise = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let pixel = |index: usize| {
        let (x, y) = ((index % (2 * ROWS)) as f64, (index / (2 * ROWS)) as f64);
        let wave = ((x % 900.0 / 450.0 - 1.0).abs() + (y % 500.0 / 250.0 - 1.0).abs()) as f32;
        [1.0, 0.8, 0.6].map(|colour| colour * (0.1 + wave) * (1.0 + 0.02 * noise()))
    };
    Image::new(2 * ROWS, ROWS, (0..2 * ROWS * ROWS).map(pixel).collect()).expect("all pixels")
}

fn environment(bytes: &[u8]) -> Environment {
    let image = read_image(bytes, &ReadOptions::default()).expect("an image").image;
    Environment::from_image(image, Layout::LatLong, None).expect("an environment")
}

fn benches_of(criterion: &mut Criterion) {
    let picture = picture();
    let exr = write_exr(&picture, Precision::Half, None).expect("an OpenEXR file").bytes;
    let hdr = write_rgbe(&picture, None).expect("a Radiance file").bytes;
    let mut group = criterion.benchmark_group("photograph");
    group.sample_size(10);
    for (name, bytes) in [("import-exr", &exr), ("import-hdr", &hdr)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| tensors::encode_environment_rows(&environment(bytes)));
        });
    }
    let environment = environment(&exr);
    let degree = Degree::new(255).expect("a degree");
    let transform = Transform::new(environment.grid(), degree).expect("a transform");
    group.bench_function("lamps", |bencher| {
        bencher.iter(|| environment.separate_lamps(Stop::NEVER));
    });
    group.bench_function("project", |bencher| {
        bencher.iter(|| transform.analyse_rows(&environment, Stop::NEVER));
    });
    group.finish();
}

criterion_group!(benches, benches_of);
criterion_main!(benches);
