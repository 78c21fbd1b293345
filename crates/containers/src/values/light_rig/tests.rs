use sphere::{Direction, from_file};

use super::*;

/// From the zenith, from the front (+X, which is +Z of files), from the back, and from anywhere.
fn lights() -> Vec<Light> {
    let light = |x: f64, y: f64, z: f64, radius, irradiance| Light {
        direction: Direction::normalised(DVec3::new(x, y, z)),
        radius,
        irradiance,
    };
    vec![
        light(0.0, 0.0, 1.0, 0.1, [3.0, 2.0, 0.5]),
        light(1.0, 0.0, 0.0, 0.0, [0.25, 1.0, 0.5]),
        light(-1.0, 0.0, 0.0, 1.5, [1e-7, 0.0, 3e-7]),
        light(0.3, -0.5, -0.8, 0.02, [1e5, 2e5, 4e5]),
        light(0.0, 1.0, 0.0, 0.02, [0.0; 3]),
    ]
}

#[track_caller]
fn assert_close(found: [f64; 3], expected: [f64; 3]) {
    let most = expected.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= 1e-6 * most, "{found} {expected}");
    }
}

/// By the words of KHR_lights_punctual: a directional light shines along the node's local -Z.
#[test]
fn the_gltf_crate_reads_the_lights() {
    let file = write_gltf_lights(&lights(), SceneAxes::IDENTITY, Some("{\"kind\":\"rig\"}")).unwrap();
    let document = gltf::Gltf::from_slice(&file).unwrap();
    let scene = document.default_scene().unwrap();
    assert_eq!(scene.nodes().len(), lights().len());
    for (node, expected) in scene.nodes().zip(lights()) {
        let light = node.light().unwrap();
        assert!(matches!(light.kind(), gltf::khr_lights_punctual::Kind::Directional));
        let matrix = node.transform().matrix().map(|column| column.map(f64::from));
        let way = from_file(-DVec3::new(matrix[2][0], matrix[2][1], matrix[2][2]));
        assert!((way + expected.direction.vector()).length() < 1e-6, "{way} {expected:?}");
        let color = light.color().map(f64::from);
        assert!(color.iter().all(|value| (0.0..=1.0).contains(value)) && color.contains(&1.0));
        assert_close(color.map(|value| value * f64::from(light.intensity())), expected.irradiance);
    }
    assert_eq!(crate::read_recipe::read_recipe(&file).as_deref(), Some("{\"kind\":\"rig\"}"));
    // The zenith is +Y of the file, and light from there goes down.
    let nodes: Vec<_> = scene.nodes().collect();
    let down = glam::Quat::from_array(nodes[0].transform().decomposed().1) * -glam::Vec3::Z;
    assert!((down + glam::Vec3::Y).length() < 1e-6, "{down}");
}

/// What a reader of USD needs of a `DistantLight`: the attributes by their names.
fn usd_lights(text: &str) -> Vec<std::collections::BTreeMap<String, String>> {
    assert!(text.starts_with("#usda 1.0\n(") && text.contains("\n    upAxis = \"Y\"\n"));
    let prims = text.split("def DistantLight ").skip(1);
    prims
        .map(|prim| {
            let (_, body) = prim.split_once('{').unwrap();
            let (body, _) = body.split_once('}').unwrap();
            let attribute = |line: &str| {
                let (name, value) = line.trim().split_once(" = ")?;
                Some((name.rsplit(' ').next()?.to_owned(), value.to_owned()))
            };
            body.lines().filter_map(attribute).collect()
        })
        .collect()
}

fn numbers(text: &str) -> Vec<f64> {
    text.split(['(', ')', ',', ' '])
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().unwrap())
        .collect()
}

/// With `normalize` the radiance is the intensity / (pi sin^2 of half the angle); emission is along -Z.
#[test]
fn usd_lights_have_the_radiance_and_the_way_of_theirs() {
    let recipe = r#"{"kind":"rig","path":"a\\b \"c\""}"#;
    let file = write_usda_lights(&lights(), SceneAxes::IDENTITY, None, Some(recipe)).unwrap();
    let read = usd_lights(std::str::from_utf8(&file).unwrap());
    assert_eq!(read.len(), lights().len());
    for (read, expected) in read.iter().zip(lights()) {
        assert_eq!(read["inputs:normalize"], "1");
        assert_eq!(read["xformOpOrder"], "[\"xformOp:transform\"]");
        let matrix = numbers(&read["xformOp:transform"]);
        // Row vector (0, 0, -1, 0) times the matrix.
        let way = from_file(-DVec3::from_slice(&matrix[8..11]));
        assert!((way + expected.direction.vector()).length() < 1e-12, "{way} {expected:?}");
        let [x, y, z] = [0, 4, 8].map(|row| DVec3::from_slice(&matrix[row..row + 3]));
        assert!((x.cross(y) - z).length() < 1e-12, "a rotation");
        let [angle, intensity] = ["inputs:angle", "inputs:intensity"].map(|name| numbers(&read[name])[0]);
        let half = angle.to_radians() / 2.0;
        let size = if angle == 0.0 { 1.0 } else { std::f64::consts::PI * half.sin().powi(2) };
        let radiance: Vec<f64> =
            numbers(&read["inputs:color"]).iter().map(|c| c * intensity / size).collect();
        let disk = 4.0 * std::f64::consts::PI * (expected.radius / 2.0).sin().powi(2);
        let flux = expected.flux();
        let expected = flux.map(|flux| if disk == 0.0 { flux } else { flux / disk });
        assert_close(radiance.try_into().unwrap(), expected);
    }
    assert_eq!(crate::read_recipe::read_recipe(&file).as_deref(), Some(recipe));
}

