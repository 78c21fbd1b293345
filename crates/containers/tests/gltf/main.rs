//! glTF: the ways in which a file may hold a mesh.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // as in any test

use std::sync::Arc;

use base64::Engine;
use base64::prelude::BASE64_STANDARD as STANDARD;
use containers::{Error, ErrorKind, Model, read_gltf};
use glam::Vec3;
use mesh::{MaterialRange, Mesh};
use serde_json::{Value, json};

mod damage;
mod files;
mod image_based_light;
mod instances;
mod materials;
mod scenes;
mod skins;
mod write_back;
mod written;

/// The message for an index that does not exist.
const NOTHING: &str = "there is nothing of this index";

/// A `.glb` of a document and its binary chunk.
fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((length as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Reads a file that names no others.
fn read(bytes: &[u8]) -> Result<Model, Error> {
    read_gltf(bytes, &mut |path| panic!("{path} was asked for"))
}

fn error_of(document: &Value, binary: &[u8]) -> String {
    read(&glb(document, binary)).unwrap_err().to_string()
}

/// A square before the XY plane of the file, facing +Z_file, with all attributes; its binary chunk.
///
/// Positions at 0, normals at 48, coordinates at 96, tangents at 128, indices at 192 (u8), 200 (u16) and 212
/// (u32).
fn square() -> (Value, Vec<u8>) {
    let mut binary = floats(&[0.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 3.0, 1.0, 0.0, 3.0, 1.0]);
    binary.extend(floats(&[0.0, 0.0, 1.0].repeat(4)));
    binary.extend(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    binary.extend(floats(&[1.0, 0.0, 0.0, 1.0].repeat(4)));
    let corners = [0_u8, 1, 2, 0, 2, 3];
    binary.extend(corners);
    binary.extend([0; 2]);
    binary.extend(corners.iter().flat_map(|&corner| u16::from(corner).to_le_bytes()));
    binary.extend(corners.iter().flat_map(|&corner| u32::from(corner).to_le_bytes()));
    let document = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TANGENT": 3 },
            "indices": 4
        }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 96, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 0, "byteOffset": 128, "componentType": 5126, "count": 4, "type": "VEC4" },
            { "bufferView": 0, "byteOffset": 192, "componentType": 5121, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": binary.len() }],
        "buffers": [{ "byteLength": binary.len() }]
    });
    (document, binary)
}

/// What [`square`] is in Specula's frame.
fn expected() -> Mesh {
    Mesh::new(
        vec![[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 3.0], [1.0, 0.0, 3.0]],
        vec![[1.0, 0.0, 0.0]; 4],
        vec![[0.0, 1.0, 0.0, 1.0]; 4],
        Some(vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]),
        vec![[0, 1, 2], [0, 2, 3]],
    )
    .unwrap()
}

#[test]
fn a_binary_file_is_read_into_our_frame() {
    let (document, binary) = square();
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model, Model { mesh: expected(), notes: vec![] });
}

#[test]
fn data_may_be_embedded_or_lie_beside_the_file() {
    let (mut document, binary) = square();
    document["buffers"][0]["uri"] =
        format!("data:application/octet-stream;base64,{}", STANDARD.encode(&binary)).into();
    assert_eq!(read(document.to_string().as_bytes()).unwrap().mesh, expected());

    document["buffers"][0]["uri"] = "sub/two%20words.bin".into();
    let bytes = document.to_string();
    let mut asked = Vec::new();
    let model = read_gltf::<Error>(bytes.as_bytes(), &mut |path| {
        asked.push(path.to_owned());
        Ok(Arc::new(binary.clone()))
    });
    assert_eq!((model.unwrap().mesh, asked), (expected(), vec!["sub/two words.bin".to_owned()]));
}

