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
    let file = write_gltf_lights(&lights(), Some("{\"kind\":\"rig\"}")).unwrap();
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
    let file = write_usda_lights(&lights(), Some(recipe)).unwrap();
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
            write_gltf_lights(&[light], None).err(),
            write_usda_lights(&[light], None).err(),
            write_csv_lights(&[light]).err(),
            crate::values::tensors::encode_light_rig(&[light], 512, None).err(),
        ] {
            assert!(error.unwrap().to_string().contains("light 0: expected a finite irradiance"));
        }
    }
    assert!(write_gltf_lights(&[], Some("not JSON")).is_err());
}
