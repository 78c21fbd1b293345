//! The kinds from a glTF file to light at probes, next to values that were computed without this project's
//! code (`SPECULA_REFERENCE`).

use std::sync::Arc;

use probes::Repair;
use serde_json::Value;
use sh::{Degree, Expansion};
use stages::artifacts::{Lighting, ProbeLamps, ProbePlaces, ProbeTransport, Probes, Scene};

use crate::fixture::{case, part};

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

/// A reference scene with its values, lit by the kinds; `None` if the test is skipped.
struct Lit {
    json: Value,
    places: Arc<ProbePlaces>,
    /// Under all of its lights.
    all: Arc<Probes>,
    /// Under its sky alone.
    sky: Option<Arc<Probes>>,
}

/// A reference scene with its values; `None` if the test is skipped.
pub(crate) fn scene(test: &str, name: &str) -> Option<(Value, Arc<Scene>)> {
    let json = test_data::reference(test, &format!("probes/{name}.json"))?;
    let folder = test_data::folder(test, "SPECULA_REFERENCE")?;
    let bytes = std::fs::read(folder.join(format!("probes/{name}.glb"))).unwrap();
    Some((json, case("import-scene", "").file("a.glb", bytes).source("a.glb").artifact()))
}

fn lit(test: &str, name: &str) -> Option<Lit> {
    let (json, scene) = scene(test, name)?;
    let points: Vec<Value> =
        json["probes"].as_array().unwrap().iter().map(|probe| probe["position"].clone()).collect();
    // TOML has floats with a point.
    let point = |point: &Value| {
        let [x, y, z] = <[f64; 3]>::try_from(numbers(point)).unwrap();
        format!("[{x:?}, {y:?}, {z:?}]")
    };
    let points = points.iter().map(point).collect::<Vec<_>>().join(", ");
    let places: Arc<ProbePlaces> = case("place-probes", &format!("points = [{points}]"))
        .input("scene", &*part(&scene, "shape"))
        .artifact();
    let bake = |kind, of: &str| case(kind, "").input("scene", &*part(&scene, of)).input("places", &*places);
    let transport: Arc<ProbeTransport> = bake("bake-probes", "surfaces").artifact();
    let lamps: Arc<ProbeLamps> = bake("bake-lamps", "lamps").artifact();
    let sky = numbers(&json["lighting"]["sky"]).as_chunks::<3>().0.to_vec();
    let sky = Expansion::from_coefficients(Degree::new(2).unwrap(), sky);
    let light = |parameters: &str| {
        let case = case("light-probes", &format!("window = \"none\"\n{parameters}"))
            .input("transport", &*transport)
            .input("lamps", &*lamps)
            .input("scene", &*scene);
        match &sky {
            Some(sky) => case.input("lighting", &Lighting(sky.clone().into())).artifact::<Probes>(),
            None => case.artifact(),
        }
    };
    let all = light("lamps = \"all\"");
    let of_sky = sky.is_some().then(|| light("lamps-scale = 0.0\nemission-scale = 0.0"));
    Some(Lit { places, all, sky: of_sky, json })
}

/// The error of nine rows under the lighting of the file: RMS over all probes that stand where they were
/// put, relative to the RMS of the values.
#[test]
fn light_at_probes_is_that_of_the_reference() {
    const TEST: &str = "light_at_probes_is_that_of_the_reference";
    for (name, least) in
        [("cornell", 20), ("rooms", 20), ("courtyard", 15), ("furnace", 20), ("textures", 15)]
    {
        let Some(Lit { json, places, all, .. }) = lit(TEST, name) else { return };
        let (mut difference, mut size, mut count) = (0.0, 0.0, 0);
        for (probe, expected) in json["probes"].as_array().unwrap().iter().enumerate() {
            if places.0.repairs()[probe] != Repair::None {
                continue;
            }
            count += 1;
            let expected = numbers(&expected["incident"]["all"]);
            for (found, expected) in all.0.light.rows()[probe].as_flattened().iter().zip(expected) {
                difference += (f64::from(*found) - expected).powi(2);
                size += expected * expected;
            }
        }
        let error = (difference / size).sqrt();
        println!("{name}: {:.3} percent of {count} probes", 100.0 * error);
        assert!(count >= least, "{name}: {count}");
        assert!(error < 0.03, "{name}: {error}");
    }
}

/// The dark room sees nothing of the sky.
#[test]
fn a_wall_of_2_cm_is_dark_behind() {
    const TEST: &str = "a_wall_of_2_cm_is_dark_behind";
    let Some(Lit { places, sky, .. }) = lit(TEST, "rooms") else { return };
    let (mut dark, mut lit) = (0, 0);
    for (probe, rows) in sky.unwrap().0.light.rows().iter().enumerate() {
        let is_zero = rows.as_flattened().iter().all(|value| *value == 0.0);
        if places.0.positions()[probe][1] > 0.01 && places.0.is_valid(probe) {
            assert!(is_zero, "probe {probe}: {rows:?}");
            dark += 1;
        } else if places.0.is_valid(probe) {
            lit += usize::from(!is_zero);
        }
    }
    assert!(dark >= 8 && lit >= 8, "{dark} {lit}");
}
