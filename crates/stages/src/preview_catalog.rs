//! What of a graph a preview can show: every material under every light that the graph reflects, on every mesh.
//!
//! It is found by what the stages make, not by what they are called. A stage that makes a `reflection` or an `shrm` gives
//! *exhibits*, one for each of its items. Going back from the item, the nearest environment is the light that it reflects
//! and the nearest material is what reflects it. Where the lighting was turned on the way, so is the environment.
//!
//! An exhibit is known by two names. Its light is that of the environment's item. Its material is what is left of its own
//! item's key without the environment's: `gold`. Names that would stand for two things carry their stages: `gold (matte)`.
//! Where stages reflect the same material and some of them are exported, the others are steps on the way and not shown.

use std::collections::{BTreeMap, BTreeSet};

use engine::{Artifact, ItemIndex, ItemKey, Plan, Product, Stage, StageIndex};
use preview::MapSizes;
use preview::window::Catalogue;
use sphere::Rotation;

pub use scenes::SceneCache;

use crate::{artifacts, rotate};

mod scenes;

/// What of a graph can be shown.
pub struct PreviewCatalog {
    plan: Plan,
    environments: Vec<String>,
    materials: Vec<String>,
    /// By the places of their names.
    exhibits: BTreeMap<(usize, usize), CatalogEntry>,
    meshes: Vec<(String, Shape)>,
}

/// A material under a light, by the items that made it.
#[derive(Clone, Debug)]
pub struct CatalogEntry {
    /// What reflects: an item that makes a `reflection` or an `shrm`.
    pub reflection: ItemIndex,
    /// The light.
    pub environment: ItemIndex,
    /// The light's coefficients, before they are cut to the material's degree.
    pub lighting: Option<ItemIndex>,
    /// The material.
    pub material: Option<ItemIndex>,
    /// How the graph turns the light before it is reflected.
    pub turn: Rotation,
    /// How large the maps are that are exported of it.
    pub sizes: MapSizes,
    /// The items that export it and nothing else, in the manifest's order.
    pub exports: Vec<ItemIndex>,
    /// The items that it was made of and itself, each after those that it needs.
    pub ancestry: Vec<ItemIndex>,
}

/// Where a mesh comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// An item makes it.
    Item(ItemIndex),
    /// A shape of [`mesh::SHAPES`].
    BuiltIn(&'static str),
}

/// Why a subject cannot be shown: nothing has that name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// What was looked for: `material`.
    pub what: &'static str,
    /// Its name.
    pub name: String,
    /// The names that there are.
    pub known: Vec<String>,
}

impl PreviewCatalog {
    /// What of a plan can be shown.
    pub fn of(plan: Plan) -> Self {
        Self::among(plan, &[])
    }

