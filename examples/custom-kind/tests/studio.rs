//! The studio's command builds its pipeline.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::PI;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use containers::{Precision, write_exr};
use envmap::Image;

fn studio(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_studio")).current_dir(folder).args(arguments).output().unwrap()
}

/// A grey sky of radiance 20, the limit of the pipeline, and one pixel of 50000, reddish.
fn sky_with_a_firefly() -> Vec<u8> {
    let mut pixels = vec![[20.0; 3]; 32 * 16];
    pixels[5 * 32 + 7] = [50000.0; 3];
    let image = Image::new(32, 16, pixels).unwrap();
    write_exr(&image, Precision::Float, None).unwrap().bytes
}

#[test]
fn a_firefly_leaves_no_trace_in_the_coefficients() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("examples/custom-kind");
    let skies = root.path().join("assets/environments");
    fs::create_dir_all(&folder).unwrap();
    fs::create_dir_all(&skies).unwrap();
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("pipeline.toml"), folder.join("pipeline.toml"))
        .unwrap();
    fs::write(skies.join("night.exr"), sky_with_a_firefly()).unwrap();

    let built = studio(&folder, &["build"]);
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{said}");

    // A constant radiance c has the one coefficient c sqrt(4 pi), and no other.
    let file = fs::read(folder.join("out/night.json")).unwrap();
    let file: serde_json::Value = serde_json::from_slice(&file).unwrap();
    let rows = file["coefficients"].as_array().unwrap();
    assert_eq!(rows.len(), 25);
    for (index, row) in rows.iter().enumerate() {
        let expected = if index == 0 { 20.0 * (4.0 * PI).sqrt() } else { 0.0 };
        for channel in row.as_array().unwrap() {
            let found = channel.as_f64().unwrap();
            // The pixels are f32: the clamped one may be a rounding of 20, 2e-6, beside the others.
            assert!((found - expected).abs() < 1e-5, "row {index}: {found}, not {expected}");
        }
    }

    let again = studio(&folder, &["build", "--json"]);
    let events = String::from_utf8(again.stdout).unwrap();
    assert!(again.status.success() && !events.contains("\"started\""), "nothing is left to do: {events}");
}

#[test]
fn a_fault_of_its_parameter_has_a_place() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("pipeline.toml")).unwrap();
    fs::write(folder.path().join("pipeline.toml"), manifest.replace("limit = 20.0", "limit = 0.0")).unwrap();
    let built = studio(folder.path(), &["build"]);
    let said = String::from_utf8_lossy(&built.stderr);
    assert_eq!(built.status.code(), Some(3), "{said}");
    assert!(said.contains("limit: 0 is not more than 0") && said.contains("pipeline.toml:13"), "{said}");
}

#[test]
fn its_manual_page_comes_from_its_file() {
    let page = studio(Path::new("."), &["stages", "clamp-fireflies"]);
    let text = String::from_utf8(page.stdout).unwrap();
    assert!(
        text.starts_with("# clamp-fireflies") && text.contains("fireflies") && text.contains("`limit`"),
        "{text}"
    );
}
