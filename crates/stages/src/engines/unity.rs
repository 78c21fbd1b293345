//! Unity.

use containers::lighting_json::Preset;

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;

/// All that is known of Unity.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unity",
    "Unity.",
    EngineImage { formats: &[EngineFormat::Exr, EngineFormat::Hdr], irradiance: Some(Preset::Unity), readme },
);

fn readme(image: &str, irradiance: &str) -> String {
    format!(
        "Unity filters the image itself.

1. Import {image} with Texture Shape: Cube, Mapping: Latitude-Longitude Layout, Convolution Type:
   Specular (Glossy Reflection).
2. Lighting window, Environment Reflections: Source: Custom, Cubemap: the texture.

{irradiance} has the irradiance for SphericalHarmonicsL2 (unity_SHAr and so on).
"
    )
}
