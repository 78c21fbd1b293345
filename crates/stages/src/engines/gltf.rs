//! EXT_lights_image_based, as Babylon.js reads it: its loader sets the scale of levels to n / log2(size).

use containers::lighting_json::Preset;
use containers::{Encoded, ImageBasedLight, read_gltf_image_based_light, write_gltf_image_based_light};
use engine::Failure;
use sphere::DVec3;

use super::babylon;
use super::cube_light::CubeLight;
use super::definition::{CubeFiles, Engine, EngineCube, EngineLight};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::levels::Levels;

/// All that is known of EXT_lights_image_based.
pub(crate) const ENGINE: Engine = Engine {
    name: "gltf",
    meaning: "EXT_lights_image_based, as Babylon.js reads it.",
    versions: "",
    light: EngineLight::Cube(EngineCube {
        levels: Levels {
            roughness: |l, n, size| math::pow(size, 0.5 * (l / n - 1.0)),
            level: |r, n, size| n / math::log2(size) * math::log2(size * r * r),
            formula: "r^2 = {size}^(l / n - 1)",
            remark: "; a mirror first",
        },
        last: 16,
        levels_remark: "",
        direction_at: |c| DVec3::new(-c.x, c.y, c.z),
        direction: "(-c.x, c.y, c.z)",
        files: &[CubeFiles {
            formats: &[EngineFormat::Rgbd],
            endings: &[".gltf"],
            write,
            read: |bytes| Ok(read_gltf_image_based_light(bytes)?.cube),
            readme,
            skybox: &babylon::SKYBOX,
        }],
        endings: "`.gltf` with EXT_lights_image_based",
    }),
    axes: [DVec3::Z, DVec3::NEG_X, DVec3::Y],
    lights: EngineLights {
        readme: babylon::lights_readme,
        scene: LightScene::Gltf,
        imported_from: |d| DVec3::new(-d.x, d.y, d.z),
    },
    taps: None,
};

fn write(light: &CubeLight<'_>) -> Result<(Encoded, Vec<Vec<u8>>), Failure> {
    let irradiance = <[[f64; 3]; 9]>::try_from(light.irradiance_rows(Preset::Gltf))
        .map_err(|rows| Failure::new(format!("{} rows of irradiance", rows.len())))?;
    let document = ImageBasedLight { cube: light.texture.clone(), irradiance };
    Ok((write_gltf_image_based_light(&document, light.recipe)?, Vec::new()))
}

fn readme(document: &str, _: &str) -> String {
    format!(
        "glTF with EXT_lights_image_based, as Babylon.js reads it.

await BABYLON.ImportMeshAsync( '{document}', scene );
scene.environmentTexture.gammaSpace = false;

Babylon.js 9 takes the values for sRGB without the last line.
"
    )
}
