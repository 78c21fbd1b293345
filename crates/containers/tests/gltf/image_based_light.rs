//! EXT_lights_image_based: its irradiance with intensity and rotation, and what is wrong with a damaged
//! light.

use containers::lighting_json::{Preset, Table};
use containers::read_gltf_lighting;

use super::*;

/// The first number of each row, in the extension's own convention.
fn first_channel(document: &Value) -> Vec<f64> {
    let lighting = read_gltf_lighting(document.to_string().as_bytes()).unwrap();
    let tables = Preset::Gltf.convert(&lighting.series);
    let [Table { rows, .. }] = tables.as_slice() else { panic!("{tables:?}") };
    rows.iter().map(|row| row[0]).collect()
}

/// A document with these lights, the first of which its scene uses.
fn lit(lights: Value) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "extensions": { "EXT_lights_image_based": { "light": 0 } } }],
        "extensions": { "EXT_lights_image_based": { "lights": lights } },
    })
}

fn rows(of: impl Fn(usize) -> f64) -> Value {
    (0..9).map(|row| json!([of(row), 0.5 * of(row), -0.25 * of(row)])).collect()
}

fn assert_close(found: &[f64], expected: &[f64]) {
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}, {expected:?}");
}

/// The numbers are of a fit in Python to f(R^-1 c), c in the frame of the faces, R the quaternion's matrix.
/// Babylon.js looks up the same: its own Matrix.FromQuaternionToRef of the inverse finds +Z there when it
/// looks along +X, in left-handed and right-handed scenes.
#[test]
fn intensity_and_rotation_of_an_image_based_light_count() {
    let one = |row: usize| if row == 3 { 1.0 } else { 0.0 };
    let plain = lit(json!([{ "irradianceCoefficients": rows(one) }]));
    assert_close(&first_channel(&plain), &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let half = 0.5_f64.sqrt();
    let quarter = lit(json!([{ "irradianceCoefficients": rows(one), "rotation": [0, half, 0, half] }]));
    assert_close(&first_channel(&quarter), &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let counted = |row: usize| (row + 1) as f64;
    let both = lit(json!([
        { "irradianceCoefficients": rows(counted), "rotation": [0.1, -0.3, 0.5, 0.8], "intensity": 2.5 }
    ]));
    let expected = [
        2.5,
        13.333333333333,
        0.833333333333,
        1.666666666667,
        19.020093276557,
        10.872846761284,
        -0.79307601501,
        5.751789529194,
        -32.864193321957,
    ];
    assert_close(&first_channel(&both), &expected);
    let said = read_gltf_lighting(both.to_string().as_bytes()).unwrap().light;
    assert_eq!(
        said,
        "extensions.EXT_lights_image_based.lights[0], intensity 2.5, turned by the quaternion [0.1, -0.3, 0.5, 0.8]"
    );
}

#[test]
fn the_light_of_the_scene_is_read_from_both_kinds_of_file() {
    let one = |value: f64| json!({ "irradianceCoefficients": rows(|_| value), "name": format!("n{value}") });
    let mut document = lit(json!([one(1.0), one(2.0)]));
    assert_eq!(first_channel(&document)[0].round(), 1.0);
    document["scenes"][0]["extensions"]["EXT_lights_image_based"]["light"] = 1.into();
    let lighting = read_gltf_lighting(&glb(&document, &[])).unwrap();
    assert_eq!(lighting.light, "extensions.EXT_lights_image_based.lights[1] \"n2\", intensity 1");
    assert_eq!(first_channel(&document)[0].round(), 2.0);
    document.as_object_mut().unwrap().remove("scenes");
    assert_eq!(first_channel(&document)[0].round(), 1.0);
}

#[test]
fn damage_of_a_light_is_said_of_the_light() {
    let light = "extensions.EXT_lights_image_based.lights[0]";
    let irradiance = format!("{light}.irradianceCoefficients");
    let with = |key: &str, value: Value| {
        let mut light = json!({ "irradianceCoefficients": rows(|_| 1.0) });
        light[key] = value;
        lit(json!([light]))
    };
    let eight: Value = (0..8).map(|_| json!([1, 1, 1])).collect();
    let mut short = rows(|_| 1.0);
    short[4] = json!([1, 1]);
    let mut worded = rows(|_| 1.0);
    worded[4][2] = "x".into();
    for (document, message) in [
        (with("irradianceCoefficients", eight), format!("{irradiance}: expected 9 rows of 3 numbers, found 8")),
        (with("irradianceCoefficients", short), format!("{irradiance}[4]: expected 3 numbers, found 2")),
        (with("irradianceCoefficients", worded), format!("{irradiance}[4][2]: \"x\" is not a number")),
        (
            with("irradianceCoefficients", 3.into()),
            format!("{irradiance}: 3 is not an array of 9 rows of 3 numbers"),
        ),
        (lit(json!([{}])), format!("{irradiance} is missing")),
        (lit(json!([3])), "extensions.EXT_lights_image_based.lights[0]: 3 is not an object".to_owned()),
        (
            with("rotation", json!([0, 0, 0, 0])),
            format!("{light}.rotation: [0.0, 0.0, 0.0, 0.0] is not a quaternion of length 1"),
        ),
        (with("rotation", json!([0, 0, 1])), format!("{light}.rotation: expected 4 numbers, found 3")),
        (with("intensity", json!(-1)), format!("{light}.intensity: -1 is not a number from 0 on")),
        (
            lit(json!([])),
            "the file has no light in extensions.EXT_lights_image_based.lights; its extensions EXT_lights_image_based are not read as lighting".to_owned(),
        ),
        (
            json!({ "asset": { "version": "2.0" } }),
            "the file has no light in extensions.EXT_lights_image_based.lights".to_owned(),
        ),
    ] {
        let error = read_gltf_lighting(document.to_string().as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), message);
    }
    let text = with("intensity", json!(7)).to_string();
    for word in ["NaN", "Infinity", "-Infinity"] {
        let text = text.replace("\"intensity\":7", &format!("\"intensity\":{word}"));
        let error = read_gltf_lighting(text.as_bytes()).unwrap_err().to_string();
        assert!(error.ends_with("JSON has no NaN and no Infinity"), "{error}");
    }
    // A place that is damaged otherwise does not speak of NaN.
    let error = read_gltf_lighting(text.replace(":7", ":x").as_bytes()).unwrap_err().to_string();
    assert!(!error.contains("NaN"), "{error}");
}

/// The cube of such a document has its intensity.
#[test]
fn intensity_multiplies_the_cube() {
    use containers::{ImageBasedLight, Texture, read_gltf_image_based_light, write_gltf_image_based_light};
    let cube =
        Texture { width: 2, height: 2, faces: 6, pixels: vec![[1.0, 0.5, 0.25]; 24], ..Texture::default() };
    let light = ImageBasedLight { cube, irradiance: [[0.5; 3]; 9] };
    let file = write_gltf_image_based_light(&light, None).unwrap().bytes;
    let text = String::from_utf8(file).unwrap();
    let bright = text.replace("\"intensity\":1.0", "\"intensity\":3.0");
    let (plain, bright) = (
        read_gltf_image_based_light(text.as_bytes()).unwrap(),
        read_gltf_image_based_light(bright.as_bytes()).unwrap(),
    );
    assert_eq!(bright.irradiance, [[1.5; 3]; 9]);
    for (plain, bright) in plain.cube.pixels.iter().zip(&bright.cube.pixels) {
        assert_eq!(plain.map(|value| 3.0 * value), *bright);
    }
}

/// A document whose images are in data URIs is also read as a `.glb` whose images are parts of the binary
/// chunk, as JSON behind white space, and with its images in files beside it.
#[test]
fn images_are_read_from_the_binary_chunk() {
    use base64::Engine as _;
    use containers::{ImageBasedLight, Texture, read_gltf_image_based_light, write_gltf_image_based_light};
    let pixels = (0..24).map(|texel| [0.25, 0.5, texel as f32 / 24.0]).collect();
    let cube = Texture { width: 2, height: 2, faces: 6, pixels, ..Texture::default() };
    let light = ImageBasedLight { cube, irradiance: [[0.5; 3]; 9] };
    let file = write_gltf_image_based_light(&light, None).unwrap().bytes;
    let expected = read_gltf_image_based_light(&file).unwrap();
    let spaced = [b" \n", &file[..]].concat();
    assert_eq!(read_gltf_image_based_light(&spaced).unwrap(), expected);
    let mut document: serde_json::Value = serde_json::from_slice(&file).unwrap();
    let (mut chunk, mut views) = (Vec::new(), Vec::new());
    for image in document["images"].as_array_mut().unwrap() {
        let uri = image["uri"].as_str().unwrap().split_once(',').unwrap().1.to_owned();
        let png = base64::engine::general_purpose::STANDARD.decode(uri).unwrap();
        views.push(serde_json::json!({"buffer": 0, "byteOffset": chunk.len(), "byteLength": png.len()}));
        *image = serde_json::json!({"bufferView": views.len() - 1, "mimeType": "image/png"});
        chunk.extend(png);
        chunk.resize(chunk.len().next_multiple_of(4), 0);
    }
    document["bufferViews"] = views.into();
    document["buffers"] = serde_json::json!([{"byteLength": chunk.len()}]);
    let glb = |document: &serde_json::Value, chunk: &[u8]| {
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let word = |number: usize| (number as u32).to_le_bytes();
        let whole = word(28 + json.len() + chunk.len());
        let (json_size, chunk_size) = (word(json.len()), word(chunk.len()));
        [b"glTF", &word(2)[..], &whole, &json_size, b"JSON", &json, &chunk_size, b"BIN\0", chunk].concat()
    };
    assert_eq!(read_gltf_image_based_light(&glb(&document, &chunk)).unwrap(), expected);
    let found = containers::read_light_texture(&glb(&document, &chunk), &containers::ReadOptions::default());
    assert!(found.unwrap().is_for_babylon);
    let error = |document: &serde_json::Value, chunk: &[u8]| {
        read_gltf_image_based_light(&glb(document, chunk)).unwrap_err().to_string()
    };
    let cut = error(&document, &chunk[..chunk.len() - 8]);
    assert!(cut.contains("level 0, face 5") && cut.contains("ends before the image"), "{cut}");
    document["images"][3] = serde_json::json!({"uri": "faces/ny.png"});
    let beside = error(&document, &chunk);
    assert!(beside.contains("face 3: the image is beside the file"), "{beside}");
}

/// A quarter turn by which +Z of the faces moves to +X: the light from a direction comes from the turned one.
/// A light of a constant and a slope is 2 + c at the place c of the faces before, and 2 + (-c.z, c.y, c.x)
/// after; the irradiance turns with it, as `read_gltf_lighting` does it.
#[test]
fn a_rotation_turns_the_cube_and_its_irradiance() {
    use containers::{
        ImageBasedLight, Texture, read_gltf_image_based_light, read_gltf_lighting,
        write_gltf_image_based_light,
    };
    use sphere::{Cube, Face, to_cube};
    let cube = Cube { edge: 8 };
    let places: Vec<[f64; 3]> = (0..384)
        .map(|i| to_cube(cube.direction(Face::ALL[i / 64], i / 8 % 8, i % 8).vector()).to_array())
        .collect();
    let pixels = places.iter().map(|c| c.map(|value| 2.0 + value as f32)).collect();
    let cube = Texture { width: 8, height: 8, faces: 6, pixels, ..Texture::default() };
    let irradiance = std::array::from_fn(|row| [0.3, -0.2, 0.1].map(|value| value * (1 + row) as f64));
    let file = write_gltf_image_based_light(&ImageBasedLight { cube, irradiance }, None).unwrap().bytes;
    let text = String::from_utf8(file).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = text.replace("[0.0,0.0,0.0,1.0]", &format!("[0.0,{half},0.0,{half}]"));
    assert_ne!(text, turned);
    let light = read_gltf_image_based_light(turned.as_bytes()).unwrap();
    for ([x, y, z], found) in places.into_iter().zip(&light.cube.pixels) {
        for (found, expected) in found.iter().zip([-z, y, x].map(|value| 2.0 + value)) {
            assert!((f64::from(*found) - expected).abs() < 0.04, "{found}, expected {expected}");
        }
    }
    // The rows that are turned, as they would stand in a file that is not.
    let same = write_gltf_image_based_light(&light, None).unwrap().bytes;
    let (same, turned) = (read_gltf_lighting(&same).unwrap(), read_gltf_lighting(turned.as_bytes()).unwrap());
    for (a, b) in same.series.coefficients().iter().zip(turned.series.coefficients()) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
    }
}
