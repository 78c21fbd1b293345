//! `bc6h`: what a cube of 256^2 in BC6H costs on one thread, with the light of each block kept and with the
//! nearest texels: 0.39 million texels of a photograph. The folder of environments is named by
//! `SPECULA_CORPUS`; without it nothing runs.

use containers::{ReadOptions, TexelFormat, Texture, read_image, write_dds};
use criterion::{Criterion, criterion_group, criterion_main};
use envmap::{Environment, Layout};
use sphere::Cube;

fn benches_of(criterion: &mut Criterion) {
    let Some(corpus) = test_data::folder("bc6h", "SPECULA_CORPUS") else { return };
    let bytes = std::fs::read(corpus.join("env/cc0/studio.hdr")).expect("the environment");
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first use of threads");
    let image = read_image(&bytes, &ReadOptions::default()).expect("an image").image;
    let environment = Environment::from_image(image, Layout::LatLong, None).expect("an environment");
    let edge = 256;
    let pixels = environment.cube_map(Cube { edge }).expect("a cube").pixels().to_vec();
    let texture = Texture { width: edge, height: edge, faces: 6, pixels, ..Texture::default() };
    let mut group = criterion.benchmark_group("bc6h");
    group.sample_size(10);
    for (name, texels) in [("light", TexelFormat::Bc6h.into()), ("nearest", TexelFormat::Bc6h.nearest())] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| write_dds(&texture, texels).expect("a file"));
        });
    }
    group.finish();
}

criterion_group!(benches, benches_of);
criterion_main!(benches);
