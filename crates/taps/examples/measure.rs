//! Measures taps against sums over pixels.
use std::time::Instant;

use brdf::{Fresnel, Ggx, Material, Microfacet, Part};
use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use rayon::prelude::*;
use sh::Stop;
use sphere::{DVec3, Direction, LatLong};
use taps::{Fitted, ScaleSpace, Widths, fit};

fn load(name: &str) -> Environment {
    let path = format!("{}/env/cc0/{name}.hdr", std::env::var("SPECULA_CORPUS").unwrap());
    let image = read_image(&std::fs::read(path).unwrap(), &ReadOptions::default()).unwrap().image;
    Environment::from_image(image, Layout::LatLong, None).unwrap()
}

struct Rng(u64);
impl Rng {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

struct View {
    n: Direction,
    v: Direction,
    theta: f64,
}

fn views(count: usize) -> Vec<View> {
    let mut rng = Rng(88172645463325252);
    (0..count)
        .map(|_| {
            let z = 2.0 * rng.next() - 1.0;
            let phi = 6.283185307179586 * rng.next();
            let s = (1.0 - z * z as f64).sqrt();
            let r = DVec3::new(s * phi.cos(), s * phi.sin(), z);
            let sin2 = rng.next();
            let theta = sin2.sqrt().asin();
            let (u, w) = r.any_orthonormal_pair();
            let a = 6.283185307179586 * rng.next();
            let t = u * a.cos() + w * a.sin();
            let n = r * theta.cos() + t * theta.sin();
            let v = 2.0 * n.dot(r) * n - r;
            View { n: Direction::normalised(n), v: Direction::normalised(v), theta }
        })
        .collect()
}

/// Direction and flux.
fn pixels(environment: &Environment) -> Vec<(DVec3, [f64; 3])> {
    let mean = environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
    let mut list = Vec::new();
    let fine = environment.downsampled(LatLong::with_rows(256)).unwrap();
    let bright = |e: &Environment, i: usize| {
        e.pixels()[i].iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0 > 6.0 * mean
    };
    let mut rest = fine.pixels().to_vec();
    for i in 0..fine.grid().len() {
        let (row, column) = (i / 512, i % 512);
        if bright(&fine, i) {
            let w = fine.grid().solid_angle(row);
            list.push((
                fine.grid().direction(row, column).vector(),
                fine.pixels()[i].map(|v| f64::from(v) * w),
            ));
            rest[i] = [0.0; 3];
        }
    }
    for row in 0..128 {
        for column in 0..256 {
            let mut flux = [0.0; 3];
            for (dr, dc) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let i = (2 * row + dr) * 512 + 2 * column + dc;
                let w = fine.grid().solid_angle(2 * row + dr);
                (0..3).for_each(|c| flux[c] += f64::from(rest[i][c]) * w);
            }
            let grid = LatLong::with_rows(128);
            list.push((grid.direction(row, column).vector(), flux));
        }
    }
    list
}

/// Rows of a surface frame with the view in its xz plane.
fn frame(n: DVec3, v: DVec3) -> [DVec3; 3] {
    let x = (v - n.dot(v) * n).try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
    [x, n.cross(x), n]
}

fn reflect(material: &Material, n: DVec3, v: DVec3, lights: &[(DVec3, [f64; 3])]) -> [f64; 3] {
    let [x, y, z] = frame(n, v);
    let local = |d: DVec3| Direction::from_unit(DVec3::new(d.dot(x), d.dot(y), d.dot(z)));
    let out = local(v);
    let mut sum = [0.0; 3];
    for (d, flux) in lights {
        if d.dot(z) <= 0.0 {
            continue;
        }
        let rho = material.rho_hat(local(*d), out);
        (0..3).for_each(|c| sum[c] += rho[c] * flux[c]);
    }
    sum
}

