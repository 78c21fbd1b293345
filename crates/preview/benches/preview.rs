//! The CPU's work for a frame, on all threads. `preview/cpu/local_shrm_512/P` draws a sphere that fills 512 x
//! 512 pixels, shaded by a local SHRM on faces of 64 texels. `preview/cpu/global_update_64/P` evaluates
//! [RH02, eq. 12] at all texels of six such faces, a frame's work for a distant viewer. A frame of
//! [RH02, sec. 7.5] took 33 ms.

#![allow(clippy::disallowed_methods)] // it may compute with std

use std::hint::black_box;
use std::sync::Arc;

use brdf::{BrdfCoefficients, Centre};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use envmap::{Environment, ToneMap};
use glam::Vec3;
use preview::shading::global_shrm::{GlobalShrm, global_update_into};
use preview::{Background, Camera, Cpu, Light, Look, MapSizes, Mode, PointSet, Renderer, Scene, Shot, Show};
use sh::{Degree, Expansion, Stop};
use shrm::Reflection;
use sphere::{LatLong, Rotation};

/// A look with every coefficient of degrees (12, P), under a grey sky.
fn look(p: usize) -> Look {
    let f = 12;
    let degree = |l| Degree::new(l).expect("a supported degree");
    let wave = |row: usize| [0, 1, 2].map(|channel| ((row * 37 + channel * 11) as f64).sin());
    let lighting = Expansion::from_coefficients(degree(f), (0..(f + 1) * (f + 1)).map(wave).collect());
    let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
    for l in 0..=f {
        for p_ in 0..=p {
            for q in 0..=p_.min(l) {
                let place = (l * (p + 1) + p_) * (p + 1) + q;
                rho[place] = wave(place + 1);
            }
        }
    }
    let brdf = BrdfCoefficients::new(Centre::Reflection, degree(f), degree(p), rho);
    let lighting = lighting.expect("(F+1)^2 rows");
    let reflection = Reflection::convolve(&lighting, &brdf.expect("(F+1)(P+1)^2 entries"));
    let grid = LatLong::with_rows(32);
    let sky = Environment::new(grid, vec![[0.5; 3]; grid.len()]).expect("a texel for each place");
    Look::new(Arc::new(Light::new(sky, Some(lighting))), reflection, None, MapSizes::default())
}

fn cpu(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("preview/cpu");
    for p in [2, 5] {
        let mesh = mesh::shape("sphere").expect("a shape");
        let scene = Scene::of(Arc::new(mesh), Arc::new(look(p)));
        let shot = Shot {
            size: [512, 512],
            samples: 1,
            camera: Camera::new(scene.framing()),
            turn: Rotation::IDENTITY,
            show: Show::One(Mode::LocalShrm),
            background: Background::Flat([0.2; 3]),
            exposure: 0.0,
            tone: ToneMap::Filmic,
            light_samples: 0,
            points: PointSet::Even,
        };
        let mut renderer = Cpu::new();
        group.bench_function(BenchmarkId::new("local_shrm_512", p), |bencher| {
            bencher.iter(|| renderer.render(&scene, &shot, Stop::NEVER).expect("a picture"));
        });
    }
    for p in [2, 5] {
        let look = look(p);
        let map = GlobalShrm::new(&look.global().expect("a map")[0]).expect("a cube");
        let mut radiance = vec![[0.0; 3]; map.texels()];
        let view = Vec3::new(0.48, -0.6, 0.64);
        group.bench_function(BenchmarkId::new("global_update_64", p), |bencher| {
            bencher.iter(|| global_update_into(black_box(&map), black_box(view), &mut radiance));
        });
    }
    group.finish();
}

criterion_group!(benches, cpu);
criterion_main!(benches);
