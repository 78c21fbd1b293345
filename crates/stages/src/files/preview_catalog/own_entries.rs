//! The entries of the materials that a mesh has in its own file.

use std::collections::BTreeMap;

use engine::ItemIndex;

use super::own_materials::GltfReference;
use super::{CatalogEntry, PreviewCatalog};

impl PreviewCatalog {
    /// If the material of an entry is one of a mesh's own file: the entries of all of those under the entry's
    /// light, the entry itself among them, each with its material of that file.
    pub(super) fn own_entries(
        &self,
        entry: &CatalogEntry,
        mesh: &str,
    ) -> Vec<(&GltfReference, &CatalogEntry)> {
        let Some(mesh) = self.mesh_item(mesh) else { return Vec::new() };
        let own = |material: Option<ItemIndex>| self.own_materials.material(mesh, material?);
        if own(entry.material).is_none() {
            return Vec::new();
        }
        let stage = |entry: &CatalogEntry| entry.reflection.map(|item| self.plan.items[item].stage);
        let is_like = |other: &CatalogEntry| stage(other) == stage(entry);
        let mut found = BTreeMap::<ItemIndex, (&GltfReference, &CatalogEntry)>::new();
        for other in self.entries.values().filter(|other| other.environment == entry.environment) {
            let (Some(material), Some(reference)) = (other.material, own(other.material)) else { continue };
            match found.get(&material) {
                // Several stages may reflect one material: the one that reflects the entry's counts.
                Some((_, known)) if is_like(known) || !is_like(other) => {}
                _ => _ = found.insert(material, (reference, other)),
            }
        }
        found.into_values().collect()
    }
}
