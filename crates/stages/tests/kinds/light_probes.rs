//! Scenes and light probes in them, for the tables of all kinds; `probe-stages` has the tests of what they
//! compute.

use std::sync::Arc;

use containers::tensors::StoredScene;
use engine::Artifact;
use probes::Repair;
use stages::artifacts::{
    LightField, Lighting, ProbeLamps, ProbePlaces, ProbeTransport, Probes, Scene, Transfer,
};

use crate::fixture::{Case, case, difference, environment, lambert, sky, sky_lighting};
use crate::vertices::{pit, radiance, shaded};

/// A floor, a red wall, a panel that glows and a lamp, of the square of [`crate::import_mesh::square_files`].
const TEXT: &str = r#"{
    "asset": { "version": "2.0" },
    "scene": 0,
    "scenes": [{ "nodes": [0, 1, 2, 3] }],
    "nodes": [
        { "name": "floor", "mesh": 0, "rotation": [0, 0, 0.70710678, 0.70710678] },
        { "name": "wall", "mesh": 0, "translation": [-1, 1, 0] },
        { "name": "panel", "mesh": 1, "translation": [1, 1.5, 0], "rotation": [0, 1, 0, 0], "scale": [1, 0.4, 0.4] },
        { "name": "lamp", "translation": [0, 1.5, 0.5], "extensions": { "KHR_lights_punctual": { "light": 0 } } }
    ],
    "meshes": [
        { "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] },
        { "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 1 }] }
    ],
    "materials": [
        { "name": "red", "pbrMetallicRoughness": { "baseColorFactor": [0.7, 0.2, 0.1, 1], "metallicFactor": 0 } },
        { "name": "glow", "emissiveFactor": [1, 0.5, 0.25] }
    ],
    "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
        { "bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2" },
        { "bufferView": 0, "byteOffset": 80, "componentType": 5121, "count": 6, "type": "SCALAR" }
    ],
    "bufferViews": [{ "buffer": 0, "byteLength": 86 }],
    "buffers": [{ "uri": "square.bin", "byteLength": 86 }],
    "extensions": { "KHR_lights_punctual": {
        "lights": [{ "type": "spot", "color": [1, 0.8, 0.6], "intensity": 20, "range": 10 }]
    } }
}"#;

pub(crate) fn import() -> Case {
    let (_, bytes) = crate::import_mesh::square_files();
    case("import-scene", "").file("room.gltf", TEXT).file("square.bin", bytes).source("room.gltf")
}

pub(crate) fn part(part: &str) -> Case {
    let scene: Arc<Scene> = import().artifact();
    case("scene-part", &format!("part = \"{part}\"")).input("scene", (*scene).clone())
}

pub(crate) fn places() -> Case {
    let shape: Arc<Scene> = part("shape").artifact();
    case("place-probes", "spacing = 0.7\nlattice = \"corners\"").input("scene", (*shape).clone())
}

/// A bake of a kind in a part of the scene.
pub(crate) fn bake(kind: &'static str, of: &str) -> Case {
    let (scene, places): (Arc<Scene>, Arc<ProbePlaces>) = (part(of).artifact(), places().artifact());
    case(kind, "paths = 64").input("scene", (*scene).clone()).input("places", (*places).clone())
}

pub(crate) fn lit() -> Case {
    let transport: Arc<ProbeTransport> = bake("bake-probes", "surfaces").artifact();
    let lamps: Arc<ProbeLamps> = bake("bake-lamps", "lamps").artifact();
    let scene: Arc<Scene> = import().artifact();
    case("light-probes", "lamps = \"all\"")
        .input("transport", (*transport).clone())
        .input("lamps", (*lamps).clone())
        .input("scene", (*scene).clone())
        .input::<Lighting>("lighting", sky_lighting())
}

pub(crate) fn pattern() -> Case {
    case("probe-pattern", "light = \"noise\"\ncounts = [3, 2, 2]")
}

pub(crate) fn exported() -> Case {
    let pattern: Arc<Probes> = pattern().artifact();
    case("export-probes", "preset = \"ktx2\"\nscale = 1.5").input("probes", (*pattern).clone())
}

pub(crate) fn leaks() -> Case {
    let (scene, places): (Arc<Scene>, Arc<ProbePlaces>) = (part("shape").artifact(), places().artifact());
    case("check-probes", "points = 300\nblend = \"bevy\"")
        .input("scene", (*scene).clone())
        .input("places", (*places).clone())
}

