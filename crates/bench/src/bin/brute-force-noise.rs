//! The noise of brute force with samples of the product of light and material, and without them, on the CPU
//! and on this machine's graphics device, printed as tables.
//!
//! `cargo run --release -p bench --features gpu --bin brute-force-noise -- [--size N] [ENVIRONMENT...]`
//!
//! Each table is of a sphere of one metal under one environment, in N x N pixels (64): the sample assets'
//! studio, and those of the lat-long files. Noise is the root mean square error over the sphere, relative
//! to that of the picture itself; the truth has 32,768 even points a pixel. A time is the median of three
//! pictures, after one that makes what all share, each from a direction of its own, so that it includes the
//! tables of a view. The last column is noise squared times time without the product over that with it.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use bench::frames::{Times, studio};
use brdf::{Choice, Fresnel, Ggx, Material, project};
use envmap::{Environment, Layout, ToneMap};
use preview::{
    Background, Camera, Cpu, Gpu, Light, Look, MapSizes, Mode, Picture, PointSet, Renderer, Scene, Shot, Show,
};
use sh::{Degree, Stop};
use shrm::Reflection;
use sphere::Rotation;

/// The light samples of a pixel in the rows of a table.
const COUNTS: [u32; 3] = [256, 1024, 4096];

/// The light samples of the truth.
const TRUTH: u32 = 1 << 15;

/// The pictures that are timed, after one that makes what pictures share.
const PICTURES: usize = 3;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1).peekable();
    let size = match arguments.next_if(|argument| argument == "--size") {
        Some(_) => arguments.next().ok_or("--size wants a number")?.parse()?,
        None => 64,
    };
    let mut lights = vec![("studio".to_owned(), studio()?)];
    for file in arguments {
        let bytes = std::fs::read(&file).map_err(|error| format!("{file}: {error}"))?;
        let image = containers::read_image(&bytes, &containers::ReadOptions::default())?.image;
        let light = Light::new(Environment::from_image(image, Layout::LatLong, None)?, None);
        let name = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        lights.push((name, Arc::new(light)));
    }
    let mut renderers: Vec<Box<dyn Renderer>> = vec![Box::new(Cpu::new())];
    match Gpu::new() {
        Ok(gpu) => renderers.push(Box::new(gpu)),
        Err(error) => println!("no graphics device: {error}"),
    }
    let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    let metals = [
        ("gold of roughness 0.45", Ggx::new(0.45, gold, [1.0; 3])?),
        ("brushed gold, 0.4 by 0.8", Ggx::stretched([0.4, 0.8], gold, [1.0; 3])?),
    ];
    for (name, metal) in metals {
        let metal = Material::Ggx(metal);
        let choice = Choice::Degree { f: Degree::new(19)?, p: Degree::new(16)? };
        let coefficients = project(&metal, choice, Stop::NEVER)?.coefficients;
        for (environment, light) in &lights {
            let reflection = Reflection::convolve(light.lighting(), &coefficients);
            let sizes = MapSizes::default();
            let with = Look::new(Arc::clone(light), reflection, Some(metal.clone()), sizes);
            let without = Look::without_maps(Arc::clone(light), metal.clone(), sizes);
            let ball = Arc::new(mesh::shape("sphere").ok_or("a sphere")?);
            let [with, without] = [with, without].map(|look| Scene::of(Arc::clone(&ball), Arc::new(look)));
            println!("{name}, {environment}, {size} x {size} pixels");
            table(&mut renderers, size, &with, &without)?;
        }
    }
    Ok(())
}

fn table(
    renderers: &mut [Box<dyn Renderer>],
    size: u32,
    with: &Scene,
    without: &Scene,
) -> Result<(), Failure> {
    let shot = |points, light_samples, yaw: f64| {
        let camera = Camera::new(with.framing());
        Shot {
            size: [size, size],
            samples: 1,
            camera: Camera { yaw: camera.yaw + yaw, ..camera },
            turn: Rotation::IDENTITY,
            show: Show::One(Mode::BruteForce),
            background: Background::Environment,
            exposure: 0.0,
            tone: ToneMap::Filmic,
            light_samples,
            points,
        }
    };
    let truth = Cpu::new().render(with, &shot(PointSet::Even, TRUTH, 0.0), Stop::NEVER)?;
    for renderer in renderers {
        println!("  {}", renderer.name());
        for points in PointSet::ALL {
            for count in COUNTS {
                let mut of = |scene: &Scene| -> Result<[f64; 2], Failure> {
                    let picture = renderer.render(scene, &shot(points, count, 0.0), Stop::NEVER)?;
                    let mut times = Vec::new();
                    for turn in 1..=PICTURES {
                        let shot = shot(points, count, 1e-3 * turn as f64);
                        let start = Instant::now();
                        renderer.render(scene, &shot, Stop::NEVER)?;
                        times.push(start.elapsed());
                    }
                    Ok([noise(&picture, &truth), Times::new(times).percentile(0.5)])
                };
                let ([noise, time], [more, less]) = (of(with)?, of(without)?);
                println!(
                    "  {points:>8?} {count:>6}: noise {:6.2} % {:6.2} %, seconds {time:8.4} {less:8.4}, {:6.2}",
                    100.0 * noise,
                    100.0 * more,
                    more * more * less / (noise * noise * time),
                );
            }
        }
    }
    Ok(())
}

/// The error over the pixels that show the sphere alone, relative to the truth.
fn noise(picture: &Picture, truth: &Picture) -> f64 {
    let (mut error, mut whole) = (0.0, 0.0);
    for (found, expected) in picture.radiance.iter().zip(&truth.radiance) {
        if found[3] == 1.0 && expected[3] == 1.0 {
            for channel in 0..3 {
                error += f64::from(found[channel] - expected[channel]).powi(2);
                whole += f64::from(expected[channel]).powi(2);
            }
        }
    }
    f64::sqrt(error / whole)
}