#[test]
fn a_buffer_that_no_mesh_needs_is_not_asked_for() {
    let (mut document, binary) = square();
    document["buffers"].as_array_mut().unwrap().push(json!({ "uri": "animation.bin", "byteLength": 10 }));
    document["bufferViews"].as_array_mut().unwrap().push(json!({ "buffer": 1, "byteLength": 10 }));
    let accessor = json!({ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" });
    document["accessors"].as_array_mut().unwrap().push(accessor);
    document["meshes"][0]["primitives"][0]["attributes"]["_WIND"] = 5.into();
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected());
}

#[test]
fn every_type_of_index_is_read() {
    for (code, offset) in [(5121, 192), (5123, 200), (5125, 212)] {
        let (mut document, binary) = square();
        document["accessors"][4]["componentType"] = code.into();
        document["accessors"][4]["byteOffset"] = offset.into();
        assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected(), "{code}");
    }
}

#[test]
fn strips_fans_and_lists_without_indices_give_their_triangles() {
    // Section 3.7.2.1 of the specification.
    for (mode, indexed, expected) in [
        (5, true, vec![[0, 1, 2], [1, 0, 2], [2, 0, 2], [0, 3, 2]]),
        (6, true, vec![[1, 2, 0], [2, 0, 0], [0, 2, 0], [2, 3, 0]]),
        (5, false, vec![[0, 1, 2], [1, 3, 2]]),
        (6, false, vec![[1, 2, 0], [2, 3, 0]]),
    ] {
        let (mut document, binary) = square();
        let primitive = &mut document["meshes"][0]["primitives"][0];
        primitive["mode"] = mode.into();
        if !indexed {
            primitive.as_object_mut().unwrap().remove("indices");
        }
        assert_eq!(read(&glb(&document, &binary)).unwrap().mesh.triangles(), expected, "{mode} {indexed}");
    }
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    let message = "meshes[0].primitives[0]: 4 corners are not whole triangles";
    assert_eq!(error_of(&document, &binary), message);
}

#[test]
fn points_and_lines_are_left_out() {
    let (mut document, binary) = square();
    let lines = json!({ "attributes": { "POSITION": 0 }, "mode": 1 });
    document["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model.mesh, expected());
    assert_eq!(model.notes, ["1 of 2 primitives is points or lines, which are left out"]);
}

#[test]
fn quantised_and_interleaved_numbers_are_read() {
    let (mut document, mut binary) = square();
    // Positions as i16 and normals as normalised i8, 12 bytes apart; coordinates as normalised u16.
    let start = binary.len();
    for [x, y] in [[0_i16, 0], [2, 0], [2, 3], [0, 3]] {
        binary.extend([x, y, 1].iter().flat_map(|value| value.to_le_bytes()));
        binary.extend([0, 0, 0, 127, 0, 0]);
    }
    let pairs = binary.len();
    binary.extend(
        [0, 0xffff, 0xffff, 0xffff, 0xffff, 0, 0, 0].iter().flat_map(|value: &u16| value.to_le_bytes()),
    );
    document["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": start },
        { "buffer": 0, "byteOffset": start, "byteLength": pairs - start, "byteStride": 12 },
        { "buffer": 0, "byteOffset": pairs, "byteLength": 16 }
    ]);
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors[0] = json!({ "bufferView": 1, "componentType": 5122, "count": 4, "type": "VEC3" });
    accessors[1] = json!({ "bufferView": 1, "byteOffset": 7, "componentType": 5120, "normalized": true, "count": 4, "type": "VEC3" });
    accessors[2] =
        json!({ "bufferView": 2, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC2" });
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected());
}