    /// What of a plan can be shown where these stages are built, with all that they need; none stand for all stages.
    pub fn among(plan: Plan, built: &[String]) -> Self {
        let graph = Connections::of(&plan);
        let built = with_their_needs(&plan, built);
        let items = (0..plan.items.len()).filter(|item| built[plan.items[*item].stage]);
        let found = items.clone().filter_map(|item| graph.exhibit(&plan, item)).collect();
        let found = without_steps(&plan, &graph, found);
        let lights = found.iter().map(|exhibit| exhibit.environment).collect::<BTreeSet<_>>();
        let lights = lights.into_iter().collect::<Vec<_>>();
        let named = lights.iter().map(|item| Named::of(&plan, *item));
        let environments = told_apart(&named.collect::<Vec<_>>());
        // What is left of a key tells the materials of a stage apart.
        let coats = found.iter().map(|exhibit| MaterialKey::of(&plan, exhibit)).collect::<Vec<_>>();
        let each = coats.iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>();
        let materials = told_apart(&each.iter().map(|coat| coat.named(&plan)).collect::<Vec<_>>());
        let place = |exhibit: &CatalogEntry, coat: &MaterialKey| {
            let environment = lights.binary_search(&exhibit.environment).unwrap_or_default();
            (environment, each.binary_search(&coat).unwrap_or_default())
        };
        let places = found.iter().zip(&coats).map(|(exhibit, coat)| place(exhibit, coat));
        let exhibits = places.collect::<Vec<_>>().into_iter().zip(found).collect();
        let meshes = meshes(&plan, items);
        Self { plan, environments, materials, exhibits, meshes }
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Whether there is nothing to show: no stage makes a reflection of an environment.
    pub fn is_empty(&self) -> bool {
        self.exhibits.is_empty()
    }

    /// The names of all that can be shown, and what goes together.
    pub fn catalogue(&self) -> Catalogue {
        Catalogue {
            environments: self.environments.clone(),
            materials: self.materials.clone(),
            meshes: self.meshes(),
            pairs: self.exhibits.keys().copied().collect(),
        }
    }

    /// The names of the environments, as the manifest has them.
    pub fn environments(&self) -> &[String] {
        &self.environments
    }

    /// The names of the materials, as the manifest has them.
    pub fn materials(&self) -> &[String] {
        &self.materials
    }

    /// The names of the meshes: those of the manifest, then the built-in ones.
    pub fn meshes(&self) -> Vec<String> {
        self.meshes.iter().map(|(name, _)| name.clone()).collect()
    }

    /// A material under an environment; `None` where the graph does not bring the two together.
    ///
    /// # Errors
    /// Where one of them is not known at all.
    pub fn exhibit(&self, environment: &str, material: &str) -> Result<Option<&CatalogEntry>, Unknown> {
        let environment = position("environment", &self.environments, environment)?;
        let material = position("material", &self.materials, material)?;
        Ok(self.exhibits.get(&(environment, material)))
    }

    /// Whether an environment is known.
    ///
    /// # Errors
    /// Where it is not.
    pub fn check_environment(&self, name: &str) -> Result<(), Unknown> {
        position("environment", &self.environments, name).map(|_| ())
    }

    /// Whether a material is known.
    ///
    /// # Errors
    /// Where it is not.
    pub fn check_material(&self, name: &str) -> Result<(), Unknown> {
        position("material", &self.materials, name).map(|_| ())
    }

    /// Whether a mesh is known.
    ///
    /// # Errors
    /// Where it is not.
    pub fn check_mesh(&self, name: &str) -> Result<(), Unknown> {
        position("mesh", &self.meshes(), name).map(|_| ())
    }

    /// The stages that make an exhibit and a mesh, and those that they need.
    pub fn stages(&self, exhibit: &CatalogEntry, mesh: &str) -> BTreeSet<&str> {
        let shape = self.meshes.iter().find(|(name, _)| name == mesh).map(|(_, shape)| *shape);
        let mesh = match shape {
            Some(Shape::Item(item)) => Some(item),
            Some(Shape::BuiltIn(_)) | None => None,
        };
        let items = exhibit.ancestry.iter().copied().chain(mesh);
        items.map(|item| stage_name(&self.plan, item)).collect()
    }
}

/// For each stage, whether it is among the named ones or needed by one of them; no names stand for all.
fn with_their_needs(plan: &Plan, names: &[String]) -> Vec<bool> {
    let is_named = |stage: &Stage| names.is_empty() || names.contains(&stage.name);
    let mut chosen = plan.stages.iter().map(is_named).collect::<Vec<_>>();
    // Stages come after those that they need.
    for (index, stage) in plan.stages.iter().enumerate().rev() {
        if chosen[index] {
            stage.inputs.iter().for_each(|(_, from)| chosen[*from] = true);
        }
    }
    chosen
}

fn position(what: &'static str, names: &[String], name: &str) -> Result<usize, Unknown> {
    let found = names.iter().position(|known| known == name);
    found.ok_or_else(|| Unknown { what, name: name.into(), known: names.to_vec() })
}

/// A material as a stage reflects it: the stage, and what of an item's key is not the environment's.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct MaterialKey {
    reflection: StageIndex,
    rest: ItemKey,
    /// The stage of the material, where there is one.
    material: Option<StageIndex>,
}

impl MaterialKey {
    fn of(plan: &Plan, exhibit: &CatalogEntry) -> Self {
        let (item, environment) = (&plan.items[exhibit.reflection], &plan.items[exhibit.environment]);
        let rest = item.key.iter().filter(|(stage, _)| environment.key.get(stage).is_none()).collect();
        let material = exhibit.material.map(|item| plan.items[item].stage);
        Self { reflection: item.stage, rest, material }
    }

