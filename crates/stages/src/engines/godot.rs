//! Godot.

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::tap_shaders::TapPreset;
use sphere::DVec3;
use taps::{Language, Source};

/// All that is known of Godot.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "godot",
    "Godot.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: None, readme },
    [DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y],
    EngineLights { readme: lights_readme, scene: LightScene::Godot, imported_from: |d| d },
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

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image, children of the node of this script:

for entry in JSON.parse_string(FileAccess.get_file_as_string(\"res://{lights}\")).lights:
	var light := DirectionalLight3D.new()
	var direction := Vector3(entry.direction[0], entry.direction[1], entry.direction[2])
	add_child(light)
	light.name = entry.name
	light.look_at_from_position(direction, Vector3.ZERO, Vector3.UP if abs(direction.y) < 0.99 else Vector3.RIGHT)
	light.light_color = Color(entry.colour[0], entry.colour[1], entry.colour[2]).linear_to_srgb()
	light.light_energy = entry.intensity / PI
	light.light_angular_distance = entry.angular_diameter
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Glsl,
    source: Source::Atlas,
    textures: ".exr",
    rows_from_bottom: false,
    ending: ".gdshader",
    indent: "",
    shader: include_str!("tap_shaders/godot.gdshader"),
    readme: include_str!("tap_shaders/godot.txt"),
};
