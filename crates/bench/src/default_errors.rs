//! How close to brute force the maps are that a manifest without degrees makes.
//!
//! Each pair of an environment and a material goes through the program at its default settings but for the
//! resolution, which the errors do not depend on; the files are read back and compared with sums over all
//! pixels ([`brute_force`]) at the centres of texels, so that interpolation is not measured, and from views
//! as a sphere shows them to a distant camera. The error is measured in stops,
//!
//! > |log2((max(got, 0) + e) / (want + e))| in each channel,
//!
//! e being [`DARK`] of the environment's mean radiance. What is got is the value of the map plus, if lamps
//! are beside it, the irradiance of each times rho_hat. A plain map is compared with the mean over all views.

use std::error::Error;

use brdf::{Centre, Material};
use containers::{ReadOptions, read_image, tensors};
use rayon::prelude::*;
use shrm::{MapGrid, Shrm};
use sphere::{Cube, Direction};

pub mod brute_force;
mod materials;
mod project;

use brute_force::{MeanOverViews, Pixels, Pose, uniform};
pub use materials::{Case, cases};
pub use project::{Built, Project};

/// Radiance below this share of the mean counts as black.
pub const DARK: f64 = 0.01;

/// What can go wrong on the way.
pub type Failure = Box<dyn Error + Send + Sync>;

/// One of the maps of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// `export-shrm` with `lamps = "separate"`, and with as high a P as it needs. A material of two parts has
    /// two maps, whose sum is measured.
    Separate,
    /// `export-shrm`, by default with the lamps in the map, and with as high a P as it needs.
    Baked,
    /// `export-reflection-map`, by default the mean over all views, with both parts of a material in one map.
    Plain,
}

impl Map {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Separate, Self::Baked, Self::Plain];

    /// The name of its stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Separate => "separate",
            Self::Baked => "baked",
            Self::Plain => "plain",
        }
    }

    /// The stops below which 95 and 99 of 100 samples should be; `None` if that is not asked of such a
    /// material.
    pub fn target(self, case: &Case) -> Option<[f64; 2]> {
        match self {
            Self::Separate if case.sharp => Some([0.2, 0.5]),
            Self::Separate => Some([0.1, 0.25]),
            Self::Baked if case.sharp => None,
            Self::Baked => Some([0.15, 0.5]),
            Self::Plain => Some([0.05, f64::INFINITY]),
        }
    }
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Texels and views of each SHRM; texels of each plain map.
    pub samples: usize,
    /// Where the random numbers begin.
    pub seed: u64,
}

/// What was measured of one map.
#[derive(Clone, Debug)]
pub struct Row {
    /// The environment.
    pub environment: String,
    /// The material.
    pub material: String,
    /// The map.
    pub map: Map,
    /// The degree F that `convolve` chose.
    pub f: usize,
    /// The degree P of the file; 0 for a plain map.
    pub p: usize,
    /// The number of lights beside the map.
    pub lights: usize,
    /// The stops that 95 of 100 samples stay below.
    pub p95: f64,
    /// The stops that 99 of 100 samples stay below.
    pub p99: f64,
    /// The share of samples below -0.1 e before they are clamped; of a plain map, of all values below 0.
    pub negative: f64,
    /// The size of the file.
    pub bytes: usize,
    /// The seconds of `project-sh`, `project-brdf`, `convolve` and the export.
    pub seconds: [f64; 4],
    /// The stops that should not be exceeded.
    pub target: Option<[f64; 2]>,
}

impl Row {
    /// The larger of both errors in parts of its target: above 1 it is missed. 0 if there is no target.
    pub fn excess(&self) -> f64 {
        let Some([p95, p99]) = self.target else { return 0.0 };
        let ringing = if self.map == Map::Plain && self.negative > 0.0 { f64::INFINITY } else { 0.0 };
        (self.p95 / p95).max(self.p99 / p99).max(ringing)
    }