    /// Its name, and the stages that tell it from others of that name.
    fn named<'p>(&self, plan: &'p Plan) -> Named<'p> {
        let name = |stage: StageIndex| plan.stages[stage].name.as_str();
        let stages = self.material.into_iter().chain([self.reflection]).map(name).collect::<Vec<_>>();
        let name = if self.rest.is_empty() { stages[0].into() } else { self.rest.to_string() };
        Named { name, stages }
    }
}

/// A name, and the stages that may tell it from others.
struct Named<'p> {
    name: String,
    stages: Vec<&'p str>,
}

impl<'p> Named<'p> {
    /// An item, by its key.
    fn of(plan: &'p Plan, item: ItemIndex) -> Self {
        let (stage, key) = (stage_name(plan, item), &plan.items[item].key);
        let name = if key.is_empty() { stage.to_owned() } else { key.to_string() };
        Self { name, stages: vec![stage] }
    }

    /// Longer and longer: the name alone, with one stage, with all.
    fn labels(&self) -> Vec<String> {
        let Self { name, stages } = self;
        let with = |told: &str| format!("{name} ({told})");
        let mut labels = vec![name.clone()];
        labels.extend(stages.iter().map(|stage| with(stage)));
        labels.push(with(&stages.join(", ")));
        labels
    }
}

/// The meshes among some items, then the built-in ones.
fn meshes(plan: &Plan, items: impl Iterator<Item = ItemIndex>) -> Vec<(String, Shape)> {
    let items = items.filter(|item| artifact(plan, *item) == Some(artifacts::Mesh::TYPE));
    let made = items.map(|item| (Named::of(plan, item), Shape::Item(item)));
    let built_in = |name: &'static str| Named { name: name.into(), stages: vec!["built-in"] };
    let built_in = mesh::SHAPES.into_iter().map(|name| (built_in(name), Shape::BuiltIn(name)));
    let (named, shapes): (Vec<_>, Vec<_>) = made.chain(built_in).unzip();
    told_apart(&named).into_iter().zip(shapes).collect()
}

