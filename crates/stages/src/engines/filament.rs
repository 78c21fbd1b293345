//! Filament. Its shader looks levels up in perceptualRoughnessToLod.

use containers::lighting_json::Preset;
use containers::{Encoded, write_ktx1};
use engine::Failure;
use sphere::DVec3;
use taps::{Language, Source};

use super::cube_light::CubeLight;
use super::definition::{CubeFiles, Engine, EngineCube, EngineLight, Skybox, read_cube};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::levels::QUADRATIC;
use super::tap_shaders::TapPreset;

/// All that is known of Filament.
pub(crate) const ENGINE: Engine = Engine {
    name: "filament",
    meaning: "Filament.",
    versions: "",
    light: EngineLight::Cube(EngineCube {
        levels: QUADRATIC,
        last: 16,
        levels_remark: "",
        direction_at: |c| c,
        direction: "(c.x, c.y, c.z): mirrored in relation to KTX2, as the engine wants it",
        files: &[CubeFiles {
            formats: &[EngineFormat::R11G11B10F, EngineFormat::Rgba16F],
            endings: &[".ktx", "-sh.txt"],
            write,
            read: read_cube,
            readme,
            skybox: &SKYBOX,
        }],
        endings: "`.ktx`, with the irradiance under the key `sh`; `-sh.txt`",
    }),
    axes: [DVec3::Z, DVec3::X, DVec3::Y],
    lights: EngineLights { readme: lights_readme, scene: LightScene::Gltf, imported_from: |d| d },
    taps: Some(&TAPS),
};

fn write(light: &CubeLight<'_>) -> Result<(Encoded, Vec<Vec<u8>>), Failure> {
    let line = |[r, g, b]: [f64; 3]| format!("{r} {g} {b}\n");
    let lines: String = light.irradiance_rows(Preset::Filament).into_iter().map(line).collect();
    let cube = write_ktx1(&light.texture, light.texels, light.recipe, &[("sh", &lines)])?;
    Ok((cube, vec![lines.into_bytes()]))
}

fn readme(cube: &str, coefficients: &str) -> String {
    format!(
        "Filament. `bytes` and `size` are the content of {cube}.

auto* bundle = new image::Ktx1Bundle(bytes, size);
filament::math::float3 sh[9];
bundle->getSphericalHarmonics(sh);
filament::Texture* cube = ktxreader::Ktx1Reader::createTexture(engine, bundle, false);
auto* light = filament::IndirectLight::Builder().reflections(cube).irradiance(3, sh).build(*engine);
scene->setIndirectLight(light);

In JavaScript: engine.createIblFromKtx1( '{cube}' ), which takes the irradiance from the last level.
{coefficients} has the nine coefficients that are in the file, too.
"
    )
}

const SKYBOX: Skybox = Skybox {
    ending: "-skybox.ktx",
    write: |cube, texels, recipe| Ok(write_ktx1(cube, texels, recipe, &[])?),
    readme: skybox_readme,
};

fn skybox_readme(cube: &str) -> String {
    format!(
        "The sky, of which `bytes` and `size` are the content of {cube}:

auto* sky = ktxreader::Ktx1Reader::createTexture(engine, new image::Ktx1Bundle(bytes, size), false);
scene->setSkybox(filament::Skybox::Builder().environment(sky).build(*engine));

In JavaScript: scene.setSkybox( engine.createSkyFromKtx1( '{cube}' ) ).
"
    )
}

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image are in {lights}. Each is, by its `direction`, `colour`, `intensity` and
`angular_diameter`, with the intensity of the IndirectLight (30000 if it was not set),

filament::LightManager::Builder(filament::LightManager::Type::SUN)
    .direction(-direction).color(filament::LinearColor{{ colour }}).intensity(light->getIntensity() * intensity)
    .sunAngularRadius(angular_diameter / 2).build(*engine, utils::EntityManager::get().create());

The first alone is a SUN; others are DIRECTIONAL. Add the entities to the scene.
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Glsl,
    source: Source::Atlas,
    textures: ".exr",
    rows_from_bottom: false,
    ending: ".mat",
    indent: "    ",
    shader: include_str!("tap_shaders/filament.mat"),
    readme: include_str!("tap_shaders/filament.txt"),
};
