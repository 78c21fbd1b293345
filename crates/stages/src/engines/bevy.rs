//! Bevy. It loads no lat-long image; the centre of one is laid along +X, as by three.js.

use containers::{Encoded, write_ktx2_zstd};
use engine::Failure;
use sphere::DVec3;
use taps::{Language, Source};

use super::cube_light::CubeLight;
use super::definition::{CubeFiles, Engine, EngineCube, EngineLight, Skybox, read_cube};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::levels::Levels;
use super::tap_shaders::TapPreset;

/// All that is known of Bevy.
pub(crate) const ENGINE: Engine = Engine {
    name: "bevy",
    meaning: "Bevy.",
    versions: "",
    light: EngineLight::Cube(EngineCube {
        levels: Levels {
            roughness: |l, n, _| l / n,
            level: |r, n, _| n * r,
            formula: "r = l / n",
            remark: "",
        },
        last: 16,
        levels_remark: "; one level of irradiance over pi",
        direction_at: |c| DVec3::new(c.z, c.y, c.x),
        direction: "(c.z, c.y, c.x)",
        files: &[CubeFiles {
            formats: &[EngineFormat::Rgb9E5, EngineFormat::Rgba16F, EngineFormat::Bc6h],
            endings: &["-specular.ktx2", "-diffuse.ktx2"],
            write,
            read: read_cube,
            readme,
            skybox: &Skybox::ktx2(skybox_readme),
        }],
        endings: "`-specular.ktx2`, `-diffuse.ktx2`",
    }),
    axes: [DVec3::X, DVec3::NEG_Z, DVec3::Y],
    lights: EngineLights { readme: lights_readme, scene: LightScene::Gltf, imported_from: |d| d },
    taps: Some(&TAPS),
};

fn write(light: &CubeLight<'_>) -> Result<(Encoded, Vec<Vec<u8>>), Failure> {
    let diffuse = write_ktx2_zstd(&light.irradiance_cube()?, light.texels, light.recipe, &[])?;
    Ok((light.ktx2()?, vec![diffuse.bytes]))
}

fn readme(specular: &str, diffuse: &str) -> String {
    format!(
        "Bevy, with the features ktx2 and zstd_rust.

commands.spawn((Camera3d::default(), EnvironmentMapLight {{
    specular_map: assets.load(\"{specular}\"),
    diffuse_map: assets.load(\"{diffuse}\"),
    intensity: 1000.0,
    ..default()
}}));

Bevy adds an ambient light to every scene; without it: app.insert_resource(GlobalAmbientLight {{ brightness: 0.0, ..default() }}).
"
    )
}

fn skybox_readme(cube: &str) -> String {
    format!(
        "The sky, a further component of the camera, as bright as the light:

Skybox {{ image: assets.load(\"{cube}\"), brightness: 1000.0, ..default() }}
"
    )
}

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image are in {lights}. Each is, by its `direction`, `colour` and `intensity`,

commands.spawn((
    DirectionalLight {{ illuminance: 1000.0 * intensity, color: Color::linear_rgb(colour[0], colour[1], colour[2]), ..default() }},
    Transform::from_translation(direction).looking_at(Vec3::ZERO, Vec3::Y),
));

with the 1000 of the light above.
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Wgsl,
    source: Source::CubeArray,
    textures: ".ktx2",
    rows_from_bottom: false,
    ending: ".wgsl",
    indent: "",
    shader: include_str!("tap_shaders/bevy.wgsl"),
    readme: include_str!("tap_shaders/bevy.txt"),
};
