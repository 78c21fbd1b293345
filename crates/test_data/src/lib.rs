//! For tests: where the values lie that this project did not make.
//!
//! `SPECULA_CORPUS` names a folder of real environments, BRDFs and meshes, `SPECULA_REFERENCE` one of values that
//! were computed without this project's code. A test that wants them is skipped, aloud, where they are unset, and
//! fails where `SPECULA_REQUIRE` says that nothing may be skipped.

use std::path::PathBuf;

use serde_json::Value;

/// The folder that an environment variable names; `None`, with a line on standard error, where it is unset.
///
/// # Panics
/// Where it is unset and `SPECULA_REQUIRE` is set.
pub fn folder(test: &str, variable: &str) -> Option<PathBuf> {
    let folder = std::env::var_os(variable).map(PathBuf::from);
    if folder.is_none() {
        skip(test, &format!("{variable} is unset"));
    }
    folder
}

/// A file of the reference values; `None` where the test is to be skipped.
///
/// # Panics
/// As [`folder`], and where the file cannot be read or is not JSON.
pub fn reference(test: &str, file: &str) -> Option<Value> {
    let path = folder(test, "SPECULA_REFERENCE")?.join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// Says that a test is skipped, and why.
///
/// # Panics
/// Where `SPECULA_REQUIRE` is set: nothing may be skipped there.
pub fn skip(test: &str, why: &str) {
    assert!(std::env::var_os("SPECULA_REQUIRE").is_none(), "{test} may not be skipped: {why}");
    eprintln!("SKIPPED {test}: {why}");
}
