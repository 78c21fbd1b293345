//! Damaged and hostile files: an error that names the place, never a panic or a huge mesh.

use super::*;

#[test]
fn every_truncated_length_is_an_error() {
    let (document, binary) = square();
    let bytes = glb(&document, &binary);
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length}");
    }
    let mut embedded = document;
    embedded["buffers"][0]["uri"] = format!("data:;base64,{}", STANDARD.encode(&binary)).into();
    let text = embedded.to_string();
    for length in 0..text.len() {
        assert!(read(&text.as_bytes()[..length]).is_err(), "{length}");
    }
}

/// Each byte of a file, changed in several ways: an error or a mesh, never a panic.
#[test]
fn no_changed_byte_is_a_panic() {
    let (document, binary) = square();
    let bytes = glb(&document, &binary);
    let mut meshes = 0;
    for at in 0..bytes.len() {
        for flip in [0x01, 0x04, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            let mut beside = |_: &str| Err(read(b"").unwrap_err());
            meshes += usize::from(read_gltf(&changed, &mut beside).is_ok());
        }
    }
    assert!(meshes > 100, "{meshes} files were still meshes");
}

#[test]
fn contradictions_are_reported_with_their_place() {
    let primitive = "meshes[0].primitives[0]: ";
    let position = format!("{primitive}attributes.POSITION: accessors[0]: ");
    let cases: [(&str, Value, String); 22] = [
        ("/scene", 3.into(), format!("scene: {NOTHING}")),
        ("/scenes/0/nodes/0", 9.into(), format!("scenes[0].nodes[0]: {NOTHING}")),
        ("/nodes/0/mesh", 1.into(), format!("nodes[0].mesh: {NOTHING}")),
        (
            "/nodes/0/children",
            json!([0]),
            "nodes[0]: the node is reached twice; nodes must form a tree without cycles".into(),
        ),
        (
            "/nodes/0/rotation",
            json!([0, 0, 0, 0]),
            "nodes[0]: the rotation [0, 0, 0, 0] is not a quaternion of length 1".into(),
        ),
        (
            "/nodes/0/scale",
            json!([1e300, 1, 1]),
            "meshes[0]: the positions of vertex 0 hold a number that is not finite".into(),
        ),
        ("/meshes/0/primitives/0/attributes", json!({}), format!("{primitive}attributes.POSITION is missing")),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            77.into(),
            format!("meshes[0].primitives[0].attributes[\"POSITION\"]: {NOTHING}"),
        ),
        ("/meshes/0/primitives/0/indices", 77.into(), format!("meshes[0].primitives[0].indices: {NOTHING}")),
        (
            "/meshes/0/primitives/0/indices",
            0.into(),
            format!("{primitive}indices: accessors[0]: expected elements of the type Scalar, found Vec3"),
        ),
        (
            "/accessors/1/count",
            3.into(),
            format!("{primitive}attributes.NORMAL: accessors[1]: the count is 3, and there are 4 positions"),
        ),
        ("/accessors/0/bufferView", 5.into(), format!("accessors[0].bufferView: {NOTHING}")),
        ("/accessors/0/componentType", 5124.into(), "accessors[0].componentType: the value is not one that glTF allows".into()),
        (
            "/accessors/4/componentType",
            5126.into(),
            format!("{primitive}indices: accessors[4]: componentType 5126 is not one of an index"),
        ),
        (
            "/accessors/0/byteOffset",
            190.into(),
            format!(
                "{position}4 elements of 12 bytes, 12 apart, from byte 190 on are more than the 236 bytes of buffer view 0"
            ),
        ),
        (
            "/accessors/0/byteOffset",
            usize::MAX.into(),
            format!(
                "{position}4 elements of 12 bytes, 12 apart, from byte 18446744073709551615 on are more than the 236 bytes of buffer view 0"
            ),
        ),
        (
            "/bufferViews/0/byteStride",
            4.into(),
            format!("{position}bufferViews[0]: a stride of 4 bytes is less than the 12 of an element"),
        ),
        (
            "/bufferViews/0/byteLength",
            usize::MAX.into(),
            format!(
                "{position}bufferViews[0]: 18446744073709551615 bytes from byte 0 on are more than the 236 of buffer 0"
            ),
        ),
        ("/bufferViews/0/buffer", 1.into(), format!("bufferViews[0].buffer: {NOTHING}")),
        (
            "/buffers/0/byteLength",
            999.into(),
            "buffers[0]: byteLength is 999, and there are 236 bytes".into(),
        ),
        (
            "/accessors/4/byteOffset",
            98.into(),
            format!("{primitive}triangle 1 has corners [0, 128, 63], and there are 4 vertices"),
        ),
        (
            "/accessors/0/count",
            1_000_000_000.into(),
            "the scene declares 2 triangles and 1000000000 vertices, each instance counted; at most 4194304 triangles are read".into(),
        ),
    ];
    for (pointer, value, expected) in cases {
        let (mut document, binary) = square();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let slot = document.pointer_mut(parent).unwrap();
        match key.parse::<usize>() {
            Ok(index) if slot.is_array() => slot[index] = value,
            _ => slot[key] = value,
        }
        assert_eq!(error_of(&document, &binary), expected, "{pointer}");
    }
}

