//! Prints [RH02, tabs. 4 and 5] as a build takes them: the seconds of whole stages, from the artifacts that
//! a stage reads to those that it stores, or to the files that it exports.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin paper-builds`
//!
//! The manifests in `frozen-paper` hold a row of each table in the paper's mode, with degrees that are
//! given. Every other row has its own parameters in their place. The harmonic side is `project-sh`,
//! `project-brdf`, `convolve` and the export, each with all threads for itself. A build has two ways to
//! integrate over angles, the two methods of `reference`. `summed` adds all texels of a wide lobe but those
//! that the paper leaves out, too. A lobe of less than 20 rows it integrates over the areas of texels, to an
//! error of 5e-4, which takes far longer than the paper's sum; `paper-ratios` has that sum. `sampled` takes
//! 64 directions a texel, which err by about as much as the paper's sum does.
//!
//! Reading the environment and the material, which all need, is not counted. Rounds of all stages follow
//! each other, and medians count; a stage that has taken a few seconds has no further round.
//!
//! The last columns of table 4 are differences from `summed`, relative and RMS: of the harmonic map, whose
//! degree is the paper's, and of `sampled`.

use std::collections::HashMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Mutex;

use containers::{Precision, ReadOptions};
use engine::{BuildOptions, BuildSession, Cancel, Event, Plan};
use envmap::Image;
use research::paper::{TABLE4, TABLE5, VIEWS, difference, environment, phong_degree};
use research::turns::median;
use sphere::LatLong;
use tempfile::TempDir;

/// Rounds that are timed, after one to warm up.
const ROUNDS: usize = 5;

/// The milliseconds after which a stage has no further round.
const LONG: f64 = 2000.0;

/// S_L and S_B: as many texels as 128 x 128, in the shape that a build has.
const GRID: LatLong = LatLong { width: 180, height: 90 };

/// A row of a table as a project.
struct Project {
    folder: TempDir,
}

impl Project {
    /// The frozen manifest and material, with some of their text replaced, and the light.
    fn new(manifest: &str, material: &str, edits: &[[&str; 2]]) -> Result<Self, Box<dyn Error>> {
        let frozen = Path::new(env!("CARGO_MANIFEST_DIR")).join("frozen-paper");
        let folder = tempfile::tempdir()?;
        for (from, to) in [(manifest, "pipeline.toml"), (material, "material.toml")] {
            let mut text = fs::read_to_string(frozen.join(from))?;
            for [old, new] in edits {
                text = text.replace(old, new);
            }
            fs::write(folder.path().join(to), text)?;
        }
        let light = Image::new(GRID.width, GRID.height, environment(GRID).pixels().to_vec());
        let light = light.ok_or("the pixels fill the image")?;
        let light = containers::write_exr(&light, Precision::Float, None)?;
        fs::write(folder.path().join("sky.exr"), light.bytes)?;
        Ok(Self { folder })
    }

