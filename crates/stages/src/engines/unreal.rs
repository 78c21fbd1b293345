//! Unreal Engine.

use containers::lighting_json::Preset;

use super::definition::{Engine, EngineImage};
use super::engine_format::EngineFormat;

/// All that is known of Unreal Engine.
pub(crate) const ENGINE: Engine = Engine::of_image(
    "unreal",
    "Unreal Engine.",
    EngineImage { formats: &[EngineFormat::Hdr], irradiance: Some(Preset::Unreal), readme },
);

fn readme(image: &str, light: &str) -> String {
    format!(
        "Unreal Engine filters the image itself.

1. Import {image}: a Radiance image becomes a TextureCube.
2. Sky Light, Source Type: SLS Specified Cubemap, Cubemap: the texture.

{light} has the light as nine coefficients in Unreal's frame.
"
    )
}
