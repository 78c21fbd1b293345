//! How long a lighting designer waits: the projects of `watch-latency`, their edits and what they are
//! measured by.
//!
//! The manifests and the materials in `frozen-watch` and `frozen-defaults` are frozen: they stay as they are,
//! so that figures can be compared over time. The environments are a gradient with a sun and grain, 1024 x
//! 512, half floats with ZIP compression; in place of that of the second project a photograph may be given.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use containers::{Precision, ReadOptions};
use envmap::Image;
use sphere::{Direction, LatLong};

/// The environments of the project.
pub const ENVIRONMENTS: [&str; 2] = ["dusk", "noon"];

/// The materials of the project, each with the parameter that an edit changes.
pub const MATERIALS: [(&str, &str); 4] = [
    ("chalk", "albedo = 0.8"),
    ("gold", "sigma = 0.2"),
    ("lacquer", "sigma = 0.2"),
    ("satin", "sigma = 0.4"),
];

/// A copy of the frozen project.
pub struct Project {
    folder: tempfile::TempDir,
    edits: u32,
}

impl Project {
    /// The project with nothing built.
    ///
    /// # Errors
    /// Where the folder cannot be written.
    pub fn new() -> io::Result<Self> {
        let project = Self { folder: tempfile::tempdir()?, edits: 0 };
        for folder in ["environments", "materials"] {
            fs::create_dir(project.folder.path().join(folder))?;
        }
        fs::copy(frozen("pipeline.toml"), project.manifest())?;
        for (name, _) in MATERIALS {
            fs::copy(frozen(&material(name)), project.folder.path().join(material(name)))?;
        }
        for (index, name) in ENVIRONMENTS.into_iter().enumerate() {
            fs::write(project.folder.path().join(environment(name)), sky(2.0 * index as f64))?;
        }
        Ok(project)
    }

    /// The manifest.
    pub fn manifest(&self) -> PathBuf {
        self.folder.path().join("pipeline.toml")
    }

    /// An edit of a material: its file with a parameter that it never had before.
    ///
    /// # Errors
    /// Where the frozen material cannot be read.
    pub fn next_material(&mut self) -> io::Result<Edit> {
        let (name, parameter) = MATERIALS[self.edits as usize % MATERIALS.len()];
        self.edits += 1;
        let text = fs::read_to_string(frozen(&material(name)))?;
        let changed = text.replace(parameter, &format!("{parameter}{:04}", self.edits));
        assert_ne!(text, changed, "the edit changes the file");
        Ok(Edit {
            place: self.folder.path().join(material(name)),
            content: changed.into_bytes(),
            exports: ENVIRONMENTS.len(),
        })
    }

    /// An edit of an environment: the sun has moved.
    pub fn next_environment(&mut self) -> Edit {
        let name = ENVIRONMENTS[self.edits as usize % ENVIRONMENTS.len()];
        self.edits += 1;
        Edit {
            place: self.folder.path().join(environment(name)),
            // Never where the sun stood at first.
            content: sky(0.005 + 0.01 * f64::from(self.edits)),
            exports: MATERIALS.len(),
        }
    }
}

/// The exports of [`DefaultsProject`].
pub const DEFAULT_EXPORTS: [&str; 2] = ["map", "shrm"];

/// A copy of the second frozen project: one environment, one metal, and nothing but defaults.
pub struct DefaultsProject {
    folder: tempfile::TempDir,
    photograph: Option<Image>,
    edits: u32,
}

impl DefaultsProject {
    /// The project with nothing built; the environment is a photograph in any format that Specula reads, or
    /// the gradient.
    ///
    /// # Errors
    /// Where the photograph cannot be read or the folder cannot be written.
    pub fn new(photograph: Option<&Path>) -> io::Result<Self> {
        let photograph = match photograph {
            Some(path) => {
                let read = containers::read_image(&fs::read(path)?, &ReadOptions::default());
                Some(read.map_err(io::Error::other)?.image)
            }
            None => None,
        };
        let mut project = Self { folder: tempfile::tempdir()?, photograph, edits: 0 };
        for folder in ["environments", "materials"] {
            fs::create_dir(project.folder.path().join(folder))?;
        }
        fs::copy(of_defaults("pipeline.toml"), project.manifest())?;
        fs::copy(of_defaults(&material("gold")), project.folder.path().join(material("gold")))?;
        project.next_light().save()?;
        Ok(project)
    }

