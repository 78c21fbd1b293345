//! Writes the table of directional albedos that engines use with a prefiltered environment.
//!
//! ```toml
//! [stage.dfg]
//! kind = "dfg"
//! variant = "correlated"
//! path = "dfg"
//! ```
//!
//! A texel holds A and B of E = F0 A + B, the share of light that a GGX lobe reflects if all directions are
//! equally bright; F0 is the reflectance seen straight on (Karis 2013, "Real Shading in Unreal Engine 4";
//! glTF and Filament call the table DFG). Columns are n.v, rows the roughness r with a = r^2, both at the
//! centres of texels; the first row is smooth.
//!
//! | `variant` | masking and shadowing | red, green |
//! | --- | --- | --- |
//! | `correlated` | Smith's with correlated heights (Heitz 2014): glTF, Bevy, Unity HDRP, Godot | A, B |
//! | `uncorrelated` | Smith's, G1(v) G1(l) | A, B |
//! | `karis` | Schlick's with k = a / 2: Unreal, three.js before r160 | A, B |
//! | `filament` | as `correlated`, for multiple scattering: E = mix(x, y, F0), times 1 + F0 (1 / y - 1); the first row is rough, r = min((rows - row + 0.5) / rows, 1) | B, A + B |
//!
//! Multiple scattering after Fdez-Aguera 2019 uses A and B of `correlated` at run time.
//!
//! With `sheen` the third channel is the albedo of the sheen lobe of Estevez and Kulla 2017 ("Charlie") with
//! the visibility of Neubelt and Pettineo 2013. It can exceed 1.
//!
//! ## Taps
//!
//! `form = "taps"` instead writes the table for compact maps (docs/taps.md) that serves every metal and
//! dielectric of an engine. For each of `taps` look-ups into the scale space of an environment
//! (`scale-space`) it has the position, the width, and A and B. The highlight is the sum of F0 A + B times
//! the result of each look-up. Over all look-ups A and B add up to those of `correlated`.
//!
//! The texture is an array of 65 columns, column i for 1 - n.v = i / 64, and 33 rows, row i for the roughness
//! i / 32, in halves. Layer j is (delta, log2 s, A, B) of look-up j, with the angle delta from the mirrored
//! view toward the normal and the width s in radians; the last layer is (y, 0, A, B) of the look-up about the
//! normal. It is fitted in seconds.
//!
//! Values are accurate to 1e-6. KTX2 and DDS round them to halves: RG16F, or RGBA16F with sheen. OpenEXR
//! holds floats. The table has no input, so it is computed only once.
//!
//! ## Files
//!
//! `.ktx2`, `.exr` or `.dds` after the item's `path`.

use brdf::{ScaleBias, Visibility, environment_brdf, sheen_albedo};
use containers::{Precision, TexelFormat, Texture, write_dds, write_exr, write_ktx2};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use rayon::prelude::*;
use taps::{Widths, fit_by_reflectance};

use super::varied_taps::{STEPS, texture};
use crate::values::{UntilStopped, image};

choice! {
    /// Masking and shadowing, and what the channels hold.
    pub(crate) enum Variant {
        /// Smith's of correlated heights.
        Correlated = "correlated",
        /// Smith's, of light and view by themselves.
        Uncorrelated = "uncorrelated",
        /// Schlick's approximation with k = a / 2.
        Karis = "karis",
        /// As Filament has it.
        Filament = "filament",
    }
}

choice! {
    /// What a table holds.
    pub(crate) enum Form {
        /// A and B.
        Albedo = "albedo",
        /// Look-ups with A and B of each.
        Taps = "taps",
    }
}

choice! {
    /// The container.
    pub(crate) enum DfgFormat {
        /// KTX2 in halves.
        Ktx2 = "ktx2",
        /// OpenEXR in floats.
        Exr = "exr",
        /// DDS in halves.
        Dds = "dds",
    }
}