/// Every number of an artifact, tensor by tensor in the order of their names.
pub(crate) fn numbers(type_name: &str, bytes: &[u8]) -> Option<Vec<f64>> {
    use safetensors::tensor::Dtype;
    let types = [Scene::TYPE, ProbePlaces::TYPE, ProbeTransport::TYPE, ProbeLamps::TYPE, Probes::TYPE];
    if !types.contains(&type_name) {
        return None;
    }
    let file = safetensors::SafeTensors::deserialize(bytes).unwrap();
    // How far probes see is whole numbers, so many that their sum would hide the others; what bricks were
    // made from is hashes.
    let mut tensors = file.tensors();
    tensors.retain(|(name, _)| name != "reach" && !name.starts_with("bricks."));
    tensors.sort_by(|(one, _), (other, _)| one.cmp(other));
    let numbers = |(_, tensor): (String, safetensors::tensor::TensorView<'_>)| -> Vec<f64> {
        let data = tensor.data();
        let words = data.as_chunks::<4>().0.iter();
        match tensor.dtype() {
            Dtype::F32 => words.map(|word| f32::from_le_bytes(*word).into()).collect(),
            // Bits of visibility and numbers of things: their ones.
            Dtype::U32 => words.map(|word| u32::from_le_bytes(*word).count_ones().into()).collect(),
            Dtype::F16 => half_numbers(data),
            Dtype::U8 => data.iter().map(|byte| f64::from(*byte)).collect(),
            other => panic!("give {other:?} an arm here"),
        }
    };
    Some(tensors.into_iter().flat_map(numbers).collect())
}

/// The values of 16-bit floats.
fn half_numbers(data: &[u8]) -> Vec<f64> {
    let number = |word: &[u8; 2]| {
        let bits = u16::from_le_bytes(*word);
        let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
        let size = if exponent == 0 {
            mantissa * 2_f64.powi(-14)
        } else {
            (1.0 + mantissa) * 2_f64.powi(exponent - 15)
        };
        if bits >> 15 == 1 { -size } else { size }
    };
    data.as_chunks::<2>().0.iter().map(number).collect()
}

/// Probes around [`pit`], all with the light of a lighting of degree 2.
fn alike(lighting: &sh::Lighting) -> Probes {
    let bounds = [[-2.0, -5.0, -1.0], [2.0, 5.0, 5.0]];
    let volume = probes::Volume::new("pit".into(), bounds, [3, 4, 3], probes::Lattice::Corners).unwrap();
    let count = volume.len();
    let places = probes::ProbePlaces::from_parts(probes::PlacesParts {
        positions: (0..count).map(|probe| volume.position(volume.cell(probe))).collect(),
        volumes: vec![volume],
        points: Vec::new(),
        back_share: vec![0.0; count],
        inside_of: vec![None; count],
        repairs: vec![probes::Repair::None; count],
        visible: vec![(1 << 26) - 1; count],
        reach: vec![255; 256 * count],
    });
    let rows = lighting.series.coefficients().iter().map(|row| row.map(|value| value as f32));
    let rows: [[f32; 3]; 9] = rows.collect::<Vec<_>>().try_into().unwrap();
    let light = probes::LitProbes::from_parts(vec![rows; count], vec![0.0; count]).unwrap();
    Probes(containers::tensors::Probes { places: places.unwrap(), light })
}

/// Wherever a lighting goes, probes with the same light do the same, past the mesh or not.
#[test]
fn probes_light_vertices_as_a_lighting_does() {
    let Lighting(lighting) = sky_lighting();
    let probes = alike(&lighting);
    let bake = case("precompute-transfer", "directions = 512").input("mesh", pit()).artifact::<Transfer>();
    let table = crate::vertices::table(lambert(0.8));
    for with_shadows in [false, true] {
        let case = case("shade-vertices", "camera = [-3, 1, 2]")
            .input("mesh", pit())
            .input("table", table.clone())
            .input("lighting", probes.clone());
        let case = if with_shadows { case.input("transfer", (*bake).clone()) } else { case };
        let expected = radiance(&shaded(with_shadows));
        assert!(difference(&radiance(&case), &expected) < 1e-5);
        // A second lighting is added, as far away.
        let twice: Vec<[f32; 3]> = expected.iter().map(|rgb| rgb.map(|value| 2.0 * value)).collect();
        assert!(difference(&radiance(&case.input("lights", sky_lighting())), &twice) < 1e-5);
        let export = || {
            let case = crate::export_gltf::export("");
            if with_shadows { case.input("transfer", (*bake).clone()) } else { case }
        };
        let numbers = |case: Case| crate::export_gltf::Read::of(&case.files()[0]).numbers();
        let found = numbers(export().input("lighting", probes.clone()));
        let expected = numbers(export().input("lighting", sky_lighting()));
        assert_eq!(found.len(), expected.len());
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-5));
    }
}

