//! How `specula inspect` describes textures and reflection maps in spherical harmonics.

use containers::{BabylonEnv, Texture, read_babylon_env, read_texture, tensors};
use serde_json::{Value, json};

use super::facts::{Facts, range};

/// The facts of a texture: KTX2 or DDS.
pub(super) fn texture(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let file = read_texture(bytes)?;
    let texture = &file.texture;
    let kind = match (texture.depth > 1, texture.faces == 6, texture.layers > 0) {
        (true, ..) => "volume",
        (_, true, true) => "cube array",
        (_, true, false) => "cube",
        (_, false, true) => "2D array",
        (_, false, false) => "2D",
    };
    let mut shape = format!("{} x {}", texture.width, texture.height);
    for (count, what) in [
        (texture.depth, "slices"),
        (texture.faces, "faces"),
        (texture.layers, "layers"),
        (texture.levels().len(), "levels"),
    ] {
        if count > 1 || (what == "layers" && count > 0) {
            shape.push_str(&format!(", {count} {what}"));
        }
    }
    let mut facts = vec![
        ("what", format!("texture, {kind}").into()),
        ("format", file.container.into()),
        ("shape", format!("{shape}, {}", file.format.name()).into()),
    ];
    let texts = file.metadata.iter().filter(|(key, _)| *key != "specula");
    let texts: serde_json::Map<String, Value> =
        texts.map(|(key, value)| (key.clone(), json!(value))).collect();
    let units = [("specula.basis", "coefficients of radiance"), ("specula.entries", "entries of matrices")];
    let unit = units.into_iter().find(|(key, _)| texts.contains_key(*key));
    let unit = unit.map_or("linear Rec. 709", |(_, unit)| unit);
    if !texts.is_empty() {
        facts.push(("metadata", Value::Object(texts)));
    }
    facts.extend(range(unit, texture.levels().flatten().map(|pixel| pixel.map(f64::from))));
    Ok(facts)
}

/// The facts of an `.env` file of Babylon.js.
pub(super) fn babylon_env(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let BabylonEnv { cube, irradiance, irradiance_cube, lod_generation_scale } = read_babylon_env(bytes)?;
    let mut facts: Facts =
        vec![("what", "environment for Babylon.js, a prefiltered cube".into()), ("format", ".env".into())];
    facts.extend(light(&cube));
    facts.push((
        "irradiance",
        match (irradiance, irradiance_cube) {
            (None, _) => "none".into(),
            (Some(_), None) => "a quadratic polynomial".into(),
            (Some(_), Some(cube)) => {
                format!("a quadratic polynomial, and a cube of {0} x {0}", cube.width).into()
            }
        },
    ));
    facts.push(("lod scale", lod_generation_scale.into()));
    facts.extend(range("linear Rec. 709", cube.levels().flatten().map(|pixel| pixel.map(f64::from))));
    Ok(facts)
}

/// The size and the frame of a prefiltered cube in RGBD.
pub(super) fn light(cube: &Texture) -> Facts {
    let Texture { width, height, faces, .. } = cube;
    vec![
        ("shape", format!("{width} x {height}, {faces} faces, {} levels, RGBD", cube.levels().len()).into()),
        ("frame", "+Y up; faces +X -X +Y -Y +Z -Z, looked up with x mirrored, as Babylon.js does".into()),
    ]
}