fn material(name: &str) -> Material {
    let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
    let (kind, value) = name.split_at(name.find(|c: char| c.is_ascii_digit()).unwrap());
    let x: f64 = value.parse().unwrap();
    match kind {
        "mf" => Material::Microfacet(Microfacet::new(x, [1.0; 3]).unwrap()),
        "ggx" => Material::Ggx(Ggx::new(x, copper, [1.0; 3]).unwrap()),
        "gloss" => Material::Ggx(Ggx::new(x, Fresnel::Dielectric(1.5), [1.0; 3]).unwrap()),
        _ => panic!(),
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let edge: usize = args[0].parse().unwrap();
    let envs: Vec<&str> = args[1].split(',').collect();
    let materials: Vec<&str> = args[2].split(',').collect();
    let taps: Vec<usize> = args[3].split(',').map(|x| x.parse().unwrap()).collect();
    let counts: Vec<usize> = args[4].split(',').map(|x| x.parse().unwrap()).collect();
    let widths = Widths::new(edge).unwrap();
    let views = views(3000);
    let _ = Part::Specular;
    let tables: Vec<_> = materials
        .iter()
        .flat_map(|m| taps.iter().map(move |j| (*m, *j)))
        .map(|(m, j)| {
            let start = Instant::now();
            let Fitted { table, rms: cost } = fit(&material(m), j, widths, Stop::NEVER).unwrap();
            println!("fit {m} J={j}: {:.0} ms, rms {cost:.4}", start.elapsed().as_secs_f64() * 1e3);
            if std::env::var("SHOW").is_ok() {
                for row in [0, 8, 16, 24, 32, 40, 48, 56, 60, 62, 64] {
                    let text: Vec<String> = table.rows()[row]
                        .taps
                        .iter()
                        .map(|t| {
                            format!(
                                "{:6.1} {:5.1} {:.3}",
                                t.delta.to_degrees(),
                                t.std.to_degrees(),
                                t.weight[0]
                            )
                        })
                        .collect();
                    println!("   {row:2}: {}", text.join(" | "));
                }
            }
            (m, j, table)
        })
        .collect();
    if counts.contains(&1000) {
        return;
    }
    for env in envs {
        let environment = load(env);
        let mean = environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
        let separated = environment.separate_lamps(Stop::NEVER).unwrap();
        let list = pixels(&environment);
        println!("{env}: {} lamps, mean {mean:.3}", separated.lights.len());
        for count in &counts {
            let kept = &separated.lights[..(*count).min(separated.lights.len())];
            let start = Instant::now();
            let space = ScaleSpace::new(&environment, kept, widths, Stop::NEVER).unwrap();
            let took = start.elapsed().as_secs_f64() * 1e3;
            for m in &materials {
                let mat = material(m);
                let path = format!("/tmp/truth-{env}-{m}.bin");
                let truth: Vec<[f64; 3]> = match std::fs::read(&path) {
                    Ok(bytes) => bytes
                        .chunks_exact(24)
                        .map(|c| {
                            std::array::from_fn(|i| {
                                f64::from_le_bytes(c[8 * i..8 * i + 8].try_into().unwrap())
                            })
                        })
                        .collect(),
                    Err(_) => {
                        let truth: Vec<[f64; 3]> = views
                            .par_iter()
                            .map(|view| reflect(&mat, view.n.vector(), view.v.vector(), &list))
                            .collect();
                        let bytes: Vec<u8> = truth.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
                        std::fs::write(&path, bytes).unwrap();
                        truth
                    }
                };
                let points: Vec<(DVec3, [f64; 3])> = kept
                    .iter()
                    .flat_map(|light| {
                        let flux = light.flux();
                        let points = light.points(mat.highlight_width());
                        points
                            .into_iter()
                            .map(move |(d, share)| (d.vector(), flux.map(|f| f * share)))
                            .collect::<Vec<_>>()
                    })
                    .collect();
                for (_, j, table) in tables.iter().filter(|t| t.0 == *m) {
                    let mut bands: [Vec<f64>; 5] = Default::default();
                    let got: Vec<[f64; 3]> = views
                        .par_iter()
                        .map(|view| {
                            let a = table.radiance(&space, view.n, view.v);
                            let b = reflect(&mat, view.n.vector(), view.v.vector(), &points);
                            std::array::from_fn(|c| a[c] + b[c])
                        })
                        .collect();
                    for ((view, got), truth) in views.iter().zip(&got).zip(&truth) {
                        let e = 0.01 * mean;
                        for c in 0..3 {
                            let stops = ((got[c] + e) / (truth[c] + e)).log2().abs();
                            bands[0].push(stops);
                            let band = match view.theta.to_degrees() {
                                t if t < 45.0 => 1,
                                t if t < 60.0 => 2,
                                t if t < 75.0 => 3,
                                _ => 4,
                            };
                            bands[band].push(stops);
                        }
                    }
                    let text: Vec<String> = bands
                        .iter_mut()
                        .map(|band| {
                            band.sort_by(f64::total_cmp);
                            let at = |q: f64| band[(q * band.len() as f64) as usize];
                            format!("{:.3}/{:.3}", at(0.95), at(0.99))
                        })
                        .collect();
                    println!(
                        "{env:10} {count:2} lights ({} points) {m:8} J={j}: {}   [M {took:.0} ms]",
                        points.len(),
                        text.join("  ")
                    );
                }
            }
        }
    }
}
