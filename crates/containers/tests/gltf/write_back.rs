//! Files that come back with numbers of one's own at their vertices.

use std::collections::BTreeMap;
use std::sync::Arc;

use containers::{
    AssetFile, Error, GlbText, VertexAttribute, read_gltf, read_gltf_attribute, read_recipe, write_into_gltf,
};
use mesh::Mesh;
use serde_json::{Value, json};

use super::{floats, glb, read, square};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nand so on";
const RECIPE: &str = r#"{"kind":"made-up","z":1e-7}"#;

/// Files beside a document.
type Beside = BTreeMap<&'static str, Vec<u8>>;

fn find(beside: &Beside) -> impl FnMut(&str) -> Result<Arc<Vec<u8>>, Error> {
    |path| Ok(Arc::new(beside.get(path).unwrap_or_else(|| panic!("{path} was asked for")).clone()))
}

fn mesh_of(file: &[u8], beside: &Beside) -> Mesh {
    read_gltf(file, &mut find(beside)).unwrap().mesh
}

/// The number of each vertex of ours is its place in the mesh.
fn numbered(mesh: &Mesh) -> Vec<VertexAttribute> {
    let values = (0..mesh.positions().len()).map(|vertex| vertex as f32).collect();
    vec![VertexAttribute { name: "_NUMBER".into(), width: 1, values }]
}

fn written(file: &[u8], beside: &Beside, attributes: &[VertexAttribute]) -> AssetFile {
    let text = GlbText { recipe: Some(RECIPE), extras: &[("basis", "some")], ..GlbText::default() };
    write_into_gltf(file, &mesh_of(file, beside), attributes, text, &mut find(beside)).unwrap()
}

/// The JSON and the bytes of a binary file.
fn parts(file: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let end = 20 + word(12);
    assert_eq!((word(8), word(end) + end + 8), (file.len(), file.len()));
    (serde_json::from_slice(&file[20..end]).unwrap(), file[end + 8..].to_vec())
}

/// What is different between two documents: the path of each value that was added, removed or changed.
fn differences(before: &Value, after: &Value, path: &str, found: &mut Vec<String>) {
    match (before, after) {
        (Value::Object(one), Value::Object(other)) => {
            let keys: std::collections::BTreeSet<&String> = one.keys().chain(other.keys()).collect();
            for key in keys {
                let path = format!("{path}/{key}");
                differences(&before[key], &after[key], &path, found);
            }
        }
        (Value::Array(one), Value::Array(other)) => {
            for index in 0..one.len().max(other.len()) {
                let of = |array: &[Value]| array.get(index).cloned().unwrap_or_default();
                differences(&of(one), &of(other), &format!("{path}/{index}"), found);
            }
        }
        (before, after) if before == after => {}
        (Value::Null, _) => found.push(format!("+ {path}")),
        (_, Value::Null) => found.push(format!("- {path}")),
        _ => found.push(format!("! {path}")),
    }
}

fn diff(before: &Value, after: &Value) -> Vec<String> {
    let mut found = Vec::new();
    differences(before, after, "", &mut found);
    found
}

/// An asset with clothes: a material, a texture, an animation, extensions and extras of every kind, with
/// numbers as people write them.
fn dressed() -> (Value, Vec<u8>) {
    let (mut document, mut binary) = square();
    document["asset"]["generator"] = "by hand".into();
    document["asset"]["extras"] = json!({ "author": "someone" });
    document["meshes"][0]["name"] = "Square".into();
    document["meshes"][0]["extras"] = json!({ "tags": [1, 2.50, null] });
    document["meshes"][0]["primitives"][0]["material"] = 0.into();
    document["nodes"] = json!([
        { "mesh": 0, "name": "one", "rotation": [0.0, 0.0, 0.0, 1.0], "extras": "a text" },
        { "name": "empty", "children": [] , "extensions": { "KHR_lights_punctual": { "light": 0 } } }
    ]);
    document["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    document["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    document["materials"] = json!([{
        "name": "Paint",
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.30000001, 1], "baseColorTexture": { "index": 0 } }
    }]);
    document["textures"] = json!([{ "source": 0, "sampler": 0 }]);
    document["samplers"] = json!([{ "wrapS": 33071 }]);
    document["animations"] = json!([{
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "scale" } }],
        "samplers": [{ "input": 0, "output": 0 }]
    }]);
    let start = binary.len();
    binary.extend(PNG);
    let views = document["bufferViews"].as_array_mut().unwrap();
    views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": PNG.len() }));
    document["images"] =
        json!([{ "bufferView": views.len() - 1, "mimeType": "image/png", "name": "stripes" }]);
    document["buffers"][0]["byteLength"] = binary.len().into();
    (document, binary)
}

