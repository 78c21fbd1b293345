//! Manifests for files that have none: what `specula preview FILES`, `specula convert` and `specula init`
//! build.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use stages::Engine;

use crate::assets::{Assets, Environments, Recognised, glob_of, slashed, source_of};

pub(crate) const STARTER: &str = include_str!("starter/pipeline.toml");

/// The sources of the starter manifest.
const STARTER_ENVIRONMENT: &str = "assets/environments/*.{exr,hdr}";
const STARTER_MATERIAL: &str = "assets/materials/*.toml";

/// A text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Adds a stage to the text: its name, and its lines.
fn stage(text: &mut String, name: &str, lines: &[String]) {
    let _ = writeln!(text, "\n[stage.{name}]");
    lines.iter().for_each(|line| _ = writeln!(text, "{line}"));
}

/// A line `key = "value"`.
fn line(key: &str, value: &str) -> String {
    format!("{key} = {}", quoted(value))
}

/// Changes to files beyond reading them: further lines of the stages that import them, and a turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ImportParameters {
    /// Lines of `import-environment`.
    pub(crate) environment: Vec<String>,
    /// Lines of `import-material`.
    pub(crate) material: Vec<String>,
    /// The turn of the light after its import: yaw, pitch and roll in degrees.
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

/// The stages that import what was recognised, each file by the path that `place` gives it.
pub(crate) fn imports(recognised: &Recognised, place: impl Fn(&Path) -> PathBuf) -> String {
    let mut text = String::from("schema = 1\nout = \"out\"\n");
    let mut import = |name: &str, kind: &str, layout: Option<&str>, files: &[PathBuf]| {
        if files.is_empty() {
            return;
        }
        let files: Vec<PathBuf> = files.iter().map(|file| place(file)).collect();
        let lines = [line("kind", kind), line("source", &source_of(&files, Path::new("")))];
        let layout = layout.map(|layout| line("layout", layout));
        stage(&mut text, name, &lines.into_iter().chain(layout).collect::<Vec<_>>());
    };
    for Environments { layout, sources } in &recognised.environments {
        import(layout.unwrap_or("environment"), "import-environment", *layout, sources);
    }
    import("material", "import-material", None, &recognised.materials);
    import("mesh", "import-mesh", None, &recognised.meshes);
    text
}

/// The stages of the starter manifest that belong to one stage of environments.
const OF_ENVIRONMENTS: [&str; 9] =
    ["environment", "engine", "light", "compact", "lighting", "reflection", "map", "sh", "sheet"];

/// The engine that the starter manifest names, whose preset and folder are replaced by those of another.
pub(crate) const STARTER_ENGINE: &str = "gltf";

