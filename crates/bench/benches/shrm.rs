//! `shrm/GRID/F_P`: a local reflection map, all (P+1)^2 coefficients, from coefficients to texels in f32.
//! `baked/GRID/P`: 37 lamps put into such a map, and `baked/map_degree`: the choice of its degree P.

use brdf::{BrdfCoefficients, Centre, Material, Standard, StandardParameters};
use criterion::{Criterion, criterion_group, criterion_main};
use sh::{Degree, Expansion, Light, Stop};
use shrm::{DegreeRule, LampTables, Lamps, MapContent, MapGrid, MapTolerance, Reflection, Terms, View};
use sphere::{Cube, Direction, LatLong};

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

/// Two soft boxes of a studio, each as many small lamps, over a field of degrees 50 and 16.
fn baked(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("baked");
    group.sample_size(10);
    let gold = StandardParameters {
        base_color: [1.0, 0.77, 0.34],
        metallic: 1.0,
        roughness: 0.3,
        ..StandardParameters::default()
    };
    let material = Material::Standard(Standard::new(gold).expect("parameters in their ranges"));
    let lamp = |k: usize| {
        let (across, along) = ((k / 2 % 6) as f64, (k / 12) as f64);
        let [theta, phi] = if k.is_multiple_of(2) { [0.8, 1.6] } else { [1.6, -1.1] };
        let direction = Direction::from_angles(theta + 0.03 * across, phi + 0.04 * along);
        Light::from_flux(direction, 0.015 + 0.0003 * k as f64, [0.3, 0.32, 0.35])
    };
    let lamps = Lamps { lights: (0..37).map(lamp).collect(), material };
    let reflection = reflection(50, 16).with_lamps(lamps);
    let grid = MapGrid::Cube(Cube { edge: 32 });
    let soft = reflection.synthesise(grid, View::Local, Stop::NEVER).expect("a map");
    let texels: Vec<usize> = (0..grid.len()).collect();
    let p = Degree::new(4).expect("a supported degree");
    group.bench_function("cube_32/4", |bencher| {
        bencher.iter(|| {
            reflection.bake_texels(&soft, p, &texels, &mut LampTables::default(), Stop::NEVER).expect("a map")
        });
    });
    let rule = DegreeRule { tolerance: MapTolerance::Stops([0.15, 0.4]), most_p: p.get(), terms: Terms::All };
    let content = MapContent { lamps: true, base: None };
    group.bench_function("map_degree", |bencher| {
        bencher.iter(|| {
            reflection.map_degree(content, rule, &mut LampTables::default(), Stop::NEVER).expect("a degree")
        });
    });
    group.finish();
}

criterion_group!(benches, shrm, baked);
criterion_main!(benches);
