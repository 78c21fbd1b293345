//! Writes a reflection map without harmonics, by the integral that the other kinds compute faster.
//!
//! ```toml
//! [stage.truth]
//! kind = "reference"
//! inputs = { environment = "environment", material = "material" }
//! view = [30.0, -10.0]
//! resolution = 32
//! format = "png"
//! path = "{environment}/{material}/truth"
//! ```
//!
//! Each texel is the integral of radiance times rho_hat (the BRDF with its cosine) over all directions:
//!
//! > B(C, V) = integral over w of L(w) rho_hat(w, V) dOmega
//!
//! A texel of the environment has the same radiance over its whole area. With `method = "summed"`, a lobe
//! of at least 20 rows is summed over the texels, with rho_hat at their centres. A narrower lobe is
//! integrated over their areas: blocks of texels, texels and parts of texels are divided where rho_hat
//! varies in them, until the estimated error is 5e-4 of the radiance, 7e-4 stops.
//!
//! There are no harmonics, no degree and no ringing, so use it to see what a degree or an export loses. The
//! central direction C of a texel is its own direction, as in `export-reflection-map`: the reflection vector,
//! or the normal of a lambert material, or the tangent of a kajiya-kay one. The time of a sum is proportional
//! to (texels of the map) x (lit texels of the environment); `environment-resolution` limits the second.
//!
//! ## Sampled
//!
//! With `method = "sampled"` each texel is the mean over `samples` directions. They are drawn from the
//! product of the light and the material, from the light alone and from the material alone, and weighted by
//! the balance heuristic (Veach and Guibas 1995). The densities come from a short series of the material
//! and from simple lobes, but each direction counts with its exact radiance and rho_hat. So there is no
//! ringing here either: the series affects only the noise. The time does not depend on the size of the
//! environment, so you can use a large `environment-resolution`.
//!
//! The build notes the standard error relative to the root mean square of the map: its root mean square
//! over all texels and channels, and the largest. Two thirds of the differences from the truth are smaller
//! than the standard error. It is itself an estimate, from independent batches of 32 directions: with few
//! batches it is uncertain, and if almost nothing is reflected, it may be too small. Four times as many
//! samples at least halve it. Another `seed` gives different noise.
//!
//! Samples are spread over the areas of the environment's texels, so both methods converge to the same
//! integral.
//!
//! ```toml
//! [stage.truth]
//! kind = "reference"
//! inputs = { environment = "environment", material = "material" }
//! method = "sampled"
//! samples = 4096
//! environment-resolution = 1024
//! path = "{environment}/{material}/truth"
//! ```
//!
//! ## The view
//!
//! | `view` | meaning of a texel |
//! | --- | --- |
//! | `"head-on"` | each surface viewed straight on: the view, the normal and the reflection vector are the same; for kajiya-kay, whose texels are tangents, the view is perpendicular to the tangent |
//! | `[yaw, pitch]` | every central direction seen by one distant viewer, in the direction +X rotated by these degrees (a positive pitch tilts it down, as in `rotate`) |
//!
//! For a material that looks the same from every view (lambert, phong) the map does not depend on `view`.
//!
//! ## Files
//!
//! The same files as `export-reflection-map` writes with the same `layout` and `format`.

use std::ops::Range;

use brdf::{Centre, Choice, Material, project};
use engine::{
    Context, Diagnostic, Failure, Kind, Output, Parameter, Port, Product, Reporter, Value, ValueKind, choice,
    parameters, unexpected,
};
use serde_json::json;
use sh::Tolerance;
use shrm::reference::{Cull, Estimate, Reference, Sampled};
use shrm::{MapGrid, View};
use sphere::{Direction, LatLong, Rotation};

use super::map_pictures::{Layout, MapPictures, PictureFormat, endings};
use crate::values::{Encoding, FileFormat, MAX_RESOLUTION, Numbers, STOPS, UntilStopped, artifacts, percent};

/// The direction of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Viewer {
    /// The viewer is straight above each surface.
    HeadOn,
    /// The viewer is distant: +X turned by yaw and pitch, in degrees.
    Far {
        /// The yaw about +Z, after the pitch.
        yaw: f64,
        /// The pitch about +Y; positive lowers +X.
        pitch: f64,
    },
}

