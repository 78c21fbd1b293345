//! The materials that a mesh has in its own file, found among those of the graph.
//!
//! A material file with `model = "gltf"` names a glTF file and one of its materials; a stage may name both
//! itself. What `import-mesh` makes of the same file knows which of its triangles are of which material.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use containers::MaterialChoice;
use engine::{Artifact, Document, ItemIndex, Kind, Plan, Table, ValueKind, canonicalize};
use serde_json::Value;

use super::origin::{artifact, single_inputs};
use crate::material::{GLTF, ImportMaterial, is_gltf_file};
use crate::values::artifacts;

/// A material of a glTF file.
#[derive(Debug, PartialEq)]
pub(super) struct GltfReference {
    file: PathBuf,
    /// Which of its materials; `None` for the only one.
    choice: Option<MaterialChoice>,
}

/// The glTF files of materials and meshes, by the items that make these.
#[derive(Default)]
pub(super) struct OwnMaterials {
    materials: BTreeMap<ItemIndex, GltfReference>,
    meshes: BTreeMap<ItemIndex, PathBuf>,
}

impl OwnMaterials {
    /// The glTF files of the materials and meshes that some items of a plan make. A material file that cannot
    /// be read is left out.
    pub(super) fn of(plan: &Plan, items: impl Iterator<Item = ItemIndex>) -> Self {
        let mut own = Self::default();
        for item in items {
            match artifact(plan, item) {
                Some(artifacts::Material::TYPE) => {
                    own.materials.extend(reference(plan, item).map(|reference| (item, reference)));
                }
                Some(artifacts::Mesh::TYPE) => {
                    own.meshes.extend(mesh_file(plan, item).map(|file| (item, file)));
                }
                _ => {}
            }
        }
        own
    }

    /// The material of the file of a mesh that an item makes, if it is one.
    pub(super) fn material(&self, mesh: ItemIndex, material: ItemIndex) -> Option<&GltfReference> {
        let file = self.meshes.get(&mesh)?;
        self.materials.get(&material).filter(|reference| reference.file == *file)
    }
}

impl GltfReference {
    /// The place of the material among the names of all materials of its file.
    pub(super) fn place(&self, names: &[String]) -> Option<usize> {
        match &self.choice {
            None => (names.len() == 1).then_some(0),
            Some(MaterialChoice::Index(index)) => (*index < names.len()).then_some(*index),
            Some(MaterialChoice::Name(name)) => {
                let mut found = (0..names.len()).filter(|index| names[*index] == *name);
                found.next().filter(|_| found.next().is_none())
            }
        }
    }
}

/// The material of a glTF file that an item imports, by its own source or by a material file.
fn reference(plan: &Plan, item: ItemIndex) -> Option<GltfReference> {
    let stage = &plan.stages[plan.items[item].stage];
    let source = plan.items[item].source.as_deref().filter(|_| stage.kind.name() == ImportMaterial::NAME)?;
    let name = source.file_name()?.to_string_lossy();
    if is_gltf_file(&name) {
        let choice = match &stage.configured.canonical()["material"] {
            Value::String(name) => Some(MaterialChoice::Name(name.clone())),
            number => number.as_u64().map(|index| MaterialChoice::Index(index as usize)),
        };
        return Some(GltfReference { file: real(source), choice });
    }
    if !source.extension()?.eq_ignore_ascii_case("toml") {
        return None;
    }
    let bytes = engine::read_file(source).ok()?;
    let table = Document::parse(name, &bytes).ok()?.table;
    let file = text(&table, "file").filter(|_| text(&table, "model") == Some(GLTF))?;
    let choice = match table.get("material").map(|entry| &entry.value.kind) {
        Some(ValueKind::String(name)) => Some(MaterialChoice::Name(name.clone())),
        Some(ValueKind::Integer(index)) => Some(MaterialChoice::Index(usize::try_from(*index).ok()?)),
        _ => None,
    };
    Some(GltfReference { file: real(&source.parent()?.join(file)), choice })
}

fn text<'t>(table: &'t Table, key: &str) -> Option<&'t str> {
    match &table.get(key)?.value.kind {
        ValueKind::String(text) => Some(text),
        _ => None,
    }
}

/// The glTF file that a mesh was read from, by the item itself or by one that it is made of.
fn mesh_file(plan: &Plan, item: ItemIndex) -> Option<PathBuf> {
    if let Some(source) = &plan.items[item].source {
        return Some(real(source));
    }
    let mesh = single_inputs(plan, item).find(|input| artifact(plan, *input) == Some(artifacts::Mesh::TYPE));
    mesh_file(plan, mesh?)
}

/// A path without links and detours, so that two ways to one file are equal.
fn real(path: &Path) -> PathBuf {
    canonicalize(path).unwrap_or_else(|_| path.to_owned())
}