/// The facts of the safetensors of a reflection map.
pub(super) fn reflection_map(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let map = tensors::decode_shrm(bytes)?;
    // The facts of every tensor file include the centre.
    let entries = containers::shrm_metadata(&map).into_iter().filter(|(key, _)| *key != "centre");
    let mut facts: Facts = entries.map(|(key, value)| (key, value.into())).collect();
    facts.extend(range("coefficients of radiance", map.values().iter().map(|value| value.map(f64::from))));
    Ok(facts)
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use containers::{Precision, TexelFormat, write_dds, write_ktx2};
    use sh::Degree;
    use shrm::{MapGrid, Shrm, Terms, View};
    use sphere::Cube;

    use super::*;

    fn by_label(facts: Facts) -> std::collections::BTreeMap<&'static str, Value> {
        facts.into_iter().collect()
    }

    #[test]
    fn a_texture_has_its_shape_its_texts_and_its_non_finite_values() {
        let mut cube = Texture { width: 2, height: 2, layers: 9, faces: 6, ..Texture::default() };
        cube.pixels = vec![[1.0, -2.0, f32::NAN]; 216];
        let bytes =
            write_ktx2(&cube, Precision::Half, Some("{}"), &[("specula.basis", "real")]).unwrap().bytes;
        let facts = by_label(super::super::describe(&bytes).unwrap());
        assert_eq!(facts["what"], "texture, cube array");
        assert_eq!(facts["shape"], "2 x 2, 6 faces, 9 layers, RGBA16F");
        assert_eq!(facts["metadata"]["KTXorientation"], "rd");
        assert_eq!(facts["values"], "coefficients of radiance");
        assert_eq!(
            (&facts["not finite"], &facts["least"]),
            (&json!(216), &json!("[1.000000, -2.000000, none]"))
        );
        assert_eq!(facts["recipe"], json!({}));
        let bytes = write_ktx2(&cube, Precision::Half, None, &[("specula.entries", "row i")]).unwrap().bytes;
        assert_eq!(by_label(super::super::describe(&bytes).unwrap())["values"], "entries of matrices");

        let volume = Texture { depth: 3, layers: 0, faces: 1, pixels: vec![[0.5; 3]; 12], ..cube };
        let volume = Texture { smaller_levels: vec![vec![[0.25; 3]]], ..volume };
        let bytes = write_dds(&volume, Precision::Float).unwrap().bytes;
        let facts = by_label(super::super::describe(&bytes).unwrap());
        assert_eq!((&facts["what"], &facts["format"]), (&json!("texture, volume"), &json!("DDS")));
        assert_eq!(facts["shape"], "2 x 2, 3 slices, 2 levels, RGBA32F");
        assert!(facts["recipe"].as_str().unwrap().contains("beside"), "{}", facts["recipe"]);
        assert!(!facts.contains_key("metadata"));
    }

    #[test]
    fn an_array_of_cubes_has_its_layers_its_levels_and_its_texts() {
        let level = |edge: usize| vec![[0.5, 1.0, 2.0]; 4 * 6 * edge * edge];
        let cubes = Texture { width: 8, height: 8, layers: 4, faces: 6, ..Texture::default() };
        let cubes = Texture { pixels: level(8), smaller_levels: vec![level(4), level(2)], ..cubes };
        for (format, name) in [(TexelFormat::Rgb9E5, "RGB9E5"), (TexelFormat::Bc6h, "BC6H")] {
            let texts = [("specula.std", "[0.3,0.36,0.42,0.5]")];
            let ktx2 = write_ktx2(&cubes, format.nearest(), None, &texts).unwrap().bytes;
            let dds = write_dds(&cubes, format.nearest()).unwrap().bytes;
            for bytes in [&ktx2, &dds] {
                let facts = by_label(super::super::describe(bytes).unwrap());
                assert_eq!(facts["what"], "texture, cube array");
                assert_eq!(facts["shape"], format!("8 x 8, 6 faces, 4 layers, 3 levels, {name}"));
                assert_eq!(facts["greatest"], "[0.500000, 1.000000, 2.000000]");
            }
            let facts = by_label(super::super::describe(&ktx2).unwrap());
            assert_eq!(facts["metadata"]["specula.std"], "[0.3,0.36,0.42,0.5]");
        }
    }

    #[test]
    fn lights_of_engines_say_what_they_are() {
        let cube =
            Texture { width: 2, height: 2, faces: 6, pixels: vec![[0.5; 3]; 24], ..Texture::default() };
        let cube = Texture { smaller_levels: vec![vec![[0.25; 3]; 6]], ..cube };
        let env = BabylonEnv {
            cube: cube.clone(),
            irradiance: None,
            irradiance_cube: None,
            lod_generation_scale: 0.8,
        };
        let bytes = containers::write_babylon_env(&env, Some("{}")).unwrap().bytes;
        let facts = by_label(super::super::describe(&bytes).unwrap());
        assert_eq!(
            (&facts["format"], &facts["shape"]),
            (&json!(".env"), &json!("2 x 2, 6 faces, 2 levels, RGBD"))
        );
        assert_eq!((&facts["irradiance"], &facts["recipe"]), (&json!("none"), &json!({})));
        let light = containers::ImageBasedLight { cube, irradiance: [[0.5; 3]; 9] };
        let bytes = containers::write_gltf_image_based_light(&light, Some("{}")).unwrap().bytes;
        let facts = super::super::mesh::of_file(std::path::Path::new("a.gltf"), &bytes).unwrap().unwrap();
        let facts = by_label(facts);
        assert_eq!(facts["what"], "image-based light (EXT_lights_image_based)");
        assert_eq!((&facts["irradiance"], &facts["intensity"]), (&json!("9 coefficients"), &json!(1.0)));
        assert_eq!(facts["shape"], "2 x 2, 6 faces, 2 levels, RGBD");
    }

    #[test]
    fn a_reflection_map_has_its_view_and_frame() {
        let grid = MapGrid::Cube(Cube { edge: 1 });
        let values = vec![[0.5; 3]; 6 * 2];
        let map = Shrm::new(grid, View::Local, Centre::Normal, Degree::new(1).unwrap(), Terms::Zonal, values)
            .unwrap();
        let facts =
            by_label(super::super::describe(&tensors::encode_shrm(&map, &[], None).unwrap()).unwrap());
        assert_eq!((&facts["what"], &facts["degree"]), (&json!("shrm"), &json!("1")));
        assert_eq!((&facts["layout"], &facts["centre"]), (&json!("cube"), &json!("normal")));
        assert_eq!(facts["shape"], json!(["shrm [6, 1, 1, 4, 3] F32"]));
        assert_eq!((&facts["view"], &facts["terms"]), (&json!("local"), &json!("zonal")));
        assert!(facts["frame"].as_str().unwrap().contains("+Z up"));
    }
}
