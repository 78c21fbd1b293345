//! A large project of cheap items, for measuring the engine itself.

use std::fs;
use std::path::Path;

/// Joins every text of one folder with every text of another.
const MANIFEST: &str = r#"
schema = 1
[stage]
left = { kind = "text-source", source = "left/*.txt" }
right = { kind = "text-source", source = "right/*.txt" }
loud-left = { kind = "suffix", input = "left", text = "!" }
loud-right = { kind = "suffix", input = "right", text = "!!" }
pair = { kind = "concat", inputs = { left = "loud-left", right = "loud-right" } }
file = { kind = "write", input = "pair", path = "{left}/{right}/text" }
"#;

/// Writes a project of 200 texts by 200 others: 80,800 items, of which 40,000 are files.
pub(crate) fn make(folder: &Path) {
    for side in ["left", "right"] {
        fs::create_dir_all(folder.join(side)).expect("a folder");
        for n in 0..200 {
            fs::write(folder.join(format!("{side}/{n:03}.txt")), format!("{side} {n}")).expect("a text");
        }
    }
    fs::write(folder.join("pipeline.toml"), MANIFEST).expect("the manifest");
}
