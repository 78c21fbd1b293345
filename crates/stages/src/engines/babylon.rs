//! Babylon.js. Its shader looks up the level log2(size alpha), scaled.

use containers::lighting_json::Preset;
use containers::{BabylonEnv, Encoded, Polynomial, Texture, read_babylon_env, write_babylon_env};
use engine::Failure;
use sphere::DVec3;
use taps::{Language, Source};

use super::cube_light::CubeLight;
use super::definition::{CubeFiles, Engine, EngineCube, EngineLight, IRRADIANCE, Skybox, read_cube};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::levels::Levels;
use super::tap_shaders::TapPreset;

/// The scale by which Babylon.js finds the level of a roughness; the default of its own files.
const LOD_GENERATION_SCALE: f64 = 0.8;

/// All that is known of Babylon.js.
pub(crate) const ENGINE: Engine = Engine {
    name: "babylon",
    meaning: "Babylon.js.",
    versions: "",
    light: EngineLight::Cube(EngineCube {
        levels: Levels {
            roughness: |l, _, size| math::exp2(l / LOD_GENERATION_SCALE).min(size).sqrt() / size.sqrt(),
            level: |r, _, size| LOD_GENERATION_SCALE * math::log2(size * r * r),
            formula: "r^2 = 2^(l / 0.8) / {size}",
            remark: ", at most 1; a mirror first",
        },
        last: 1,
        levels_remark: "",
        direction_at: |c| DVec3::new(-c.x, c.y, c.z),
        direction: "(-c.x, c.y, c.z)",
        files: &[
            CubeFiles {
                formats: &[EngineFormat::Rgbd],
                endings: &[".env"],
                write: write_env,
                read: |bytes| Ok(read_babylon_env(bytes)?.cube),
                readme: |cube, _| {
                    readme(
                        cube,
                        "The file holds the irradiance, too, as a polynomial and as a cube, which Babylon.js 8 and later takes.",
                    )
                },
                skybox: &SKYBOX,
            },
            CubeFiles {
                formats: &[EngineFormat::Rgba16F, EngineFormat::Rgba32F],
                endings: &[".dds", IRRADIANCE],
                write: |light| Ok((light.dds()?, vec![light.irradiance_json(Preset::Babylon)?])),
                read: read_cube,
                readme: dds_readme,
                skybox: &Skybox::dds(skybox_readme),
            },
        ],
        endings: "`.env`, with the irradiance; or `.dds` and `-irradiance.json`",
    }),
    axes: [DVec3::Z, DVec3::NEG_X, DVec3::Y],
    lights: EngineLights {
        readme: lights_readme,
        scene: LightScene::Gltf,
        imported_from: |d| DVec3::new(-d.x, d.y, d.z),
    },
    taps: Some(&TAPS),
};

/// The sharp cube as `.env`.
pub(crate) const SKYBOX: Skybox = Skybox {
    ending: "-skybox.env",
    write: |cube, _, recipe| env(cube, None, None, recipe),
    readme: skybox_readme,
};

fn skybox_readme(cube: &str) -> String {
    format!(
        "The sky, in a box that is larger than the scene:

scene.createDefaultSkybox( BABYLON.CubeTexture.CreateFromPrefilteredData( '{cube}', scene ), true, 1000, 0, false );
"
    )
}

fn env(
    cube: &Texture,
    irradiance: Option<Polynomial>,
    irradiance_cube: Option<Texture>,
    recipe: Option<&str>,
) -> Result<Encoded, Failure> {
    let lod_generation_scale = LOD_GENERATION_SCALE;
    let env = BabylonEnv { cube: cube.clone(), irradiance, irradiance_cube, lod_generation_scale };
    Ok(write_babylon_env(&env, recipe)?)
}

fn write_env(light: &CubeLight<'_>) -> Result<(Encoded, Vec<Vec<u8>>), Failure> {
    let rows = light.irradiance_rows(Preset::BabylonEnv);
    let [x, y, z, xx, yy, zz, yz, zx, xy] = <[[f64; 3]; 9]>::try_from(rows)
        .map_err(|rows| Failure::new(format!("{} rows of a polynomial", rows.len())))?;
    let irradiance = Polynomial { x, y, z, xx, yy, zz, yz, zx, xy };
    Ok((env(&light.texture, Some(irradiance), Some(light.irradiance_cube()?), light.recipe)?, Vec::new()))
}

fn dds_readme(cube: &str, irradiance: &str) -> String {
    let text = format!(
        "Babylon.js makes the irradiance of the cube; {irradiance} has it as coefficients for\n\
         BABYLON.SphericalHarmonics.FromArray."
    );
    readme(cube, &text)
}

fn readme(cube: &str, irradiance: &str) -> String {
    format!(
        "Babylon.js.

const texture = BABYLON.CubeTexture.CreateFromPrefilteredData( '{cube}', scene );
scene.environmentTexture = texture;

{irradiance}
Babylon.js mixes rough reflections with the irradiance. Leave mixIblRadianceWithIrradiance as it is: the
levels alone are further from brute force, because they do not bend toward the normal.
"
    )
}

pub(crate) fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image, in lux of an image in candelas per square metre:

const {{ lights }} = await ( await fetch( '{lights}' ) ).json();
for ( const {{ name, direction, colour, intensity }} of lights ) {{
	const light = new BABYLON.DirectionalLight( name, BABYLON.Vector3.FromArray( direction ).negate(), scene );
	light.diffuse = light.specular = BABYLON.Color3.FromArray( colour );
	light.intensity = intensity;
}}

A material shades four lights if its maxSimultaneousLights does not say more.
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Glsl,
    source: Source::Atlas,
    textures: ".ktx2",
    rows_from_bottom: false,
    ending: "-babylon.js",
    indent: "",
    shader: include_str!("tap_shaders/babylon.js"),
    readme: include_str!("tap_shaders/babylon.txt"),
};
