//! EXT_mesh_gpu_instancing: a mesh at several places.

use super::*;

/// The square at three places: where it is; twice as large and 5 along X_file; a quarter turn about Y_file
/// and 10 up. Rotations are normalised shorts.
fn instanced() -> (Value, Vec<u8>) {
    let (mut document, mut binary) = square();
    let start = binary.len();
    binary.extend(floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 10.0, 0.0]));
    binary.extend(
        [0_i16, 0, 0, 32767, 0, 0, 0, 32767, 0, 23170, 0, 23170].iter().flat_map(|value| value.to_le_bytes()),
    );
    binary.extend(floats(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0]));
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"][0]["byteLength"] = binary.len().into();
    let accessor = |offset: usize, code: u32, shape: &str| json!({ "bufferView": 0, "byteOffset": start + offset, "componentType": code, "normalized": code == 5122, "count": 3, "type": shape });
    document["accessors"].as_array_mut().unwrap().extend([
        accessor(0, 5126, "VEC3"),
        accessor(36, 5122, "VEC4"),
        accessor(60, 5126, "VEC3"),
    ]);
    document["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    document["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": {
        "attributes": { "TRANSLATION": 5, "ROTATION": 6, "SCALE": 7, "_ID": 5 }
    } });
    (document, binary)
}

#[test]
fn a_mesh_is_read_at_the_place_of_each_instance() {
    let (mut document, binary) = instanced();
    // The node's own place comes after that of the instance.
    document["nodes"][0]["translation"] = json!([0, 0, 100]);
    let model = read(&glb(&document, &binary)).unwrap();
    assert_eq!((model.mesh.triangles().len(), model.notes.len()), (6, 0));
    assert_sound(&model.mesh, "instanced");
    // The corner at (2, 3, 1) of the file: as it is, 2 p + (5, 0, 0), (z, y, -x) + (0, 10, 0).
    let file = |vertex: usize| {
        let [z, x, y] = model.mesh.positions()[vertex];
        Vec3::new(x, y, z)
    };
    for (instance, place) in [[2.0, 3.0, 101.0], [9.0, 6.0, 102.0], [1.0, 13.0, 98.0]].into_iter().enumerate()
    {
        let found = file(4 * instance + 2);
        assert!((found - Vec3::from(place)).length() < 1e-4, "{instance}: {found}");
    }
    // Each attribute is optional, and one of its own counts instances, too.
    document["nodes"][0] =
        json!({ "mesh": 0, "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "_ID": 5 } } } });
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    assert_eq!((mesh.triangles().len(), mesh.positions()[9]), (6, expected().positions()[1]));
    let numbers = containers::read_gltf_attribute::<Error>(&glb(&document, &binary), "POSITION", &mut |_| {
        Ok(Arc::default())
    });
    assert_eq!(numbers.unwrap(), [0.0, 2.0, 2.0, 0.0].repeat(3));
}

#[test]
fn errors_of_instances_name_their_place() {
    let here = "nodes[0]: EXT_mesh_gpu_instancing: ";
    for (attributes, expected) in [
        (json!({}), "expected `attributes`, such as TRANSLATION"),
        (json!({ "SCALE": "x" }), "SCALE: expected the number of an accessor"),
        (json!({ "SCALE": 99 }), "SCALE: there is no accessor 99"),
        (
            json!({ "ROTATION": 6, "SCALE": 1 }),
            "ROTATION has 3 elements and SCALE has 4; expected one of each for every instance",
        ),
        (json!({ "ROTATION": 7 }), "ROTATION: accessors[7]: expected elements of the type Vec4, found Vec3"),
        (json!({ "ROTATION": 3 }), "ROTATION: [0, 0, 0, 0] of instance 2 is not a quaternion of length 1"),
    ] {
        let (mut document, mut binary) = instanced();
        // The tangents serve as rotations of which one is zero.
        binary[160..176].fill(0);
        document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = attributes;
        assert_eq!(error_of(&document, &binary), format!("{here}{expected}"));
    }
    let (mut document, binary) = instanced();
    // No bytes stand behind these, whatever the mesh is.
    document["accessors"][5] = json!({ "componentType": 5126, "count": 1_u64 << 60, "type": "VEC3" });
    document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({ "TRANSLATION": 5 });
    let points = json!({ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 0 }] });
    document["meshes"].as_array_mut().unwrap().push(points);
    for mesh in [0, 1] {
        document["nodes"][0]["mesh"] = mesh.into();
        let error = read(&glb(&document, &binary)).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TooLarge, "{error}");
    }
}
