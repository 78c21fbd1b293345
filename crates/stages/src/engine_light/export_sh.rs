//! Writes the coefficients of a lighting, for people and for engines.
//!
//! ```toml
//! [stage.sh]
//! kind = "export-sh"
//! input = "lighting"
//! preset = "three"
//! path = "{environment}/sh"
//! ```
//!
//! Every JSON file describes its content: frame, signs, scale, the source of the convention, degree and
//! coefficients.
//!
//! | `preset` | what the file holds | degree |
//! | --- | --- | --- |
//! | `specula` | Specula's own convention: right-handed, +Z up, orthonormal, no Condon-Shortley phase, radiance | all |
//! | `directx` | DirectXMath and cmft: left-handed, +Y up, Condon-Shortley signs, radiance | 1 to 5 |
//! | `unreal` | left-handed, +Z up, Condon-Shortley signs, radiance | 2 |
//! | `unity` | left-handed, +Y up: SHA, SHB, SHC of the light that a white diffuse surface reflects | 2 |
//! | `filament` | right-handed, +Y up: polynomials of the light that a white diffuse surface reflects | 2 |
//! | `three` | right-handed, +Y up, no phase, radiance | 2 |
//! | `babylon` | left-handed, +Y up, Condon-Shortley signs: the light that a white diffuse surface reflects | 2 |
//! | `babylon-env` | left-handed, +Y up: the polynomial in an `.env` file | 2 |
//! | `gltf` | left-handed, +Y up, Condon-Shortley signs: irradiance, of EXT_lights_image_based | 2 |
//!
//! If the preset has a lower degree than the lighting, only the first coefficients are written (nine for
//! degree 2), and the build notes it. Diffuse surfaces lose little: degree 2 holds over 99 % of the energy
//! of the cosine.
//!
//! ## Suns
//!
//! A few coefficients cannot represent a sun: their irradiance is negative on the far side. So up to degree
//! 8 the coefficients are multiplied by the weakest window, 1 / (1 + lambda l^2 (l + 1)^2), under which the
//! irradiance is never negative (`window = "none"` turns this off). Softer light needs no window and does
//! not change.
//!
//! With `lamps = "separate"` the coefficients hold the light without suns and lamps. These are in `lights`,
//! as directional lights for an engine: a row for each with its direction in the preset's frame, its
//! angular radius in radians, and the irradiance r, g, b of a surface that faces it. `project-sh` separates
//! lamps if it has neither a degree nor a tolerance.
//!
//! ## The presets in full
//!
//! Each of these is a member of the file, under the same name. A preset loses only the degrees above its
//! own. A_l is the factor of the cosine: pi, 2 pi / 3, pi / 4 for l = 0, 1, 2.
//!
//! `specula`
//!
//! - frame: right-handed, +Z up
//! - yaw: the centre of a lat-long image looks along +X, its left quarter along +Y
//! - signs: no Condon-Shortley phase: l = 1 rows are 0.488603 (y, z, x); row l*l + l + m
//! - scale: radiance, orthonormal basis
//! - source: Specula, CONVENTIONS.md
//!
//! `directx`
//!
//! - frame: left-handed, +Y up: x = -y, y = z, z = x of Specula's frame
//! - yaw: the centre of a lat-long image looks along +Z, its right quarter along +X (cmft, latLongFromVec)
//! - signs: Condon-Shortley phase: odd m carry a minus; row l*l + l + m
//! - scale: radiance, orthonormal basis; degree 1 to 5 (order 2 to 6)
//! - source: DirectXMath SHMath/DirectXSH.cpp, sh_eval_basis; cmft src/cmft/cubemapfilter.cpp, evalSHBasis5,
//!   and cubemaputils.h
//!
//! `unreal`
//!
//! - frame: left-handed, +Z up: x = -y, y = -x, z = z of Specula's frame
//! - yaw: the centre of a lat-long image looks along -Y, its right quarter along +X (long-lat textures)
//! - signs: Condon-Shortley phase: odd m carry a minus; row l*l + l + m
//! - scale: radiance, orthonormal basis
//! - source: Unreal Engine Shaders/Private/SHCommon.ush, SHBasisFunction3; TextureCompressorModule.cpp,
//!   LookupLongLat and TransformSideToWorldSpace
//!
//! `unity`
//!
//! - frame: left-handed, +Y up: x = x, y = z, z = y of Specula's frame
//! - yaw: the centre of a lat-long image looks along +X, its left quarter along +Z (Skybox/Panoramic)
//! - signs: coefficients of polynomials: SHA of (x, y, z, 1), SHB of (xy, yz, zz, zx), SHC of xx - yy
//! - scale: A_l / pi times radiance: what a white diffuse surface reflects
//! - source: Unity EntityLighting.hlsl, SHEvalLinearL0L1 and SHEvalLinearL2; HDRP SphericalHarmonics.cs,
//!   PackCoefficients; Skybox-Panoramic.shader, ToRadialCoords
//!
//! `filament`
//!
//! - frame: right-handed, +Y up: x = y, y = z, z = x of Specula's frame
//! - yaw: the centre of a lat-long image looks along +Z, its left quarter along +X (cmgen, mirrored as by
//!   default)
//! - signs: coefficients of 1, y, z, x, xy, yz, 3zz - 1, zx, xx - yy
//! - scale: A_l / pi times radiance times the basis' constants: what a white diffuse surface reflects, ready
//!   for IndirectLight::Builder::irradiance(3, sh)
//! - source: Filament libs/ibl/src/CubemapSH.cpp, computeIrradianceSH3Bands and renderPreScaledSH3Bands;
//!   CubemapUtils.cpp, equirectangularToCubemap; cmgen.cpp
//!
//! `three`
//!
//! - frame: right-handed, +Y up: x = x, y = z, z = -y of Specula's frame
//! - yaw: the centre of a lat-long image looks along +X, its right quarter along +Z (equirectUv)
//! - signs: no Condon-Shortley phase: l = 1 rows are 0.488603 (y, z, x); row l*l + l + m
//! - scale: radiance, orthonormal basis; getIrradianceAt applies A_l
//! - source: three.js src/math/SphericalHarmonics3.js; ShaderChunk/common.glsl.js, equirectUv
//!
//! `babylon`
//!
//! - frame: left-handed, +Y up: x = -y, y = z, z = x of Specula's frame
//! - yaw: the centre of a lat-long image looks along +Z, its right quarter along +X (panoramaToCubemap.ts)
//! - signs: Condon-Shortley phase: odd m carry a minus; row l*l + l + m
//! - scale: A_l / pi times radiance, orthonormal basis:
//!   SphericalPolynomial.FromHarmonics(SphericalHarmonics.FromArray(coefficients)); preScaledHarmonics then
//!   applies the basis' constants
//! - source: Babylon.js Maths/sphericalPolynomial.ts; Misc/HighDynamicRange/cubemapToSphericalPolynomial.ts;
//!   harmonicsFunctions.fx, computeEnvironmentIrradiance
//!
//! `babylon-env`
//!
//! - frame: left-handed, +Y up: x = -y, y = z, z = x of Specula's frame, the frame of a cube's faces
//! - yaw: the centre of a lat-long image looks along +Z, its right quarter along +X (panoramaToCubemap.ts)
//! - signs: coefficients of x, y, z, xx, yy, zz, yz, zx, xy; a constant is in xx, yy and zz
//! - scale: (A_l / pi)^2 times radiance: what a white diffuse surface reflects, convolved with the cosine
//!   once more, as the files of Babylon.js have it
//! - source: Babylon.js Misc/environmentTextureTools.ts, CreateEnvTextureAsync; Maths/sphericalPolynomial.ts;
//!   seen in the engine
//!
//! `gltf`
//!
//! - frame: left-handed, +Y up: x = -y, y = z, z = x of Specula's frame, the frame of a cube's faces
//! - yaw: the centre of a lat-long image looks along +Z, its right quarter along +X, as in Babylon.js, the
//!   extension's reader
//! - signs: Condon-Shortley phase: odd m carry a minus; row l*l + l + m
//! - scale: A_l times radiance: irradiance, orthonormal basis; irradianceCoefficients
//! - source: glTF EXT_lights_image_based; Babylon.js loaders/glTF/2.0/Extensions/EXT_lights_image_based.ts;
//!   seen in the engine
//!
//! ## Safetensors
//!
//! `format = "safetensors"` writes the tensor `sh` of shape [(degree + 1)^2, 3], f64, in row order l*l + l +
//! m, in the convention of the preset `specula`. In Python:
//!
//! ```python
//! sh = safetensors.numpy.load_file("sh.safetensors")["sh"]
//! ```
//!
//! ## Files
//!
//! `.json` or `.safetensors` after the item's `path`.

