//! The project that makes the maps: a manifest without degrees.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

use brdf::Material;
use containers::Precision;
use engine::{BuildOptions, Cancel, EventLine, Plan};
use envmap::Image;
use serde_json::Value;
use tempfile::TempDir;

use super::{Case, Failure, Map};

const MANIFEST: &str = r#"
schema = 1
out = "out"

[stage.environment]
kind = "import-environment"
source = "environments/*.exr"

[stage.material]
kind = "import-material"
source = "materials/*.toml"

[stage.lighting]
kind = "project-sh"
input = "environment"

[stage.coefficients]
kind = "project-brdf"
input = "material"

[stage.reflection]
kind = "convolve"
inputs = { lighting = "lighting", brdf = "coefficients" }
"#;

/// A temporary folder with a manifest, environments and materials.
pub struct Project {
    folder: TempDir,
    resolution: usize,
}

/// A project after its build.
pub struct Built<'a> {
    /// The project.
    pub project: &'a Project,
    /// The lines that the program printed.
    events: Vec<Value>,
}

impl Project {
    /// A project of these environments, materials and maps, cubes of that edge. Measured files are copied
    /// from the corpus.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn new(
        environments: &[(&str, &Image)],
        cases: &[Case],
        (maps, resolution): (&[Map], usize),
        corpus: &Path,
    ) -> Result<Self, Failure> {
        let project = Self { folder: tempfile::tempdir()?, resolution };
        let folder = project.folder.path();
        for name in ["environments", "materials", "measured"] {
            fs::create_dir(folder.join(name))?;
        }
        for (name, image) in environments {
            let bytes = containers::write_exr(image, Precision::Float, None)?.bytes;
            fs::write(folder.join(format!("environments/{name}.exr")), bytes)?;
        }
        for case in cases {
            fs::write(folder.join(format!("materials/{}.toml", case.name)), &case.text)?;
            if let Some(file) = case.measured {
                let name = format!("measured/{file}.brdf");
                fs::copy(corpus.join("brdf").join(&name), folder.join(&name))?;
            }
        }
        fs::write(folder.join("pipeline.toml"), manifest(maps, resolution))?;
        Ok(project)
    }

    /// The edge of each cube map.
    pub fn resolution(&self) -> usize {
        self.resolution
    }

    /// Builds with a program.
    ///
    /// # Errors
    /// If the program does not succeed.
    pub fn build_with(&self, program: &Path) -> Result<Built<'_>, Failure> {
        let mut command = Command::new(program);
        command.current_dir(self.folder.path()).args(["build", "--json"]).stdin(Stdio::null());
        let output = command.output().map_err(|error| format!("{}: {error}", program.display()))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
        }
        let lines = std::str::from_utf8(&output.stdout)?.lines().map(serde_json::from_str);
        Ok(Built { project: self, events: lines.collect::<Result<_, _>>()? })
    }

    /// Builds in this process.
    ///
    /// # Errors
    /// If the build does not succeed.
    pub fn build(&self) -> Result<Built<'_>, Failure> {
        let plan = Plan::load(&self.folder.path().join("pipeline.toml"), &stages::kinds())?;
        let events = Mutex::new(Vec::new());
        let keep = |event| {
            let line = serde_json::to_value(EventLine::now(event));
            events.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(line);
        };
        let summary = engine::build(&plan, &BuildOptions::default(), &Cancel::default(), &keep)?;
        let events = events.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
        let events: Vec<Value> = events.into_iter().collect::<Result<_, _>>()?;
        if summary.failed + summary.skipped > 0 {
            let failed = events.iter().filter(|event| event["event"] == "failed");
            return Err(failed.map(|event| format!("{event}\n")).collect::<String>().into());
        }
        Ok(Built { project: self, events })
    }

    /// The material of a file.
    ///
    /// # Errors
    /// If the file has errors.
    pub fn material(&self, case: &Case) -> Result<Material, Failure> {
        let folder = self.folder.path().join("materials");
        let read = |path: &Path| {
            let bytes = fs::read(folder.join(path));
            bytes.map(Arc::new).map_err(|error| engine::Failure::new(format!("{}: {error}", path.display())))
        };
        let name = format!("{}.toml", case.name);
        let read = stages::read_material(&name, case.text.as_bytes(), None, &read);
        Ok(read.map_err(|failure| failure.to_string())?.material)
    }
}

impl Built<'_> {
    /// The file of a map.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn file(&self, environment: &str, case: &Case, map: Map) -> Result<Vec<u8>, Failure> {
        let ending = if map == Map::Plain { "exr" } else { "safetensors" };
        let name = format!("out/{environment}/{}/{}.{ending}", case.name, map.name());
        fs::read(self.project.folder.path().join(&name)).map_err(|error| format!("{name}: {error}").into())
    }

    /// The file of the map of a material's diffuse part, if it has two.
    pub fn diffuse(&self, environment: &str, case: &Case, map: Map) -> Option<Vec<u8>> {
        let name = format!("out/{environment}/{}/{}-diffuse.safetensors", case.name, map.name());
        fs::read(self.project.folder.path().join(name)).ok()
    }

    /// The degree F of a reflection, from the note of `convolve`; 0 if there is none.
    pub fn f(&self, environment: &str, case: &Case) -> usize {
        let note = self.find("note", "reflection", environment, case);
        let message = note.and_then(|event| event["message"].as_str()).unwrap_or_default();
        let number = message.strip_prefix("F = ").and_then(|rest| rest.split(',').next());
        number.and_then(|number| number.parse().ok()).unwrap_or(0)
    }

    /// The seconds of `project-sh`, `project-brdf`, `convolve` and the export.
    pub fn seconds(&self, environment: &str, case: &Case, map: Map) -> [f64; 4] {
        ["lighting", "coefficients", "reflection", map.name()].map(|stage| {
            let finished = self.find("finished", stage, environment, case);
            1e-3 * finished.and_then(|event| event["milliseconds"].as_f64()).unwrap_or(0.0)
        })
    }

    /// The first event of this name of the stage's item.
    fn find(&self, event: &str, stage: &str, environment: &str, case: &Case) -> Option<&Value> {
        self.events.iter().find(|line| {
            let key = &line["item"]["key"];
            let is = |name: &str, value: &str| key.get(name).is_none_or(|found| found == value);
            line["event"] == event
                && line["item"]["stage"] == stage
                && is("environment", environment)
                && is("material", &case.name)
        })
    }
}

/// The manifest with exports of these maps; everything but their place and resolution is left to its default.
fn manifest(maps: &[Map], resolution: usize) -> String {
    let mut text = MANIFEST.to_owned();
    for map in maps {
        let name = map.name();
        // The most exact map: by default the degree P is at most 4, with a warning if that is too little.
        let own = match map {
            Map::Separate => {
                "kind = \"export-shrm\"\nlamps = \"separate\"\nmost-p = 16\naccept = [0.01, 0.02]"
            }
            Map::Baked => "kind = \"export-shrm\"\nmost-p = 16\naccept = [0.1, 0.35]",
            Map::Plain => "kind = \"export-reflection-map\"\nlayout = \"cube-strip\"\nparts = \"together\"",
        };
        let _ = write!(
            text,
            "\n[stage.{name}]\n{own}\ninput = \"reflection\"\nresolution = {resolution}\n\
             path = \"{{environment}}/{{material}}/{name}\"\n"
        );
    }
    text
}