#[test]
fn sparse_values_replace_others_or_zero() {
    let (mut document, mut binary) = square();
    let start = binary.len();
    binary.extend([1, 2, 0, 0]);
    binary.extend(floats(&[4.0, 0.0, 1.0, 4.0, 6.0, 1.0]));
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"].as_array_mut().unwrap().extend([
        json!({ "buffer": 0, "byteOffset": start, "byteLength": 2 }),
        json!({ "buffer": 0, "byteOffset": start + 4, "byteLength": 24 }),
    ]);
    document["accessors"][0]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": 1, "componentType": 5121 },
        "values": { "bufferView": 2 }
    });
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    assert_eq!(mesh.positions(), [[1.0, 0.0, 0.0], [1.0, 4.0, 0.0], [1.0, 4.0, 6.0], [1.0, 0.0, 3.0]]);
    document["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    assert_eq!(mesh.positions(), [[0.0; 3], [1.0, 4.0, 0.0], [1.0, 4.0, 6.0], [0.0; 3]]);
    document["accessors"][0]["count"] = 2.into();
    for accessor in 1..4 {
        document["accessors"][accessor]["count"] = 2.into();
    }
    let message = "meshes[0].primitives[0]: attributes.POSITION: accessors[0]: sparse.indices: entry 1 is not an index below 2";
    assert_eq!(error_of(&document, &binary), message);
}

#[test]
fn nodes_place_their_meshes() {
    let (mut document, binary) = square();
    // Twice the size, a quarter turn about Y_file, then one up; and beside it the mirror image of all that.
    let half = 0.5_f64.sqrt();
    document["nodes"] = json!([
        { "children": [1], "translation": [0.0, 1.0, 0.0] },
        { "mesh": 0, "rotation": [0.0, half, 0.0, half], "scale": [2.0, 2.0, 2.0] },
        { "children": [3], "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1] },
        { "mesh": 0, "rotation": [0.0, half, 0.0, half], "scale": [2.0, 2.0, 2.0] }
    ]);
    document["scenes"] = json!([{ "nodes": [0, 2] }]);
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    let file = |[x, y, z]: [f32; 3]| Vec3::new(y, z, x);
    // (x, y, z) -> (z, y, -x): the square faces +X_file.
    let places = [[2.0, 1.0, 0.0], [2.0, 1.0, -4.0], [2.0, 7.0, -4.0], [2.0, 7.0, 0.0]];
    for (vertex, &place) in places.iter().enumerate() {
        let (here, there) = (file(mesh.positions()[vertex]), file(mesh.positions()[vertex + 4]));
        assert!((here - Vec3::from(place)).length() < 1e-6, "{here}");
        assert!((there - Vec3::from(place) * Vec3::new(-1.0, 1.0, 1.0)).length() < 1e-6, "{there}");
        for (at, x) in [(vertex, 1.0), (vertex + 4, -1.0)] {
            assert!((file(mesh.normals()[at]) - Vec3::X * x).length() < 1e-6);
            let [a, b, c, sign] = mesh.tangents()[at];
            assert!((file([a, b, c]) + Vec3::Z).length() < 1e-6 && sign == x, "{sign}");
        }
    }
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]);
}

#[test]
fn without_a_scene_the_roots_are_read() {
    let (mut document, binary) = square();
    document.as_object_mut().unwrap().remove("scene");
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected());
    document.as_object_mut().unwrap().remove("scenes");
    document["nodes"] = json!([{ "mesh": 0 }, { "children": [0] }]);
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected());
}

#[test]
fn normals_and_tangents_are_made_where_they_are_missing() {
    let (mut document, binary) = square();
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    attributes.as_object_mut().unwrap().remove("TANGENT");
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model.mesh, expected());
    assert_eq!(model.notes, ["the primitive has no tangents: they are made"]);
    document["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!((model.mesh.positions().len(), model.mesh.normals()[5]), (6, [1.0, 0.0, 0.0]));
    assert_eq!(model.notes[0], "the primitive has no normals: every triangle is flat");
}

/// Our up is +Y_file: about that axis tangents lead east where nothing else gives them.
#[test]
fn tangents_without_coordinates_lead_east_in_our_frame() {
    let (mut document, mut binary) = square();
    // Facing +X_file, our +Y; +Y_file, our +Z and a pole; and between them.
    let half = 0.5_f32.sqrt();
    binary[48..96].copy_from_slice(&floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, half, half, 0.0, 0.0, 0.0, 1.0]));
    document["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": 0, "NORMAL": 1 });
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    assert_eq!(mesh.normals()[..2], [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let [north, pole, between, front] = [0, 1, 2, 3].map(|vertex| mesh.tangents()[vertex]);
    assert_eq!((north, pole), ([-1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]));
    assert_eq!((between, front), ([-1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]));
}

#[test]
fn morph_targets_are_reported() {
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model, Model { mesh: expected(), notes: model.notes.clone() });
    assert_eq!(model.notes, ["the primitive has morph targets, which are left out"]);
}