impl Parameter for Viewer {
    fn expected() -> String {
        "\"head-on\" or [yaw, pitch] in degrees".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(word) if word == "head-on" => Ok(Self::HeadOn),
            ValueKind::Array(angles) => match angles.as_slice() {
                [yaw, pitch] => Ok(Self::Far { yaw: f64::parse(yaw)?, pitch: f64::parse(pitch)? }),
                _ => Err(Diagnostic::at(
                    value.span.clone(),
                    format!("{} numbers are not [yaw, pitch]", angles.len()),
                )
                .expected(format!("expected {}", Self::expected()))),
            },
            _ => Err(unexpected(value, &Self::expected())),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::HeadOn => "head-on".into(),
            Self::Far { yaw, pitch } => vec![yaw.canonical(), pitch.canonical()].into(),
        }
    }

    fn schema() -> serde_json::Value {
        let angles = json!({ "type": "number" });
        json!({ "type": ["array", "string"], "items": angles, "minItems": 2, "maxItems": 2, "pattern": "^head-on$" })
    }
}

/// The way in which the integral is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReferenceMethod {
    /// The sum over all texels of the environment.
    Summed,
    /// The mean over directions.
    Sampled,
}

choice! {
    /// How the integral is computed.
    pub(crate) enum ReferenceMethodName: ReferenceMethod {
        /// The sum over all texels of the environment.
        Summed = "summed",
        /// The mean over directions that follow the light and the material; see Sampled.
        Sampled = "sampled",
    }
}

/// The most directions at a texel.
const MOST_SAMPLES: usize = 1 << 20;

/// The number of directions at a texel, unless one is given: about as many as take as long as their
/// preparation.
const SAMPLES: usize = 512;

parameters! {
    /// Parameters of `reference`.
    pub(crate) struct Parameters {
        /// How the integral is computed; see Sampled.
        method: ReferenceMethodName = ReferenceMethodName(ReferenceMethod::Summed),
        /// With method "sampled": directions at each texel of the map, rounded up to batches of 32. Default:
        /// 512.
        #[range(64..=MOST_SAMPLES)]
        samples: Option<usize> = None,
        /// With method "sampled": another number gives different noise. Default: 0.
        #[range(0..=u32::MAX as usize)]
        seed: Option<usize> = None,
        /// The direction of the viewer; see The view.
        view: Viewer = Viewer::HeadOn,
        /// Rows of the environment for the sum; it has twice as many columns. A finer environment is first
        /// averaged down to this, by exact areas.
        #[range(1..=MAX_RESOLUTION)]
        #[was("rows")]
        environment_resolution: usize = 128,
        /// With method "summed": the share of a lobe that may be ignored. Lambert, phong and microfacet sum
        /// over the cap that contains the rest, if it is at least 20 rows wide. 0 sums over everything.
        #[range(0.0..1.0)]
        cull: f64 = 0.0,
        /// How the sphere is laid out on the written images, as in export-reflection-map.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long map, which has twice as many columns; texels along the edge of a cube's face.
        #[range(1..=MAX_RESOLUTION)]
        resolution: usize = 32,
        /// The container: OpenEXR, Radiance, or a tone-mapped PNG for viewing.
        format: PictureFormat = PictureFormat::Exr,
        /// With format "png": stops by which radiance is multiplied before tone mapping.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        ..numbers: Numbers,
    }
}

impl Parameters {
    fn pictures(&self) -> MapPictures {
        MapPictures { layout: self.layout, resolution: self.resolution }
    }

    fn encoding(&self) -> Encoding<PictureFormat> {
        Encoding::new(self.format, self.numbers).with_exposure(self.exposure)
    }

    fn cull(&self) -> Cull {
        Tolerance::new(self.cull).map_or(Cull::None, Cull::Energy)
    }
}

/// Rows of the map between two checks for cancellation.
const BAND: usize = 4;

/// The kind `reference`.
pub(crate) struct ReferenceMap;

impl Kind for ReferenceMap {
    type Parameters = Parameters;