/// A mesh under probes with the same light everywhere is drawn as under a light field with that light.
#[test]
fn a_preview_under_probes_is_that_of_their_light() {
    // Dimmer than the environment, from which light would come otherwise.
    let rows =
        sky_lighting().0.whole().coefficients().iter().map(|rgb| rgb.map(|value| 0.2 * value)).collect();
    let series = sh::Expansion::from_coefficients(sh::Degree::new(2).unwrap(), rows).unwrap();
    let lighting = sh::Lighting::from(series);
    let field = LightField(transfer::LightField::new(vec![[1.5, 0.0, 0.0]], vec![lighting.whole()]).unwrap());
    let bake = case("precompute-transfer", "directions = 512").input("mesh", pit()).artifact::<Transfer>();
    let drawn = || {
        case("preview", "size = 32\nsamples = 1\nmodes = [\"table\", \"transfer\"]\nlight-yaw = 30\ncamera-yaw = 180\ncamera-pitch = 30")
            .input("environment", environment(32, sky))
            .input("mesh", pit())
            .input("table", crate::vertices::table(lambert(0.8)))
            .input("transfer", (*bake).clone())
    };
    let codes = |case: Case| crate::preview::frames(&case.files()[0]).1[0].clone();
    let expected = codes(drawn().input("light-field", field));
    let found = codes(drawn().input("light-field", alike(&lighting)));
    let apart = expected.iter().zip(&found).flat_map(|(a, b)| (0..3).map(|k| a[k].abs_diff(b[k]))).max();
    assert!(apart <= Some(1), "{apart:?}");
    let plain = codes(drawn());
    assert!(plain.iter().zip(&found).any(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 8)));
}

/// A report of probes alone: every probe is counted once and every repaired one listed, and the pictures have
/// a mark for each state.
#[test]
fn a_report_draws_probes() {
    let (scene, places): (Arc<Scene>, Arc<ProbePlaces>) = (part("shape").artifact(), places().artifact());
    let with_places = || case("report", "").input("places", (*places).clone());
    let (json, page) = crate::report::report(&with_places().input("scene", (*scene).clone()));
    crate::report::check_page(&page);
    let repairs = places.0.repairs();
    let count = |is: fn(&Repair) -> bool| repairs.iter().filter(|repair| is(repair)).count();
    let counts = [
        ("probes", repairs.len()),
        ("in_place", count(|repair| *repair == Repair::None)),
        ("moved", count(|repair| *repair == Repair::Moved)),
        ("filled", count(|repair| matches!(repair, Repair::Filled(_)))),
        ("lost", count(|repair| matches!(repair, Repair::Lost(_)))),
    ];
    for (key, expected) in counts {
        assert_eq!(json["probes"][key], expected, "{key}");
    }
    assert!(counts[2].1 > 0, "{counts:?}");
    let repaired = json["probes"]["repaired"].as_array().unwrap();
    assert_eq!(repaired.len(), repairs.len() - counts[1].1);
    for probe in repaired {
        assert_ne!(repairs[probe["probe"].as_u64().unwrap() as usize], Repair::None);
    }
    assert_eq!(page.matches("<svg viewBox=\"0 0").count(), 2);
    assert!(page.contains("class=\"moved\"") && page.contains("class=\"wall\""));
    let leaks = json["probes"]["leaks"].as_array().unwrap();
    assert_eq!(
        leaks.iter().map(|leak| leak["blend"].as_str().unwrap()).collect::<Vec<_>>(),
        ["three", "bevy", "visible"]
    );
    // Without a scene there are no walls, and nothing is known of leaks.
    let (json, page) = crate::report::report(&with_places());
    crate::report::check_page(&page);
    assert!(json["probes"]["leaks"].as_array().unwrap().is_empty() && !page.contains("class=\"wall\""));
    // Walls of another scene would be drawn around them.
    let mut parts = scene.0.scene.parts().clone();
    parts.triangles.swap(0, 1);
    let other = StoredScene { scene: probes::Scene::new(parts).unwrap(), ..scene.0.clone() };
    let failure = with_places().input("scene", Scene(other)).failure();
    assert!(failure.starts_with("the probes were placed in a scene with other triangles than"), "{failure}");
    // Environments are needed for the rest.
    let errors = with_places().input("environment", environment(16, sky)).input_errors().join("; ");
    assert!(errors.contains("need the port material"), "{errors}");
    let errors = case("report", "").input("scene", (*scene).clone()).input_errors().join("; ");
    assert!(errors.contains("need the port environment") && errors.contains("without `places`"), "{errors}");
}
