//! The studio's command builds its pipeline.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use containers::{Precision, write_exr};
use envmap::Image;
use tempfile::TempDir;

/// The example in a folder of its own, with one sky.
struct Example(TempDir);

impl Example {
    fn new(sky: &[u8]) -> Self {
        let example = Self(tempfile::tempdir().unwrap());
        let skies = example.0.path().join("assets/environments");
        fs::create_dir_all(example.folder()).unwrap();
        fs::create_dir_all(&skies).unwrap();
        fs::write(skies.join("night.exr"), sky).unwrap();
        let pipeline = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipeline.toml");
        fs::copy(pipeline, example.folder().join("pipeline.toml")).unwrap();
        example
    }

    fn folder(&self) -> PathBuf {
        self.0.path().join("examples/custom-kind")
    }

    /// Runs the studio's command.
    fn studio(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_studio"));
        command.current_dir(self.folder()).args(arguments).env("NO_COLOR", "1").output().unwrap()
    }
}

/// A grey sky of radiance 20, the limit of the pipeline, and one pixel of 50000.
fn sky_with_a_firefly() -> Vec<u8> {
    let mut pixels = vec![[20.0; 3]; 32 * 16];
    pixels[5 * 32 + 7] = [50000.0; 3];
    let image = Image::new(32, 16, pixels).unwrap();
    write_exr(&image, Precision::Float, None).unwrap().bytes
}

#[test]
fn a_firefly_leaves_no_trace_in_the_coefficients() {
    let example = Example::new(&sky_with_a_firefly());
    let built = example.studio(&["build"]);
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));

    // A constant radiance c has the one coefficient c sqrt(4 pi), and no other.
    let file = fs::read(example.folder().join("out/night.json")).unwrap();
    let file: serde_json::Value = serde_json::from_slice(&file).unwrap();
    let rows = file["coefficients"].as_array().unwrap();
    assert_eq!(rows.len(), 25);
    for (index, row) in rows.iter().enumerate() {
        let expected = if index == 0 { 20.0 * (4.0 * PI).sqrt() } else { 0.0 };
        for channel in row.as_array().unwrap() {
            let found = channel.as_f64().unwrap();
            // Pixels are f32: the clamped one may be a rounding of 20 (2e-6) beside the others.
            assert!((found - expected).abs() < 1e-5, "row {index}: {found}, not {expected}");
        }
    }

    let again = example.studio(&["build", "--json"]);
    let events = String::from_utf8(again.stdout).unwrap();
    assert!(again.status.success() && events.contains("\"ended\""), "{events}");
    assert!(!events.contains("\"started\""), "nothing is left to do: {events}");
}

#[test]
fn an_error_of_its_parameter_has_a_place() {
    let example = Example::new(&sky_with_a_firefly());
    let pipeline = example.folder().join("pipeline.toml");
    let text = fs::read_to_string(&pipeline).unwrap();
    let line = 1 + text.lines().position(|line| line == "limit = 20.0").unwrap();
    fs::write(&pipeline, text.replace("limit = 20.0", "limit = 0.0")).unwrap();
    let built = example.studio(&["build"]);
    let said = String::from_utf8_lossy(&built.stderr);
    assert_eq!(built.status.code(), Some(3), "{said}");
    for words in ["limit: 0.0 is not a number above 0", &format!("pipeline.toml:{line}:9")] {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
}

#[test]
fn its_manual_page_comes_from_its_file() {
    let page = Example::new(b"").studio(&["stages", "clamp-fireflies"]);
    let text = String::from_utf8(page.stdout).unwrap();
    assert!(text.starts_with("# clamp-fireflies") && text.contains("`limit`"), "{text}");
}
