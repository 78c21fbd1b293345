//! The entries of a graph without a material: its exports of light, and environments.

use std::collections::BTreeSet;

use engine::{Artifact, ItemIndex, Plan};
use sphere::Rotation;

use super::light_alone::{LightAlone, exported_light};
use super::origin::{Origin, artifact, single_inputs};
use super::{CatalogEntry, Connections};
use crate::values::artifacts;

impl Connections {
    /// The entries of light without a material, if there is none.
    pub(super) fn light_entries(
        &self,
        plan: &Plan,
        items: impl Iterator<Item = ItemIndex> + Clone,
    ) -> Vec<CatalogEntry> {
        let made = |item: ItemIndex| artifact(plan, item);
        if items.clone().any(|item| made(item) == Some(artifacts::Material::TYPE)) {
            return Vec::new();
        }
        let exports = items.clone().filter(|item| exported_light(plan, *item).is_some());
        let mut found: Vec<_> = exports.filter_map(|item| self.light_entry(plan, item, Some(item))).collect();
        let shown: BTreeSet<_> = found.iter().flat_map(|entry| entry.ancestry.iter().copied()).collect();
        let environments = items.filter(|item| made(*item) == Some(artifacts::Environment::TYPE));
        let steps: BTreeSet<_> = environments.clone().flat_map(|item| single_inputs(plan, item)).collect();
        let rest = environments.filter(|item| !shown.contains(item) && !steps.contains(item));
        found.extend(rest.filter_map(|item| self.light_entry(plan, item, None)));
        found
    }

    /// The entry of the light that an item exports, or of the environment that it makes.
    fn light_entry(&self, plan: &Plan, item: ItemIndex, export: Option<ItemIndex>) -> Option<CatalogEntry> {
        let (mut origin, mut source) = (Origin::default(), Origin::default());
        origin.follow(plan, item, Rotation::IDENTITY);
        let (environment, _) = origin.environment?;
        source.follow(plan, environment, Rotation::IDENTITY);
        let mut ancestry = origin.ancestry;
        ancestry.sort_unstable();
        Some(CatalogEntry {
            light_alone: Some(LightAlone { export }),
            exports: export.map_or_else(|| self.exports(plan, environment), |item| vec![item]),
            maps: ancestry.iter().copied().filter(|item| !source.ancestry.contains(item)).collect(),
            ancestry,
            ..CatalogEntry::of_light(environment)
        })
    }
}