/// The starter manifest for an engine, and files of a folder, which it names relative to it. Environments of
/// a further layout have stages of their own, whose names and folders hold the layout. What was left out is
/// at the end.
pub(crate) fn starter(recognised: &Recognised, folder: &Path, engine: &Engine) -> String {
    let Recognised { environments, materials, meshes, left_out } = recognised;
    let mut text = STARTER
        .replace(&line("preset", STARTER_ENGINE), &line("preset", engine.name))
        .replace(&format!("/{STARTER_ENGINE}\""), &format!("/{}\"", engine.name));
    if engine.looks_up_taps() {
        let inputs = "taps = \"taps\" }\n";
        text = text.replace(inputs, &format!("{inputs}{}\n", line("preset", engine.name)));
    }
    if !materials.is_empty() {
        text = text.replace(&quoted(STARTER_MATERIAL), &quoted(&glob_of(materials, folder)));
    }
    if !meshes.is_empty() {
        let source = line("source", &glob_of(meshes, folder));
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
    let blocks: Vec<String> = text.split("\n\n").map(str::to_owned).collect();
    let is_of_environments = |block: &&String| {
        let names = OF_ENVIRONMENTS.iter().chain(&["picture"]);
        names.into_iter().any(|name| block.starts_with(&format!("[stage.{name}]")))
    };
    for (index, Environments { layout, sources }) in environments.iter().enumerate() {
        // Six faces are a folder, or one of them is named.
        let named = match *layout {
            Some("cube") => source_of(sources, folder),
            _ => glob_of(sources, folder),
        };
        let placed = |block: &str| {
            let source = match layout {
                Some("probe") => format!(
                    "source = {}\n{} # square images; that of a mirror ball is \"mirror-ball\"",
                    quoted(&named),
                    line("layout", "probe")
                ),
                Some(layout) => format!("source = {}\n{}", quoted(&named), line("layout", layout)),
                None => format!("source = {}", quoted(&named)),
            };
            block.replace(
                &format!("source = {} # lat-long images; one item per file", quoted(STARTER_ENVIRONMENT)),
                &source,
            )
        };
        match (index, layout) {
            (0, _) => text = placed(&text),
            (_, layout) => {
                let suffix = layout.unwrap_or("lat-long");
                for block in blocks.iter().filter(is_of_environments) {
                    text += &format!("\n{}\n", suffixed(placed(block).trim_end(), suffix));
                }
            }
        }
    }
    if !left_out.is_empty() {
        text += "\n# Left out, because a build cannot read them:\n";
        for (file, reason) in left_out {
            let place = file.strip_prefix(folder).unwrap_or(file);
            let words = format!("{}: {reason}", slashed(place));
            let words: String = words.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            text += &format!("# {words}\n");
        }
    }
    text
}

/// A stage with another name and other inputs, its files in a folder of their own.
fn suffixed(block: &str, suffix: &str) -> String {
    let mut block = block.replace("path = \"", &format!("path = \"{suffix}/"));
    for name in OF_ENVIRONMENTS.iter().chain(&["picture"]) {
        block = block
            .replace(&format!("[stage.{name}]"), &format!("[stage.{name}-{suffix}]"))
            .replace(&format!("{{{name}}}"), &format!("{{{name}-{suffix}}}"))
            .replace(&format!("= \"{name}\""), &format!("= \"{name}-{suffix}\""));
    }
    block
}

/// How an environment is converted: lines of the stages that do it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Conversion {
    /// Lines of `import-environment`, without its source.
    pub(crate) import: Vec<String>,
    /// Lines of `rotate`; none if the light is not turned.
    pub(crate) rotate: Vec<String>,
    /// What the environment becomes.
    pub(crate) target: Target,
    /// Lines of the stage that writes it, without its path.
    pub(crate) export: Vec<String>,
}

/// What an environment is converted to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Target {
    /// An image or a texture.
    #[default]
    Environment,
    /// The light of compact maps, with lines of `scale-space`.
    Taps(Vec<String>),
    /// Light that an engine loads.
    Engine,
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
        let mut export = match &self.target {
            Target::Environment => with("export-environment", line("input", input), &self.export),
            Target::Engine => with("export-engine", line("input", input), &self.export),
            Target::Taps(light) => {
                stage(&mut text, "light", &with("scale-space", line("input", input), light));
                with("export-taps", "inputs = { scale-space = \"light\" }".into(), &self.export)
            }
        };
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
        let engine = |name: &str| *stages::ENGINES.iter().find(|engine| engine.name == name).unwrap();
        assert_eq!(starter(&Recognised::default(), Path::new(""), engine(STARTER_ENGINE)), STARTER);
        for (name, count) in [("three", 2), ("blender", 1)] {
            let bare = starter(&Recognised::default(), Path::new(""), engine(name));
            assert_eq!(bare.matches(&format!("\npreset = \"{name}\"\n")).count(), count, "{bare}");
        }
        let recognised = Recognised {
            environments: vec![
                Environments {
                    layout: None,
                    sources: vec!["/none/hdri/sky.hdr".into(), "/none/hdri/sun.exr".into()],
                },
                Environments { layout: Some("cube"), sources: vec!["/none/faces".into()] },
            ],
            materials: vec!["/none/gold.toml".into()],
            meshes: vec!["/none/models/knot.glb".into()],
            left_out: vec![("/none/broken.exr".into(), "OpenEXR: two\nlines".into())],
        };
        let text = starter(&recognised, Path::new("/none"), engine("unity"));
        for line in [
            "source = \"hdri/*.{exr,hdr}\"\n",
            "source = \"*.toml\"",
            "preset = \"unity\"\npath = \"cube/{environment-cube}/unity\"",
            "source = \"models/*.glb\"",
            "[stage.environment-cube]\nkind = \"import-environment\"\nsource = \"faces\"\nlayout = \"cube\"\n",
            "inputs = { lighting = \"lighting-cube\", brdf = \"coefficients\" }",
            "path = \"cube/{environment-cube}/{material}/reflection\"",
            "path = \"cube/{environment-cube}/{material}/{mesh}\"",
            "# broken.exr: OpenEXR: two lines\n",
        ] {
            assert!(text.contains(line), "no {line} in\n{text}");
        }
        assert!(toml::from_str::<toml::Table>(&text).is_ok(), "{text}");
        assert!(!text.contains("assets/"), "{text}");
    }
}