    /// Whether the targets are met; `None` if there are none.
    pub fn is_met(&self) -> Option<bool> {
        self.target.map(|_| self.excess() <= 1.0)
    }

    /// The lines above the rows of a table in Markdown.
    pub const HEAD: &'static str = "\
        | environment | material | map | F | P | lights | p95 | p99 | negative | MB | sh s | brdf s | convolve s | export s | target |\n\
        | --- | --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --- |";

    /// A row of that table.
    pub fn markdown(&self) -> String {
        let Self { environment, material, f, p, lights, p95, p99, .. } = self;
        let (map, negative, megabytes) = (self.map.name(), 100.0 * self.negative, 1e-6 * self.bytes as f64);
        let [sh, brdf, convolve, export] = self.seconds;
        let target = match self.is_met() {
            None => "-",
            Some(true) => "met",
            Some(false) => "MISSED",
        };
        format!(
            "| {environment} | {material} | {map} | {f} | {p} | {lights} | {p95:.3} | {p99:.3} | {negative:.1} % | \
             {megabytes:.1} | {sh:.1} | {brdf:.1} | {convolve:.1} | {export:.1} | {target} |"
        )
    }
}

/// Measures maps of an environment and a material, which were built.
///
/// # Errors
/// If a file is missing or is not what the manifest asks for.
pub fn measure(
    built: &Built<'_>,
    (environment, pixels): (&str, &Pixels),
    case: &Case,
    maps: &[Map],
    effort: Effort,
) -> Result<Vec<Row>, Failure> {
    let material = built.project.material(case)?;
    // About the tangent, rho_hat is the same all around it, whatever the normal.
    if !material.is_isotropic() && material.centre() != Centre::Tangent {
        return Err(format!("{}: brute force takes isotropic materials only", case.name).into());
    }
    let pair = Pair { built, environment, pixels, case, material: &material, effort };
    let mut brute_force = None;
    maps.iter()
        .map(|map| match map {
            Map::Plain => pair.plain(),
            _ => pair.shrm(*map, brute_force.get_or_insert_with(|| pair.samples())),
        })
        .collect()
}

/// A texel, a view and the radiance that brute force finds there.
struct Sample {
    texel: usize,
    pose: Pose,
    want: [f64; 3],
}

/// An environment and a material.
struct Pair<'a> {
    built: &'a Built<'a>,
    environment: &'a str,
    pixels: &'a Pixels,
    case: &'a Case,
    material: &'a Material,
    effort: Effort,
}

