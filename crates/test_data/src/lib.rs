//! For tests: the data that this project did not make, and messages about what a test leaves out.
//!
//! `SPECULA_CORPUS` names a folder of real environments, BRDFs and meshes, `SPECULA_REFERENCE` one of values
//! that were computed without this project's code. If they are unset, a test that needs them is skipped and
//! says so; if `SPECULA_REQUIRE` is set, it fails instead. Tests that repeat something many times are short
//! unless `CI` is set.

mod metal;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io::Write as _;
use std::path::PathBuf;

use serde_json::Value;

pub use metal::run_metal;

/// The folder that an environment variable names. If it is unset, the test is skipped.
///
/// # Panics
/// If the variable is unset and `SPECULA_REQUIRE` is set.
pub fn folder(test: &str, variable: &str) -> Option<PathBuf> {
    let folder = std::env::var_os(variable).map(PathBuf::from);
    if folder.is_none() {
        skip(test, &format!("{variable} is unset"));
    }
    folder
}

/// A file of the reference values; `None` if the test is to be skipped.
///
/// # Panics
/// If there is no folder and `SPECULA_REQUIRE` is set; if the file cannot be read or is not JSON.
pub fn reference(test: &str, file: &str) -> Option<Value> {
    let path = folder(test, "SPECULA_REFERENCE")?.join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// The tensors of a safetensors file of the reference values, all of type F64, by name; `None` if the test is
/// to be skipped.
///
/// # Panics
/// If there is no folder and `SPECULA_REQUIRE` is set; if the file cannot be read or holds something else.
pub fn tensors(test: &str, file: &str) -> Option<BTreeMap<String, Vec<f64>>> {
    let path = folder(test, "SPECULA_REFERENCE")?.join(file);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(read_tensors(&bytes).unwrap_or_else(|| panic!("{}: not a safetensors file of F64", path.display())))
}

fn read_tensors(bytes: &[u8]) -> Option<BTreeMap<String, Vec<f64>>> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    let (header, data) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    let header: BTreeMap<String, Value> = serde_json::from_slice(header).ok()?;
    let tensors = header.into_iter().filter(|(name, _)| name != "__metadata__");
    tensors
        .map(|(name, entry)| {
            let offset = |index: usize| usize::try_from(entry["data_offsets"][index].as_u64()?).ok();
            let (numbers, rest) = data.get(offset(0)?..offset(1)?)?.as_chunks::<8>();
            let is_f64 = entry["dtype"] == "F64" && rest.is_empty();
            is_f64.then(|| (name, numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()))
        })
        .collect()
}

/// Reports that a test is skipped, and why.
///
/// # Panics
/// If `SPECULA_REQUIRE` is set, because then no test may be skipped.
pub fn skip(test: &str, why: &str) {
    assert!(std::env::var_os("SPECULA_REQUIRE").is_none(), "{test} may not be skipped: {why}");
    say(&format!("SKIPPED {test}: {why}"));
}

/// A text with its paths as Unix has them: `C:\project\sky.exr` becomes
/// `/project/sky.exr`. On Unix it is as it was.
pub fn unix_paths(text: impl Into<String>) -> String {
    let text = text.into();
    if !cfg!(windows) {
        return text;
    }
    let tops = ["project", "assets", "users"];
    let text = tops.iter().fold(text, |text, top| text.replace(&format!(r"C:\{top}"), &format!("/{top}")));
    let is_of_name = |c: &char| c.is_alphanumeric() || "_.-~$".contains(*c);
    let mut before = ' ';
    let mut characters = text.chars().peekable();
    let mut plain = String::new();
    while let Some(c) = characters.next() {
        let separates =
            c == '\\' && (before == ' ' || is_of_name(&before)) && characters.peek().is_none_or(is_of_name);
        // Escapes of messages, such as `\u{301}`.
        let is_escape = text[plain.len() + c.len_utf8()..].starts_with("u{");
        plain.push(if separates && !is_escape { '/' } else { c });
        before = c;
    }
    plain
}

/// The length of a long test: `full` if `CI` is set, otherwise `short`, which is reported. `what` says what
/// it counts.
pub fn length<N: Display>(test: &str, what: &str, full: N, short: N) -> N {
    if std::env::var_os("CI").is_some() {
        return full;
    }
    say(&format!("SHORTENED {test}: {short} instead of {full} {what}; CI=1 makes it full"));
    short
}

/// Prints a line to standard error even if the test passes: libtest captures only what the macros print.
pub fn say(line: &str) {
    // If standard error is closed, nobody can read the line.
    let _ = std::io::stderr().write_all(format!("{line}\n").as_bytes());
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::*;

    const TEST: &str = "tests::what_a_test_leaves_out_is_seen_though_its_output_is_captured";
    /// Set in the process in which the test leaves something out.
    const INNER: &str = "SPECULA_TEST_LEAVES_OUT";

    /// Runs the test below once more, in a process of its own with captured output, and returns what is seen.
    fn run(variable: Option<(&str, &str)>) -> String {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", TEST]).env_remove("CI").env_remove("SPECULA_REQUIRE").env(INNER, "1");
        let output = command.envs(variable).output().unwrap();
        String::from_utf8(output.stdout).unwrap() + &String::from_utf8(output.stderr).unwrap()
    }

    #[test]
    fn tensors_are_read_by_name() {
        let header = br#"{"__metadata__":{"about":""},"a":{"dtype":"F64","shape":[1],"data_offsets":[0,8]}}"#;
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(header);
        bytes.extend_from_slice(&1.5f64.to_le_bytes());
        assert_eq!(super::read_tensors(&bytes).unwrap()["a"], [1.5]);
        assert_eq!(super::read_tensors(&bytes[..bytes.len() - 1]), None);
    }

    #[test]
    fn what_a_test_leaves_out_is_seen_though_its_output_is_captured() {
        if std::env::var_os(INNER).is_some() {
            skip("a_test", "there is no data");
            assert!([5, 200].contains(&length("a_long_test", "rounds", 200, 5)));
            return;
        }
        let printed = run(None);
        assert!(printed.contains("SKIPPED a_test: there is no data\n"), "{printed}");
        assert!(printed.contains("SHORTENED a_long_test: 5 instead of 200 rounds; CI=1"), "{printed}");
        assert!(printed.contains("1 passed"), "{printed}");
        assert!(!run(Some(("CI", "1"))).contains("SHORTENED"));
        assert!(run(Some(("SPECULA_REQUIRE", "1"))).contains("a_test may not be skipped"));
    }
}
