//! Scenes for light probes.

use containers::{GltfScene, Metals, SceneOptions, Transmission, read_gltf_scene, write_png};
use probes::{Alpha, LampKind, Scene, Wrap};

use super::*;

fn scene_with(document: &Value, binary: &[u8], options: &SceneOptions<'_>) -> Result<GltfScene, Error> {
    read_gltf_scene(&glb(document, binary), options, &mut |path| panic!("{path} was asked for"))
}

fn scene(document: &Value, binary: &[u8]) -> Scene {
    scene_with(document, binary, &SceneOptions::default()).unwrap().scene
}

fn error(document: &Value, binary: &[u8]) -> String {
    scene_with(document, binary, &SceneOptions::default()).unwrap_err().to_string()
}

/// The way of a triangle's front.
fn front(scene: &Scene, triangle: usize) -> Vec3 {
    let [a, b, c] = scene.parts().triangles[triangle].map(Vec3::from);
    (b - a).cross(c - a).normalize()
}

/// The square faces +Z of the file, which is our +X; a node that mirrors it keeps its front to +Z, but for a
/// mirror along Z itself.
#[test]
fn a_negative_scale_turns_the_winding() {
    let (document, binary) = square();
    for (scale, x) in
        [([1, 1, 1], 1.0), ([-1, 1, 1], 1.0), ([2, -3, 1], 1.0), ([1, 1, -1], -1.0), ([-1, -1, -1], -1.0)]
    {
        let mut document = document.clone();
        document["nodes"][0]["scale"] = json!(scale);
        let scene = scene(&document, &binary);
        assert_eq!(scene.parts().triangles.len(), 2);
        for triangle in 0..2 {
            assert!((front(&scene, triangle) - Vec3::X * x).length() < 1e-6, "{scale:?}");
        }
    }
}

#[test]
fn all_instances_of_all_nodes_of_the_wanted_scene_are_read() {
    let (mut document, mut binary) = square();
    let start = binary.len();
    binary.extend(floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0]));
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"][0]["byteLength"] = binary.len().into();
    let accessor = |offset: usize| json!({ "bufferView": 0, "byteOffset": start + offset, "componentType": 5126, "count": 2, "type": "VEC3" });
    let accessors = document["accessors"].as_array_mut().unwrap();
    let first = accessors.len();
    accessors.extend([accessor(0), accessor(24)]);
    document["nodes"] = json!([
        { "mesh": 0, "name": "many", "extensions": { "EXT_mesh_gpu_instancing": {
            "attributes": { "TRANSLATION": first, "SCALE": first + 1 } } } },
        { "children": [2], "translation": [0, 7, 0] },
        { "mesh": 0, "name": "child", "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1] },
        { "mesh": 0, "name": "other" },
    ]);
    document["scenes"] = json!([{ "nodes": [0, 1], "name": "main" }, { "nodes": [3], "name": "other" }]);
    document["scene"] = json!(0);
    let found = scene(&document, &binary);
    let parts: Vec<(&str, usize)> =
        found.parts().parts.iter().map(|part| (part.name.as_str(), part.triangles)).collect();
    assert_eq!(parts, [("many", 4), ("child", 2)]);
    assert_eq!((found.part_of(3), found.part_of(4), found.part_of(9)), ("many", "child", ""));
    assert!((0..6).all(|triangle| (front(&found, triangle) - Vec3::X).length() < 1e-6));
    let of = |name| SceneOptions { scene: Some(name), ..SceneOptions::default() };
    assert_eq!(scene_with(&document, &binary, &of("other")).unwrap().scene.parts().triangles.len(), 2);
    let message = scene_with(&document, &binary, &of("attic")).unwrap_err().to_string();
    assert_eq!(message, "there is no scene \"attic\"; expected one of: main, other");
}

