//! Unity.

use containers::lighting_json::Preset;
use taps::{Language, Source};

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::tap_shaders::TapPreset;

/// All that is known of Unity.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unity",
    "Unity.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: Some(Preset::Unity), readme },
)
.with_taps(&TAPS);

fn readme(image: &str, irradiance: &str) -> String {
    format!(
        "Unity filters the image itself.

1. Import {image} with Texture Shape: Cube, Mapping: Latitude-Longitude Layout, Convolution Type:
   Specular (Glossy Reflection).
2. Lighting window, Environment Reflections: Source: Custom, Cubemap: the texture.
3. The sky: a material with the shader Skybox/Cubemap and the texture, in Lighting window, Environment:
   Skybox Material.

{irradiance} has the irradiance for SphericalHarmonicsL2 (unity_SHAr and so on).
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Hlsl,
    source: Source::Atlas,
    textures: ".exr",
    cube_coordinates: ["-d.z", "d.y", "d.x"],
    rows_from_bottom: true,
    ending: ".hlsl",
    indent: "",
    shader: include_str!("tap_shaders/unity.hlsl"),
    readme: include_str!("tap_shaders/unity.txt"),
};
