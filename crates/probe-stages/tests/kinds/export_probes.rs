//! `export-probes` and `probe-pattern`: what is in the files of a whole scene.

use half::f16;
use serde_json::Value;
use sh::{Basis, Degree, Expansion};
use sphere::{DVec3, Direction};
use stages::artifacts::Probes;

use crate::fixture::{Case, ExportedContents, case};
use crate::relighting::{Baked, sky};
use crate::room::Room;

/// What a white surface reflects of nine rows of radiance, toward a normal of the same axes.
fn reflected(rows: &[[f64; 3]], normal: DVec3) -> [f64; 3] {
    let mut harmonics = [0.0; 9];
    Basis::new(Degree::new(2).unwrap()).evaluate_into(Direction::normalised(normal), &mut harmonics);
    let factor = |row: usize| [1.0, 2.0 / 3.0, 0.25][usize::from(row > 0) + usize::from(row > 3)];
    [0, 1, 2].map(|channel| (0..9).map(|k| factor(k) * harmonics[k] * rows[k][channel]).sum())
}

/// The contents of the files of an export.
fn files(case: &Case) -> ExportedContents {
    case.files_of().unwrap_or_else(|failure| panic!("{failure}")).0
}

/// The transport times the sky and the lamps of a scene is the light of `light-probes`, probe by probe.
#[test]
fn the_exported_transport_lights_as_light_probes_does() {
    let baked = Baked::of(&Room::new(), "paths = 64\nerror = 0.05\npaths-most = 256");
    let sky: Expansion = sky(1.3);
    let lit = baked.lit("window = \"none\"", Some(&sky)).value;
    let export = case("export-probes", "preset = \"transport\"")
        .input("probes", &*baked.transport)
        .input("lamps", &*baked.lamps)
        .input("scene", &*baked.scene);
    let files = files(&export);
    let [Some(bytes), .., Some(json)] = files.as_slice() else { panic!("no transport") };
    let json: Value = serde_json::from_slice(json).unwrap();
    let parts = baked.scene.0.scene.parts();
    let names = json["lamps"]["names"].as_array().unwrap();
    let lamps: Vec<[f64; 3]> = names
        .iter()
        .map(|name| {
            let lamp = parts.lamps.iter().find(|lamp| lamp.name == *name).unwrap();
            lamp.color.map(|c| f64::from(c) * f64::from(lamp.intensity))
        })
        .collect();
    let emission: Vec<[f64; 3]> = baked
        .scene
        .0
        .scene
        .emitters()
        .into_iter()
        .map(|material| parts.materials[material as usize].emission.unwrap().radiance.map(f64::from))
        .collect();
    let emitters = baked.scene.0.scene.emitters();
    let emitter_names: Vec<&str> =
        emitters.iter().map(|material| parts.materials[*material as usize].name.as_str()).collect();
    assert_eq!(json["emission"]["names"], serde_json::json!(emitter_names));
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let probes = number(&json["probes"]);
    assert_eq!(probes, lit.0.places.len());
    let mut light = vec![[[0.0; 3]; 9]; probes];
    for (section, colours) in
        [("sky", sky.coefficients()), ("emission", &emission[..]), ("lamps", &lamps[..])]
    {
        let [columns, channels, offset] =
            ["columns", "channels", "offset"].map(|key| number(&json[section][key]));
        assert_eq!(columns, colours.len(), "{section}");
        let halves = bytes[offset..].as_chunks::<2>().0;
        for (index, row) in light.as_flattened_mut().iter_mut().enumerate() {
            for (column, colour) in colours.iter().enumerate() {
                for channel in 0..3 {
                    let at = (index * columns + column) * channels + channel % channels;
                    row[channel] += f16::from_le_bytes(halves[at]).to_f64() * colour[channel];
                }
            }
        }
    }
    // The probes of files are in another order: x of files, which is y of ours, is the fastest.
    let [volume] = lit.0.places.volumes() else { panic!("one volume") };
    let [nx, ny, nz] = volume.counts;
    assert_eq!(json["grids"][0]["resolution"], serde_json::json!([ny, nz, nx]));
    let (mut worst, mut brightest) = (0.0_f64, 0.0_f64);
    for (place, rows) in light.iter().enumerate() {
        let (y, z, x) = (place % ny, place / ny % nz, place / (ny * nz));
        let own = lit.0.light.rows()[volume.index([x, y, z])].map(|row| row.map(f64::from));
        for normal in [DVec3::X, DVec3::Y, DVec3::NEG_Z, DVec3::new(0.3, -0.5, 0.8)] {
            let found = reflected(rows, DVec3::new(normal.y, normal.z, normal.x));
            for (found, expected) in found.into_iter().zip(reflected(&own, normal)) {
                worst = worst.max((found - expected).abs());
                brightest = brightest.max(expected);
            }
        }
    }
    assert!(worst < 1e-3 * brightest, "{worst} of {brightest}");
}

