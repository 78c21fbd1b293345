//! `specula --version --verbose`: from what the program was built.

/// The crates that the program with all features contains on any system, by their licences: written by the
/// test below with `UPDATE_EXPECT=1 cargo test -p cli --lib version`.
const CRATES: &str = include_str!("version/crates.txt");

/// The version, the commit, the features and the licences.
pub(crate) fn in_full() -> String {
    let commit = option_env!("SPECULA_COMMIT").filter(|commit| !commit.is_empty());
    let features = [
        ("gpu", cfg!(feature = "gpu")),
        ("window", cfg!(feature = "window")),
        ("remote", cfg!(feature = "remote")),
    ];
    let features = features.map(|(name, is_on)| format!("{name} {}", if is_on { "on" } else { "off" }));
    format!(
        "specula {}\ncommit: {}\nfeatures: {}\nlicence: {}\n\nWith all features it contains these crates:\n\n{CRATES}",
        env!("CARGO_PKG_VERSION"),
        commit.unwrap_or("not recorded"),
        features.join(", "),
        env!("CARGO_PKG_LICENSE"),
    )
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};
    use std::process::Command;

    use expect_test::expect_file;

    /// The systems of which the list has the crates.
    const TARGETS: [&str; 5] = [
        "x86_64-unknown-linux-gnu",
        "aarch64-unknown-linux-musl",
        "x86_64-pc-windows-msvc",
        "x86_64-apple-darwin",
        "aarch64-apple-darwin",
    ];

    /// A licence expression in one form: alternatives are sorted, and separated by `OR`.
    fn normal(licence: &str) -> String {
        if licence.contains(['(', '&']) || licence.contains(" AND ") {
            return licence.to_owned();
        }
        let mut names: Vec<_> =
            licence.split('/').flat_map(|part| part.split(" OR ")).map(str::trim).collect();
        names.sort_unstable();
        names.join(" OR ")
    }

    /// The crates that Cargo.lock names for the program, without our own and without those that only run
    /// while it is compiled. Cargo may have to download those of other systems.
    #[test]
    fn the_crates_and_their_licences_are_those_of_the_program() {
        let mut cargo = Command::new(std::env::var("CARGO").unwrap());
        cargo.args(["tree", "--locked", "--package", "cli", "--all-features", "--prefix", "none"]);
        cargo.args(["--edges", "normal,no-proc-macro", "--format", "{p}|{l}"]);
        cargo.args(TARGETS.iter().flat_map(|target| ["--target", target]));
        let output = match cargo.current_dir(env!("CARGO_MANIFEST_DIR")).output() {
            Ok(output) if output.status.success() => Ok(output.stdout),
            Ok(output) => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
            Err(error) => Err(error.to_string()),
        };
        let text = match output {
            Ok(text) => String::from_utf8(text).unwrap(),
            Err(why) => {
                return test_data::skip("the_crates_and_their_licences_are_those_of_the_program", &why);
            }
        };
        let mut by_licence = BTreeMap::<String, BTreeSet<String>>::new();
        for line in text.lines().filter(|line| !line.is_empty()) {
            let (package, licence) = line.trim_end_matches(" (*)").split_once('|').unwrap();
            let (name, version) = package.split_once(" v").unwrap();
            if version.contains('(') {
                continue; // a folder: one of ours
            }
            assert!(!licence.is_empty(), "{name} names its licence");
            by_licence.entry(normal(licence)).or_default().insert(format!("{name} {version}"));
        }
        let mut list = String::new();
        for (licence, crates) in &by_licence {
            list += &format!("{licence}:\n");
            let mut line = String::new();
            for (index, name) in crates.iter().enumerate() {
                let end = if index + 1 == crates.len() { "" } else { "," };
                if line.len() + name.len() > 98 {
                    list += &format!(" {line}\n");
                    line.clear();
                }
                line += &format!(" {name}{end}");
            }
            list += &format!(" {line}\n");
        }
        let count: usize = by_licence.values().map(BTreeSet::len).sum();
        assert!(count > 200 && list.len() < 30_000, "{count} crates in {} bytes", list.len());
        expect_file!["version/crates.txt"].assert_eq(&list);
    }
}
