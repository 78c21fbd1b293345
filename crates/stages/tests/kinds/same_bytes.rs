//! Every kind makes the same bytes on every machine.
//!
//! `digests.txt` has the digest of each output of each kind's fixture, those of [`crate::revisions`]. They
//! are compared at the best level of this CPU's instructions, at the portable level, and without AVX-512
//! beside a system's library that believes in a CPU without AVX2 and FMA, each in a process of its own. If an
//! output changes on purpose, raise the revision of the kind or of its kernel, and run the test with
//! `UPDATE_EXPECT=1`.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use engine::{Output, Product};

use crate::fixture::kinds;
use crate::revisions::{VARIANTS, fixture, kind_of};

/// Where a child writes the digests.
const TO: &str = "SPECULA_DIGESTS_TO";

/// The machines: a name, and the variables that imitate it on this one.
const MACHINES: [(&str, &[(&str, &str)]); 3] = [
    ("this CPU", &[]),
    ("portable instructions", &[("SPECULA_SIMD_LEVEL", "portable")]),
    (
        "a CPU without AVX-512, and a library without AVX2 and FMA",
        // The second is read by glibc alone.
        &[("SPECULA_SIMD_LEVEL", "v3"), ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA")],
    ),
];

/// A line for each output: `kind, variant: ending digest`.
fn digests() -> String {
    let mut lines = String::new();
    for kind in kinds().iter().filter(|kind| kind.name() != "exec" || cfg!(unix)) {
        let variants = VARIANTS.iter().filter(|variant| kind_of(variant) == kind.name());
        for name in std::iter::once(kind.name()).chain(variants.copied()) {
            let case = fixture(name);
            let output = case.run().unwrap_or_else(|failure| panic!("{name}: {failure}")).output;
            let outputs = match (case.product(), &output) {
                (Product::Artifact(type_name), _) => vec![type_name.to_owned()],
                (Product::Files(_), Output::Files(_)) => case.endings(),
                _ => unreachable!("checked by the run"),
            };
            for (ending, digest) in outputs.iter().zip(output.digests()) {
                lines += &format!("{name}: {ending} {digest}\n");
            }
        }
    }
    lines
}

/// The lines by their outputs.
fn by_output(lines: &str) -> BTreeMap<&str, &str> {
    lines.lines().map(|line| line.rsplit_once(' ').unwrap()).collect()
}

#[test]
fn every_kind_makes_the_same_bytes_on_every_machine() {
    if let Some(path) = std::env::var_os(TO) {
        std::fs::write(path, digests()).unwrap();
        return;
    }
    if cfg!(windows) {
        // The fixture of `exec` is a script of Unix, and MinGW's fused multiply-add rounds twice.
        return test_data::skip(
            "every_kind_makes_the_same_bytes_on_every_machine",
            "tests/windows.sh compares the digests of this CPU",
        );
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/kinds/digests.txt");
    let folder = tempfile::tempdir().unwrap();
    let mut errors = Vec::new();
    for (machine, variables) in MACHINES {
        let to = folder.path().join("digests");
        let child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "same_bytes::every_kind_makes_the_same_bytes_on_every_machine"])
            .envs(variables.iter().copied())
            .env(TO, &to)
            .output()
            .unwrap();
        assert!(child.status.success(), "{machine}: {}", String::from_utf8_lossy(&child.stdout));
        let found = std::fs::read_to_string(&to).unwrap();
        if machine == MACHINES[0].0 && std::env::var_os("UPDATE_EXPECT").is_some() {
            std::fs::write(&golden, &found).unwrap();
        }
        let expected = std::fs::read_to_string(&golden).unwrap();
        let (expected, found) = (by_output(&expected), by_output(&found));
        assert!(found.len() >= kinds().iter().count() - 1, "{machine}: {found:?}");
        for output in expected.keys().chain(found.keys().filter(|output| !expected.contains_key(*output))) {
            if expected.get(output) != found.get(output) {
                errors.push(format!(
                    "{machine}: {output} is {:?}, not {:?}",
                    found.get(output),
                    expected.get(output)
                ));
            }
        }
    }
    assert!(errors.is_empty(), "{errors:#?}");
}
