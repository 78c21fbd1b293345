//! `shrm/GRID/F_P`: a local reflection map, all (P+1)^2 coefficients, from coefficients to texels in f32.

use brdf::{BrdfCoefficients, Centre};
use criterion::{Criterion, criterion_group, criterion_main};
use sh::{Degree, Expansion, Stop};
use shrm::{MapGrid, Reflection, View};
use sphere::{Cube, LatLong};

/// Coefficients of size 1 with every q.
fn reflection(f: usize, p: usize) -> Reflection {
    let degree = |l| Degree::new(l).expect("a supported degree");
    let wave = |row: usize| [0, 1, 2].map(|channel| ((row * 37 + channel * 11) as f64).sin());
    let sky = Expansion::from_coefficients(degree(f), (0..(f + 1) * (f + 1)).map(wave).collect());
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
    Reflection::convolve(&sky.expect("(F+1)^2 rows"), &brdf.expect("(F+1)(P+1)^2 entries"))
}

fn shrm(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("shrm");
    for (name, grid, f, p) in [
        ("cube_64", MapGrid::Cube(Cube { edge: 64 }), 12, 2),
        ("cube_128", MapGrid::Cube(Cube { edge: 128 }), 30, 5),
        ("cube_32", MapGrid::Cube(Cube { edge: 32 }), 50, 16),
        ("cube_64", MapGrid::Cube(Cube { edge: 64 }), 120, 16),
        ("lat_long_64", MapGrid::LatLong(LatLong::with_rows(64)), 12, 2),
        ("lat_long_128", MapGrid::LatLong(LatLong::with_rows(128)), 23, 2),
    ] {
        let reflection = reflection(f, p);
        group.bench_function(format!("{name}/{f}_{p}"), |bencher| {
            bencher.iter(|| reflection.synthesise(grid, View::Local, Stop::NEVER).expect("a map"));
        });
    }
    let reflection = reflection(12, 2);
    let map =
        reflection.synthesise(MapGrid::Cube(Cube { edge: 64 }), View::Local, Stop::NEVER).expect("a map");
    group.bench_function("to_global/cube_64/2", |bencher| bencher.iter(|| map.to_global()));
    group.finish();
}

criterion_group!(benches, shrm);
criterion_main!(benches);
