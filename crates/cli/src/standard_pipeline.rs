//! Manifests for files that have none: what `specula preview FILES`, `specula convert` and `specula init`
//! build.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::assets::{Assets, glob_of, source_of};

/// The starter manifest.
pub(crate) const STARTER: &str = include_str!("starter/pipeline.toml");

/// The sources of the starter manifest.
const STARTER_ENVIRONMENT: &str = "assets/environments/*.{exr,hdr}";
const STARTER_MATERIAL: &str = "assets/materials/*.toml";

/// A text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// One stage: its name, and its lines.
fn stage(text: &mut String, name: &str, lines: &[String]) {
    let _ = writeln!(text, "\n[stage.{name}]");
    lines.iter().for_each(|line| _ = writeln!(text, "{line}"));
}

/// A line `key = "value"`.
fn line(key: &str, value: &str) -> String {
    format!("{key} = {}", quoted(value))
}

/// What is done to files beyond reading them: further lines of the stages that import them, and a turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ImportParameters {
    /// Of `import-environment`.
    pub(crate) environment: Vec<String>,
    /// Of `import-material`.
    pub(crate) material: Vec<String>,
    /// How the light is turned after that: yaw, pitch and roll in degrees.
    pub(crate) turn: Option<[f64; 3]>,
}

/// Everything that a window needs to show these files.
pub(crate) fn preview(assets: &Assets, parameters: &ImportParameters, folder: &Path) -> String {
    let mut text = String::from("schema = 1\nout = \"out\"\n");
    let import = |kind: &str, files: &[PathBuf], parameters: &[String]| {
        [&[line("kind", kind), line("source", &source_of(files, folder))], parameters].concat()
    };
    let ImportParameters { environment, material, turn } = parameters;
    stage(&mut text, "environment", &import("import-environment", &assets.environments, environment));
    stage(&mut text, "material", &import("import-material", &assets.materials, material));
    if !assets.meshes.is_empty() {
        stage(&mut text, "mesh", &import("import-mesh", &assets.meshes, &[]));
    }
    stage(&mut text, "lighting", &[line("kind", "project-sh"), line("input", "environment")]);
    stage(&mut text, "coefficients", &[line("kind", "project-brdf"), line("input", "material")]);
    let mut lighting = "lighting";
    if let Some(angles) = turn {
        let angles = ["yaw", "pitch", "roll"].into_iter().zip(angles);
        let angles = angles.map(|(name, degrees)| format!("{name} = {degrees:?}"));
        let lines = [line("kind", "rotate"), line("input", lighting)].into_iter().chain(angles);
        lighting = "turned";
        stage(&mut text, lighting, &lines.collect::<Vec<_>>());
    }
    let inputs = format!("inputs = {{ lighting = {}, brdf = \"coefficients\" }}", quoted(lighting));
    stage(&mut text, "reflection", &[line("kind", "convolve"), inputs]);
    text
}

/// The starter manifest for files of a folder, which it names relative to it.
pub(crate) fn starter(assets: &Assets, folder: &Path) -> String {
    let mut text = STARTER.to_owned();
    if !assets.environments.is_empty() {
        text = text.replace(&quoted(STARTER_ENVIRONMENT), &quoted(&glob_of(&assets.environments, folder)));
    }
    if !assets.materials.is_empty() {
        text = text.replace(&quoted(STARTER_MATERIAL), &quoted(&glob_of(&assets.materials, folder)));
    }
    if !assets.meshes.is_empty() {
        let source = line("source", &glob_of(&assets.meshes, folder));
        stage(&mut text, "mesh", &[line("kind", "import-mesh"), source]);
        let lines = [
            format!(
                "{} # a picture of each mesh; `specula preview` opens a window on them",
                line("kind", "preview")
            ),
            "inputs = { reflection = \"reflection\", environment = \"environment\", mesh = \"mesh\" }".into(),
            line("path", "{environment}/{material}/{mesh}"),
        ];
        stage(&mut text, "picture", &lines);
    }
    text
}

/// How an environment is converted: lines of the stages that do it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Conversion {
    /// Of `import-environment`, without its source.
    pub(crate) import: Vec<String>,
    /// Of `rotate`; none if the light is not turned.
    pub(crate) rotate: Vec<String>,
    /// Of `export-environment`, without its path.
    pub(crate) export: Vec<String>,
}

impl Conversion {
    /// The manifest that converts a source to a path below `out`.
    pub(crate) fn manifest(&self, source: &str, path: &str) -> String {
        let mut text = String::from("schema = 1\nout = \"out\"\n");
        let with = |kind: &str, first: String, lines: &[String]| {
            [vec![line("kind", kind), first], lines.to_vec()].concat()
        };
        let import = with("import-environment", line("source", source), &self.import);
        stage(&mut text, "environment", &import);
        let mut input = "environment";
        if !self.rotate.is_empty() {
            stage(&mut text, "turned", &with("rotate", line("input", input), &self.rotate));
            input = "turned";
        }
        let mut export = with("export-environment", line("input", input), &self.export);
        export.push(line("path", path));
        stage(&mut text, "converted", &export);
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_starter_names_the_files_that_are_there() {
        assert_eq!(starter(&Assets::default(), Path::new("")), STARTER);
        let assets = Assets {
            environments: vec!["/none/hdri/sky.hdr".into(), "/none/hdri/sun.exr".into()],
            materials: vec!["/none/gold.toml".into()],
            meshes: vec!["/none/models/knot.glb".into()],
        };
        let text = starter(&assets, Path::new("/none"));
        for line in ["source = \"hdri/*.{exr,hdr}\"", "source = \"*.toml\"", "source = \"models/*.glb\""] {
            assert!(text.contains(line), "no {line} in\n{text}");
        }
        assert!(!text.contains("assets/"), "{text}");
    }
}
