//! Damaged manifests give faults that lie in the text, never a panic.

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
    Plan::of_bytes(Path::new(MANIFEST), bytes, &kinds(), &Tree::new(FILES))
}

#[test]
fn the_whole_manifest_is_sound() {
    assert_eq!(load(&whole()).unwrap().items.len(), 2 + 2 + 4 + 4 + 2 + 2);
}

#[test]
fn every_truncated_length_gives_a_plan_or_faults_in_the_text() {
    let whole = whole();
    let mut faulty = 0;
    for length in 0..whole.len() {
        if let Err(faults) = load(&whole[..length]) {
            faulty += 1;
            assert_placed(&faults);
        }
    }
    assert!(faulty > whole.len() / 2, "{faulty} of {}", whole.len());
}

fn assert_placed(faults: &Diagnostics) {
    assert!(!faults.faults.is_empty());
    for fault in &faults.faults {
        let span = fault.span.clone().unwrap_or(0..0);
        assert!(faults.text.get(span.clone()).is_some(), "{span:?} is not in the text: {fault:?}");
    }
    let _ = faults.to_string();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_give_a_plan_or_faults_in_the_text(
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = whole();
        for (place, byte) in flips {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Err(faults) = load(&bytes) {
            assert_placed(&faults);
        }
    }

    #[test]
    fn exchanged_lines_give_a_plan_or_faults_in_the_text(
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..8),
    ) {
        let bytes = whole();
        let text = String::from_utf8(bytes).unwrap();
        let mut lines: Vec<_> = text.lines().collect();
        for (from, to) in swaps {
            let (from, to) = (from.index(lines.len()), to.index(lines.len()));
            lines[to] = lines[from];
        }
        if let Err(faults) = load(lines.join("\n").as_bytes()) {
            assert_placed(&faults);
        }
    }
}
