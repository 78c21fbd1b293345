//! What can be previewed, by name: environments, materials and meshes.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::Mode;

/// What can be shown, by name. Meshes are those of the manifest and those that Specula has by itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Catalog {
    /// The environments.
    pub environments: Vec<String>,
    /// The materials.
    pub materials: Vec<String>,
    /// The meshes.
    pub meshes: Vec<String>,
    /// The environments and materials that go together, by their places in the lists.
    pub pairs: BTreeSet<(usize, usize)>,
}

impl Catalog {
    /// What there is that is nearest to what is `wanted`; what was wished for counts twice. Of two as near, it is the one that
    /// is nearer to what is seen `now`, then the first. Where there is nothing, names are empty.
    pub fn nearest(&self, wanted: &Subject, wish: &SubjectRequest, now: &Subject) -> Subject {
        let weights = [&wish.environment, &wish.material].map(|name| 1 + u32::from(name.is_some()));
        let named = self.pairs.iter().filter_map(|&(environment, material)| {
            Some((self.environments.get(environment)?, self.materials.get(material)?))
        });
        let nearest = named.min_by_key(|(environment, material)| {
            let lacks = |subject: &Subject| {
                [**environment != subject.environment, **material != subject.material].map(u32::from)
            };
            let [environment, material] = lacks(wanted);
            (environment * weights[0] + material * weights[1], lacks(now))
        });
        let (environment, material) =
            nearest.map(|(one, other)| (one.clone(), other.clone())).unwrap_or_default();
        let mesh = [&wanted.mesh, &now.mesh].into_iter().find(|name| self.meshes.contains(name));
        let mesh = mesh.or(self.meshes.first()).cloned().unwrap_or_default();
        Subject { environment, material, mesh }
    }
}

/// A material on a mesh under an environment, each by its name in the [`Catalog`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Subject {
    /// The environment.
    pub environment: String,
    /// The material.
    pub material: String,
    /// The mesh.
    pub mesh: String,
}

/// What is asked for at first; the rest is as it was, or the first of its list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SubjectRequest {
    /// The environment.
    pub environment: Option<String>,
    /// The material.
    pub material: Option<String>,
    /// The mesh.
    pub mesh: Option<String>,
    /// The map that shades it, alone.
    pub mode: Option<Mode>,
}

/// One of the lists of a [`Catalog`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum List {
    /// Its environments.
    Environments,
    /// Its materials.
    Materials,
    /// Its meshes.
    Meshes,
}

impl Subject {
    /// Environment, material and mesh.
    pub fn names(&self) -> [&str; 3] {
        [&self.environment, &self.material, &self.mesh].map(String::as_str)
    }
}

impl List {
    /// All three, in the order of a [`Subject`].
    pub const ALL: [Self; 3] = [Self::Environments, Self::Materials, Self::Meshes];

    /// Its names, and which of them is chosen.
    pub fn of<'a>(self, catalogue: &'a Catalog, subject: &'a Subject) -> (&'a [String], &'a str) {
        match self {
            Self::Environments => (&catalogue.environments, &subject.environment),
            Self::Materials => (&catalogue.materials, &subject.material),
            Self::Meshes => (&catalogue.meshes, &subject.mesh),
        }
    }

    /// The name that a subject has of it.
    pub fn chosen(self, subject: &mut Subject) -> &mut String {
        match self {
            Self::Environments => &mut subject.environment,
            Self::Materials => &mut subject.material,
            Self::Meshes => &mut subject.mesh,
        }
    }
}