#[test]
fn what_is_not_read_is_named() {
    let (mut document, binary) = square();
    document["extensionsRequired"] = json!(["KHR_materials_unlit", "KHR_draco_mesh_compression"]);
    let error = read(&glb(&document, &binary)).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    let message = "the file requires KHR_draco_mesh_compression, which is not read here; export it without (compression of meshes switched off)";
    assert_eq!(error.to_string(), message);
    document["extensionsRequired"] = json!(["VENDOR_hair", "KHR_materials_unlit"]);
    let message = "the file requires VENDOR_hair, which is not read here; export it without";
    assert_eq!(error_of(&document, &binary), message);
    document["extensionsRequired"] = json!(["KHR_texture_transform"]);
    assert_eq!(read(&glb(&document, &binary)).unwrap().mesh, expected());
    document["asset"] = json!({ "version": "1.0" });
    assert_eq!(error_of(&document, &binary), "the file is of glTF 1.0; 2.0 is read");

    for (bytes, kind, message) in [
        (&b""[..], ErrorKind::Empty, "the file is empty"),
        (
            b"# Wavefront",
            ErrorKind::UnknownFormat,
            "this is not a glTF file: it is not JSON, and does not begin with the letters glTF",
        ),
        (
            b"{\n  \"asset\": 3 }",
            ErrorKind::Damaged,
            "the JSON is not that of glTF 2.0: invalid type: integer `3`, expected struct Asset",
        ),
        (b"glTF\x01\0\0\0\0\0\0\0", ErrorKind::Unsupported, "the file is of binary glTF 1; 2 is read"),
        (b"glTF\x02\0\0\0\x0c\0\0\0", ErrorKind::Damaged, "there is no chunk of JSON"),
    ] {
        let error = read(bytes).unwrap_err();
        assert_eq!((error.kind(), error.to_string().as_str()), (kind, message));
    }
}

/// Files that are far larger in memory than on disk.
#[test]
fn small_files_do_not_become_large_meshes() {
    let (mut document, binary) = square();
    // 2^40 instances, were each node to appear in two others.
    document["nodes"] = (0..40)
        .map(|node| json!({ "children": [node + 1, node + 1] }))
        .chain([json!({ "mesh": 0 })])
        .collect();
    assert!(error_of(&document, &binary).contains("reached twice"));
    let (mut document, binary) = square();
    document["meshes"][0]["primitives"] =
        (0..1000).map(|_| document["meshes"][0]["primitives"][0].clone()).collect();
    document["nodes"] = (0..10_000).map(|_| json!({ "mesh": 0 })).collect();
    document["scenes"][0]["nodes"] = (0..10_000).collect();
    let error = read(&glb(&document, &binary)).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::TooLarge);
}
