//! Writes lights for renderers and programs: as glTF, USD, a table, or samples.
//!
//! ```toml
//! [stage.lights]
//! kind = "export-light-rig"
//! input = "rig"
//! format = "usda"
//! path = "{environment}/lights"
//! ```
//!
//! | `format` | the file holds | frame |
//! | --- | --- | --- |
//! | `gltf` | directional lights of `KHR_lights_punctual`, a node for each | +Y up, as all glTF |
//! | `usda` | a `DistantLight` for each | +Y up |
//! | `csv` | a row for each: direction, radius, irradiance and flux | Specula's, +Z up |
//! | `safetensors` | `direction` [n, 3], `radiance` [n, 3], `pdf` and `mip` \[n\], 32-bit | Specula's, +Z up |
//!
//! Specula's (x, y, z) is (z, x, y) of glTF and USD. The lights come from `sample-light`, from
//! `circular-lights`, or from a `project-sh` with separate lamps; the series is not written (`export-sh`
//! does that).
//!
//! ## glTF and USD
//!
//! The light of a node or prim travels along its -Z. `color` is scaled so that its largest channel is 1,
//! and `intensity` times `color` is the irradiance of a surface that faces the light, in the unit of the
//! environment times steradians, which is right for renderers that show a radiance of 1 as white. glTF
//! calls this lux. USD lights have `inputs:angle`, the diameter in degrees, and `inputs:normalize`: without
//! it the intensity would be the radiance of the disk (OpenUSD, "Normalizing Distant Lights - In Depth"). A
//! glTF light has no size: renderers shade it as a point, whose highlight is too bright and too small if
//! the light is wider than the highlight. Its angular radius in degrees is in `extras`.
//!
//! ## Samples
//!
//! `safetensors` holds one sample of each light, for renderers that use importance sampling of an
//! environment and read it from mip levels. With n lights, each with a solid angle W, `pdf` is 1 / (n W),
//! `radiance` is the mean over W, and `mip` is the level of a lat-long map of `resolution` rows whose
//! texels are as large as W (Krivanek and Colbert 2008). So 1/n times the sum of f(direction) radiance /
//! pdf is the integral of f times the light.
//!
//! ```python
//! rig = safetensors.numpy.load_file("rig.safetensors")
//! flux = rig["radiance"] / (len(rig["pdf"]) * rig["pdf"][:, None])
//! ```
//!
//! ## Files
//!
//! `.gltf`, `.usda`, `.csv` or `.safetensors` after the item's `path`. A CSV file has no room for the
//! recipe, which is in a `.json` file next to it.

use containers::{
    SceneAxes, tensors, texture_sidecar, write_csv_lights, write_gltf_lights, write_usda_lights,
};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};

use crate::values::{MAX_RESOLUTION, artifacts};

choice! {
    /// The container.
    pub(crate) enum RigFormat {
        /// glTF, as text.
        Gltf = "gltf",
        /// USD, as text.
        Usda = "usda",
        /// A table.
        Csv = "csv",
        /// Samples for programs.
        Safetensors = "safetensors",
    }
}

/// The number of rows of the map that `mip` is a level of.
const ROWS: usize = 512;

parameters! {
    /// Parameters of `export-light-rig`.
    pub(crate) struct Parameters {
        /// The container; see the table.
        format: RigFormat = RigFormat::Gltf,
        /// With format "safetensors": rows of the lat-long map whose levels `mip` refers to. Default: 512.
        #[range(1..=MAX_RESOLUTION)]
        #[was("rows")]
        resolution: Option<usize> = None,
    }
}

/// The kind `export-light-rig`.
pub(crate) struct ExportLightRig;

impl Kind for ExportLightRig {
    type Parameters = Parameters;

    const NAME: &'static str = "export-light-rig";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("export_light_rig.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lights")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        let endings: &[&str] = match parameters.format {
            RigFormat::Gltf => &[".gltf"],
            RigFormat::Usda => &[".usda"],
            RigFormat::Csv => &[".json", ".csv"],
            RigFormat::Safetensors => &[".safetensors"],
        };
        Product::Files(endings.iter().map(|ending| (*ending).to_owned()).collect())
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        if parameters.resolution.is_some() && parameters.format != RigFormat::Safetensors {
            return vec![("resolution", "only format = \"safetensors\" uses it".into())];
        }
        Vec::new()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let lighting = &context.inputs.get::<artifacts::Lighting>("lights")?.0;
        let lights = &lighting.lights[..];
        if lights.is_empty() {
            return Err(Failure::new("the lighting has no separate lights")
                .help("make some with sample-light, or with lamps = \"separate\" of project-sh"));
        }
        if lighting.series.coefficients().as_flattened().iter().any(|value| *value != 0.0) {
            context.reporter.note("only the lights are written, not the series");
        }
        let recipe = Some(context.recipe());
        Ok(Output::files(match parameters.format {
            RigFormat::Gltf => vec![write_gltf_lights(lights, SceneAxes::IDENTITY, recipe)?],
            RigFormat::Usda => vec![write_usda_lights(lights, SceneAxes::IDENTITY, None, recipe)?],
            RigFormat::Csv => vec![texture_sidecar(recipe, &[])?, write_csv_lights(lights)?],
            RigFormat::Safetensors => {
                vec![tensors::encode_light_rig(lights, parameters.resolution.unwrap_or(ROWS), recipe)?]
            }
        }))
    }
}
