//! three.js. Its shader looks levels up in bicubicCubeUV.

use containers::lighting_json::Preset;
use sphere::DVec3;
use taps::{Language, Source};

use super::definition::{CubeFiles, Engine, EngineCube, EngineLight, IRRADIANCE, Skybox, read_cube};
use super::engine_format::EngineFormat;
use super::engine_lights::{EngineLights, LightScene};
use super::levels::QUADRATIC;
use super::tap_shaders::TapPreset;

/// All that is known of three.js.
pub(crate) const ENGINE: Engine = Engine {
    name: "three",
    meaning: "three.js from r187 on.",
    versions: "r187 or later",
    light: EngineLight::Cube(EngineCube {
        levels: QUADRATIC,
        last: 8,
        levels_remark: "",
        direction_at: |c| DVec3::new(-c.z, c.y, -c.x),
        direction: "(-c.z, c.y, -c.x)",
        files: &[
            CubeFiles {
                formats: &[EngineFormat::Rgba16F],
                endings: &[".ktx2", IRRADIANCE],
                write: |light| Ok((light.ktx2()?, vec![light.irradiance_json(Preset::Three)?])),
                read: read_cube,
                readme: ktx2_readme,
                skybox: &Skybox::ktx2(skybox_readme),
            },
            CubeFiles {
                formats: &[EngineFormat::Bc6h],
                endings: &[".dds", IRRADIANCE],
                write: |light| Ok((light.dds()?, vec![light.irradiance_json(Preset::Three)?])),
                read: read_cube,
                readme: dds_readme,
                skybox: &Skybox::dds(skybox_readme),
            },
        ],
        endings: "`.ktx2`, or `.dds` for BC6H; `-irradiance.json`",
    }),
    axes: [DVec3::X, DVec3::NEG_Z, DVec3::Y],
    lights: EngineLights { readme: lights_readme, scene: LightScene::Gltf, imported_from: |d| d },
    taps: Some(&TAPS),
};

fn ktx2_readme(cube: &str, irradiance: &str) -> String {
    format!(
        "three.js, r187 or later. KTX2Loader makes one flat texture of the six faces; `loadCube` undoes that.

import {{ KTX2Loader }} from 'three/addons/loaders/KTX2Loader.js';
async function loadCube( name ) {{
	const flat = await new KTX2Loader().detectSupport( renderer ).loadAsync( name );
	const face = ( f ) => flat.mipmaps.map( ( m ) => ( {{ ...m, data: m.data.subarray( f * m.data.length / 6, ( f + 1 ) * m.data.length / 6 ) }} ) );
	const cube = new THREE.CompressedCubeTexture( [ 0, 1, 2, 3, 4, 5 ].map( ( f ) => ( {{ ...face( f )[ 0 ], mipmaps: face( f ) }} ) ), flat.format, flat.type );
	return Object.assign( cube, {{ colorSpace: flat.colorSpace, minFilter: THREE.LinearMipmapLinearFilter, magFilter: THREE.LinearFilter, needsUpdate: true }} );
}}
scene.environment = Object.assign( await loadCube( '{cube}' ), {{ isPMREMTexture: true }} );

isPMREMTexture tells three.js that the levels are prefiltered. The last level is irradiance over pi.
{irradiance} has the same irradiance as nine coefficients for THREE.LightProbe.
"
    )
}

fn skybox_readme(cube: &str) -> String {
    format!(
        "The sky:

scene.background = await loadCube( '{cube}' );
"
    )
}

fn dds_readme(cube: &str, irradiance: &str) -> String {
    format!(
        "three.js, r187 or later, with EXT_texture_compression_bptc.

import {{ DDSLoader }} from 'three/addons/loaders/DDSLoader.js';
async function loadCube( name ) {{
	const cube = await new DDSLoader().loadAsync( name );
	Object.assign( cube, {{ mapping: THREE.CubeReflectionMapping, isCubeTexture: true, isCompressedCubeTexture: true }} );
	return Object.assign( cube, {{ colorSpace: THREE.LinearSRGBColorSpace, needsUpdate: true }} );
}}
scene.environment = Object.assign( await loadCube( '{cube}' ), {{ isPMREMTexture: true }} );

isPMREMTexture tells three.js that the levels are prefiltered. The last level is irradiance over pi.
{irradiance} has the same irradiance as nine coefficients for THREE.LightProbe.
"
    )
}

fn lights_readme(lights: &str) -> String {
    format!(
        "The lights that are not in the image, in lux of an image in candelas per square metre:

const {{ lights }} = await ( await fetch( '{lights}' ) ).json();
for ( const {{ name, direction, colour, intensity }} of lights ) {{
	const light = new THREE.DirectionalLight( new THREE.Color( ...colour ), intensity );
	light.name = name;
	light.position.set( ...direction );
	scene.add( light );
}}
"
    )
}

const TAPS: TapPreset = TapPreset {
    language: Language::Glsl,
    source: Source::Atlas,
    textures: ".ktx2",
    rows_from_bottom: false,
    ending: "-three.js",
    indent: "",
    shader: include_str!("tap_shaders/three.js"),
    readme: include_str!("tap_shaders/three.txt"),
};
