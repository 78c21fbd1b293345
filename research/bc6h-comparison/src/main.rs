//! Prints how near the blocks of BC6H are to the texels, and how fast they are made, beside those of Intel's
//! ISPC texture compressor with its profile `slow`: the table of docs/engines.md.
//!
//! `cargo run --release --manifest-path research/Cargo.toml -p bc6h-comparison`, with `SPECULA_CORPUS` set to
//! the folder of the corpus; on Linux, whose clock of a thread it reads. Its ten cubes are each photograph
//! itself, and prefiltered. For each cube the encoders run in turn on one thread, three times, of which the
//! fastest counts. The compressor is given halves; the other encoder makes them itself, in its time.

use std::fs;
use std::path::PathBuf;

use containers::{ReadOptions, TexelEncoding, TexelFormat, Texture, read_dds, read_image, write_dds};
use envmap::{Environment, Layout};
use half::f16;
use intel_tex_2::{RgbaSurface, bc6h};
use sh::Stop;
use shrm::{Distribution, MethodChoice, prefilter};
use sphere::Cube;

type Failure = Box<dyn std::error::Error>;

const ENVIRONMENTS: [&str; 5] = ["apartment", "forest", "night", "studio", "sunrise"];

const ROUGHNESS: f64 = 0.3;
const ROUGH_EDGE: usize = 256;
const SHARP_EDGE: usize = 512;

const FACES: usize = 6;

const ROUNDS: usize = 3;

/// The range of halves in stops, which the error is a share of.
const STOPS: f64 = 30.0;

/// The least normal half: what is below counts as it.
const LEAST_NORMAL_HALF: f32 = 6.103_515_6e-5;

/// The greatest half: what is above counts as it.
const GREATEST_HALF: f32 = 65504.0;

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    let corpus = std::env::var_os("SPECULA_CORPUS").map(PathBuf::from);
    let corpus = corpus.ok_or("SPECULA_CORPUS is unset: expected the folder of the corpus")?;
    println!(
        "| cube | engines, dB | Mpix/s | light | nearest, dB | Mpix/s | ISPC slow, dB | Mpix/s | light |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut rows = Vec::new();
    for name in ENVIRONMENTS {
        let bytes = fs::read(corpus.join(format!("env/cc0/{name}.hdr")))?;
        let image = read_image(&bytes, &ReadOptions::default())?.image;
        let environment = Environment::from_image(image, Layout::LatLong, None)?;
        for (kind, texture) in [("rough", rough(&environment)?), ("sharp", sharp(&environment)?)] {
            let [engines, nearest, ispc] = measure(&texture)?;
            println!(
                "| {name}, {kind} | {} | {} | {} | {} | {} |",
                engines.text(),
                engines.light(),
                nearest.text(),
                ispc.text(),
                ispc.light(),
            );
            rows.push([engines, nearest, ispc]);
        }
    }
    let [engines, nearest, ispc] = [0, 1, 2].map(|encoder| mean(&rows, encoder).text());
    println!("| all | {engines} | | {nearest} | {ispc} | |");
    Ok(())
}

/// The photograph itself.
fn sharp(environment: &Environment) -> Result<Texture, Failure> {
    Ok(cube(SHARP_EDGE, environment.cube_map(Cube { edge: SHARP_EDGE })?.pixels()))
}

/// The photograph as a rough surface reflects it.
fn rough(environment: &Environment) -> Result<Texture, Failure> {
    let (ggx, auto) = (Distribution::Ggx, MethodChoice::Auto);
    let made = prefilter(environment, None, ggx, &[ROUGHNESS], ROUGH_EDGE, auto, Stop::NEVER)?;
    Ok(cube(ROUGH_EDGE, made.levels[0].map.pixels()))
}

fn cube(edge: usize, pixels: &[[f32; 3]]) -> Texture {
    Texture { width: edge, height: edge, faces: FACES, pixels: pixels.to_vec(), ..Texture::default() }
}

/// What is seen of an encoder.
#[derive(Clone, Copy)]
struct Seen {
    decibels: f64,
    /// Millions of texels in a second.
    speed: f64,
    /// The change of the sum of all values, as a share.
    light: f64,
}