/// For each its first label that no other has in the same place.
fn told_apart(named: &[Named<'_>]) -> Vec<String> {
    let labels = named.iter().map(Named::labels).collect::<Vec<_>>();
    let mut counts = BTreeMap::<(usize, &str), usize>::new();
    for (place, label) in labels.iter().flat_map(|labels| labels.iter().enumerate()) {
        *counts.entry((place, label)).or_default() += 1;
    }
    let is_single = |(place, label): &(usize, &String)| counts[&(*place, label.as_str())] == 1;
    let chosen = labels.iter().map(|labels| {
        let single = labels.iter().enumerate().find(is_single).map(|(_, label)| label);
        single.or(labels.last()).cloned().unwrap_or_default()
    });
    chosen.collect()
}

fn stage_name(plan: &Plan, item: ItemIndex) -> &str {
    &plan.stages[plan.items[item].stage].name
}

/// Of the stages that reflect one material, those that lead to files; where none does, all.
fn without_steps(plan: &Plan, graph: &Connections, found: Vec<CatalogEntry>) -> Vec<CatalogEntry> {
    let stage = |exhibit: &CatalogEntry| plan.items[exhibit.reflection].stage;
    let materials = found.iter().filter(|exhibit| graph.leads_to_files[stage(exhibit)]);
    let exported = materials.map(|exhibit| (exhibit.environment, exhibit.material)).collect::<BTreeSet<_>>();
    let is_shown = |exhibit: &CatalogEntry| {
        graph.leads_to_files[stage(exhibit)] || !exported.contains(&(exhibit.environment, exhibit.material))
    };
    found.into_iter().filter(is_shown).collect()
}

/// What follows from what.
struct Connections {
    /// For each item, those at whose single ports it arrives.
    consumers: Vec<Vec<ItemIndex>>,
    /// For each stage, whether a stage after it exports it and nothing beside it.
    leads_to_files: Vec<bool>,
}

impl Connections {
    fn of(plan: &Plan) -> Self {
        let mut consumers = vec![Vec::new(); plan.items.len()];
        for item in 0..plan.items.len() {
            single_inputs(plan, item).for_each(|arriving| consumers[arriving].push(item));
        }
        let mut leads_to_files = vec![false; plan.stages.len()];
        for (index, stage) in plan.stages.iter().enumerate().rev() {
            let leads = matches!(stage.product, Product::Files(_)) || leads_to_files[index];
            for (port, from) in stage.inputs.iter().filter(|_| leads) {
                leads_to_files[*from] |= !is_many(stage, port);
            }
        }
        Self { consumers, leads_to_files }
    }

    /// The exhibit of an item that reflects an environment.
    fn exhibit(&self, plan: &Plan, item: ItemIndex) -> Option<CatalogEntry> {
        if ![artifacts::Reflection::TYPE, artifacts::Shrm::TYPE].contains(&artifact(plan, item)?) {
            return None;
        }
        let mut origin = Origin::default();
        origin.follow(plan, item, Rotation::IDENTITY);
        let exports = self.exports(plan, item);
        origin.ancestry.sort_unstable();
        let (environment, turn) = origin.environment?;
        let (lighting, material, ancestry) = (origin.lighting, origin.material, origin.ancestry);
        let sizes =
            sizes(exports.iter().map(|export| plan.stages[plan.items[*export].stage].configured.map_sizes()));
        Some(CatalogEntry {
            reflection: item,
            environment,
            lighting,
            material,
            turn,
            sizes,
            exports,
            ancestry,
        })
    }

    /// The items that export what an item made, as it is or as maps.
    fn exports(&self, plan: &Plan, item: ItemIndex) -> Vec<ItemIndex> {
        let (mut open, mut exports) = (vec![item], BTreeSet::new());
        while let Some(item) = open.pop() {
            for &consumer in &self.consumers[item] {
                match plan.stages[plan.items[consumer].stage].product {
                    Product::Files(_) => _ = exports.insert(consumer),
                    Product::Artifact(_) => open.push(consumer),
                }
            }
        }
        exports.into_iter().collect()
    }
}

fn is_many(stage: &Stage, port: &str) -> bool {
    stage.ports.iter().any(|known| known.name == port && known.many)
}

/// The items that arrive at an item's single ports.
fn single_inputs(plan: &Plan, item: ItemIndex) -> impl Iterator<Item = ItemIndex> {
    let (item, stage) = (&plan.items[item], &plan.stages[plan.items[item].stage]);
    let ports = stage.inputs.iter().zip(&item.inputs).filter(|((port, _), _)| !is_many(stage, port));
    ports.flat_map(|(_, items)| items.iter().copied())
}

/// The type of the artifact that an item makes.
fn artifact(plan: &Plan, item: ItemIndex) -> Option<&'static str> {
    match plan.stages[plan.items[item].stage].product {
        Product::Artifact(name) => Some(name),
        Product::Files(_) => None,
    }
}

/// Where a reflection comes from, as far as it has been followed.
#[derive(Default)]
struct Origin {
    environment: Option<(ItemIndex, Rotation)>,
    lighting: Option<ItemIndex>,
    material: Option<ItemIndex>,
    ancestry: Vec<ItemIndex>,
}

impl Origin {
    /// Follows an item back. `turn` is what is done to the light after it.
    fn follow(&mut self, plan: &Plan, item: ItemIndex, mut turn: Rotation) {
        if self.ancestry.contains(&item) {
            return;
        }
        self.ancestry.push(item);
        match artifact(plan, item) {
            Some(artifacts::Environment::TYPE) if self.environment.is_none() => {
                self.environment = Some((item, turn))
            }
            Some(artifacts::Material::TYPE) if self.material.is_none() => self.material = Some(item),
            Some(artifacts::Lighting::TYPE) => {
                self.lighting = self.lighting.or(Some(item));
                let stage = &plan.stages[plan.items[item].stage];
                turn = turn.after(rotate::turn_of(stage));
            }
            _ => {}
        }
        for input in plan.items[item].inputs.iter().filter_map(|arriving| arriving.first()) {
            self.follow(plan, *input, turn);
        }
    }
}

/// The first sizes that exports fix, and the default for the rest.
fn sizes(exports: impl Iterator<Item = engine::MapSizes> + Clone) -> MapSizes {
    let default = MapSizes::default();
    MapSizes {
        edge: exports.clone().find_map(|sizes| sizes.edge).unwrap_or(default.edge),
        slices: exports.clone().find_map(|sizes| sizes.slices).unwrap_or(default.slices),
    }
}

#[cfg(test)]
mod tests;
