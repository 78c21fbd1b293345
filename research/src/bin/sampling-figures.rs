//! Draws and measures the figures of `docs/sampling.md`: [`research::sampling_figures`].
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin sampling-figures -- [OPTIONS] FOLDER`. The
//! pictures and `sampling.json`, with all numbers, are written into the folder.
//!
//! | option | meaning |
//! | --- | --- |
//! | `--environment FILE` | the light of products and renders, as often as wanted: a lat-long image, or a square angular probe; default: `assets/environments/sky.exr` and `studio.exr` |
//! | `--no-speeds` | measures no speed |

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use research::sampling_figures::renders::{BYTES_OF_HARMONICS, SAMPLES, Scene, Stored};
use research::sampling_figures::{equal_size, products, speeds, spheres};
use serde_json::{Map, Value, json};

/// Threads whose speed is measured.
const THREADS: [usize; 2] = [1, 2];

/// What the command line says.
struct Options {
    environments: Vec<PathBuf>,
    speeds: bool,
    folder: PathBuf,
}

fn main() {
    let options = match parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            std::process::exit(2);
        }
    };
    if let Err(error) = run(&options) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Options, String> {
    let (mut environments, mut speeds, mut folder) = (Vec::new(), true, None);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--environment" => {
                environments.push(arguments.next().ok_or("--environment needs a file")?.into());
            }
            "--no-speeds" => speeds = false,
            option if option.starts_with('-') => return Err(format!("unknown option {option}")),
            _ if folder.is_some() => return Err(format!("one folder only, not {argument} too")),
            _ => folder = Some(argument.into()),
        }
    }
    if environments.is_empty() {
        environments = ["sky", "studio"].map(|name| format!("assets/environments/{name}.exr").into()).into();
    }
    let folder = folder.ok_or("usage: sampling-figures [--environment FILE]... [--no-speeds] FOLDER")?;
    Ok(Options { environments, speeds, folder })
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(&options.folder)?;
    let write = |name: &str, bytes: &[u8]| -> Result<(), Box<dyn Error>> {
        let path = options.folder.join(name);
        fs::write(&path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        println!("{}", path.display());
        Ok(())
    };
    let mut numbers = Map::new();
    write("spheres.png", &spheres::draw()?.png()?)?;

    write("equal-size.png", &equal_size::draw()?.png()?)?;
    for case in equal_size::CASES {
        let lost = case.lost()?;
        let coefficients = (case.degree + 1) * (case.degree + 1);
        numbers.insert(
            format!("lost of exponent {} in {coefficients}", case.exponent),
            json!({
                "harmonics": lost.harmonics,
                "wavelets": lost.wavelets,
                "wavelets at worst": lost.wavelets_at_worst,
            }),
        );
    }

    for path in &options.environments {
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let environment = read(path)?;
        write(&format!("products-{name}.png"), &products::draw(&environment)?.png()?)?;
        let scene = Scene::new(&environment)?;
        let exact = scene.exact();
        let harmonics = scene.by_harmonics()?;
        let error = harmonics.error(&exact);
        let (small, at_equal_memory) = scene.at_equal_memory(&exact);
        let (large, at_equal_quality) = scene.at_equal_quality(&exact, error);
        let picture = scene.draw(&[&harmonics, &at_equal_memory, &at_equal_quality, &exact]);
        write(&format!("renders-{name}.png"), &picture.png()?)?;
        let wavelets = |stored: Stored, error: f64| {
            json!({
                "orientations": stored.orientations,
                "wavelets": stored.wavelets,
                "bytes": stored.bytes(),
                "error": error,
            })
        };
        numbers.insert(
            format!("renders under {name}"),
            json!({
                "samples": SAMPLES,
                "harmonics": { "bytes": BYTES_OF_HARMONICS, "error": error },
                "wavelets at equal memory": wavelets(small, at_equal_memory.error(&exact)),
                "wavelets at equal quality": wavelets(large, at_equal_quality.error(&exact)),
            }),
        );
    }

    if options.speeds {
        for threads in THREADS {
            let lines = speeds::measure(threads)?;
            let table: Map<String, Value> =
                lines.iter().map(|line| (line.name.into(), json!(line.millions))).collect();
            numbers.insert(format!("million points a second, threads: {threads}"), table.into());
            if threads == THREADS[THREADS.len() - 1] {
                write("speeds.svg", speeds::chart(&lines, threads).as_bytes())?;
            }
        }
    }
    let numbers = serde_json::to_string_pretty(&numbers)?;
    write("sampling.json", format!("{numbers}\n").as_bytes())
}

/// A lat-long image, or an angular probe if it is square.
fn read(path: &Path) -> Result<Environment, Box<dyn Error>> {
    let said = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let bytes = fs::read(path).map_err(|error| said(&error))?;
    let image = read_image(&bytes, &ReadOptions::default()).map_err(|error| said(&error))?.image;
    let layout = if image.width() == image.height() { Layout::Probe } else { Layout::LatLong };
    Ok(Environment::from_image(image, layout, None).map_err(|error| said(&error))?)
}