/// By OpenUSD's words a dome's image has its centre along +Z and its left along +X, as the frame of files.
#[test]
fn a_dome_and_its_lights_are_turned_alike() {
    let axes = SceneAxes::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
    let file = write_usda_lights(&lights(), axes, Some("sky.exr"), None).unwrap();
    let text = std::str::from_utf8(&file).unwrap();
    let (_, dome) = text.split_once("def DomeLight \"Sky\"").unwrap();
    let (dome, _) = dome.split_once("    }").unwrap();
    assert!(dome.contains("asset inputs:texture:file = @./sky.exr@"), "{dome}");
    let matrix = dome.lines().find_map(|line| line.split_once("xformOp:transform = ")).unwrap().1;
    // The rows of the matrix are where the image's left, top and centre go.
    let rows = [[0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    assert_eq!(numbers(matrix), rows.as_flattened());
    for (read, expected) in usd_lights(text).iter().zip(lights()) {
        let way = -DVec3::from_slice(&numbers(&read["xformOp:transform"])[8..11]);
        assert!((way + axes * to_file(expected.direction.vector())).length() < 1e-12, "{way}");
    }
    for name in ["a@b.exr", "a\nb.exr"] {
        assert!(write_usda_lights(&[], axes, Some(name), None).is_err());
    }
}

/// By the words of Godot: a light shines along its -Z, `Transform3D` lists the rows of the basis, the energy
/// is multiplied by pi, and colours are sRGB.
#[test]
fn a_scene_of_godot_has_the_image_and_the_lights() {
    let recipe = r#"{"kind":"rig","path":"a\\b \"c\""}"#;
    let file = write_tscn_lights(&lights(), SceneAxes::IDENTITY, "sky.exr", Some(recipe)).unwrap();
    assert_eq!(crate::read_recipe::read_recipe(&file).as_deref(), Some(recipe));
    let text = std::str::from_utf8(&file).unwrap();
    assert!(text.contains("[ext_resource type=\"Texture2D\" path=\"sky.exr\" id=\"1\"]"));
    let nodes: Vec<_> = text.split("[node ").skip(2).collect();
    assert_eq!(nodes.len(), lights().len());
    for (node, expected) in nodes.into_iter().zip(lights()) {
        assert!(node.contains("type=\"DirectionalLight3D\" parent=\".\""), "{node}");
        let value = |key: &str| {
            let line = node.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).unwrap();
            numbers(line.trim_start_matches(char::is_alphabetic).trim_start_matches("3D"))
        };
        let basis = value("transform");
        let way = from_file(-DVec3::new(basis[2], basis[5], basis[8]));
        assert!((way + expected.direction.vector()).length() < 1e-12, "{way} {expected:?}");
        let linear = |x: f64| if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
        let energy = value("light_energy")[0] * std::f64::consts::PI;
        let colour = value("light_color");
        assert_close([0, 1, 2].map(|c| linear(colour[c]) * energy), expected.irradiance);
        assert!((value("light_angular_distance")[0] - 2.0 * expected.radius.to_degrees()).abs() < 1e-9);
    }
    assert!(write_tscn_lights(&[], SceneAxes::IDENTITY, "a\"b.exr", None).is_err());
}

#[test]
fn a_table_has_every_number_exactly() {
    let text = String::from_utf8(write_csv_lights(&lights()).unwrap()).unwrap();
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| columns.iter().position(|column| *column == name).unwrap();
    for (line, expected) in lines.zip(lights()) {
        let row: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let three = |names: [&str; 3]| names.map(|name| row[at(name)]);
        assert_eq!(three(["x", "y", "z"]), expected.direction.vector().to_array());
        assert_eq!(row[at("radius_degrees")], expected.radius.to_degrees());
        assert_eq!(three(["irradiance_r", "irradiance_g", "irradiance_b"]), expected.irradiance);
        assert_eq!(three(["flux_r", "flux_g", "flux_b"]), expected.flux());
    }
    assert_eq!(text.lines().count(), 1 + lights().len());
}

#[test]
fn light_that_is_negative_or_not_finite_is_refused() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        let light = Light { direction: Direction::Z, radius: 0.1, irradiance: [1.0, value, 0.0] };
        for error in [
            write_gltf_lights(&[light], SceneAxes::IDENTITY, None).err(),
            write_usda_lights(&[light], SceneAxes::IDENTITY, None, None).err(),
            write_csv_lights(&[light]).err(),
            crate::values::tensors::encode_light_rig(&[light], 512, None).err(),
        ] {
            assert!(error.unwrap().to_string().contains("light 0: expected a finite irradiance"));
        }
    }
    assert!(write_gltf_lights(&[], SceneAxes::IDENTITY, Some("not JSON")).is_err());
}
