//! Godot.

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;

/// All that is known of Godot.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "godot",
    "Godot.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: None, readme },
);

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