use containers::lighting_json::{self, Preset};
use containers::tensors;
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use sh::Degree;

use super::irradiance::{MOST_WINDOWED, windowed};
use crate::values::{LampsName, Window, artifacts};

choice! {
    /// The container.
    pub(crate) enum ShFormat {
        /// JSON.
        Json = "json",
        /// Safetensors.
        Safetensors = "safetensors",
    }
}

choice! {
    /// The convention of the coefficients.
    pub(crate) enum PresetName: Preset {
        /// Specula's own.
        Specula,
        /// DirectXMath and cmft.
        DirectX,
        /// Unreal Engine.
        Unreal,
        /// Unity.
        Unity,
        /// Filament.
        Filament,
        /// three.js.
        Three,
        /// Babylon.js.
        Babylon,
        /// The polynomial in an `.env` file of Babylon.js.
        BabylonEnv,
        /// EXT_lights_image_based of glTF.
        Gltf,
    }
}

parameters! {
    /// Parameters of `export-sh`.
    pub(crate) struct Parameters {
        /// The container: JSON for people and engines, safetensors for programs.
        format: ShFormat = ShFormat::Json,
        /// With format "json": the convention of the coefficients; see the table.
        preset: PresetName = PresetName(Preset::Specula),
        /// The highest l that is written, 2 for the nine coefficients of a probe. Default: that of the
        /// lighting, or of the preset.
        #[range(0..=Degree::MAX.get())]
        degree: Option<usize> = None,
        /// Whether suns and lamps are in the coefficients or separate; see Suns.
        lamps: LampsName = LampsName::Baked,
        /// Up to degree 8: the window against ringing; see Suns.
        #[words(Window::Auto, Window::None)]
        window: Window = Window::Auto,
    }
}

