//! What a preview shows of light without a material: white metal of a few roughnesses under what is exported.

use std::collections::BTreeSet;

use engine::{Artifact, ItemIndex, Plan};
use preview::MapSizes;
use sphere::Rotation;

use super::origin::{Origin, artifact, single_inputs};
use super::{CatalogEntry, Connections};
use crate::engines::ExportedLight;
use crate::values::artifacts;

/// The roughness of each piece of white metal, from the left to the right.
pub const ROUGHNESSES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// The name of what shows a light alone.
pub(super) const WHITE_METAL: &str = "white metal";

/// What lights the metal that shows a light alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightAlone {
    /// The item that exports the light; `None` if the environment lights it.
    pub export: Option<ItemIndex>,
}

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
            reflection: None,
            table: None,
            compact_map: None,
            light_alone: Some(LightAlone { export }),
            environment,
            added: Vec::new(),
            lighting: None,
            material: None,
            turn: Rotation::IDENTITY,
            sizes: MapSizes::default(),
            holds_lamps: false,
            exports: export.map_or_else(|| self.exports(plan, environment), |item| vec![item]),
            maps: ancestry.iter().copied().filter(|item| !source.ancestry.contains(item)).collect(),
            ancestry,
        })
    }
}

/// What an item exports, if a surface can be lit by it.
pub(super) fn exported_light(plan: &Plan, item: ItemIndex) -> Option<ExportedLight> {
    let details = plan.stages[plan.items[item].stage].configured.details()?;
    let light = *details.downcast::<ExportedLight>().ok()?;
    match light {
        ExportedLight::Engine { .. } => Some(light),
        ExportedLight::Texture => prefiltered(plan, item).map(|_| light),
    }
}

/// The item that makes the prefiltered cube that another receives.
pub(super) fn prefiltered(plan: &Plan, item: ItemIndex) -> Option<ItemIndex> {
    single_inputs(plan, item).find(|input| artifact(plan, *input) == Some(artifacts::Prefiltered::TYPE))
}