    /// The manifest.
    pub fn manifest(&self) -> PathBuf {
        self.folder.path().join("pipeline.toml")
    }

    /// An edit of the metal's roughness, to a value between 0.2 and 0.4 that it never had before.
    ///
    /// # Errors
    /// Where the frozen material cannot be read.
    pub fn next_material(&mut self) -> io::Result<Edit> {
        self.edits += 1;
        let text = fs::read_to_string(of_defaults(&material("gold")))?;
        let roughness = 0.2 + 0.2 * (f64::from(self.edits) * 0.618_034).fract();
        let changed = text.replace("roughness = 0.3", &format!("roughness = {roughness:.6}"));
        assert_ne!(text, changed, "the edit changes the file");
        let place = self.folder.path().join(material("gold"));
        Ok(Edit { place, content: changed.into_bytes(), exports: DEFAULT_EXPORTS.len() })
    }

    /// An edit of the environment: the photograph is brighter by a few tenths of a percent, or the sun of the
    /// gradient has moved.
    pub fn next_light(&mut self) -> Edit {
        self.edits += 1;
        let content = match &self.photograph {
            Some(photograph) => {
                let exposure = 1.0 + 0.004 * self.edits as f32;
                let pixels = photograph.pixels().iter().map(|pixel| pixel.map(|value| exposure * value));
                encoded(photograph.width(), photograph.height(), pixels.collect())
            }
            None => sky(0.005 + 0.01 * f64::from(self.edits)),
        };
        let place = self.folder.path().join(environment("studio"));
        Edit { place, content, exports: DEFAULT_EXPORTS.len() }
    }
}

/// A save of a file.
pub struct Edit {
    place: PathBuf,
    content: Vec<u8>,
    /// The number of maps that depend on it.
    pub exports: usize,
}

impl Edit {
    /// Saves as most editors do: a temporary file, renamed over the old one.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn save(&self) -> io::Result<()> {
        let temporary = self.place.with_extension("tmp");
        fs::write(&temporary, &self.content)?;
        fs::rename(&temporary, &self.place)
    }
}

fn frozen(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("frozen-watch").join(name)
}

fn of_defaults(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("frozen-defaults").join(name)
}

fn material(name: &str) -> String {
    format!("materials/{name}.toml")
}

fn environment(name: &str) -> String {
    format!("environments/{name}.exr")
}

/// An EXR file of a sky whose sun stands at an azimuth, in radians.
fn sky(azimuth: f64) -> Vec<u8> {
    let grid = LatLong { width: 1024, height: 512 };
    let sun = Direction::from_angles(1.0, azimuth).vector();
    // Grain, so that the file compresses no better than a photograph.
    let mut grain = 1_u32;
    let mut pixels = Vec::with_capacity(grid.width * grid.height);
    for row in 0..grid.height {
        for column in 0..grid.width {
            let direction = grid.direction(row, column).vector();
            grain = grain.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = 0.05 * f64::from(grain >> 8) / f64::from(1 << 24);
            let disk = 500.0 * (2000.0 * (direction.dot(sun) - 1.0)).exp();
            let up = 0.3 + 0.7 * direction.z.max(0.0);
            pixels.push([0.4, 0.6, 1.0].map(|tint| (tint * up + disk + noise) as f32));
        }
    }
    encoded(grid.width, grid.height, pixels)
}