/// The kind `export-sh`.
pub(crate) struct ExportSh;

impl Kind for ExportSh {
    type Parameters = Parameters;

    const NAME: &'static str = "export-sh";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sh::revisions::WINDOW];
    const TEXT: &'static str = include_str!("export_sh.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lighting")]
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![match parameters.format {
            ShFormat::Json => ".json".into(),
            ShFormat::Safetensors => ".safetensors".into(),
        }])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        if parameters.format == ShFormat::Safetensors && parameters.preset.0 != Preset::Specula {
            return vec![(
                "preset",
                "format = \"safetensors\" holds coefficients in Specula's own convention only".into(),
            )];
        }
        Vec::new()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let lighting = &context.inputs.get::<artifacts::Lighting>("lighting")?.0;
        let mut lighting = match parameters.lamps {
            LampsName::Baked => lighting.whole().into(),
            LampsName::Separate => lighting.clone(),
        };
        if let Some(degree) = parameters.degree {
            lighting.series = lighting.series.to_degree(Degree::new(degree)?);
        }
        let PresetName(preset) = parameters.preset;
        let (given, written) = (lighting.series.degree(), preset.degree(lighting.series.degree()));
        if written < given.get() {
            context.reporter.note(format!(
                "preset {} holds degree {written}: the first {} of {} coefficients",
                preset.name(),
                (written + 1) * (written + 1),
                given.rows()
            ));
            lighting.series = lighting.series.to_degree(Degree::new(written)?);
        }
        if parameters.window == Window::Auto && lighting.series.degree().get() <= MOST_WINDOWED {
            lighting.series = windowed(lighting.series, &context.reporter);
        }
        let recipe = Some(context.recipe());
        if parameters.format == ShFormat::Safetensors {
            return Ok(Output::files(vec![tensors::encode_lighting(&lighting, recipe)?]));
        }
        Ok(Output::files(vec![lighting_json::encode(&lighting, preset, recipe)?]))
    }
}
