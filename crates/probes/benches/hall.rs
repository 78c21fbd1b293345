//! Probes in a hall of 260,000 triangles, as large and as tessellated as Sponza: two storeys of arcades
//! around a court that is open to the sky.

#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark may panic")]

use std::f32::consts::{PI, TAU};
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use probes::{
    BakeOptions, Lattice, LitProbes, Material, Part, PlacesParts, ProbePlaces, Repair, Scene, SceneLighting,
    SceneParts, Surfaces, Transport, TransportParts, Volume, bake,
};
use sh::{Degree, Expansion, Stop};
use transfer::RayCaster;

/// A number in [0, 1) for each index.
fn noise(index: usize) -> f32 {
    let mixed = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 40) as f32 / (1 << 24) as f32
}

/// Triangles of a grid of squares over a function of the unit square.
fn grid(counts: [usize; 2], at: impl Fn(f32, f32) -> Vec3) -> Vec<[[f32; 3]; 3]> {
    let corner = |x: usize, y: usize| at(x as f32 / counts[0] as f32, y as f32 / counts[1] as f32).to_array();
    let square = |x: usize, y: usize| {
        let [a, b] = [corner(x, y), corner(x + 1, y)];
        let [c, d] = [corner(x + 1, y + 1), corner(x, y + 1)];
        [[a, b, c], [a, c, d]]
    };
    let squares = (0..counts[1]).flat_map(|y| (0..counts[0]).map(move |x| (x, y)));
    squares.flat_map(|(x, y)| square(x, y)).collect()
}

/// The size of the hall: 30 m long, 14 m wide, 12 m high.
const SIZE: Vec3 = Vec3::new(30.0, 14.0, 12.0);

fn hall() -> Scene {
    let mut parts = SceneParts::default();
    let mut add = |name: &str, material: u32, triangles: Vec<[[f32; 3]; 3]>| {
        parts.material_of.extend(vec![material; triangles.len()]);
        parts.attributes_of.extend(vec![SceneParts::NONE; triangles.len()]);
        parts.parts.push(Part { name: name.into(), triangles: triangles.len() });
        parts.triangles.extend(triangles);
    };
    let Vec3 { x: long, y: wide, z: high } = SIZE;
    // Stones of the floor and the walls are uneven.
    let rough = |x: f32, y: f32| 0.02 * ((37.0 * x).sin() * (53.0 * y).cos());
    add("floor", 0, grid([180, 100], |x, y| Vec3::new(long * x, wide * y, rough(long * x, wide * y))));
    for side in [0.0, 1.0] {
        let wall = |x: f32, z: f32| {
            let at =
                Vec3::new(long * x, wide * side + (1.0 - 2.0 * side) * rough(long * x, high * z), high * z);
            if side == 0.0 { at } else { Vec3::new(long - at.x, at.y, at.z) }
        };
        add("wall", 1, grid([140, 60], |x, z| wall(1.0 - x, z)));
        let end = |y: f32, z: f32| {
            Vec3::new(long * side, if side == 0.0 { wide * y } else { wide * (1.0 - y) }, high * z)
        };
        add("end", 1, grid([60, 60], end));
        // The floors of the galleries and the roofs above them, seen from both sides.
        for height in [6.0, high] {
            let gallery = |x: f32, y: f32| Vec3::new(long * x, (wide - 4.0) * side + 4.0 * y, height);
            add("gallery", 2, grid([120, 20], gallery));
        }
        // Columns with a swelling, and drapes between them.
        for storey in [0.0, 6.0] {
            for column in 0..10 {
                let centre =
                    Vec3::new(1.5 + 3.0 * column as f32, if side == 0.0 { 4.0 } else { wide - 4.0 }, storey);
                let shaft = |angle: f32, z: f32| {
                    let radius = 0.35 + 0.1 * (PI * z).sin() + 0.02 * (12.0 * TAU * angle).cos();
                    let (sine, cosine) = (TAU * angle).sin_cos();
                    centre + Vec3::new(radius * cosine, radius * sine, 6.0 * z)
                };
                add("column", 2, grid([48, 48], shaft));
                let drape = |x: f32, z: f32| {
                    centre + Vec3::new(0.5 + 2.0 * x, 0.15 * (30.0 * x).sin() * (1.0 - z), 3.0 + 2.8 * z)
                };
                if column < 9 && storey == 0.0 {
                    add("drape", 3, grid([40, 20], drape));
                }
            }
        }
    }
    let matte = |name: &str, [red, green, blue]: [f32; 3], is_double_sided: bool| Material {
        name: name.into(),
        base: [red, green, blue, 1.0],
        is_double_sided,
        ..Material::default()
    };
    parts.materials = vec![
        matte("stone", [0.45, 0.42, 0.38], false),
        matte("plaster", [0.6, 0.55, 0.45], true),
        matte("marble", [0.55, 0.52, 0.5], true),
        matte("cloth", [0.5, 0.1, 0.08], true),
    ];
    Scene::new(parts).unwrap()
}