#[test]
fn materials_are_matte_and_keep_what_light_needs() {
    let (mut document, mut binary) = square();
    let png = write_png(2, 1, &[[0, 51, 102], [255, 153, 0]], None).unwrap();
    let start = binary.len();
    binary.extend(&png);
    document["buffers"][0]["byteLength"] = binary.len().into();
    let views = document["bufferViews"].as_array_mut().unwrap();
    let view = views.len();
    views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": png.len() }));
    document["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    document["samplers"] = json!([{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }]);
    document["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    document["materials"] = json!([{
        "name": "leaves",
        "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 0.75], "roughnessFactor": 0.1,
            "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "offset": [0.5, 0], "scale": [2, 1] } } } },
        "normalTexture": { "index": 99 },
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "emissiveFactor": [0, 0.5, 1], "emissiveTexture": { "index": 0 },
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
            "KHR_materials_transmission": { "transmissionFactor": 0.5 } },
    }]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    let read = scene_with(&document, &binary, &SceneOptions::default()).unwrap();
    let (scene, parts) = (&read.scene, read.scene.parts());
    let [material] = parts.materials.as_slice() else { panic!("{:?}", parts.materials) };
    assert_eq!((material.base, material.metallic), ([1.0, 0.5, 0.25, 0.75], 0.0));
    assert_eq!(
        (material.alpha, material.is_double_sided, material.transmission),
        (Alpha::Mask(0.25), true, 0.5)
    );
    let emission = material.emission.unwrap();
    assert_eq!(emission.radiance, [0.0, 2.0, 4.0]);
    let how = material.base_texture.unwrap();
    assert_eq!((how.wrap, how.is_nearest), ([Wrap::Clamp, Wrap::Mirror], true));
    // Both textures are one picture, in linear light.
    assert_eq!((parts.textures.len(), parts.textures[0].size()), (1, [2, 1]));
    let expected = |code: f64| (((code / 255.0 + 0.055) / 1.055).powf(2.4) * 65535.0).round() as u16;
    assert_eq!(parts.textures[0].texels()[1], [65535, expected(153.0), 0, 65535]);
    assert!(!scene.is_grey() && scene.emitters() == [0]);
    // The transform is in the coordinates of the base colour alone.
    for corner in parts.attributes.as_flattened() {
        assert_eq!(corner.base, [2.0 * corner.emission[0] + 0.5, corner.emission[1]]);
    }
    assert_eq!(read.notes.len(), 2, "{:?}", read.notes);
    assert!(
        read.notes[0].contains("above 0.95") && read.notes[0].contains("(1 texels): leaves"),
        "{:?}",
        read.notes
    );

    // What does not concern light changes no byte.
    let mut other = document.clone();
    other["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.9);
    other["materials"][0]["normalTexture"]["index"] = json!(3);
    assert_eq!(scene_with(&other, &binary, &SceneOptions::default()).unwrap(), read);
    // glTF's metallicFactor is 1 where it is absent.
    let options =
        SceneOptions { metals: Metals::Black, transmission: Transmission::Opaque, ..SceneOptions::default() };
    let black = scene_with(&document, &binary, &options).unwrap().scene;
    let material = &black.parts().materials[0];
    assert_eq!((material.metallic, material.transmission), (1.0, 0.0));
    // An unlit material emits its base colour.
    other["materials"][0]["extensions"]["KHR_materials_unlit"] = json!({});
    let unlit = scene_with(&other, &binary, &SceneOptions::default()).unwrap().scene;
    let material = &unlit.parts().materials[0];
    assert!(material.is_unlit && material.emission.unwrap().radiance == [1.0, 0.5, 0.25]);
    assert_eq!(material.emission.unwrap().texture, material.base_texture);
    // Pictures that are not there.
    other["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = json!(7);
    assert!(error(&other, &binary).contains("textures"), "{}", error(&other, &binary));
}

#[test]
fn lamps_shine_along_the_nodes_minus_z() {
    let (mut document, binary) = square();
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes[0]["children"] = json!([1, 2, 3]);
    let lamp = |light: usize| json!({ "translation": [1, 2, 3], "extensions": { "KHR_lights_punctual": { "light": light } } });
    nodes.extend([lamp(0), lamp(1), lamp(2)]);
    document["nodes"][2]["rotation"] =
        json!([-std::f64::consts::FRAC_1_SQRT_2, 0, 0, std::f64::consts::FRAC_1_SQRT_2]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "name": "bulb", "color": [1, 0.5, 0.25], "intensity": 20, "range": 0 },
        { "type": "spot", "intensity": 5, "range": 9, "spot": { "innerConeAngle": 0.25 } },
        { "type": "directional", "name": "off", "intensity": 0 },
    ] } });
    let read = scene_with(&document, &binary, &SceneOptions::default()).unwrap();
    let [bulb, spot, sun] = read.scene.parts().lamps.as_slice() else { panic!() };
    assert_eq!((bulb.name.as_str(), bulb.position, bulb.range), ("bulb", [3.0, 1.0, 2.0], None));
    assert_eq!((bulb.color, bulb.intensity, bulb.kind), ([1.0, 0.5, 0.25], 20.0, LampKind::Point));
    // Turned by -90 degrees about X_file, -Z_file becomes -Y_file: down, our -Z.
    assert!((Vec3::from(spot.direction) - Vec3::NEG_Z).length() < 1e-6, "{:?}", spot.direction);
    assert_eq!((spot.range, spot.name.as_str()), (Some(9.0), "nodes[2]"));
    assert_eq!(spot.kind, LampKind::Spot { inner: 0.25, outer: std::f32::consts::FRAC_PI_4 });
    assert_eq!((sun.kind, sun.direction), (LampKind::Directional, [-1.0, 0.0, 0.0]));
    assert_eq!(read.notes.last().unwrap(), "lamps without light, whose intensity or colour is 0: off");
    let lights = &mut document["extensions"]["KHR_lights_punctual"]["lights"];
    lights[0]["intensity"] = json!(-1);
    let message = "extensions.KHR_lights_punctual.lights[0].intensity: -1 is not a number of 0 or more";
    assert_eq!(error(&document, &binary), message);
}

