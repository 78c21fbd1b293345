//! Prints how close to brute force the maps are that a manifest without degrees makes:
//! [`bench::default_errors`].
//!
//! `cargo run --release -p bench --bin default-errors -- [OPTIONS]`, with `SPECULA_CORPUS` set to the
//! folder of the corpus and the program of `cargo build --release` at hand. The table is Markdown; a row
//! comes as soon as it is measured. After it are the numbers of targets that are met, and the rows that
//! miss theirs, the worst first.
//!
//! | option | meaning |
//! | --- | --- |
//! | `--environments A,B` | these only: apartment, forest, night, studio, sunrise |
//! | `--materials A,B` | these only; an unknown name lists them all |
//! | `--lamps separate` or `baked` | only these SHRMs; with `--plain`, those too |
//! | `--plain` | only the plain maps |
//! | `--samples N` | texels and views of each map: 200 |
//! | `--resolution N` | the edge of each cube map: 64; sizes and seconds depend on it, errors do not |
//! | `--seed N` | where the random numbers begin: 1 |
//! | `--specula PATH` | the program: `target/release/specula` of the checkout |

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use bench::default_errors::brute_force::Pixels;
use bench::default_errors::{Case, Effort, Failure, Map, Project, Row, cases, measure};
use containers::{ReadOptions, read_image};
use envmap::Image;

const ENVIRONMENTS: [&str; 5] = ["apartment", "forest", "night", "studio", "sunrise"];

/// What the command line says.
struct Options {
    environments: Vec<String>,
    cases: Vec<Case>,
    maps: Vec<Map>,
    resolution: usize,
    effort: Effort,
    program: PathBuf,
}

fn main() {
    let options = match Options::parse(std::env::args().skip(1)) {
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

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let name = format!("specula{}", std::env::consts::EXE_SUFFIX);
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/release").join(name);
        let mut options = Self {
            environments: ENVIRONMENTS.map(str::to_owned).into(),
            cases: cases(),
            maps: Vec::new(),
            resolution: 64,
            effort: Effort { samples: 200, seed: 1 },
            program,
        };
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{argument}: expected a value"));
            match argument.as_str() {
                "--environments" => {
                    let names = ENVIRONMENTS.map(str::to_owned);
                    options.environments = chosen(&value()?, &names, |name| name)?;
                }
                "--materials" => options.cases = chosen(&value()?, &cases(), |case| &case.name)?,
                "--lamps" => options.maps.push(match value()?.as_str() {
                    "separate" => Map::Separate,
                    "baked" => Map::Baked,
                    other => return Err(format!("--lamps {other}: expected separate or baked")),
                }),
                "--plain" => options.maps.push(Map::Plain),
                "--samples" => options.effort.samples = number(&argument, &value()?)?,
                "--resolution" => options.resolution = number(&argument, &value()?)?,
                "--seed" => options.effort.seed = number(&argument, &value()?)?,
                "--specula" => {
                    let path = PathBuf::from(value()?);
                    options.program =
                        fs::canonicalize(&path).map_err(|error| format!("{}: {error}", path.display()))?;
                }
                unknown => return Err(format!("{unknown} is not an option; the file's head lists them")),
            }
        }
        if options.maps.is_empty() {
            options.maps = Map::ALL.into();
        }
        Ok(options)
    }
}

/// The entries that a list names.
fn chosen<T: Clone>(list: &str, all: &[T], name: impl Fn(&T) -> &String) -> Result<Vec<T>, String> {
    let find = |wanted: &str| {
        let found = all.iter().find(|entry| name(entry) == wanted).cloned();
        found.ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|entry| name(entry).as_str()).collect();
            format!("{wanted}: expected one of {}", names.join(", "))
        })
    };
    list.split(',').map(find).collect()
}

fn number<T: std::str::FromStr>(option: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{option} {text}: expected a number"))
}

fn run(options: &Options) -> Result<(), Failure> {
    let corpus = std::env::var_os("SPECULA_CORPUS").map(PathBuf::from);
    let corpus = corpus.ok_or("SPECULA_CORPUS is unset: expected the folder of the corpus")?;
    let read = |name: &String| -> Result<Image, Failure> {
        let bytes = fs::read(corpus.join(format!("env/cc0/{name}.hdr")))?;
        Ok(read_image(&bytes, &ReadOptions::default())?.image)
    };
    let images: Vec<Image> = options.environments.iter().map(read).collect::<Result<_, _>>()?;
    let pixels: Vec<Pixels> = images.iter().map(Pixels::new).collect();
    let names = options.environments.iter().map(String::as_str);
    let environments: Vec<(&str, &Image)> = names.clone().zip(&images).collect();
    println!("{}", Row::HEAD);
    let mut rows = Vec::new();
    // A project for each material: baked maps are large.
    for case in &options.cases {
        let maps = (options.maps.as_slice(), options.resolution);
        let project = Project::new(&environments, std::slice::from_ref(case), maps, &corpus)?;
        let built = project.build_with(&options.program)?;
        for environment in names.clone().zip(&pixels) {
            for row in measure(&built, environment, case, &options.maps, options.effort)? {
                println!("{}", row.markdown());
                rows.push(row);
            }
            std::io::stdout().flush()?;
        }
    }
    println!();
    for map in &options.maps {
        let met: Vec<bool> = rows.iter().filter(|row| row.map == *map).filter_map(Row::is_met).collect();
        let count = met.iter().filter(|met| **met).count();
        println!("{}: {count} of {} targets are met", map.name(), met.len());
    }
    rows.retain(|row| row.is_met() == Some(false));
    rows.sort_by(|a, b| b.excess().total_cmp(&a.excess()));
    if !rows.is_empty() {
        println!("\nMissed, the worst first:\n\n{}", Row::HEAD);
        rows.iter().for_each(|row| println!("{}", row.markdown()));
    }
    Ok(())
}
