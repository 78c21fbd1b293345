//! The names of what can be previewed: environments, materials and meshes.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::Mode;

/// The names that a preview offers. The meshes are those of the manifest and Specula's own shapes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Catalog {
    /// The environments.
    pub environments: Vec<String>,
    /// The materials.
    pub materials: Vec<String>,
    /// The meshes.
    pub meshes: Vec<String>,
    /// The combinations of environment and material that exist, as indices into the lists.
    pub pairs: BTreeSet<(usize, usize)>,
}

impl Catalog {
    /// The subject that differs least from `wanted`. Names that `request` gives count twice. If several
    /// subjects differ equally, it is the one that differs less from `now`, then the first. If there is none,
    /// the names are empty.
    pub fn nearest(&self, wanted: &Subject, request: &SubjectRequest, now: &Subject) -> Subject {
        let weights = [&request.environment, &request.material].map(|name| 1 + u32::from(name.is_some()));
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

/// A material on a mesh under an environment: their names in the [`Catalog`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Subject {
    /// The environment.
    pub environment: String,
    /// The material.
    pub material: String,
    /// The mesh.
    pub mesh: String,
}

/// The parts of a subject that the user asked for. The others are as saved, or the first of their lists.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SubjectRequest {
    /// The environment.
    pub environment: Option<String>,
    /// The material.
    pub material: Option<String>,
    /// The mesh.
    pub mesh: Option<String>,
    /// The one mode to show.
    pub mode: Option<Mode>,
}

/// One of the lists of a [`Catalog`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum List {
    /// The list of environments.
    Environments,
    /// The list of materials.
    Materials,
    /// The list of meshes.
    Meshes,
}

impl Subject {
    /// The names of environment, material and mesh.
    pub fn names(&self) -> [&str; 3] {
        [&self.environment, &self.material, &self.mesh].map(String::as_str)
    }
}

impl List {
    /// All three lists, in the order of a [`Subject`].
    pub const ALL: [Self; 3] = [Self::Environments, Self::Materials, Self::Meshes];

    /// The names of the list, and the chosen one.
    pub fn of<'a>(self, catalog: &'a Catalog, subject: &'a Subject) -> (&'a [String], &'a str) {
        match self {
            Self::Environments => (&catalog.environments, &subject.environment),
            Self::Materials => (&catalog.materials, &subject.material),
            Self::Meshes => (&catalog.meshes, &subject.mesh),
        }
    }

    /// A subject's name from this list.
    pub fn chosen(self, subject: &mut Subject) -> &mut String {
        match self {
            Self::Environments => &mut subject.environment,
            Self::Materials => &mut subject.material,
            Self::Meshes => &mut subject.mesh,
        }
    }
}