#[test]
fn only_what_is_new_is_new() {
    let (document, binary) = dressed();
    let file = glb(&document, &binary);
    let mesh = mesh_of(&file, &Beside::new());
    let AssetFile { bytes, notes, warnings, means } = written(&file, &Beside::new(), &numbered(&mesh));
    assert_eq!((notes, warnings, means), (vec![], vec![], 0));
    let (after, numbers) = parts(&bytes);
    let added = document["accessors"].as_array().unwrap().len();
    let view = document["bufferViews"].as_array().unwrap().len();
    assert_eq!(
        diff(&document, &after),
        [
            format!("+ /accessors/{added}"),
            "+ /asset/extras/specula".into(),
            format!("+ /bufferViews/{view}"),
            "! /buffers/0/byteLength".into(),
            "+ /meshes/0/extras/basis".into(),
            "+ /meshes/0/primitives/0/attributes/_NUMBER".into(),
        ]
    );
    assert_eq!(numbers[..binary.len()], binary);
    assert_eq!(mesh_of(&bytes, &Beside::new()), mesh);
    assert_eq!(read_recipe(&bytes).as_deref(), Some(RECIPE));
    let found = read_gltf_attribute::<Error>(&bytes, "_NUMBER", &mut |_| unreachable!()).unwrap();
    assert_eq!(found, [0.0, 1.0, 2.0, 3.0]);
    // A second time: the attribute is replaced, the recipe too.
    let again = written(&bytes, &Beside::new(), &numbered(&mesh));
    assert_eq!(again.warnings, ["the asset's own _NUMBER is replaced"]);
    assert_eq!(read_recipe(&again.bytes).as_deref(), Some(RECIPE));
}

#[test]
fn files_beside_a_document_become_part_of_it() {
    let (mut document, binary) = dressed();
    // Positions and normals in one file, the rest in another, and the picture in a third, twice.
    let (one, other) = binary.split_at(96);
    let beside = Beside::from([
        ("a b.bin", one.to_vec()),
        ("data/rest.bin", other.to_vec()),
        ("data/stripes.png", PNG.to_vec()),
    ]);
    document["buffers"] = json!([
        { "uri": "a%20b.bin", "byteLength": one.len(), "name": "first" },
        { "uri": "data/rest.bin", "byteLength": other.len() }
    ]);
    let original = document["bufferViews"][0].clone();
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": one.len() },
        { "buffer": 1, "byteLength": other.len() }
    ]);
    for (accessor, view, offset) in [(0, 0, 0), (1, 0, 48), (2, 1, 0), (3, 1, 32), (4, 1, 96)] {
        document["accessors"][accessor]["bufferView"] = view.into();
        document["accessors"][accessor]["byteOffset"] = offset.into();
    }
    assert!(original.is_object());
    document["images"] =
        json!([{ "uri": "data/stripes.png", "name": "stripes" }, { "uri": "data/stripes.png" }]);
    let file = document.to_string().into_bytes();
    let mesh = mesh_of(&file, &beside);
    let AssetFile { bytes, notes, warnings, .. } = written(&file, &beside, &numbered(&mesh));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(
        notes,
        ["2 buffers of the asset become one", "1 picture beside the asset becomes part of the file"]
    );
    assert_eq!(mesh_of(&bytes, &Beside::new()), mesh);
    let (after, numbers) = parts(&bytes);
    assert_eq!(after["buffers"], json!([{ "name": "first", "byteLength": numbers.len() }]));
    let image = |index: usize| {
        let view = &after["bufferViews"][after["images"][index]["bufferView"].as_u64().unwrap() as usize];
        let [start, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        &numbers[start..start + length]
    };
    assert_eq!([image(0), image(1)], [PNG; 2]);
    assert_eq!(after["images"][0], json!({ "bufferView": 2, "mimeType": "image/png", "name": "stripes" }));
    for kept in ["materials", "textures", "samplers", "animations", "nodes", "scenes", "extensions"] {
        assert_eq!(after[kept], document[kept], "{kept}");
    }
}

