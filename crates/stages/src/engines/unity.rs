//! Unity.

use containers::lighting_json::Preset;
use sphere::DVec3;
use taps::{Language, Source};

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::tap_shaders::TapPreset;

/// All that is known of Unity.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unity",
    "Unity.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: Some(Preset::Unity), readme },
    [DVec3::X, DVec3::Z, DVec3::Y],
    EngineLights {
        readme: lights_readme,
        scene: LightScene::Gltf,
        imported_from: |d| DVec3::new(-d.x, d.y, d.z),
    },
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

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image are in {lights}. Each is a Directional Light:

light.transform.rotation = Quaternion.LookRotation(-direction);
light.color = new Color(colour[0], colour[1], colour[2]).gamma;
light.intensity = intensity / Mathf.PI;

HDRP takes the intensity itself, in Lux, and the angular diameter.
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Hlsl,
    source: Source::Atlas,
    textures: ".exr",
    rows_from_bottom: true,
    ending: ".hlsl",
    indent: "",
    shader: include_str!("tap_shaders/unity.hlsl"),
    readme: include_str!("tap_shaders/unity.txt"),
};
