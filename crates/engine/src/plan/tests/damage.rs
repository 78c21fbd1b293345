//! Damaged manifests give errors that lie within the text, never a panic.

use super::*;

fn whole() -> Vec<u8> {
    let stages = r#"
[stage.mixed]
kind = "concat" # a comment
inputs = { left = "sky", right = "paint" }
[stage.suffixed]
kind = "suffix"
input = "mixed"
text = 'é"x"'
times = 0x2
place = "before"
[stage.all]
kind = "collect"
input = "mixed"
per = [
  "sky",
]
[stage.export]
kind = "write"
input = "all"
path = "{sky}/all"
"#;
    format!("\u{feff}schema = 1\r\nout = \"out\"\n{SOURCES}{stages}").into_bytes()
}

fn load(bytes: &[u8]) -> Result<Plan, Diagnostics> {
    Plan::of_bytes(&manifest_file(), bytes, &kinds(), &Tree::new(FILES))
}

#[test]
fn the_whole_manifest_is_valid() {
    assert_eq!(load(&whole()).unwrap().items.len(), 2 + 2 + 4 + 4 + 2 + 2);
}

#[test]
fn every_truncated_length_gives_a_plan_or_errors_in_the_text() {
    let whole = whole();
    let mut invalid = 0;
    for length in 0..whole.len() {
        if let Err(errors) = load(&whole[..length]) {
            invalid += 1;
            assert_placed(&errors);
        }
    }
    assert!(invalid > whole.len() / 2, "{invalid} of {}", whole.len());
}

fn assert_placed(errors: &Diagnostics) {
    assert!(!errors.errors.is_empty());
    for error in &errors.errors {
        let span = error.span.clone().unwrap_or(0..0);
        assert!(errors.text.get(span.clone()).is_some(), "{span:?} is not in the text: {error:?}");
    }
    let _ = errors.to_string();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_give_a_plan_or_errors_in_the_text(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = whole();
        for (place, byte) in flips {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Err(errors) = load(&bytes) {
            assert_placed(&errors);
        }
    }

    #[test]
    fn exchanged_lines_give_a_plan_or_errors_in_the_text(
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..8),
    ) {
        let bytes = whole();
        let text = String::from_utf8(bytes).unwrap();
        let mut lines: Vec<_> = text.lines().collect();
        for (from, to) in swaps {
            let (from, to) = (from.index(lines.len()), to.index(lines.len()));
            lines[to] = lines[from];
        }
        if let Err(errors) = load(lines.join("\n").as_bytes()) {
            assert_placed(&errors);
        }
    }
}