    /// The median milliseconds of each stage.
    fn times(&self, stages: &[&'static str]) -> Result<Times, Box<dyn Error>> {
        let plan = Plan::load(&self.folder.path().join("pipeline.toml"), &stages::kinds())?;
        let session = BuildSession::new(None, 0)?;
        let mut milliseconds: HashMap<&'static str, Vec<f64>> = HashMap::new();
        for _ in 0..=ROUNDS {
            for &stage in stages {
                let times = milliseconds.entry(stage).or_default();
                if times.iter().sum::<f64>() > LONG {
                    continue;
                }
                let took = Mutex::new(0.0);
                let options =
                    BuildOptions { stages: vec![stage.to_string()], force: true, ..BuildOptions::default() };
                let summary = session.build(&plan, &options, &Cancel::default(), &|event| {
                    if let Event::Finished { item, milliseconds, .. } = event
                        && item.stage == stage
                        && let Ok(mut took) = took.lock()
                    {
                        *took += milliseconds;
                    }
                })?;
                if summary.failed > 0 {
                    return Err(format!("{stage} failed").into());
                }
                times.push(took.into_inner()?);
            }
        }
        let warm = |times: Vec<f64>| if times.len() > 1 { times[1..].to_vec() } else { times };
        Ok(Times(milliseconds.into_iter().map(|(stage, times)| (stage, median(warm(times)))).collect()))
    }

    /// The values of an exported picture.
    fn picture(&self, name: &str) -> Result<Image, Box<dyn Error>> {
        let bytes = fs::read(self.folder.path().join("out").join(name))?;
        Ok(containers::read_image(&bytes, &ReadOptions::default())?.image)
    }
}

/// The median milliseconds of stages.
struct Times(HashMap<&'static str, f64>);

impl Times {
    fn of(&self, stages: &[&str]) -> f64 {
        stages.iter().filter_map(|stage| self.0.get(stage)).sum()
    }
}

/// Up to the reflected light.
const FIELD: [&str; 3] = ["lighting", "coefficients", "reflection"];

fn main() -> Result<(), Box<dyn Error>> {
    table4()?;
    println!();
    table5()
}

fn table4() -> Result<(), Box<dyn Error>> {
    println!("Table 4 in a build: phong, {} x {}; milliseconds of stages", GRID.width, GRID.height);
    println!("ratio: the time by angles over that by harmonics");
    println!(
        "{:>4} {:>3} | {:>8} {:>8} | {:>6} {:>6} {:>8} {:>6} {:>6} | {:>6} {:>7} {:>7} | {:>7} {:>7}",
        "", "", "by", "angles", "pro-", "pro-", "", "", "", "ratio", "ratio", "", "differ-", "ences"
    );
    println!(
        "{:>4} {:>3} | {:>8} {:>8} | {:>6} {:>6} {:>8} {:>6} {:>6} | {:>6} {:>7} {:>7} | {:>7} {:>7}",
        "s",
        "F",
        "summed",
        "sampled",
        "sh",
        "brdf",
        "convolve",
        "export",
        "all",
        "summed",
        "sampled",
        "paper's",
        "map",
        "sampled"
    );
    for row in TABLE4 {
        let degree = phong_degree(row.s);
        let project = Project::new(
            "table4.toml",
            "phong.toml",
            &[
                ["exponent = 32", &format!("exponent = {}", row.s)],
                ["degree = 14", &format!("degree = {degree}")],
                ["degree = [14, 0]", &format!("degree = [{degree}, 0]")],
            ],
        )?;
        let times = project.times(&["lighting", "coefficients", "reflection", "map", "sampled", "summed"])?;
        let [summed, sampled] = [times.of(&["summed"]), times.of(&["sampled"])];
        let harmonics = times.of(&FIELD) + times.of(&["map"]);
        let truth = project.picture("summed.exr")?;
        let [map_off, sampled_off] = [project.picture("map.exr")?, project.picture("sampled.exr")?]
            .map(|picture| difference(GRID, picture.pixels(), truth.pixels()));
        println!(
            "{:>4} {:>3} | {:>8.1} {:>8.1} | {:>6.2} {:>6.2} {:>8.2} {:>6.2} {:>6.2} \
             | {:>6.0} {:>7.0} {:>7.1} | {:>7.4} {:>7.4}",
            row.s,
            degree,
            summed,
            sampled,
            times.of(&["lighting"]),
            times.of(&["coefficients"]),
            times.of(&["reflection"]),
            times.of(&["map"]),
            harmonics,
            summed / harmonics,
            sampled / harmonics,
            row.angular / row.frequency,
            map_off,
            sampled_off,
        );
    }
    Ok(())
}

fn table5() -> Result<(), Box<dyn Error>> {
    let maps = (VIEWS * VIEWS) as f64;
    println!("Table 5 in a build: microfacet, {} x {}; milliseconds of stages", GRID.width, GRID.height);
    println!("SHRM and maps are each all stages up to them; ratio: {maps} maps by angles over `maps`");
    println!(
        "{:>5} {:>7} | {:>8} {:>8} | {:>7} {:>7} {:>7} | {:>7} {:>7} {:>7}",
        "", "", "a map by", "angles", "", "", "", "ratio", "ratio", ""
    );
    println!(
        "{:>5} {:>7} | {:>8} {:>8} | {:>7} {:>7} {:>7} | {:>7} {:>7} {:>7}",
        "sigma", "[F, P]", "summed", "sampled", "field", "SHRM", "maps", "summed", "sampled", "paper's"
    );
    for row in TABLE5 {
        let [f, p] = row.degrees;
        let project = Project::new(
            "table5.toml",
            "microfacet.toml",
            &[
                ["sigma = 0.2", &format!("sigma = {}", row.sigma)],
                ["degree = 12", &format!("degree = {f}")],
                ["degree = [12, 2]", &format!("degree = [{f}, {p}]")],
            ],
        )?;
        let stages = ["lighting", "coefficients", "reflection", "shrm", "view-maps", "sampled", "summed"];
        let times = project.times(&stages)?;
        let [summed, sampled, field] = [times.of(&["summed"]), times.of(&["sampled"]), times.of(&FIELD)];
        let all = field + times.of(&["view-maps"]);
        println!(
            "{:>5} {:>7} | {:>8.1} {:>8.1} | {:>7.2} {:>7.2} {:>7.2} | {:>7.0} {:>7.0} {:>7.0}",
            row.sigma,
            format!("{:?}", row.degrees),
            summed,
            sampled,
            field,
            field + times.of(&["shrm"]),
            all,
            maps * summed / all,
            maps * sampled / all,
            maps * row.angular / row.frequency,
        );
    }
    Ok(())
}
