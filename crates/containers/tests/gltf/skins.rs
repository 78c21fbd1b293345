//! Skins: vertices where their joints rest.

use super::*;

/// The two upper vertices of the square hang on a joint that is up and turned, the lower ones on one that is
/// not, or on both; the mesh's own node says nothing.
fn skinned() -> (Value, Vec<u8>) {
    let (mut document, mut binary) = square();
    let (joints, weights, inverse) = (binary.len(), binary.len() + 16, binary.len() + 80);
    binary.extend([[0_u8, 0, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]].concat());
    binary.extend(floats(&[1.0, 0.0, 0.0, 0.0, 0.75, 0.25, 0.0, 0.0]));
    binary.extend(floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]));
    // By columns: as it is, and 3 down.
    for down in [0.0, -3.0] {
        binary.extend(floats(&[
            1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, down, 0.0, 1.0,
        ]));
    }
    document["buffers"][0]["byteLength"] = binary.len().into();
    document["bufferViews"][0]["byteLength"] = binary.len().into();
    let accessor = |offset: usize, code: u32, count: usize, shape: &str| json!({ "bufferView": 0, "byteOffset": offset, "componentType": code, "count": count, "type": shape });
    document["accessors"].as_array_mut().unwrap().extend([
        accessor(joints, 5121, 4, "VEC4"),
        accessor(weights, 5126, 4, "VEC4"),
        accessor(inverse, 5126, 2, "MAT4"),
    ]);
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (5.into(), 6.into());
    let half = 0.5_f64.sqrt();
    document["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": 7 }]);
    document["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0], "scale": [9, 9, 9] },
        { "children": [2], "translation": [0, 0, 1] },
        { "translation": [0, 7, 0], "rotation": [0, half, 0, half] }
    ]);
    document["scenes"] = json!([{ "nodes": [0, 1] }]);
    (document, binary)
}

#[test]
fn a_skin_takes_vertices_where_its_joints_rest() {
    let (document, binary) = skinned();
    let mesh = read(&glb(&document, &binary)).unwrap().mesh;
    // In the file: (x, y, z + 1) by the first joint, (z, y + 4, 1 - x) by the second.
    let places =
        [[0.0, 0.0, 2.0], [0.75 * 2.0 + 0.25, 1.0, 0.75 * 2.0 - 0.25], [1.0, 7.0, -1.0], [1.0, 7.0, 1.0]];
    for (vertex, [x, y, z]) in places.into_iter().enumerate() {
        let found = Vec3::from(mesh.positions()[vertex]);
        assert!((found - Vec3::new(z, x, y)).length() < 1e-6, "{vertex}: {found}");
    }
    let close =
        |found: &[f32], expected: [f32; 3]| (Vec3::from_slice(found) - Vec3::from(expected)).length() < 1e-6;
    // +Z_file is our X; turned by a quarter about Y_file it is +X_file, our Y.
    assert!(close(&mesh.normals()[0], [1.0, 0.0, 0.0]) && close(&mesh.normals()[2], [0.0, 1.0, 0.0]));
    assert!(close(&mesh.tangents()[0], [0.0, 1.0, 0.0]) && close(&mesh.tangents()[2], [-1.0, 0.0, 0.0]));
    assert_eq!(mesh.triangles(), expected().triangles());
    assert_sound(&mesh, "skinned");
}

#[test]
fn errors_of_skins_name_their_place() {
    let attributes = "/meshes/0/primitives/0/attributes";
    let primitive = "meshes[0].primitives[0]: attributes.";
    for (pointer, value, expected) in [
        ("/nodes/0/skin".to_owned(), 3.into(), format!("nodes[0].skin: {NOTHING}")),
        ("/skins/0/joints".to_owned(), json!([1, 9]), format!("skins[0].joints[1]: {NOTHING}")),
        (
            "/skins/0/joints".to_owned(),
            json!([1]),
            "skins[0]: inverseBindMatrices: accessors[7]: the count is 2, and there are 1 joints".to_owned(),
        ),
        (
            format!("{attributes}/WEIGHTS_0"),
            4.into(),
            format!("{primitive}WEIGHTS_0: accessors[4]: expected elements of the type Vec4, found Scalar"),
        ),
        (
            attributes.to_owned(),
            json!({ "POSITION": 0 }),
            format!("{primitive}JOINTS_0 is missing, and a node gives the mesh a skin"),
        ),
    ] {
        let (mut document, binary) = skinned();
        *document.pointer_mut(&pointer).unwrap() = value;
        assert_eq!(error_of(&document, &binary), expected, "{pointer}");
    }
    let (mut document, binary) = skinned();
    document["skins"][0] = json!({ "joints": [1] });
    assert_eq!(error_of(&document, &binary), format!("{primitive}JOINTS_0: joint 1 of a skin of 1"));
}