impl Pair<'_> {
    fn dark(&self) -> f64 {
        DARK * self.pixels.mean()
    }

    fn cube(&self) -> Cube {
        Cube { edge: self.built.project.resolution() }
    }

    /// A texel, all of the sphere being equally likely, and random numbers for its view.
    fn texel(&self, sample: usize) -> (usize, [f64; 3]) {
        let numbers: [f64; 5] =
            std::array::from_fn(|k| uniform(self.effort.seed, 5 * sample as u64 + k as u64));
        let direction = Direction::from_angles(
            (1.0 - 2.0 * numbers[0]).clamp(-1.0, 1.0).acos(),
            std::f64::consts::TAU * numbers[1],
        );
        let cube = self.cube();
        let (face, s, t) = cube.position(direction);
        let index = |position: f64| ((position * cube.edge as f64) as usize).min(cube.edge - 1);
        let texel = (face as usize * cube.edge + index(t)) * cube.edge + index(s);
        (texel, [numbers[2], numbers[3], numbers[4]])
    }

    fn samples(&self) -> Vec<Sample> {
        let (centre, grid) = (self.material.centre(), MapGrid::Cube(self.cube()));
        let sample = |index| {
            let (texel, numbers) = self.texel(index);
            let pose = Pose::new(centre, grid.direction(texel).vector(), numbers);
            Sample { texel, want: pose.reflected(self.material, self.pixels), pose }
        };
        (0..self.effort.samples).into_par_iter().map(sample).collect()
    }

    fn shrm(&self, map: Map, samples: &[Sample]) -> Result<Row, Failure> {
        let bytes = self.built.file(self.environment, self.case, map)?;
        let (shrm, lights) = (tensors::decode_shrm(&bytes)?, tensors::decode_lights(&bytes)?);
        if shrm.grid() != MapGrid::Cube(self.cube()) || shrm.centre() != self.material.centre() {
            return Err(format!("{}: a map of another grid or centre", self.case.name).into());
        }
        let diffuse = self.built.diffuse(self.environment, self.case, map);
        let size = bytes.len() + diffuse.as_ref().map_or(0, Vec::len);
        let diffuse = diffuse.map(|bytes| tensors::decode_shrm(&bytes)).transpose()?;
        let (mut lookup, mut base) = (shrm.lookup(), diffuse.as_ref().map(Shrm::lookup));
        let (dark, mut stops, mut negative) = (self.dark(), Vec::new(), 0);
        for Sample { texel, pose, want } in samples {
            let view = Direction::normalised(pose.view());
            let mut got = lookup.texel(*texel, view);
            if let Some(base) = &mut base {
                let matte = base.radiance(Direction::normalised(pose.normal()), view);
                (0..3).for_each(|channel| got[channel] += f64::from(matte[channel]));
            }
            for light in &lights {
                let rho = pose.rho_hat(self.material, light.direction.vector());
                (0..3).for_each(|channel| got[channel] += light.irradiance[channel] * rho[channel]);
            }
            negative += got.iter().filter(|value| **value < -0.1 * dark).count();
            stops.extend((0..3).map(|channel| error(got[channel], want[channel], dark)));
        }
        let negative = negative as f64 / stops.len().max(1) as f64;
        Ok(self.row(map, shrm.p().get(), lights.len(), stops, negative, size))
    }

    fn plain(&self) -> Result<Row, Failure> {
        let bytes = self.built.file(self.environment, self.case, Map::Plain)?;
        let image = read_image(&bytes, &ReadOptions::default())?.image;
        let grid = MapGrid::Cube(self.cube());
        if image.pixels().len() != grid.len() {
            return Err(format!("{}: a plain map of another size", self.case.name).into());
        }
        let mean = MeanOverViews::new(self.material);
        let dark = self.dark();
        let stops: Vec<f64> = (0..self.effort.samples)
            .into_par_iter()
            .flat_map_iter(|sample| {
                let (texel, _) = self.texel(sample);
                let want = mean.reflected(grid.direction(texel).vector(), self.pixels);
                let got = image.pixels()[texel].map(f64::from);
                (0..3).map(move |channel| error(got[channel], want[channel], dark))
            })
            .collect();
        let values = image.pixels().as_flattened();
        let negative = values.iter().filter(|value| **value < 0.0).count() as f64 / values.len() as f64;
        Ok(self.row(Map::Plain, 0, 0, stops, negative, bytes.len()))
    }

    fn row(
        &self,
        map: Map,
        p: usize,
        lights: usize,
        mut stops: Vec<f64>,
        negative: f64,
        bytes: usize,
    ) -> Row {
        stops.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let rank = (share * stops.len() as f64).ceil() as usize;
            stops.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Row {
            environment: self.environment.to_owned(),
            material: self.case.name.clone(),
            map,
            f: self.built.f(self.environment, self.case),
            p,
            lights,
            p95: quantile(0.95),
            p99: quantile(0.99),
            negative,
            bytes,
            seconds: self.built.seconds(self.environment, self.case, map),
            target: map.target(self.case),
        }
    }
}

/// The error in stops.
fn error(got: f64, want: f64, dark: f64) -> f64 {
    ((got.max(0.0) + dark) / (want + dark)).log2().abs()
}
