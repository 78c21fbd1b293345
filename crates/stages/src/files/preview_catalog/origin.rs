//! What an item of a graph was made of: the nearest environment, material, lighting, light field and table
//! upstream.

use std::collections::BTreeMap;

use engine::{Artifact, ItemIndex, Plan, Product, Stage};
use sphere::Rotation;

use crate::light::rotate;
use crate::values::artifacts;

/// The items that make a compact map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompactMapItems {
    /// The item that makes the `scale-space` of the light.
    pub scales: ItemIndex,
    /// The item that makes the `taps` of the material.
    pub taps: ItemIndex,
}

/// The origin of a reflection, as far as it has been followed.
#[derive(Default)]
pub(super) struct Origin {
    pub(super) environment: Option<(ItemIndex, Rotation)>,
    pub(super) lighting: Option<ItemIndex>,
    /// The light field; the environment and the lighting are those of its first point.
    pub(super) light_field: Option<ItemIndex>,
    /// The lighting that was made of nothing, and its turn.
    pub(super) disks: Vec<(ItemIndex, Rotation)>,
    pub(super) material: Option<ItemIndex>,
    pub(super) table: Option<ItemIndex>,
    /// The compact map, if it is known before.
    pub(super) compact_map: Option<CompactMapItems>,
    pub(super) ancestry: Vec<ItemIndex>,
    /// What the lightings of the other points of a light field were made of.
    pub(super) others: Vec<ItemIndex>,
}

impl Origin {
    /// Follows an item upstream. `turn` is how the light is turned after it.
    pub(super) fn follow(&mut self, plan: &Plan, item: ItemIndex, mut turn: Rotation) {
        if self.ancestry.contains(&item) {
            return;
        }
        self.ancestry.push(item);
        match artifact(plan, item) {
            Some(artifacts::Environment::TYPE) if self.environment.is_none() => {
                self.environment = Some((item, turn))
            }
            Some(artifacts::Material::TYPE) if self.material.is_none() => self.material = Some(item),
            Some(artifacts::BrdfTable::TYPE) => self.table = self.table.or(Some(item)),
            Some(artifacts::Lighting::TYPE) => {
                if plan.items[item].inputs.iter().all(Vec::is_empty) {
                    self.disks.push((item, turn));
                }
                // If the reflection was turned, none of the items is its light.
                let is_final = turn == Rotation::IDENTITY;
                self.lighting = self.lighting.or(is_final.then_some(item));
                let stage = &plan.stages[plan.items[item].stage];
                turn = turn.after(rotate::turn_of(stage));
            }
            Some(artifacts::LightField::TYPE) => {
                self.light_field = self.light_field.or(Some(item));
                let lightings = plan.items[item].inputs.iter().flatten();
                for lighting in lightings.skip(1) {
                    let mut other = Self::default();
                    other.follow(plan, *lighting, turn);
                    self.others.extend(other.ancestry);
                }
            }
            Some(artifacts::Reflection::TYPE) => {
                turn = turn.after(rotate::turn_of(&plan.stages[plan.items[item].stage]));
            }
            _ => {}
        }
        for input in plan.items[item].inputs.iter().filter_map(|arriving| arriving.first()) {
            self.follow(plan, *input, turn);
        }
    }
}

impl Origin {
    /// All items that were found, each after those that it needs.
    pub(super) fn all(&mut self) -> Vec<ItemIndex> {
        let mut all = std::mem::take(&mut self.ancestry);
        all.append(&mut self.others);
        all.sort_unstable();
        all.dedup();
        all
    }
}

/// What is made of materials and environments alone, by the item that it is made of: the first of each.
#[derive(Default)]
pub(super) struct EntryParts {
    /// The tables of materials.
    pub(super) tables: BTreeMap<ItemIndex, ItemIndex>,
    /// The taps of materials.
    taps: BTreeMap<ItemIndex, ItemIndex>,
    /// The scale spaces of environments.
    scales: BTreeMap<ItemIndex, ItemIndex>,
}

impl EntryParts {
    pub(super) fn of(plan: &Plan, items: impl Iterator<Item = ItemIndex>) -> Self {
        let mut parts = Self::default();
        for item in items {
            let of_material = match artifact(plan, item) {
                Some(artifacts::BrdfTable::TYPE) => Some(&mut parts.tables),
                Some(artifacts::Taps::TYPE) => Some(&mut parts.taps),
                Some(artifacts::ScaleSpace::TYPE) => None,
                _ => continue,
            };
            let mut origin = Origin::default();
            origin.follow(plan, item, Rotation::IDENTITY);
            let (found, source) = match of_material {
                Some(found) => (found, origin.material),
                None => (&mut parts.scales, origin.environment.map(|(environment, _)| environment)),
            };
            if let Some(source) = source {
                found.entry(source).or_insert(item);
            }
        }
        parts
    }

    /// The compact map of an environment and a material.
    pub(super) fn compact_map(
        &self,
        environment: ItemIndex,
        material: Option<ItemIndex>,
    ) -> Option<CompactMapItems> {
        Some(CompactMapItems { scales: *self.scales.get(&environment)?, taps: *self.taps.get(&material?)? })
    }
}

/// Whether a port of a stage takes many items.
pub(super) fn is_many(stage: &Stage, port: &str) -> bool {
    stage.ports.iter().any(|known| known.name == port && known.many)
}

/// The items that arrive at those ports of an item that take one item.
pub(super) fn single_inputs(plan: &Plan, item: ItemIndex) -> impl Iterator<Item = ItemIndex> {
    let (item, stage) = (&plan.items[item], &plan.stages[plan.items[item].stage]);
    let ports = stage.inputs.iter().zip(&item.inputs).filter(|((port, _), _)| !is_many(stage, port));
    ports.flat_map(|(_, items)| items.iter().copied())
}

/// The type of the artifact that an item makes.
pub(super) fn artifact(plan: &Plan, item: ItemIndex) -> Option<&'static str> {
    match plan.stages[plan.items[item].stage].product {
        Product::Artifact(name) => Some(name),
        Product::Files(_) => None,
    }
}
