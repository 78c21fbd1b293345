//! Godot.

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::tap_shaders::TapPreset;
use taps::{Language, Source};

/// All that is known of Godot.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "godot",
    "Godot.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: None, readme },
)
.with_taps(&TAPS);

fn readme(image: &str, _: &str) -> String {
    format!(
        "Godot 4 filters the image itself. In a script of a WorldEnvironment:

var sky := PanoramaSkyMaterial.new()
sky.panorama = load(\"res://{image}\")
environment.sky = Sky.new()
environment.sky.sky_material = sky
environment.background_mode = Environment.BG_SKY
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Glsl,
    source: Source::Atlas,
    textures: ".exr",
    cube_coordinates: ["d.x", "d.y", "-d.z"],
    rows_from_bottom: false,
    ending: ".gdshader",
    indent: "",
    shader: include_str!("tap_shaders/godot.gdshader"),
    readme: include_str!("tap_shaders/godot.txt"),
};
