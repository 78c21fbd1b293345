//! Unreal Engine.

use containers::lighting_json::Preset;
use taps::{Language, Source};

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::tap_shaders::TapPreset;

/// All that is known of Unreal Engine.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unreal",
    "Unreal Engine.",
    EngineImage { formats: &[EngineFormat::Hdr], irradiance: Some(Preset::Unreal), readme },
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

const TAPS: TapPreset = TapPreset {
    language: Language::Hlsl,
    source: Source::Atlas,
    textures: ".exr",
    cube_coordinates: ["d.x", "d.z", "-d.y"],
    rows_from_bottom: false,
    ending: ".ush",
    indent: "    ",
    shader: include_str!("tap_shaders/unreal.ush"),
    readme: include_str!("tap_shaders/unreal.txt"),
};
