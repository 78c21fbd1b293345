//! Writes a reflection map by brute force: the integral that the other kinds compute faster.
//!
//! Each texel sums the environment's texels, radiance times rho_hat (the BRDF with its cosine) times solid
//! angle:
//!
//! > B(C, V) = sum over w of L(w) rho_hat(w, V) dOmega
//!
//! There are no harmonics, no degree and no ringing: use it to see what a degree or an export loses. The
//! central direction C of a texel is its own direction, as in `export-reflection-map`: the reflection vector,
//! or the normal of a lambert material, or the tangent of a kajiya-kay one. The time is proportional to
//! (texels of the map) x (lit texels of the environment); `rows` limits the second factor.
//!
//! ## The view
//!
//! | `view` | what a texel shows |
//! | --- | --- |
//! | `"head-on"` | each surface viewed straight on: the view, the normal and the reflection vector are one; for kajiya-kay, whose texels are tangents, the view is at a right angle to the tangent |
//! | `[yaw, pitch]` | every central direction seen by one distant viewer, in the direction +X turned by these degrees (a positive pitch lowers it, as in `rotate`) |
//!
//! For a material that looks the same from every view (lambert, phong) the map does not depend on `view`.
//!
//! ## Files
//!
//! The same files as `export-reflection-map` writes with the same `layout` and `format`.
//!
//! ## Example
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

use brdf::Centre;
use containers::Precision;
use engine::{
    Context, Diagnostic, Failure, Kind, Output, Parameter, Port, Product, Value, ValueKind, parameters,
    unexpected,
};
use serde_json::json;
use sh::Tolerance;
use shrm::reference::{Cull, Reference};
use shrm::{Plain, View};
use sphere::{Direction, LatLong, Rotation};

use crate::artifacts;
use crate::choices::{LampsName, MOST, Overflow, PrecisionName, STOPS};
use crate::export_reflection_map::{self as picture, ExportReflectionMap, Format, Layout};
use crate::parts::PartsName;

/// The direction of the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Viewer {
    /// Straight above each surface.
    HeadOn,
    /// A distant viewer: +X turned by yaw and pitch, in degrees.
    Far {
        /// About +Z, after the pitch.
        yaw: f64,
        /// About +Y; positive lowers +X.
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

parameters! {
    /// Parameters of `reference`.
    pub(crate) struct Parameters {
        /// The direction of the viewer; see The view.
        view: Viewer = Viewer::HeadOn,
        /// Rows of the environment that is summed over; it has twice as many columns. A finer environment is
        /// first averaged down to this, by exact areas.
        #[range(1..=MOST)]
        rows: usize = 128,
        /// The share of a lobe that may be ignored: lambert, phong and microfacet sum over the cap that holds
        /// the rest. 0 sums over everything.
        #[range(0.0..1.0)]
        cull: f64 = 0.0,
        /// How the sphere lies on the written images, as in export-reflection-map.
        layout: Layout = Layout::LatLong,
        /// Rows of a lat-long map, which has twice as many columns; texels along the edge of a cube's face.
        #[range(1..=MOST)]
        resolution: usize = 32,
        /// The container: OpenEXR, Radiance, or a tone-mapped PNG for looking.
        format: Format = Format::Exr,
        /// With format "exr": 16-bit or 32-bit numbers. A half holds 3 digits, up to 65504.
        precision: PrecisionName = PrecisionName(Precision::Half),
        /// With precision "half": what happens to values past 65504: they become 65504, or the item fails.
        overflow: Overflow = Overflow::Clamp,
        /// With format "png": stops by which radiance is multiplied before tone mapping.
        #[range(STOPS)]
        exposure: f64 = 0.0,
    }
}

impl Parameters {
    /// The parameters of the written files.
    fn picture(&self) -> picture::Parameters {
        picture::Parameters {
            layout: self.layout,
            resolution: self.resolution,
            format: self.format,
            precision: self.precision,
            overflow: self.overflow,
            exposure: self.exposure,
            view: picture::PlainName(Plain::Mean),
            lamps: LampsName::Baked,
            parts: PartsName::Together,
        }
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
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] =
        &[brdf::revisions::MODELS, shrm::revisions::REFERENCE, envmap::revisions::RESAMPLING];
    const TEXT: &'static str = include_str!("reference.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Environment>("environment"), Port::one::<artifacts::Material>("material")]
    }

    fn product(parameters: &Parameters, types: &[(&str, &'static str)]) -> Product {
        ExportReflectionMap::product(&parameters.picture(), types)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        ExportReflectionMap::check(&parameters.picture())
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let environment = context.get::<artifacts::Environment>("environment")?;
        let material = context.get::<artifacts::Material>("material")?;
        let whole = environment.0.grid();
        let coarse = (whole.height > parameters.rows)
            .then(|| environment.0.downsampled(LatLong::with_rows(parameters.rows)))
            .transpose()?;
        let light = coarse.as_ref().unwrap_or(&environment.0);
        let reference = Reference::new(light, &material.0, parameters.cull());
        let (view, toward) = match parameters.view {
            Viewer::HeadOn => match material.0.centre() {
                Centre::Reflection | Centre::Normal => (View::Local, Direction::Z),
                // A normal of the tangent: +X of the texel's frame. All normals of the tangent are
                // equivalent.
                Centre::Tangent => (View::Local, Direction::X),
            },
            Viewer::Far { yaw, pitch } => {
                let turn = Rotation::from_yaw_pitch_roll(yaw.to_radians(), pitch.to_radians(), 0.0);
                (View::Global, turn.apply(Direction::X))
            }
        };
        let picture = parameters.picture();
        let grid = picture::grid(&picture);
        let [faces, height, _] = grid.shape();
        let mut pixels = Vec::with_capacity(grid.len());
        for first in (0..faces * height).step_by(BAND) {
            context.check_cancelled()?;
            let rows = first..(first + BAND).min(faces * height);
            pixels.extend(reference.rows(grid, rows, view, toward));
        }
        note_sizes(light.grid(), whole, &reference, grid.len(), context);
        picture::write(&picture, &picture::arrange(&picture, pixels)?, context)
    }
}

/// Notes what was summed over.
fn note_sizes(used: LatLong, whole: LatLong, reference: &Reference, texels: usize, context: &Context<'_>) {
    let from = if used == whole {
        String::new()
    } else {
        format!(", averaged from {} x {}", whole.width, whole.height)
    };
    let width = reference.width();
    let cap = if width < 1.0 {
        format!(", limited to a cap of {:.2} % of the sphere", 100.0 * width)
    } else {
        String::new()
    };
    context.note(format!(
        "{texels} texels of the map, {} lit ones of {} x {} of the environment{from}{cap}",
        reference.lit(),
        used.width,
        used.height
    ));
}
