//! Meshes from glTF files, through the engine's own door.

use std::path::Path;

use engine::Artifact;
use stages::artifacts::Mesh;

use crate::fixture::{Case, case};

/// A square of side 2 that faces +X_file, our +Y, twice: with a picture on it that is turned by a quarter, so
/// no other rule gives its tangent, and with one coordinate everywhere, which gives none. Its numbers are in
/// separate files.
pub(crate) fn square() -> Case {
    let (text, bytes) = square_files();
    case("import-mesh", "")
        .file("meshes/square.gltf", text)
        .file("meshes/square.bin", bytes)
        .source("meshes/square.gltf")
}

/// The document of the square, and the file of its numbers, `square.bin`.
pub(crate) fn square_files() -> (&'static str, Vec<u8>) {
    let numbers: Vec<f32> = vec![
        0.0, -1.0, 1.0, 0.0, -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, // positions
        0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, // coordinates
    ];
    let mut bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    bytes.extend([0, 1, 2, 0, 2, 3]);
    let text = r#"{
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [0, 2, 0] }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2 },
            { "attributes": { "POSITION": 0, "TEXCOORD_0": 3 }, "indices": 2 }
        ] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 0, "byteOffset": 80, "componentType": 5121, "count": 6, "type": "SCALAR" },
            { "componentType": 5126, "count": 4, "type": "VEC2" }
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 86 }],
        "buffers": [{ "uri": "square.bin", "byteLength": 86 }]
    }"#;
    (text, bytes)
}

/// The corpus's helmet, with its numbers in separate files.
pub(crate) fn helmet(corpus: &Path) -> Case {
    let read = |name: &str| std::fs::read(corpus.join("mesh/FlightHelmet").join(name)).unwrap();
    case("import-mesh", "")
        .file("FlightHelmet.gltf", read("FlightHelmet.gltf"))
        .file("FlightHelmet.bin", read("FlightHelmet.bin"))
        .source("FlightHelmet.gltf")
}

#[test]
fn a_mesh_is_read_with_the_files_beside_it() {
    let ran = square().run().unwrap();
    let mesh = ran.artifact::<Mesh>();
    assert_eq!(mesh.0.triangles(), [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]]);
    assert_eq!(mesh.0.positions()[..2], [[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]]);
    assert!(mesh.0.normals().iter().all(|normal| *normal == [0.0, 1.0, 0.0]));
    // The direction in which the picture's u grows; and for a normal to the north, east: Z x Y.
    assert_eq!(mesh.0.tangents()[..6], [[0.0, 0.0, 1.0, 1.0]; 6]);
    assert_eq!(mesh.0.tangents()[6..], [[-1.0, 0.0, 0.0, 1.0]; 6]);
    let read: Vec<_> = ran.reads.iter().filter_map(|read| read.path.file_name()).collect();
    assert_eq!(read, ["square.gltf", "square.bin"]);
    assert_eq!(
        ran.notes,
        [
            "2 of 2 primitives have no normals: every triangle is flat",
            "2 of 2 primitives have no tangents: they are made"
        ]
    );
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
}

#[test]
fn failures_name_the_file() {
    let bare = case("import-mesh", "").file("a.glb", "glTF").source("a.glb");
    assert_eq!(bare.failure(), "cannot import a.glb: the file ends at byte 4, within a header");
    let text = r#"{ "asset": { "version": "2.0" }, "extensionsRequired": ["KHR_draco_mesh_compression"] }"#;
    let packed = case("import-mesh", "").file("a.gltf", text).source("a.gltf");
    assert!(
        packed.failure().starts_with("cannot import a.gltf: the file requires KHR_draco_mesh_compression")
    );
    let outside = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "uri": "URI", "byteLength": 36 }] }"#;
    let case = |uri| case("import-mesh", "").file("a.gltf", outside.replace("URI", uri)).source("a.gltf");
    let message = "cannot import a.gltf: buffers[0]: the uri \"/a.bin\" does not name a file beside this one";
    assert_eq!(case("/a.bin").failure(), message);
    assert!(case("a.bin").failure().starts_with("cannot import a.gltf: cannot read"));
}

/// Exporters put buffers and textures into folders beside that of the scene, and some write names as they
/// are.
#[test]
fn buffers_may_lie_in_other_folders_and_have_any_name() {
    let document = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "uri": "URI", "byteLength": 36 }] }"#;
    let binary: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    for (uri, file) in [
        ("../buffers/a.bin", "models/../buffers/a.bin"),
        ("..\\\\buffers\\\\a.bin", "models/../buffers/a.bin"),
        ("%2E%2E/buffers/a%20b.bin", "models/../buffers/a b.bin"),
        ("100%.bin", "models/100%.bin"),
        ("a%20b.bin", "models/a%20b.bin"),
    ] {
        let case = case("import-mesh", "").file("models/a.gltf", document.replace("URI", uri));
        let case = case.file(file, binary.clone()).source("models/a.gltf");
        assert_eq!(case.artifact::<Mesh>().0.triangles().len(), 1, "{uri}");
    }
}

#[test]
fn an_empty_scene_is_a_mesh_with_a_warning() {
    let case =
        case("import-mesh", "").file("a.gltf", r#"{ "asset": { "version": "2.0" } }"#).source("a.gltf");
    let ran = case.run().unwrap();
    assert_eq!(ran.artifact::<Mesh>().0.positions().len(), 0);
    assert_eq!(ran.warnings, ["the mesh has no triangles"]);
}

/// Real files pass through the artifact's bytes, which a run of a case compares with the value.
#[test]
fn files_of_the_corpus_are_imported() {
    let Some(corpus) = test_data::folder("files_of_the_corpus_are_imported", "SPECULA_CORPUS") else {
        return;
    };
    let mesh = helmet(&corpus).artifact::<Mesh>();
    assert_eq!(mesh.0.positions().len(), 55_392);
    assert_eq!(Mesh::decode(&mesh.encode().unwrap()).unwrap(), *mesh);
    // It stands on the ground and looks along +X: its goggles are in front.
    let (centre, radius) = mesh.0.bounds();
    assert!(centre[2] > 0.0 && radius < 1.0, "{centre:?} {radius}");
}