/// Every preset writes a pattern, and its index says how it was made.
#[test]
fn every_preset_exports_a_pattern_with_its_recipe() {
    let pattern = case("probe-pattern", "light = \"noise\"\nlattice = \"corners\"").artifact::<Probes>();
    assert_eq!(pattern.0.places.volumes()[0].counts, [5, 4, 3]);
    for preset in ["three", "bevy", "godot", "unity", "vrc-light-volumes", "ktx2", "gltf"] {
        let export = case("export-probes", &format!("preset = \"{preset}\"")).input("probes", &*pattern);
        let files = files(&export);
        let holds = |file: &Vec<u8>| containers::read_recipe(file).is_some_and(|r| r.contains("a recipe"));
        assert!(files.iter().flatten().any(holds), "{preset}");
        assert!(files.last().unwrap().is_some(), "{preset}");
    }
}

#[test]
fn formats_and_sizes_that_do_not_fit_are_errors() {
    let errors = |kind, parameters: &str| case(kind, parameters).errors().join("; ");
    let evaluation =
        errors("export-probes", "evaluation = \"irradiance\"\ncompression = \"cpca\"\nbytes = 50");
    assert!(evaluation.contains("only \"ktx2\" has a choice"), "{evaluation}");
    assert!(evaluation.contains("only \"transport\" has matrices"), "{evaluation}");
    let bytes = errors("export-probes", "preset = \"transport\"\nbytes = 50");
    assert!(bytes.contains("no effect without compression"), "{bytes}");
    let format = errors("export-probes", "preset = \"bevy\"\nformat = \"float\"");
    assert!(format.contains("this preset stores numbers as \"half\" or \"rgb9e5\""), "{format}");
    let counts = errors("probe-pattern", "counts = [2, 3]");
    assert!(counts.contains("expected three numbers, [x, y, z]"), "{counts}");
    let failure = case("probe-pattern", "counts = [4096, 1, 1]").failure();
    assert!(failure.contains("the box pattern has [4096, 1, 1] probes"), "{failure}");
    let failure = case("probe-pattern", "counts = [128, 128, 128]").failure();
    assert!(failure.contains("2097152 probes are too many for a pattern"), "{failure}");
    let failure = case("probe-pattern", "from = [1, 0, 0]\nto = [0, 1, 1]").failure();
    assert!(failure.contains("the box pattern is not one"), "{failure}");
}

/// RGB9E5 says how much it loses.
#[test]
fn the_error_of_rgb9e5_is_noted() {
    let pattern = case("probe-pattern", "").artifact::<Probes>();
    let export = case("export-probes", "preset = \"bevy\"\nformat = \"rgb9e5\"").input("probes", &*pattern);
    let notes = export.files_of().unwrap().1;
    assert!(notes[0].starts_with("rgb9e5: the largest error is 0."), "{notes:?}");
}
