//! Unreal Engine.

use containers::lighting_json::Preset;
use sphere::DVec3;
use taps::{Language, Source};

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::tap_shaders::TapPreset;

/// All that is known of Unreal Engine.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unreal",
    "Unreal Engine.",
    EngineImage { formats: &[EngineFormat::Hdr], irradiance: Some(Preset::Unreal), readme },
    [DVec3::NEG_Y, DVec3::NEG_X, DVec3::Z],
    EngineLights {
        readme: lights_readme,
        scene: LightScene::Usd { intensity: 1.0, angle: 1.0 },
        imported_from: |d| DVec3::new(d.x, d.z, d.y),
    },
)
.with_taps(&TAPS);

fn readme(image: &str, light: &str) -> String {
    format!(
        "Unreal Engine filters the image itself.

1. Import {image}: a Radiance image becomes a TextureCube.
2. Sky Light, Source Type: SLS Specified Cubemap, Cubemap: the texture.
3. The sky: an HDRI Backdrop (a plugin of the engine) with the texture as its Cubemap, which brings a Sky
   Light of its own; remove that of 2.

{light} has the light as nine coefficients in Unreal's frame.
"
    )
}

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image are in {lights}. Each is a Directional Light: its rotation that of the vector
-direction (Make Rot from X), Intensity intensity in lux, Light Color colour (linear), Source Angle angular_diameter.
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Hlsl,
    source: Source::Atlas,
    textures: ".exr",
    rows_from_bottom: false,
    ending: ".ush",
    indent: "    ",
    shader: include_str!("tap_shaders/unreal.ush"),
    readme: include_str!("tap_shaders/unreal.txt"),
};