#[test]
fn bytes_past_the_length_of_a_buffer_are_not_of_it() {
    let (mut document, binary) = square();
    document["buffers"][0]["byteLength"] = 230.into();
    let message = "meshes[0].primitives[0]: attributes.POSITION: accessors[0]: bufferViews[0]: 236 bytes from byte 0 on \
                   are more than the 230 of buffer 0";
    assert_eq!(error_of(&document, &binary), message);
}

/// Two sets of coordinates, one turned by a quarter: the normal texture's is the one that counts.
#[test]
fn tangents_follow_the_coordinates_of_the_normal_texture() {
    let (mut document, mut binary) = square();
    let start = binary.len();
    binary.extend(floats(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0]));
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"][0]["byteLength"] = binary.len().into();
    let pairs =
        json!({ "bufferView": 0, "byteOffset": start, "componentType": 5126, "count": 4, "type": "VEC2" });
    document["accessors"].as_array_mut().unwrap().push(pairs);
    document["materials"] = json!([{ "normalTexture": { "index": 0, "texCoord": 1 } }]);
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["material"] = 0.into();
    primitive["attributes"] = json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 5 });
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model.mesh.tangents()[0], [0.0, 0.0, 1.0, 1.0]);
    let sets =
        "the primitive has several sets of texture coordinates: that of the normal texture is read, or set 0";
    assert_eq!(model.notes[1..], [sets]);
    // KHR_texture_transform may name another set, and turn the picture.
    document["materials"][0]["normalTexture"]["extensions"] =
        json!({ "KHR_texture_transform": { "texCoord": 0, "rotation": 1.5 } });
    let model = read(&glb(&document, &binary)).unwrap();
    let all = MaterialRange { material: Some(0), triangles: expected().triangles().len() };
    assert_eq!(model.mesh, expected().with_materials(vec!["0".to_owned()], &[all]).unwrap());
    assert_eq!(
        model.notes[1..],
        [
            "the primitive has a normal texture that KHR_texture_transform turns; its tangents are not turned",
            sets
        ]
    );
}

