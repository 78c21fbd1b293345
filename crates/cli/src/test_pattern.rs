//! `specula test-pattern`: files that show where an engine looks, without a manifest.

use engine::Kinds;

use crate::arguments::TestPatternArguments;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::one_build::{self, StageOption};

/// The options that are parameters of the stage.
const OPTIONS: [StageOption; 3] = [
    StageOption { stage: "pattern", parameter: "preset", option: "--preset" },
    StageOption { stage: "pattern", parameter: "format", option: "--format" },
    StageOption { stage: "pattern", parameter: "resolution", option: "--resolution" },
];

pub(crate) fn run(arguments: &TestPatternArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let TestPatternArguments { output, preset, format, resolution, probes } = arguments;
    let text = |key: &str, value: &str| format!("{key} = {}\n", toml::Value::from(value));
    let mut manifest = String::from("schema = 1\n");
    manifest += match probes {
        true => {
            "[stage.light]\nkind = \"probe-pattern\"\n\
             [stage.pattern]\nkind = \"export-probes\"\ninput = \"light\"\n"
        }
        false => "[stage.pattern]\nkind = \"test-pattern\"\n",
    };
    manifest += "path = \"pattern\"\n";
    manifest += &text("preset", preset);
    manifest += &format.as_ref().map_or_else(String::new, |format| text("format", format));
    manifest += &resolution.map_or_else(String::new, |resolution| format!("resolution = {resolution}\n"));
    let place = |file: &str| Some(output.join(file.trim_start_matches("pattern/")));
    one_build::build(|_| manifest, kinds, output, place, &OPTIONS)
}