#[test]
fn nodes_may_be_boxes_for_probes() {
    let (mut document, binary) = square();
    document["nodes"] = json!([
        { "mesh": 0, "children": [1, 2, 3] },
        { "name": "hall", "extras": { "specula_probes": true }, "translation": [0, 1, 0], "scale": [2, 1, 3] },
        { "name": "probes.001", "mesh": 0 },
        { "name": "no", "extras": { "specula_probes": false } },
    ]);
    let is_box = |name: &str| name.starts_with("probes.");
    let options = SceneOptions { is_box: Some(&is_box), ..SceneOptions::default() };
    let scene = scene_with(&document, &binary, &options).unwrap().scene;
    let boxes: Vec<(&str, [[f32; 3]; 2])> =
        scene.parts().boxes.iter().map(|found| (found.name.as_str(), found.bounds)).collect();
    assert_eq!(boxes[0], ("hall", [[-3.0, -2.0, 0.0], [3.0, 2.0, 2.0]]));
    assert_eq!((boxes[1].0, boxes[1].1[0][0], boxes[1].1[1][0]), ("probes.001", 1.0, 1.0));
    assert_eq!((boxes.len(), scene.parts().triangles.len()), (2, 2));
}

#[test]
fn files_that_are_no_scene_say_why() {
    let (document, binary) = square();
    let wrong = |change: &dyn Fn(&mut Value, &mut Vec<u8>)| {
        let (mut document, mut binary) = (document.clone(), binary.clone());
        change(&mut document, &mut binary);
        error(&document, &binary)
    };
    let no_triangles = wrong(&|document, _| document["meshes"][0]["primitives"][0]["mode"] = json!(0));
    assert_eq!(no_triangles, "the scene has no triangles; expected a mesh in a node of the scene");
    let nan = wrong(&|_, binary| binary[0..4].copy_from_slice(&f32::NAN.to_le_bytes()));
    assert_eq!(nan, "nodes[0]: the positions of a triangle are not finite numbers");
    let flat = wrong(&|_, binary| binary[..48].fill(0));
    assert_eq!(flat, "none of the 2 triangles of the scene has an area");
    let glossy = wrong(&|document, _| {
        document["extensionsRequired"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
    });
    assert!(glossy.contains("gltf-transform metalrough"), "{glossy}");
    let mode = wrong(&|document, _| {
        document["materials"] = json!([{ "alphaMode": "CLIP" }]);
        document["meshes"][0]["primitives"][0]["material"] = json!(0);
    });
    assert_eq!(mode, "materials[0].alphaMode: \"CLIP\" is not OPAQUE, MASK or BLEND");
}
