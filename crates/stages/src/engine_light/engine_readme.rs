//! The text beside an engine's files: the code that loads them.

use crate::values::{EngineFormat, EnginePreset};

/// The text for an engine, with the names of its files.
pub(crate) fn readme(preset: EnginePreset, format: EngineFormat, names: &[String]) -> String {
    let name = |index: usize| names.get(index).map_or("", |name| name.trim_start_matches('/'));
    let (first, second) = (name(0), name(1));
    match (preset, format) {
        (EnginePreset::Three, EngineFormat::Bc6h) => format!(
            "three.js, r187 or later, with EXT_texture_compression_bptc.

import {{ DDSLoader }} from 'three/addons/loaders/DDSLoader.js';
const cube = await new DDSLoader().loadAsync( '{first}' );
Object.assign( cube, {{ mapping: THREE.CubeReflectionMapping, isCubeTexture: true, isCompressedCubeTexture: true }} );
Object.assign( cube, {{ colorSpace: THREE.LinearSRGBColorSpace, isPMREMTexture: true, needsUpdate: true }} );
scene.environment = cube;

isPMREMTexture tells three.js that the levels are prefiltered. The last level is irradiance over pi.
{second} has the same irradiance as nine coefficients for THREE.LightProbe.
"
        ),
        (EnginePreset::Three, _) => format!(
            "three.js, r187 or later. KTX2Loader makes one flat texture of the six faces; lines 3 to 5 undo that.

import {{ KTX2Loader }} from 'three/addons/loaders/KTX2Loader.js';
const flat = await new KTX2Loader().detectSupport( renderer ).loadAsync( '{first}' );
const face = ( f ) => flat.mipmaps.map( ( m ) => ( {{ ...m, data: m.data.subarray( f * m.data.length / 6, ( f + 1 ) * m.data.length / 6 ) }} ) );
const cube = new THREE.CompressedCubeTexture( [ 0, 1, 2, 3, 4, 5 ].map( ( f ) => ( {{ ...face( f )[ 0 ], mipmaps: face( f ) }} ) ), flat.format, flat.type );
Object.assign( cube, {{ colorSpace: flat.colorSpace, minFilter: THREE.LinearMipmapLinearFilter, magFilter: THREE.LinearFilter, isPMREMTexture: true, needsUpdate: true }} );
scene.environment = cube;

isPMREMTexture tells three.js that the levels are prefiltered. The last level is irradiance over pi.
{second} has the same irradiance as nine coefficients for THREE.LightProbe.
"
        ),
        (EnginePreset::Filament, _) => format!(
            "Filament. `bytes` and `size` are the content of {first}.

auto* bundle = new image::Ktx1Bundle(bytes, size);
filament::math::float3 sh[9];
bundle->getSphericalHarmonics(sh);
filament::Texture* cube = ktxreader::Ktx1Reader::createTexture(engine, bundle, false);
auto* light = filament::IndirectLight::Builder().reflections(cube).irradiance(3, sh).build(*engine);
scene->setIndirectLight(light);

In JavaScript: engine.createIblFromKtx1( '{first}' ), which takes the irradiance from the last level.
{second} has the nine coefficients that are in the file, too.
"
        ),
        (EnginePreset::Babylon, _) => {
            let polynomial = match format {
                EngineFormat::Rgbd => "The file holds the irradiance, too.".to_owned(),
                _ => format!(
                    "Babylon.js makes the irradiance of the cube; {second} has it as coefficients for\n\
                     BABYLON.SphericalHarmonics.FromArray."
                ),
            };
            format!(
                "Babylon.js.

const texture = BABYLON.CubeTexture.CreateFromPrefilteredData( '{first}', scene );
scene.environmentTexture = texture;

{polynomial}
Babylon.js mixes rough reflections with the irradiance. Leave mixIblRadianceWithIrradiance as it is: the
levels alone are further from brute force, because they do not bend toward the normal.
"
            )
        }
        (EnginePreset::Bevy, _) => format!(
            "Bevy, with the features ktx2 and zstd_rust.

commands.spawn((Camera3d::default(), EnvironmentMapLight {{
    specular_map: assets.load(\"{first}\"),
    diffuse_map: assets.load(\"{second}\"),
    intensity: 1000.0,
    ..default()
}}));
"
        ),
        (EnginePreset::Gltf, _) => format!(
            "glTF with EXT_lights_image_based, as Babylon.js reads it.

await BABYLON.ImportMeshAsync( '{first}', scene );
scene.environmentTexture.gammaSpace = false;

Babylon.js 9 takes the values for sRGB without the last line.
"
        ),
        (EnginePreset::Godot, _) => format!(
            "Godot 4 filters the image itself. In a script of a WorldEnvironment:

var sky := PanoramaSkyMaterial.new()
sky.panorama = load(\"res://{first}\")
environment.sky = Sky.new()
environment.sky.sky_material = sky
environment.background_mode = Environment.BG_SKY
"
        ),
        (EnginePreset::Blender, _) => format!(
            "Blender filters nothing: it samples the image. In Python:

import bpy
nodes = bpy.context.scene.world.node_tree.nodes
image = nodes.new(\"ShaderNodeTexEnvironment\")
image.image = bpy.data.images.load(\"//{first}\")
bpy.context.scene.world.node_tree.links.new(image.outputs[0], nodes[\"Background\"].inputs[0])
"
        ),
        (EnginePreset::Unity, _) => format!(
            "Unity filters the image itself.

1. Import {first} with Texture Shape: Cube, Mapping: Latitude-Longitude Layout, Convolution Type:
   Specular (Glossy Reflection).
2. Lighting window, Environment Reflections: Source: Custom, Cubemap: the texture.

{second} has the irradiance for SphericalHarmonicsL2 (unity_SHAr and so on).
"
        ),
        (EnginePreset::Unreal, _) => format!(
            "Unreal Engine filters the image itself.

1. Import {first}: a Radiance image becomes a TextureCube.
2. Sky Light, Source Type: SLS Specified Cubemap, Cubemap: the texture.

{second} has the light as nine coefficients in Unreal's frame.
"
        ),
    }
}

#[cfg(test)]
mod tests {
    use engine::Choice;

    use super::*;
    use crate::engine_light::engine_files::names;

    #[test]
    fn every_file_of_an_engine_is_named() {
        for (.., preset) in EnginePreset::words() {
            for &format in preset.formats() {
                let names = names(preset, format, "environment");
                let text = readme(preset, format, &names);
                for name in names {
                    assert!(text.contains(name.trim_start_matches('/')), "{preset:?} {format:?}: {name}");
                }
            }
        }
    }
}