parameters! {
    /// Parameters of `dfg`.
    pub(crate) struct Parameters {
        /// Masking and shadowing, and the content of the channels; see the table.
        variant: Variant = Variant::Correlated,
        /// Columns and rows.
        #[range(2..=1024)]
        #[was("size")]
        resolution: usize = RESOLUTION,
        /// Whether the third channel is the albedo of sheen.
        sheen: bool = false,
        /// The container.
        format: DfgFormat = DfgFormat::Ktx2,
        /// The content of the table; see Taps.
        form: Form = Form::Albedo,
        /// With form "taps": the number of look-ups into the levels of a scale space.
        #[range(1..=16)]
        taps: usize = TAPS,
    }
}

/// The default columns and rows, and the default look-ups.
const RESOLUTION: usize = 128;
const TAPS: usize = 6;

impl Parameters {
    fn texel(&self, row: usize, column: usize) -> [f32; 3] {
        let size = self.resolution as f64;
        let view = (column as f64 + 0.5) / size;
        let roughness = match self.variant {
            Variant::Filament => ((size - row as f64 + 0.5) / size).min(1.0),
            _ => (row as f64 + 0.5) / size,
        };
        let visibility = match self.variant {
            Variant::Correlated | Variant::Filament => Visibility::Correlated,
            Variant::Uncorrelated => Visibility::Uncorrelated,
            Variant::Karis => Visibility::Karis,
        };
        let ScaleBias { scale, bias } = environment_brdf(visibility, roughness, view);
        let [red, green] = match self.variant {
            Variant::Filament => [bias, scale + bias],
            _ => [scale, bias],
        };
        let blue = if self.sheen { sheen_albedo(roughness, view) } else { 0.0 };
        [red as f32, green as f32, blue as f32]
    }
}

/// The kind `dfg`.
pub(crate) struct Dfg;

impl Kind for Dfg {
    type Parameters = Parameters;

    const NAME: &'static str = "dfg";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] =
        &[brdf::revisions::ENVIRONMENT_BRDF, brdf::revisions::MODELS, taps::revisions::FIT];
    const TEXT: &'static str = include_str!("dfg.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![
            match parameters.format {
                DfgFormat::Ktx2 => ".ktx2",
                DfgFormat::Exr => ".exr",
                DfgFormat::Dds => ".dds",
            }
            .into(),
        ])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let of_albedo = "only form = \"albedo\" uses it";
        let wrong = match parameters.form {
            Form::Albedo => {
                vec![("taps", parameters.taps != TAPS, "only form = \"taps\" uses it")]
            }
            Form::Taps => vec![
                ("variant", parameters.variant != Variant::Correlated, of_albedo),
                ("resolution", parameters.resolution != RESOLUTION, of_albedo),
                ("sheen", parameters.sheen, of_albedo),
                (
                    "format",
                    parameters.format == DfgFormat::Exr,
                    "OpenEXR has no arrays of pictures; expected \"ktx2\" or \"dds\"",
                ),
            ],
        };
        let wrong = wrong.into_iter().filter(|(_, is_wrong, _)| *is_wrong);
        wrong.map(|(name, _, text)| (name, text.to_owned())).collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        if parameters.form == Form::Taps {
            let fitted = context.reporter.until_stopped(|stop| {
                fit_by_reflectance(STEPS, parameters.taps, Widths::FINEST, stop).map_err(Failure::from)
            })?;
            let is_dds = parameters.format == DfgFormat::Dds;
            return Ok(Output::files(vec![texture(&fitted.table, is_dds, context.recipe())?]));
        }
        let size = parameters.resolution;
        let row = |row: usize| -> Result<Vec<[f32; 3]>, Failure> {
            context.reporter.check_cancelled()?;
            Ok((0..size).map(|column| parameters.texel(row, column)).collect())
        };
        let pixels = (0..size).into_par_iter().map(row).collect::<Result<Vec<_>, _>>()?.concat();
        let format = if parameters.sheen { TexelFormat::Rgba16F } else { TexelFormat::Rg16F };
        let recipe = Some(context.recipe());
        let encoded = match parameters.format {
            DfgFormat::Exr => write_exr(&image(size, size, pixels)?, Precision::Float, recipe)?,
            other => {
                let texture = Texture { width: size, height: size, pixels, ..Texture::default() };
                match other {
                    DfgFormat::Dds => write_dds(&texture, format)?,
                    _ => write_ktx2(&texture, format, recipe, &[])?,
                }
            }
        };
        Ok(Output::files(vec![encoded.bytes]))
    }
}
