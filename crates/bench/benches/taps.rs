//! `taps`: what an edit of the light and an edit of a material cost a compact map, on two threads: the scale
//! space of a 1k HDR, whole and without reading the file, and the fit of materials. The folder of
//! environments is named by `SPECULA_CORPUS`; without it nothing runs.

use brdf::{Fresnel, Ggx, Material, Microfacet};
use criterion::{Criterion, criterion_group, criterion_main};
use envmap::{Environment, Layout};
use sh::Stop;
use taps::{LightPoints, ScaleSpace, Truth, Widths, fit, fit_each};

fn read(bytes: &[u8]) -> Environment {
    let image = containers::read_image(bytes, &containers::ReadOptions::default()).expect("an image");
    Environment::from_image(image.image, Layout::LatLong, None).expect("an environment")
}

fn benches_of(criterion: &mut Criterion) {
    let Some(corpus) = test_data::folder("taps", "SPECULA_CORPUS") else { return };
    let bytes = std::fs::read(corpus.join("env/cc0/studio.hdr")).expect("the environment");
    rayon::ThreadPoolBuilder::new().num_threads(2).build_global().expect("the first use of threads");
    let mut group = criterion.benchmark_group("taps");
    group.sample_size(20);
    let widths = Widths::new(64).expect("a power of two");
    let space = |environment: &Environment, count: usize| {
        let lamps = environment.separate_lamps(Stop::NEVER).expect("not stopped").lights;
        let kept = &lamps[..lamps.len().min(count)];
        ScaleSpace::new(environment, kept, widths, Stop::NEVER).expect("a scale space")
    };
    group.bench_function("photograph", |bencher| bencher.iter(|| space(&read(&bytes), 8)));
    let environment = read(&bytes);
    group.bench_function("scale-space", |bencher| bencher.iter(|| space(&environment, 8)));
    group.bench_function("scale-space/no-lights", |bencher| {
        bencher.iter(|| ScaleSpace::new(&environment, &[], widths, Stop::NEVER).expect("a scale space"));
    });
    let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
    let copper = Material::Ggx(Ggx::new(0.3, copper, [1.0; 3]).expect("a material"));
    let microfacet = Material::Microfacet(Microfacet::new(0.2, [1.0; 3]).expect("a material"));
    for (name, material, taps) in [("copper", &copper, 6), ("microfacet", &microfacet, 4)] {
        group.bench_function(format!("fit/{name}/{taps}"), |bencher| {
            bencher.iter(|| fit(material, taps, widths, Stop::NEVER).expect("taps"));
        });
    }
    group.sample_size(10);
    group.bench_function("fit/copper/each", |bencher| {
        bencher.iter(|| fit_each(&copper, widths, Stop::NEVER).expect("taps"));
    });
    // What the choice of taps and lights costs a pair.
    let points = LightPoints::new(&environment).expect("points");
    group.bench_function("truth/copper", |bencher| {
        bencher.iter(|| Truth::new(&points, &copper, 2000, Stop::NEVER).expect("sums"));
    });
    let truth = Truth::new(&points, &copper, 2000, Stop::NEVER).expect("sums");
    let fits = fit_each(&copper, widths, Stop::NEVER).expect("taps");
    let tables: Vec<_> = fits.iter().map(|fitted| &fitted.table).collect();
    let space = space(&environment, 8);
    let counts: Vec<usize> = (0..=space.lights().len()).collect();
    group.bench_function("trade/copper", |bencher| {
        bencher.iter(|| truth.trade(&tables, &counts, &space, &copper, Stop::NEVER).expect("errors"));
    });
    group.finish();
}

criterion_group!(benches, benches_of);
criterion_main!(benches);