/// Four primitives of two materials and of none, at two places.
#[test]
fn every_triangle_knows_its_material() {
    let (mut document, binary) = square();
    document["materials"] = json!([{ "name": "red" }, {}, { "name": "unused" }]);
    let primitive = document["meshes"][0]["primitives"][0].clone();
    let of = |material: usize| {
        let mut primitive = primitive.clone();
        primitive["material"] = material.into();
        primitive
    };
    document["meshes"][0]["primitives"] = json!([of(1), of(0), of(0), primitive]);
    document["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "translation": [2.0, 0.0, 0.0] }]);
    document["scenes"] = json!([{ "nodes": [0, 1] }]);
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    assert_eq!(mesh.materials(), ["red", "1", "unused"]);
    let each = expected().triangles().len();
    let range = |material, times: usize| MaterialRange { material, triangles: times * each };
    let once = [range(Some(1), 1), range(Some(0), 2), range(None, 1)];
    assert_eq!(mesh.material_ranges(), [once, once].concat());
}

#[test]
fn vertex_colours_are_reported() {
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 1.into();
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!(model.mesh, expected());
    assert_eq!(model.notes, ["the primitive has vertex colours (COLOR_0), which are left out"]);
}

#[test]
fn a_scene_may_be_empty() {
    let mesh = read(br#"{ "asset": { "version": "2.0" } }"#).unwrap().mesh;
    assert_eq!((mesh.positions().len(), mesh.triangles().len()), (0, 0));
    let (mut document, binary) = square();
    document["accessors"][4]["count"] = 0.into();
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh.triangles().len(), 0);
}

fn assert_sound(mesh: &Mesh, name: &str) {
    for (&normal, &[x, y, z, sign]) in mesh.normals().iter().zip(mesh.tangents()) {
        let (normal, tangent) = (Vec3::from(normal), Vec3::new(x, y, z));
        assert!((normal.length() - 1.0).abs() < 1e-6 && (tangent.length() - 1.0).abs() < 1e-6, "{name}");
        assert!(normal.dot(tangent).abs() < 1e-6 && sign.abs() == 1.0, "{name}: {normal} {tangent} {sign}");
    }
    // Normals look outward: the winding must agree with them.
    let outward = mesh.triangles().iter().filter(|corners| {
        let [a, b, c] = corners.map(|k| Vec3::from(mesh.positions()[k as usize]));
        (b - a).cross(c - a).dot(Vec3::from(mesh.normals()[corners[0] as usize])) >= 0.0
    });
    let share = outward.count() as f64 / mesh.triangles().len() as f64;
    assert!(share > 0.99, "{name}: {share} of the triangles face outward");
}

fn corpus_model(corpus: &std::path::Path, name: &str) -> Model {
    let path = corpus.join("mesh").join(name);
    let folder = path.parent().unwrap().to_owned();
    let mut beside = |other: &str| Ok::<_, Error>(Arc::new(std::fs::read(folder.join(other)).unwrap()));
    read_gltf(&std::fs::read(&path).unwrap(), &mut beside).unwrap()
}

#[test]
fn files_of_others_are_sound_meshes() {
    let Some(corpus) = test_data::folder("files_of_others_are_sound_meshes", "SPECULA_CORPUS") else {
        return;
    };
    // Counts of the corpus's README.
    for (name, vertices, made) in [
        ("suzi.glb", 8098, true),
        ("SheenCloth.glb", 58_081, false),
        ("FlightHelmet/FlightHelmet.gltf", 55_392, false),
        ("NormalTangentMirrorTest.glb", 2770, false),
    ] {
        let model = corpus_model(&corpus, name);
        assert_sound(&model.mesh, name);
        let found = model.mesh.positions().len();
        eprintln!("{name}: {found} vertices, bounds {:?}, {:?}", model.mesh.bounds(), model.notes);
        assert_eq!(model.notes.len(), usize::from(made), "{name}");
        // If tangents are made, vertices on the edges of pictures become several.
        assert!(found == vertices || made && found > vertices && found < vertices * 5 / 4, "{name}: {found}");
    }
}

/// The file's tangents were made by its author's tool: ours follow them, in mirrored pictures and in others.
#[test]
fn made_tangents_are_those_of_a_file_that_has_them() {
    let name = "made_tangents_are_those_of_a_file_that_has_them";
    let Some(corpus) = test_data::folder(name, "SPECULA_CORPUS") else { return };
    let given = corpus_model(&corpus, "NormalTangentMirrorTest.glb").mesh;
    let parts = mesh::Parts {
        positions: given.positions().to_vec(),
        normals: Some(given.normals().to_vec()),
        tangents: None,
        coordinates: given.coordinates().map(<[_]>::to_vec),
        triangles: given.triangles().to_vec(),
    };
    let made = parts.complete().unwrap();
    let (mut mirrored, mut close, mut all) = (0, 0, 0);
    for (ours, theirs) in made.triangles().iter().flatten().zip(given.triangles().iter().flatten()) {
        let (ours, theirs) = (made.tangents()[*ours as usize], given.tangents()[*theirs as usize]);
        let cosine: f32 = (0..3).map(|axis| ours[axis] * theirs[axis]).sum();
        close += usize::from(cosine > 0.99 && ours[3] == theirs[3]);
        mirrored += usize::from(theirs[3] < 0.0);
        all += 1;
    }
    eprintln!("{close} of {all} corners agree, {mirrored} of them mirrored");
    assert!(mirrored > 100 && mirrored < all);
    assert!(close as f64 > 0.999 * all as f64, "{close} of {all}");
}