    const NAME: &'static str = "reference";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[
        brdf::revisions::MODELS,
        brdf::revisions::PROJECTION,
        sampling::revisions::SAMPLERS,
        shrm::revisions::REFERENCE,
        envmap::revisions::RESAMPLING,
    ];
    const TEXT: &'static str = include_str!("reference.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment"), Port::one::<artifacts::Material>("material")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(endings(parameters.layout, parameters.format.container()))
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = parameters.encoding().check();
        match parameters.method.0 {
            ReferenceMethod::Summed => {
                let given = [("samples", parameters.samples.is_some()), ("seed", parameters.seed.is_some())];
                let unused = given.into_iter().filter(|(_, given)| *given);
                errors.extend(unused.map(|(name, _)| (name, "only method = \"sampled\" uses it".into())));
            }
            ReferenceMethod::Sampled if parameters.cull > 0.0 => {
                errors.push(("cull", "only method = \"summed\" uses it".into()));
            }
            ReferenceMethod::Sampled => {}
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let environment = context.inputs.get::<artifacts::Environment>("environment")?;
        let material = context.inputs.get::<artifacts::Material>("material")?;
        let whole = environment.0.grid();
        let most = parameters.environment_resolution;
        let coarse =
            (whole.height > most).then(|| environment.0.downsampled(LatLong::with_rows(most))).transpose()?;
        let light = coarse.as_ref().unwrap_or(&environment.0);
        let seen = view(parameters.view, &material.0);
        let pictures = parameters.pictures();
        let grid = pictures.grid();
        let pixels = match parameters.method.0 {
            ReferenceMethod::Summed => {
                let reference = Reference::new(light, &material.0, parameters.cull());
                let pixels = by_bands(grid, reporter, |rows| reference.rows(grid, rows, seen.0, seen.1))?;
                note_sizes(light.grid(), whole, &reference, grid.len(), reporter);
                pixels
            }
            ReferenceMethod::Sampled => {
                let projection = reporter.until_stopped(|stop| project(&material.0, Choice::Full, stop))?;
                let coefficients = projection.coefficients;
                let seed = u32::try_from(parameters.seed.unwrap_or(0))?;
                let samples = parameters.samples.unwrap_or(SAMPLES);
                let sampled = Sampled::new(light, &material.0, &coefficients, samples, seed);
                let estimates = by_bands(grid, reporter, |rows| sampled.rows(grid, rows, seen.0, seen.1))?;
                note_errors(light.grid(), whole, sampled.directions(), &estimates, reporter);
                estimates.iter().map(|estimate| estimate.radiance.map(|value| value as f32)).collect()
            }
        };
        Ok(Output::files(pictures.files(pixels, parameters.encoding(), context)?))
    }
}

/// The frame that a viewer is given in, and the direction toward it.
fn view(viewer: Viewer, material: &Material) -> (View, Direction) {
    match viewer {
        Viewer::HeadOn => match material.centre() {
            Centre::Reflection | Centre::Normal => (View::Local, Direction::Z),
            // A normal of the tangent: +X of the texel's frame. All normals of the tangent are equivalent.
            Centre::Tangent => (View::Local, Direction::X),
        },
        Viewer::Far { yaw, pitch } => {
            let turn = Rotation::from_yaw_pitch_roll(yaw.to_radians(), pitch.to_radians(), 0.0);
            (View::Global, turn.apply(Direction::X))
        }
    }
}

/// All texels of a map, from functions of some of its rows.
fn by_bands<T>(
    grid: MapGrid,
    reporter: &Reporter,
    rows: impl Fn(Range<usize>) -> Vec<T>,
) -> Result<Vec<T>, Failure> {
    let [faces, height, _] = grid.shape();
    let mut texels = Vec::with_capacity(grid.len());
    for first in (0..faces * height).step_by(BAND) {
        reporter.check_cancelled()?;
        texels.extend(rows(first..(first + BAND).min(faces * height)));
    }
    Ok(texels)
}

/// Notes the sizes of the grids that were summed over.
fn note_sizes(used: LatLong, whole: LatLong, reference: &Reference, texels: usize, reporter: &Reporter) {
    let from = averaged(used, whole);
    let width = reference.width();
    let cap = if width < 1.0 {
        format!(", limited to a cap of {:.2} % of the sphere", 100.0 * width)
    } else {
        String::new()
    };
    reporter.note(format!(
        "{texels} texels of the map, {} lit ones of {} x {} of the environment{from}{cap}",
        reference.lit(),
        used.width,
        used.height
    ));
}

/// Notes the size of the samples, and how exact they are.
fn note_errors(
    used: LatLong,
    whole: LatLong,
    directions: usize,
    estimates: &[Estimate],
    reporter: &Reporter,
) {
    let squares = |of: fn(&Estimate) -> [f64; 3]| {
        estimates.iter().flat_map(of).map(|value| value * value).sum::<f64>() / (3 * estimates.len()) as f64
    };
    let size = squares(|estimate| estimate.radiance).sqrt();
    let error = squares(|estimate| estimate.standard_error).sqrt();
    let largest = estimates.iter().flat_map(|estimate| estimate.standard_error).fold(0.0, f64::max);
    // A black map is exact.
    let relative = |error: f64| percent(if error > 0.0 { error / size } else { 0.0 });
    reporter.note(format!(
        "{} texels of the map, {directions} directions at each to {} x {} of the environment{}; standard error {} of \
         the map's root mean square, at most {}",
        estimates.len(),
        used.width,
        used.height,
        averaged(used, whole),
        relative(error),
        relative(largest),
    ));
}

/// Says how an environment became smaller, if it did.
fn averaged(used: LatLong, whole: LatLong) -> String {
    if used == whole { String::new() } else { format!(", averaged from {} x {}", whole.width, whole.height) }
}
