//! Prints how close to the sum over pixels compact maps are: [`research::compact_tables`].
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin compact-tables -- [OPTIONS]`, with
//! `SPECULA_CORPUS` set to the folder of the corpus. The table is Markdown, a row for each material and
//! number of taps, p95/p99 in stops for each environment with 0, 4, 8 and all lights beside the map.
//!
//! | option | meaning |
//! | --- | --- |
//! | `--environments A,B` | these only: apartment, forest, night, studio, sunrise, low-sun, window, street, or paths of lat-long pictures |
//! | `--materials A,B` | these only; an unknown name lists them all |
//! | `--taps A,B` | 1,2,3,4,6,8 |
//! | `--lights A,B` | 0,4,8,all |
//! | `--resolution N` | the edge of the finest level: 64 |
//! | `--views N` | 2000 |
//! | `--areas` | the truth integrates over the areas of pixels, as highlights below 0.2 need it |
//! | `--seed N` | where the random numbers begin: 1 |

use std::path::PathBuf;
use std::time::{Duration, Instant};

use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use research::compact_tables::{MATERIALS, PROCEDURAL, Points, Truth, material, procedural};
use sh::Stop;
use taps::{ScaleSpace, Widths, fit};

const PHOTOGRAPHS: [&str; 5] = ["apartment", "forest", "night", "studio", "sunrise"];

type Failure = Box<dyn std::error::Error>;

/// An environment, and a scale space for each number of lights.
type Loaded = (Points, Environment, Vec<(usize, ScaleSpace, Duration)>);

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// The value of an option, or its default.
fn option(name: &str, default: &str) -> String {
    let arguments: Vec<String> = std::env::args().collect();
    let at = arguments.iter().position(|argument| argument == name);
    at.and_then(|at| arguments.get(at + 1)).map_or(default, String::as_str).to_owned()
}

fn load(name: &str) -> Result<Environment, Failure> {
    if let Some(environment) = procedural(name) {
        return Ok(environment);
    }
    let path = if PHOTOGRAPHS.contains(&name) {
        let corpus = std::env::var_os("SPECULA_CORPUS").ok_or("SPECULA_CORPUS is unset")?;
        PathBuf::from(corpus).join(format!("env/cc0/{name}.hdr"))
    } else {
        PathBuf::from(name)
    };
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let image = read_image(&bytes, &ReadOptions::default())?.image;
    Ok(Environment::from_image(image, Layout::LatLong, None)?)
}

fn run() -> Result<(), Failure> {
    let list = |name: &str, default: &str| -> Vec<String> {
        option(name, default).split(',').map(|part| part.trim().to_owned()).collect()
    };
    let environments = list("--environments", &[&PHOTOGRAPHS[..], &PROCEDURAL[..]].concat().join(","));
    let all: Vec<&str> = MATERIALS.iter().map(|(name, _)| *name).collect();
    let materials = list("--materials", &all.join(","));
    let counts = list("--lights", "0,4,8,all");
    let taps: Vec<usize> =
        list("--taps", "1,2,3,4,6,8").iter().map(|text| text.parse()).collect::<Result<_, _>>()?;
    let edge: usize = option("--resolution", "64").parse()?;
    let (views, seed): (usize, u64) = (option("--views", "2000").parse()?, option("--seed", "1").parse()?);
    let widths = Widths::new(edge).ok_or("--resolution: expected a power of two from 8 to 512")?;

    let has_areas = std::env::args().any(|argument| argument == "--areas");
    let mut loaded: Vec<Loaded> = Vec::new();
    for name in &environments {
        let environment = load(name)?;
        let lamps = environment.separate_lamps(Stop::NEVER)?.lights;
        let mut spaces = Vec::new();
        for count in &counts {
            let kept = if count == "all" { lamps.len() } else { count.parse::<usize>()?.min(lamps.len()) };
            let start = Instant::now();
            let space = ScaleSpace::new(&environment, &lamps[..kept], widths, Stop::NEVER)?;
            spaces.push((kept, space, start.elapsed()));
        }
        let seconds: Vec<String> =
            spaces.iter().map(|space| format!("{:.3}", space.2.as_secs_f64())).collect();
        println!("{name}: {} lights; scale spaces in {} s", lamps.len(), seconds.join(", "));
        loaded.push((Points::new(&environment)?, environment, spaces));
    }
    let lights = counts.join(" / ");
    let heads: Vec<String> = environments.iter().map(|name| format!("{name}, {lights}")).collect();
    println!("\n| material | J | fit | {} |", heads.join(" | "));
    println!("| --- | --- | --- |{}", " --- |".repeat(heads.len()));
    for name in &materials {
        let material = material(name)?;
        let truths: Vec<Truth> = (loaded.iter())
            .map(|(points, environment, _)| match has_areas {
                true => Truth::of_areas(environment, &material, views, seed),
                false => Truth::new(points, &material, views, seed),
            })
            .collect();
        for taps in &taps {
            let start = Instant::now();
            let fitted = match fit(&material, *taps, widths, Stop::NEVER) {
                Ok(fitted) => fitted,
                Err(error) => {
                    println!("| {name} | {taps} | {error} |");
                    continue;
                }
            };
            let took = start.elapsed().as_secs_f64();
            let cell = |((_, _, spaces), truth): (&Loaded, &Truth)| {
                let each = spaces.iter().map(|(_, space, _)| {
                    let [p95, p99] = truth.error(&fitted.table, space, &material);
                    format!("{p95:.3}/{p99:.3}")
                });
                each.collect::<Vec<_>>().join(" ")
            };
            let cells: Vec<String> = loaded.iter().zip(&truths).map(cell).collect();
            println!("| {name} | {taps} | {:.3}, {took:.2} s | {} |", fitted.rms, cells.join(" | "));
        }
    }
    Ok(())
}
