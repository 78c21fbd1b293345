//! Shaders in Metal's language, run by a compiler of C++.

use std::io::Write as _;
use std::process::{Command, Stdio};
use std::{env, fs};

use crate::skip;

const STDLIB: &str = include_str!("metal/metal_stdlib");

/// Runs a program in the Metal Shading Language with a `main`, and returns what it answers.
///
/// It is compiled as C++ with a small standard library in place of Metal's (`metal/metal_stdlib`), in which
/// textures are made of numbers: `given()` are those of `input`, and `answer(v)` returns three. `None` if
/// there is no compiler, and the test is to be skipped.
///
/// # Panics
/// If there is no compiler and `SPECULA_REQUIRE` is set; if the program is not valid or fails.
pub fn run_metal(test: &str, program: &str, input: &[f32]) -> Option<Vec<[f32; 3]>> {
    if Command::new("c++").arg("--version").output().is_err() {
        skip(test, "there is no compiler c++");
        return None;
    }
    let folder = env::temp_dir().join(format!("specula-metal-{}-{test}", std::process::id()));
    fs::create_dir_all(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for (name, text) in [("metal_stdlib", STDLIB), ("shader.cpp", program)] {
        fs::write(folder.join(name), text).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    let compiled = Command::new("c++")
        .args(["-std=c++17", "-O1", "-I.", "shader.cpp", "-o", "shader"])
        .current_dir(&folder)
        .output()
        .unwrap_or_else(|error| panic!("c++: {error}"));
    assert!(compiled.status.success(), "{}\n{program}", String::from_utf8_lossy(&compiled.stderr));
    let mut child = Command::new(folder.join("shader"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("the program: {error}"));
    let bytes: Vec<u8> = input.iter().flat_map(|number| number.to_ne_bytes()).collect();
    // It reads everything before it answers.
    let written = child.stdin.take().map(|mut stdin| stdin.write_all(&bytes));
    let output = child.wait_with_output().unwrap_or_else(|error| panic!("the program: {error}"));
    assert!(output.status.success() && matches!(written, Some(Ok(()))), "{:?} {written:?}", output.status);
    let _ = fs::remove_dir_all(&folder);
    let (numbers, _) = output.stdout.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|bytes| f32::from_ne_bytes(*bytes)).collect();
    Some(numbers.as_chunks::<3>().0.to_vec())
}
