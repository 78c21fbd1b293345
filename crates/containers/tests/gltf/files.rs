//! Files that other programs compressed, quantised or stored sparsely; see `data/README.md`.

use super::*;

const TORI: [(&str, &[u8]); 4] = [
    ("quantized", include_bytes!("../data/torus-quantized.glb")),
    ("meshopt-medium", include_bytes!("../data/torus-meshopt-medium.glb")),
    ("meshopt-high", include_bytes!("../data/torus-meshopt-high.glb")),
    ("sparse", include_bytes!("../data/torus-sparse.glb")),
];

/// A torus about our Z: radii 1 and 1/4, 16 by 8 quadrangles.
#[test]
fn compressed_files_hold_the_torus_that_was_written() {
    for (name, bytes) in TORI {
        let model = read(bytes).unwrap();
        let mesh = &model.mesh;
        assert_sound(mesh, name);
        assert_eq!(mesh.triangles().len(), 2 * 16 * 8, "{name}");
        // 8 bits of a normal in an octahedron are 1/127 apart.
        let tolerance = if name == "meshopt-high" { 2e-2 } else { 2e-3 };
        for (position, normal) in mesh.positions().iter().zip(mesh.normals()) {
            let (position, normal) = (Vec3::from(*position), Vec3::from(*normal));
            let ring = position.with_z(0.0).normalize();
            let outward = (position - ring) / 0.25;
            assert!((outward.length() - 1.0).abs() < 1e-3, "{name}: {position}");
            assert!((outward - normal).length() < tolerance, "{name}: {outward}, {normal}");
        }
        let area: f32 = mesh
            .triangles()
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|k| Vec3::from(mesh.positions()[k as usize]));
                (b - a).cross(c - a).length() / 2.0
            })
            .sum();
        // 4 pi^2 * 1/4, less what 16 by 8 flat faces cut off.
        assert!((9.2..9.87).contains(&area), "{name}: {area}");
        let set = |u: f32, v: f32| mesh.coordinates().unwrap().iter().filter(|pair| **pair == [u, v]).count();
        match name {
            "sparse" => assert!(set(0.25, 0.75) > 0 && set(0.5, 0.125) > 0 && set(0.0, 0.0) > 100),
            _ => assert!(set(0.0, 1.0) > 0 && set(1.0, 0.0) > 0, "{name}"),
        }
    }
}

#[test]
fn damaged_files_are_errors_or_meshes() {
    for (name, bytes) in TORI {
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err(), "{name}: {length}");
        }
        let mut meshes = 0;
        // Every byte takes minutes.
        for at in (0..bytes.len()).step_by(7) {
            for flip in [0x01, 0x10, 0xff] {
                let mut changed = bytes.to_vec();
                changed[at] ^= flip;
                let mut beside = |_: &str| Err(read(b"").unwrap_err());
                meshes += usize::from(read_gltf(&changed, &mut beside).is_ok());
            }
        }
        assert!(meshes > 100, "{name}: {meshes} files were still meshes");
    }
}

#[test]
fn errors_of_compressed_views_name_the_extension() {
    let (mut document, binary) = square();
    let place = "bufferViews[0]: EXT_meshopt_compression: ";
    for (extension, message) in [
        (json!({}), "missing field `buffer`"),
        (
            json!({ "buffer": 0, "byteLength": 9, "byteStride": 4, "count": 1, "mode": "VOXELS" }),
            "the mode \"VOXELS\" is not read",
        ),
        (
            json!({ "buffer": 0, "byteLength": 9, "byteStride": 4, "count": 1, "mode": "TRIANGLES" }),
            "mode, filter, 1 elements and a stride of 4 bytes do not go together",
        ),
        (
            json!({ "buffer": 0, "byteLength": 9, "byteStride": 4, "count": 1u64 << 40, "mode": "ATTRIBUTES" }),
            "1099511627776 elements of 4 bytes cannot be in 9 bytes",
        ),
        (
            json!({ "buffer": 0, "byteLength": 9, "byteStride": 4, "count": 1, "mode": "ATTRIBUTES" }),
            "the compressed data are damaged or truncated",
        ),
    ] {
        document["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": extension });
        assert_eq!(error_of(&document, &binary), format!("{place}{message}"));
    }
}

#[test]
fn a_check_of_the_json_refuses_only_what_is_refused() {
    for (name, bytes) in TORI {
        let check = |bytes: &[u8]| {
            let find = &mut |path: &str| panic!("{path} is not needed");
            containers::check_gltf::<Error>(&mut std::io::Cursor::new(bytes), find)
        };
        assert_eq!(check(bytes), Ok(()), "{name}");
        for length in (0..bytes.len()).step_by(7) {
            if let Err(error) = check(&bytes[..length]) {
                assert_eq!(read(&bytes[..length]).unwrap_err().to_string(), error.to_string(), "{name}");
            }
        }
    }
}