#[test]
fn every_node_gets_numbers_of_its_own() {
    let (mut document, binary) = square();
    document["nodes"] = json!([{ "mesh": 0, "name": "left" }, { "mesh": 0, "translation": [5, 0, 0] }]);
    document["scenes"][0]["nodes"] = json!([0, 1]);
    let file = glb(&document, &binary);
    let mesh = mesh_of(&file, &Beside::new());
    let AssetFile { bytes, notes, warnings, .. } = written(&file, &Beside::new(), &numbered(&mesh));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(
        notes,
        ["1 further node shows a mesh that another shows, and gets a copy of it with numbers of its own"]
    );
    let (after, _) = parts(&bytes);
    assert_eq!(
        after["nodes"],
        json!([{ "mesh": 0, "name": "left" }, { "mesh": 1, "translation": [5, 0, 0] }])
    );
    let attribute = |mesh: usize, name: &str| &after["meshes"][mesh]["primitives"][0]["attributes"][name];
    assert_eq!(attribute(0, "POSITION"), attribute(1, "POSITION"));
    let found = read_gltf_attribute::<Error>(&bytes, "_NUMBER", &mut |_| unreachable!()).unwrap();
    assert_eq!(found, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
}

/// Without normals each triangle has corners of its own: those at the ends of the diagonal are two of ours.
#[test]
fn vertices_that_are_several_get_the_mean() {
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let file = glb(&document, &binary);
    let mesh = mesh_of(&file, &Beside::new());
    assert_eq!(mesh.positions().len(), 6);
    let AssetFile { bytes, warnings, means, .. } = written(&file, &Beside::new(), &numbered(&mesh));
    assert_eq!((warnings.len(), means), (1, 2));
    assert!(warnings[0].starts_with("2 of 4 vertices of the asset are several here"), "{warnings:?}");
    assert!(warnings[0].contains("off by at most 1.5e0 (_NUMBER)"), "{warnings:?}");
    let (after, numbers) = parts(&bytes);
    let view = after["bufferViews"].as_array().unwrap().last().unwrap();
    let start = view["byteOffset"].as_u64().unwrap() as usize;
    // Corners 0, 1, 2 and 0, 2, 3 of the square are our 0 to 5.
    assert_eq!(numbers[start..start + 16], floats(&[1.5, 1.0, 3.0, 5.0]));
    // Corners with equal numbers lose nothing by their mean.
    let same = VertexAttribute { name: "_SAME".into(), width: 2, values: [0.1, -7.0].repeat(6) };
    assert_eq!(written(&file, &Beside::new(), &[same]).warnings, Vec::<String>::new());
}

#[test]
fn what_does_not_fit_is_refused() {
    let (mut document, binary) = square();
    let file = glb(&document, &binary);
    let error = |file: &[u8], mesh: &Mesh| {
        let text = GlbText::default();
        write_into_gltf::<Error>(file, mesh, &numbered(mesh), text, &mut |_| unreachable!())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        error(&file, &mesh::shape("sphere").unwrap()).split(" has ").next(),
        Some("glTF: the file holds another mesh (it")
    );
    let mut infinite = numbered(&read(&file).unwrap().mesh);
    infinite[0].values[2] = f32::INFINITY;
    let mesh = read(&file).unwrap().mesh;
    let refused =
        write_into_gltf::<Error>(&file, &mesh, &infinite, GlbText::default(), &mut |_| unreachable!());
    assert_eq!(refused.unwrap_err().to_string(), "glTF: _NUMBER: a number of vertex 2 is not finite");
    let places = document["accessors"].as_array().unwrap().len();
    document["accessors"].as_array_mut().unwrap().push(json!(
        { "componentType": 5126, "count": 2, "type": "VEC3" }
    ));
    document["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
    let file = glb(&document, &binary);
    let message = error(&file, &read(&file).unwrap().mesh);
    assert!(message.starts_with("nodes[0]: EXT_mesh_gpu_instancing shows one mesh"), "{message}");
    let (mut document, binary) = dressed();
    document["images"][0] = json!({ "uri": "a.tif" });
    let (file, beside) = (glb(&document, &binary), Beside::from([("a.tif", b"II*\0".to_vec())]));
    let mesh = mesh_of(&file, &beside);
    let refused = write_into_gltf(&file, &mesh, &numbered(&mesh), GlbText::default(), &mut find(&beside));
    assert_eq!(refused.unwrap_err().to_string(), "images[0]: a.tif is not PNG, JPEG, WebP, KTX2 or DDS");
}

/// A compressed view keeps its bytes, and the buffer that it would be decompressed into has none.
#[test]
fn compressed_views_are_kept() {
    let (mut document, binary) = square();
    let length = binary.len();
    document["buffers"] = json!([
        { "byteLength": length },
        { "byteLength": 64, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }
    ]);
    let view = json!({
        "buffer": 1, "byteLength": 64,
        "extensions": { "EXT_meshopt_compression": { "buffer": 0, "byteLength": 4, "byteStride": 4,
            "count": 16, "mode": "ATTRIBUTES" } }
    });
    document["bufferViews"].as_array_mut().unwrap().push(view.clone());
    let file = glb(&document, &binary);
    let AssetFile { bytes, .. } = written(&file, &Beside::new(), &[]);
    let (after, numbers) = parts(&bytes);
    assert_eq!(after["bufferViews"], document["bufferViews"]);
    assert_eq!(after["buffers"][1], document["buffers"][1]);
    assert_eq!(numbers[..length], binary);
}

/// The corpus's helmet: six meshes, six materials, fifteen pictures in files.
#[test]
fn the_helmet_keeps_its_clothes() {
    let Some(corpus) = test_data::folder("the_helmet_keeps_its_clothes", "SPECULA_CORPUS") else { return };
    let folder = corpus.join("mesh/FlightHelmet");
    let file = std::fs::read(folder.join("FlightHelmet.gltf")).unwrap();
    let mut find = |path: &str| Ok::<_, Error>(Arc::new(std::fs::read(folder.join(path)).unwrap()));
    let mesh = read_gltf(&file, &mut find).unwrap().mesh;
    let AssetFile { bytes, notes, warnings, .. } =
        write_into_gltf(&file, &mesh, &numbered(&mesh), GlbText::default(), &mut find).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(notes, ["15 pictures beside the asset become part of the file"]);
    let (before, (after, numbers)) = (serde_json::from_slice(&file).unwrap(), parts(&bytes));
    let mut expected = Vec::new();
    expected.extend((30..36).map(|index| format!("+ /accessors/{index}")));
    expected.extend((4..25).map(|index| format!("+ /bufferViews/{index}")));
    expected.extend(["! /buffers/0/byteLength".into(), "- /buffers/0/uri".into()]);
    for index in 0..15 {
        let image = |change: &str| change.replace('#', &index.to_string());
        expected.extend(["+ /images/#/bufferView", "+ /images/#/mimeType", "- /images/#/uri"].map(image));
    }
    expected.extend((0..6).map(|index| format!("+ /meshes/{index}/primitives/0/attributes/_NUMBER")));
    assert_eq!(diff(&before, &after), expected);
    let original = std::fs::read(folder.join("FlightHelmet.bin")).unwrap();
    assert_eq!(numbers[..original.len()], original);
    assert_eq!(read(&bytes).unwrap().mesh, mesh);
    let found = read_gltf_attribute::<Error>(&bytes, "_NUMBER", &mut |_| unreachable!()).unwrap();
    assert_eq!(found, numbered(&mesh)[0].values);
}