/// The bytes of an EXR file.
fn encoded(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Vec<u8> {
    let image = Image::new(width, height, pixels).expect("the pixels fill the image");
    containers::write_exr(&image, Precision::Half, None).expect("the image can be encoded").bytes
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use engine::{BuildOptions, BuildSession, Cancel};

    use super::*;

    #[test]
    fn every_edit_is_one_that_no_cache_knows() {
        let mut project = Project::new().unwrap();
        let mut seen = std::collections::HashSet::new();
        for _ in 0..2 * MATERIALS.len() {
            let edit = project.next_material().unwrap();
            assert!(seen.insert((edit.place.clone(), edit.content.clone())));
            edit.save().unwrap();
        }
        for _ in 0..2 {
            let edit = project.next_environment();
            assert!(seen.insert((edit.place, edit.content)));
        }
        let plan = engine::Plan::load(&project.manifest(), &stages::kinds()).unwrap();
        assert_eq!(plan.items.len(), 2 + 4 + 2 + 4 + 8 + 8);
    }

    #[test]
    fn every_edit_of_the_defaults_is_one_that_no_cache_knows() {
        let mut project = DefaultsProject::new(None).unwrap();
        let plan = engine::Plan::load(&project.manifest(), &stages::kinds()).unwrap();
        assert_eq!(plan.items.len(), 7);
        assert!(DEFAULT_EXPORTS.iter().all(|name| plan.stages.iter().any(|stage| stage.name == *name)));
        let mut seen = std::collections::HashSet::new();
        seen.insert(fs::read(project.folder.path().join(environment("studio"))).unwrap());
        for _ in 0..3 {
            assert!(seen.insert(project.next_material().unwrap().content));
            assert!(seen.insert(project.next_light().content));
        }
    }

    /// The exported files of a project, by their names in `out`.
    fn exports(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
        let (mut found, mut open) = (BTreeMap::new(), vec![folder.join("out")]);
        while let Some(inside) = open.pop() {
            for entry in fs::read_dir(inside).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else {
                    let name = path.strip_prefix(folder).unwrap().to_path_buf();
                    found.insert(name, fs::read(path).unwrap());
                }
            }
        }
        found
    }

    /// What stays in memory under `watch` saves time and changes no byte: also for a material of two parts,
    /// and after an edit of the light.
    #[test]
    fn an_edit_gives_the_bytes_of_a_build_from_scratch() {
        let mut project = DefaultsProject::new(None).unwrap();
        let plastic = "model = \"standard\"\nbase_color = [0.1, 0.3, 0.6]\nroughness = 0.4\n";
        fs::write(project.folder.path().join(material("plastic")), plastic).unwrap();
        let kinds = stages::kinds();
        let build = |session: &BuildSession, manifest: &Path| {
            let plan = engine::Plan::load(manifest, &kinds).unwrap();
            let summary = session
                .build(&plan, &BuildOptions::default(), &Cancel::default(), &|_| {})
                .expect("the build begins");
            assert_eq!((summary.failed, summary.skipped), (0, 0));
            summary.ran
        };
        let warm = BuildSession::new(None, 512 << 20).unwrap();
        assert_eq!(build(&warm, &project.manifest()), 12);
        let mut versions = vec![exports(project.folder.path())];
        for edit in [project.next_material().unwrap(), project.next_light(), project.next_material().unwrap()]
        {
            edit.save().unwrap();
            build(&warm, &project.manifest());
            let scratch = tempfile::tempdir().unwrap();
            for folder in ["", "environments", "materials"] {
                let to = scratch.path().join(folder);
                fs::create_dir_all(&to).unwrap();
                for entry in fs::read_dir(project.folder.path().join(folder)).unwrap() {
                    let path = entry.unwrap().path();
                    if path.is_file() {
                        fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
                    }
                }
            }
            let cold = BuildSession::new(None, 0).unwrap();
            assert_eq!(build(&cold, &scratch.path().join("pipeline.toml")), 12);
            let found = exports(project.folder.path());
            assert!(
                found.len() > 14,
                "six faces of a map and an SHRM, and more of the plastic, which has two parts"
            );
            assert!(found == exports(scratch.path()), "an edit gives other bytes than a build from scratch");
            versions.push(found);
        }
        for (before, after) in versions.iter().zip(&versions[1..]) {
            assert!(before != after, "the edit changes the exports");
        }
    }
}