/// 32 x 16 x 16 places in the hall, of which each bench takes some.
fn places(count: usize) -> Vec<[f32; 3]> {
    let place = |k: usize| {
        let cell = Vec3::new((k % 32) as f32 / 32.0, (k / 32 % 16) as f32 / 16.0, (k / 512) as f32 / 16.0);
        ((cell + 0.02) * SIZE).to_array()
    };
    (0..count).map(|k| place(k * 8192 / count)).collect()
}

fn bakes(criterion: &mut Criterion) {
    let scene = hall();
    let triangles = &scene.parts().triangles;
    println!("{} triangles", triangles.len());
    let mut group = criterion.benchmark_group("hall");
    group.sample_size(10).measurement_time(Duration::from_secs(1)).warm_up_time(Duration::from_millis(100));
    group.bench_function("tree", |bencher| bencher.iter(|| Surfaces::new(&scene)));

    // Diffuse rays from surfaces, 100 from each place, on one thread.
    let caster = RayCaster::new(triangles);
    let ray = |k: usize| {
        let [a, b, c] = triangles[(noise(3 * (k / 100)) * triangles.len() as f32) as usize].map(Vec3::from);
        let normal = (b - a).cross(c - a).normalize();
        let (z, angle) = (2.0 * noise(3 * k + 1) - 1.0, TAU * noise(3 * k + 2));
        let around = Vec3::new(angle.cos(), angle.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
        ((a + b + c) / 3.0 + 1e-4 * normal, (normal + 0.999 * around).normalize())
    };
    let rays: Vec<(Vec3, Vec3)> = (0..100_000).map(ray).collect();
    group.throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function("closest_hits", |bencher| {
        bencher.iter(|| rays.iter().filter_map(|(from, way)| caster.closest(*from, *way, |_| true)).count());
    });

    // The cache takes the same time for any number of probes: the difference of two is that of probes alone.
    let surfaces = Surfaces::new(&scene);
    let options = BakeOptions { bounces: Some(3), ..BakeOptions::default() };
    for count in [64, 256] {
        let at = places(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("bake", count), |bencher| {
            bencher.iter(|| bake(&surfaces, &at, &options, Stop::NEVER).unwrap());
        });
    }
    group.finish();
}

fn lit(criterion: &mut Criterion) {
    let positions = places(8192);
    let bounds = [[0.0; 3], SIZE.to_array()];
    let volume = Volume { name: "hall".into(), bounds, counts: [32, 16, 16], lattice: Lattice::Centres };
    let places = ProbePlaces::from_parts(PlacesParts {
        reach: vec![u8::MAX; 256 * positions.len()],
        volumes: vec![volume],
        points: Vec::new(),
        back_share: vec![0.0; positions.len()],
        inside_of: vec![None; positions.len()],
        repairs: vec![Repair::None; positions.len()],
        visible: vec![0; positions.len()],
        positions,
    })
    .unwrap();
    let [degree, sky_degree] = [2, 4].map(|degree| Degree::new(degree).unwrap());
    let count = 8192 * 9 * 25 * 3;
    let transport = Transport::from_parts(TransportParts {
        degree,
        sky_degree,
        channels: 3,
        emitters: 0,
        sky: (0..count).map(|k| if k % 675 < 3 { 1.0 } else { 0.1 * noise(k) }).collect(),
        direct: Vec::new(),
        indirect: Vec::new(),
        paths: vec![4096; 8192],
        errors: vec![0.0; 8192],
    })
    .unwrap();
    let rows = (0..25).map(|row| [1.0 / (1.0 + f64::from(row)), 0.5, 0.25]).collect();
    let sky = Expansion::from_coefficients(sky_degree, rows).unwrap();
    let mut group = criterion.benchmark_group("light");
    group.sample_size(10);
    for is_windowed in [false, true] {
        let lighting = SceneLighting { sky: Some(&sky), is_windowed, ..SceneLighting::default() };
        let name = if is_windowed { "8192_windowed" } else { "8192" };
        group.bench_function(name, |bencher| {
            bencher.iter(|| LitProbes::new(&places, &transport, &lighting).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, bakes, lit);
criterion_main!(benches);