impl Seen {
    fn text(&self) -> String {
        format!("{:.2} | {:.2}", self.decibels, self.speed)
    }

    fn light(&self) -> String {
        // No -0.000.
        format!("{:.3} %", (self.light * 1e5).round() / 1e3 + 0.0)
    }
}

/// Encodes a texture for engines, with the nearest texels, and by the other compressor, and measures each.
fn measure(texture: &Texture) -> Result<[Seen; 3], Failure> {
    let halves: Vec<u8> = texture
        .pixels
        .iter()
        .flat_map(|texel| [texel[0], texel[1], texel[2], 1.0])
        .flat_map(|value| f16::from_f32(value.clamp(0.0, GREATEST_HALF)).to_le_bytes())
        .collect();
    let specula = |encoding: TexelEncoding| Ok::<_, Failure>(write_dds(texture, encoding)?.bytes);
    let mut seconds = [f64::MAX; 3];
    let mut files = [const { Vec::new() }; 3];
    let mut blocks = Vec::new();
    for _ in 0..ROUNDS {
        for encoder in 0..3 {
            let start = own_seconds()?;
            match encoder {
                0 => files[0] = specula(TexelFormat::Bc6h.into())?,
                1 => files[1] = specula(TexelFormat::Bc6h.nearest())?,
                _ => blocks = ispc(texture, &halves),
            }
            seconds[encoder] = seconds[encoder].min(own_seconds()? - start);
        }
    }
    // Blocks are the end of a file, in the same order.
    let header = files[1].len() - blocks.len();
    files[2] = [&files[1][..header], &blocks].concat();
    let mut seen = Vec::new();
    for (file, seconds) in files.iter().zip(seconds) {
        let (decibels, light) = errors(&texture.pixels, &read_dds(file)?.pixels);
        seen.push(Seen { decibels, speed: texture.pixels.len() as f64 * 1e-6 / seconds, light });
    }
    Ok([seen[0], seen[1], seen[2]])
}

/// The faces of a cube one under the other, with the compressor's profile `slow`.
fn ispc(texture: &Texture, halves: &[u8]) -> Vec<u8> {
    let (width, height) = (texture.width as u32, (FACES * texture.height) as u32);
    let surface = RgbaSurface { data: halves, width, height, stride: 8 * width };
    bc6h::compress_blocks(&bc6h::slow_settings(), &surface)
}

/// The error of base-2 logarithms in dB, and the change of the sum of values as a share.
fn errors(given: &[[f32; 3]], found: &[[f32; 3]]) -> (f64, f64) {
    let stops = |value: f32| f64::from(value.clamp(LEAST_NORMAL_HALF, GREATEST_HALF)).log2();
    let (mut squares, mut light, mut kept) = (0.0, 0.0, 0.0);
    for (given, found) in given.as_flattened().iter().zip(found.as_flattened()) {
        squares += (stops(*found) - stops(*given)).powi(2);
        light += f64::from(given.min(GREATEST_HALF));
        kept += f64::from(*found);
    }
    let rms = (squares / given.as_flattened().len() as f64).sqrt();
    (20.0 * (STOPS / rms).log10(), kept / light - 1.0)
}

/// The mean of decibels, and the speed of as many texels of each cube.
fn mean(rows: &[[Seen; 3]], encoder: usize) -> Seen {
    let count = rows.len() as f64;
    let sum = |value: fn(&Seen) -> f64| rows.iter().map(|row| value(&row[encoder])).sum::<f64>();
    Seen {
        decibels: sum(|seen| seen.decibels) / count,
        speed: count / sum(|seen| 1.0 / seen.speed),
        light: sum(|seen| seen.light) / count,
    }
}

/// The seconds for which this thread ran.
fn own_seconds() -> Result<f64, Failure> {
    let text = fs::read_to_string("/proc/thread-self/schedstat")?;
    let nanoseconds: u64 = text.split(' ').next().unwrap_or_default().parse()?;
    Ok(nanoseconds as f64 * 1e-9)
}
