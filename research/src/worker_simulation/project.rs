//! The project of the simulation: the sample with more environments and materials.

use std::any::Any;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::Arc;

use engine::{
    Configured, Context, Diagnostic, ErasedKind, Failure, Field, Kinds, Output, Port, Product, Table,
};

/// The sample's manifest, with a report for each environment.
pub const MANIFEST: &str = include_str!("../../frozen-workers/pipeline.toml");

/// How large a project is. The sample has two environments, four materials, three finishes and three brushed
/// materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Project {
    /// The environments.
    pub environments: usize,
    /// Materials, finishes and brushed materials are 4, 3 and 3 times as many.
    pub materials: usize,
}

impl Project {
    /// A project of at least so many items: with as many tens of materials as every third environment, until
    /// there are 30 of them.
    pub fn of_items(items: usize) -> Self {
        for environments in 1_usize.. {
            let materials = environments.div_ceil(3).min(30);
            let project = Self { environments, materials };
            if project.items() >= items {
                return project;
            }
        }
        Self { environments: 1, materials: 1 }
    }

    /// The items of its plan.
    pub fn items(self) -> usize {
        let Self { environments, materials } = self;
        // Reflections and their two maps; five stages of pairs with finishes; two with brushed materials.
        let pairs = environments * (3 * 4 * materials + 5 * 3 * materials + 2 * 3 * materials);
        pairs + environments * 8 + materials * (2 * 4 + 2 * 3 + 4 * 3) + 6
    }

    /// Writes the manifest and its sources. Environments have this share of the sample's bytes.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(self, folder: &Path, share: f64) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        fs::write(folder.join("pipeline.toml"), MANIFEST)?;
        let Self { environments, materials } = self;
        let size = |bytes: usize| ((bytes as f64 * share) as usize).max(64);
        for (place, count, bytes) in [
            ("environments/e%.exr", environments, size(262_144)),
            ("materials/m%.toml", 4 * materials, 100),
            ("finishes/f%.toml", 3 * materials, 150),
            ("brushed/b%.toml", 3 * materials, 160),
            ("meshes/knot.glb", 1, size(147_792)),
            ("lights/lamps.toml", 1, 351),
            ("white.toml", 1, 114),
        ] {
            for index in 0..count {
                let file = folder.join("assets").join(place.replace('%', &format!("{index:04}")));
                fs::create_dir_all(file.parent().unwrap_or(folder))?;
                let mut text = format!("{place} {index} ").into_bytes();
                text.resize(bytes, b'.');
                fs::write(file, text)?;
            }
        }
        Ok(())
    }
}

/// The kinds of the program, which fail if they run.
pub fn kinds() -> Kinds {
    let all = mesh_stages::add_to(stages::kinds());
    all.iter().fold(Kinds::new(), |list, kind| list.with_erased(Arc::new(Elsewhere(Arc::clone(kind)))))
}

/// A kind that runs on workers only.
struct Elsewhere(Arc<dyn ErasedKind>);

impl ErasedKind for Elsewhere {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn revision(&self) -> u32 {
        self.0.revision()
    }

    fn manual(&self) -> String {
        self.0.manual()
    }

    fn fields(&self) -> Vec<Field> {
        self.0.fields()
    }

    fn ports(&self) -> Vec<Port> {
        self.0.ports()
    }

    fn ports_named(&self, names: &[&str]) -> Vec<Port> {
        self.0.ports_named(names)
    }

    fn has_source(&self) -> bool {
        self.0.has_source()
    }

    fn shows_keys(&self) -> bool {
        self.0.shows_keys()
    }

    fn is_slow(&self) -> bool {
        self.0.is_slow()
    }

    fn runs_programs(&self) -> bool {
        self.0.runs_programs()
    }

    fn configure(&self, table: &Table) -> Result<Arc<dyn Configured>, Vec<Diagnostic>> {
        Ok(Arc::new(ConfiguredElsewhere(self.0.configure(table)?)))
    }
}

struct ConfiguredElsewhere(Arc<dyn Configured>);

impl Configured for ConfiguredElsewhere {
    fn canonical(&self) -> engine::serde_json::Value {
        self.0.canonical()
    }

    fn product(&self, types: &[(&str, &'static str)]) -> Product {
        self.0.product(types)
    }

    fn details(&self) -> Option<Box<dyn Any>> {
        self.0.details()
    }

    fn check_inputs(&self, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        self.0.check_inputs(types)
    }

    fn is_shared(&self) -> bool {
        self.0.is_shared()
    }

    fn properties(&self) -> Option<Vec<(String, String)>> {
        self.0.properties()
    }

    fn run(&self, _: &Context<'_>) -> Result<Output, Failure> {
        Err(Failure::new("an item ran on the machine of the build").help("all items should run on workers"))
    }
}

#[cfg(test)]
mod tests {
    use engine::Plan;

    use super::*;

    #[test]
    fn the_items_are_counted_and_those_of_the_sample_are_many_times_as_many() {
        for project in [Project { environments: 2, materials: 1 }, Project { environments: 5, materials: 2 }]
        {
            let folder = tempfile::tempdir().expect("a temporary folder");
            project.write(folder.path(), 0.01).expect("files can be written");
            let plan = Plan::load(&folder.path().join("pipeline.toml"), &kinds()).expect("it is valid");
            assert_eq!(plan.items.len(), project.items());
        }
        assert_eq!(Project::of_items(100_000), Project { environments: 100, materials: 30 });
    }
}
