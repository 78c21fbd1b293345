//! What a preview of a graph can show: every material under every light that the graph reflects, on every
//! mesh.
//!
//! Entries are found by what the stages make, not by what the stages are called. Each item of a stage that
//! makes a `reflection` or an `shrm` is an entry. Upstream of the item, the nearest environment is the light
//! that it reflects, and the nearest material is what reflects it. If the lighting was turned on the way, the
//! environment is turned too. Light that no environment made, such as that of `circular-lights`, is its own
//! environment.
//!
//! A `brdf-table` of an entry's material belongs to the entry. Each item of `shade-vertices` makes an entry
//! of its table and its lighting, unless the material is reflected under that light anyway. A mesh has the
//! `transfer` that was made of it, and the `vertex-blend`.
//!
//! The `scale-space` of an entry's environment and the `taps` of its material belong to the entry, if the
//! graph neither turns the light nor adds to it. Each item that takes one of both, such as those of
//! `export-taps`, makes an entry of their environment and their material, unless there is one anyway.
//!
//! In a graph without a material, white metal of a few roughnesses shows the light. Each export whose file a
//! surface can be lit by is an entry: one for an engine, or a cube with levels. An environment that has no
//! such export, and that no other environment is made of, is an entry by itself.
//!
//! A mesh of a glTF file has materials of its own. If the material of an entry is one of them, each triangle
//! is shown with the entry of its own material under that light, as far as the graph has it
//! (`own_materials`).
//!
//! An entry has two names. The name of its light is that of the environment's item. The name of its material
//! is the item's own key without the environment's: `gold`. Ambiguous names carry their stages: `gold
//! (matte)`. If several stages reflect the same material and some of them are exported, the others are
//! intermediate steps and are not shown.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use engine::{Artifact, ItemIndex, Kind, Plan, Product, Stage};
use preview::Catalog;
use preview::MapSizes;
use sphere::Rotation;

use crate::material::ImportMaterial;
use crate::values::{ExportedMaps, artifacts};

pub use light_alone::{LightAlone, ROUGHNESSES};
use names::{Label, MaterialKey, distinct, stage_name};
pub use origin::CompactMapItems;
use origin::{EntryParts, Origin, artifact, is_many, single_inputs};
use own_materials::OwnMaterials;
pub use scenes::SceneCache;

mod facts;
mod last_build;
mod light_alone;
mod light_entries;
mod light_files;
mod mesh_part;
mod names;
mod origin;
mod own_entries;
mod own_materials;
mod recent;
mod scenes;

/// The materials, lights and meshes of a graph that a preview can show.
pub struct PreviewCatalog {
    plan: Plan,
    environments: Vec<String>,
    materials: Vec<String>,
    /// The entries by the positions of their names.
    entries: BTreeMap<(usize, usize), CatalogEntry>,
    meshes: Vec<(String, MeshSource)>,
    /// The transfer of meshes, by the item that makes the mesh.
    transfers: BTreeMap<ItemIndex, ItemIndex>,
    /// The places of several materials of a table on meshes, by the item that makes the mesh.
    blends: BTreeMap<ItemIndex, ItemIndex>,
    own_materials: OwnMaterials,
}

/// A material under a light, by the items that made it.
#[derive(Clone, Debug)]
pub struct CatalogEntry {
    /// The item that makes a `reflection` or an `shrm`; `None` if there is only a table, a compact map or
    /// light.
    pub reflection: Option<ItemIndex>,
    /// The item that makes a `brdf-table` of the material.
    pub table: Option<ItemIndex>,
    /// The items that make the compact map of the light and the material.
    pub compact_map: Option<CompactMapItems>,
    /// What lights white metal, in an entry without a material.
    pub light_alone: Option<LightAlone>,
    /// The item that makes the light: an environment, or lighting that none was needed for.
    pub environment: ItemIndex,
    /// Lights without an environment that were added to it, and how the graph turns each.
    pub added: Vec<(ItemIndex, Rotation)>,
    /// The light's coefficients, before they are cut to the material's degree.
    pub lighting: Option<ItemIndex>,
    /// The light field that lights the table in place of the environment, which is that of its first point.
    pub light_field: Option<ItemIndex>,
    /// The item that makes the material.
    pub material: Option<ItemIndex>,
    /// The turn that the graph gives to the light before it is reflected.
    pub turn: Rotation,
    /// The sizes of the maps that are exported of the entry.
    pub sizes: MapSizes,
    /// Whether the entry's spherical harmonic reflection maps are exported with the lamps in them, and none
    /// without.
    pub holds_lamps: bool,
    /// Whether the entry's maps are exported as one for both parts of the material, and none as one of each.
    pub joins_parts: bool,
    /// The items that export the entry and nothing else, in the manifest's order.
    pub exports: Vec<ItemIndex>,
    /// The items that the entry was made of, and the item itself, each after those that it needs.
    pub ancestry: Vec<ItemIndex>,
    /// The items of the ancestry that make the entry's maps and its table, and that neither the light nor the
    /// material needs.
    pub maps: Vec<ItemIndex>,
}

impl CatalogEntry {
    /// The entry of a light that nothing is known to reflect.
    fn of_light(environment: ItemIndex) -> Self {
        Self {
            reflection: None,
            table: None,
            compact_map: None,
            light_alone: None,
            environment,
            added: Vec::new(),
            lighting: None,
            light_field: None,
            material: None,
            turn: Rotation::IDENTITY,
            sizes: MapSizes::default(),
            holds_lamps: false,
            joins_parts: false,
            exports: Vec::new(),
            ancestry: Vec::new(),
            maps: Vec::new(),
        }
    }

    fn key(&self, plan: &Plan) -> MaterialKey {
        if let Some(LightAlone { export }) = self.light_alone {
            return MaterialKey::of_light(plan, export.unwrap_or(self.environment), self.environment);
        }
        // An entry has one of the three.
        let taps = self.compact_map.map(|map| map.taps);
        let made = self.reflection.or(self.table).or(taps).unwrap_or(self.environment);
        MaterialKey::of(plan, made, self.environment, self.material)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MeshSource {
    /// An item makes it.
    Item(ItemIndex),
    /// A shape of [`mesh::SHAPES`].
    BuiltIn(&'static str),
}

/// Why a subject cannot be shown: there is nothing of that name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// The kind of subject that was looked for: `material`.
    pub what: &'static str,
    /// The name that was looked for.
    pub name: String,
    /// The names that exist.
    pub known: Vec<String>,
}

impl PreviewCatalog {
    /// The catalog of a plan.
    pub fn of(plan: Plan) -> Self {
        Self::among(plan, &[])
    }

    /// The catalog of these stages of a plan and all that they need; no names mean all stages.
    pub fn among(plan: Plan, built: &[String]) -> Self {
        let graph = Connections::of(&plan);
        let built = with_dependencies(&plan, built);
        let items = (0..plan.items.len()).filter(|item| built[plan.items[*item].stage]);
        let parts = EntryParts::of(&plan, items.clone());
        let found = items.clone().filter_map(|item| graph.entry(&plan, item, &parts)).collect();
        let mut found = without_steps(&plan, &graph, found);
        let pair = |entry: &CatalogEntry| (entry.environment, entry.material);
        let pairs = found.iter().map(pair).collect::<BTreeSet<_>>();
        let compact = items.clone().filter_map(|item| graph.compact_entry(&plan, item, &parts));
        found.extend(compact.filter(|entry| !pairs.contains(&pair(entry))));
        if found.is_empty() {
            found = graph.light_entries(&plan, items.clone());
        }
        let lights = found.iter().map(|entry| entry.environment).collect::<BTreeSet<_>>();
        let lights = lights.into_iter().collect::<Vec<_>>();
        let labels = lights.iter().map(|item| Label::of(&plan, *item));
        let environments = distinct(&labels.collect::<Vec<_>>());
        // The rest of a key distinguishes the materials of a stage.
        let keys = found.iter().map(|entry| entry.key(&plan)).collect::<Vec<_>>();
        let each = keys.iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>();
        let materials = distinct(&each.iter().map(|key| key.label(&plan)).collect::<Vec<_>>());
        let position = |entry: &CatalogEntry, key: &MaterialKey| {
            let environment = lights.binary_search(&entry.environment).unwrap_or_default();
            (environment, each.binary_search(&key).unwrap_or_default())
        };
        let positions = found.iter().zip(&keys).map(|(entry, key)| position(entry, key));
        let entries = positions.collect::<Vec<_>>().into_iter().zip(found).collect();
        let transfers = of_meshes(&plan, items.clone(), artifacts::Transfer::TYPE);
        let blends = of_meshes(&plan, items.clone(), artifacts::VertexBlend::TYPE);
        let own_materials = OwnMaterials::of(&plan, items.clone());
        let meshes = meshes(&plan, items);
        Self { plan, environments, materials, entries, meshes, transfers, blends, own_materials }
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Whether there is nothing to show: no stage makes a reflection of an environment, or shades vertices,
    /// and there is a material or no environment.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The names of all that can be shown, and which of them go together.
    pub fn catalog(&self) -> Catalog {
        Catalog {
            environments: self.environments.clone(),
            materials: self.materials.clone(),
            meshes: self.meshes(),
            pairs: self.entries.keys().copied().collect(),
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

    /// A material under an environment; `None` if the graph does not combine the two.
    ///
    /// # Errors
    /// If one of them is not known at all.
    pub fn entry(&self, environment: &str, material: &str) -> Result<Option<&CatalogEntry>, Unknown> {
        let environment = position("environment", &self.environments, environment)?;
        let material = position("material", &self.materials, material)?;
        Ok(self.entries.get(&(environment, material)))
    }

    /// All that can be shown, each with the name of its environment.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&str, &CatalogEntry)> {
        self.entries.iter().map(|((environment, _), entry)| (self.environments[*environment].as_str(), entry))
    }

    /// The first entry of a material.
    pub fn with_material(&self, material: &str) -> Option<&CatalogEntry> {
        let is_of = |(_, of): &(usize, usize)| self.materials[*of] == material;
        self.entries.iter().find(|(pair, _)| is_of(pair)).map(|(_, entry)| entry)
    }

    /// Checks that an environment is known.
    ///
    /// # Errors
    /// If it is not.
    pub fn check_environment(&self, name: &str) -> Result<(), Unknown> {
        position("environment", &self.environments, name).map(|_| ())
    }

    /// Checks that a material is known.
    ///
    /// # Errors
    /// If it is not.
    pub fn check_material(&self, name: &str) -> Result<(), Unknown> {
        position("material", &self.materials, name).map(|_| ())
    }

    /// Checks that a mesh is known.
    ///
    /// # Errors
    /// If it is not.
    pub fn check_mesh(&self, name: &str) -> Result<(), Unknown> {
        position("mesh", &self.meshes(), name).map(|_| ())
    }

    /// The items that make an entry and a mesh with its own materials, and those that they need.
    pub fn items(&self, entry: &CatalogEntry, mesh: &str) -> Vec<ItemIndex> {
        let others = self.own_entries(entry, mesh).into_iter().flat_map(|(_, other)| &other.ancestry);
        let items = entry.ancestry.iter().chain(others).copied().chain(self.mesh_items(mesh));
        items.collect::<BTreeSet<_>>().into_iter().collect()
    }

    /// The items that a scene is read from: the environment, the material, the mesh with its transfer and its
    /// blend, the table, the compact map and the reflection, or the export of a light alone; and those of the
    /// mesh's own materials.
    pub fn parts(&self, entry: &CatalogEntry, mesh: &str) -> Vec<ItemIndex> {
        let others = self.own_entries(entry, mesh).into_iter();
        let others = others.flat_map(|(_, other)| self.parts_of(other, mesh)).collect::<Vec<_>>();
        let mut parts = self.parts_of(entry, mesh);
        others.into_iter().for_each(|item| {
            if !parts.contains(&item) {
                parts.push(item);
            }
        });
        parts
    }

    /// The items that a scene of one material is read from.
    fn parts_of(&self, entry: &CatalogEntry, mesh: &str) -> Vec<ItemIndex> {
        let added = entry.added.iter().map(|(item, _)| *item);
        let sources = [Some(entry.environment), entry.material].into_iter().flatten().chain(added);
        let sources = sources.chain(entry.light_alone.and_then(|light| light.export));
        let compact_map = entry.compact_map.map(|map| [map.scales, map.taps]);
        let made = entry.table.into_iter().chain(compact_map.into_iter().flatten()).chain(entry.reflection);
        sources.chain(self.mesh_items(mesh)).chain(made).collect()
    }

    /// The item that makes a mesh, and those that make its transfer and its blend.
    fn mesh_items(&self, mesh: &str) -> impl Iterator<Item = ItemIndex> {
        self.mesh_item(mesh).into_iter().chain(self.transfer_item(mesh)).chain(self.blend_item(mesh))
    }

    /// The item that says which material of a table is where on a mesh.
    pub fn blend_item(&self, mesh: &str) -> Option<ItemIndex> {
        self.blends.get(&self.mesh_item(mesh)?).copied()
    }

    /// The item that makes the transfer of a mesh.
    pub fn transfer_item(&self, mesh: &str) -> Option<ItemIndex> {
        self.transfers.get(&self.mesh_item(mesh)?).copied()
    }

    /// The file that the material of an entry is read from.
    ///
    /// # Errors
    /// Why there is none: one line.
    pub fn material_file(&self, entry: &CatalogEntry) -> Result<&Path, String> {
        let why = if entry.light_alone.is_some() {
            "white metal shows the light: this pipeline has no material to edit"
        } else {
            "the reflection does not have a material of this pipeline"
        };
        let item = entry.material.ok_or(why)?;
        let stage = &self.plan.stages[self.plan.items[item].stage];
        let source = self.plan.items[item].source.as_deref();
        let source = source.filter(|_| stage.kind.name() == ImportMaterial::NAME);
        source.ok_or_else(|| format!("{} makes this material, not a material file", stage.name))
    }

    /// The item that makes a mesh; `None` if the mesh is built in.
    pub fn mesh_item(&self, mesh: &str) -> Option<ItemIndex> {
        match self.meshes.iter().find(|(name, _)| name == mesh)?.1 {
            MeshSource::Item(item) => Some(item),
            MeshSource::BuiltIn(_) => None,
        }
    }

    /// The stages of these items, for a scene of an entry on a mesh.
    pub fn stages(&self, entry: &CatalogEntry, mesh: &str) -> BTreeSet<&str> {
        self.items(entry, mesh).into_iter().map(|item| stage_name(&self.plan, item)).collect()
    }
}

/// For each stage, whether it is named or needed by one that is named; no names mean all stages.
fn with_dependencies(plan: &Plan, names: &[String]) -> Vec<bool> {
    let is_named = |stage: &Stage| names.is_empty() || names.contains(&stage.name);
    let mut chosen = plan.stages.iter().map(is_named).collect::<Vec<_>>();
    // Each stage comes after those that it needs.
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

/// The meshes among some items, then the built-in ones.
fn meshes(plan: &Plan, items: impl Iterator<Item = ItemIndex>) -> Vec<(String, MeshSource)> {
    let items = items.filter(|item| artifact(plan, *item) == Some(artifacts::Mesh::TYPE));
    let made = items.map(|item| (Label::of(plan, item), MeshSource::Item(item)));
    let built_in = |name: &'static str| Label { name: name.into(), stages: vec!["built-in"] };
    let built_in = mesh::SHAPES.into_iter().map(|name| (built_in(name), MeshSource::BuiltIn(name)));
    let (labels, sources): (Vec<_>, Vec<_>) = made.chain(built_in).unzip();
    distinct(&labels).into_iter().zip(sources).collect()
}

/// Keeps of the stages that reflect one material those that lead to files; if none does, all; and if no stage
/// reflects it, its table.
fn without_steps(plan: &Plan, graph: &Connections, found: Vec<CatalogEntry>) -> Vec<CatalogEntry> {
    let leads_to_files =
        |entry: &CatalogEntry| entry.reflection.map(|item| graph.leads_to_files[plan.items[item].stage]);
    let pairs = |leads: fn(bool) -> bool| {
        let pairs = found.iter().filter(|entry| leads_to_files(entry).is_some_and(leads));
        pairs.map(|entry| (entry.environment, entry.material)).collect::<BTreeSet<_>>()
    };
    let (exported, reflected) = (pairs(|leads| leads), pairs(|_| true));
    let is_shown = |entry: &CatalogEntry| {
        let pair = (entry.environment, entry.material);
        match leads_to_files(entry) {
            Some(leads) => leads || !exported.contains(&pair),
            None => !reflected.contains(&pair),
        }
    };
    found.iter().filter(|entry| is_shown(entry)).cloned().collect()
}

/// The first artifact of a type that is made of each mesh.
fn of_meshes(
    plan: &Plan,
    items: impl Iterator<Item = ItemIndex>,
    made: &'static str,
) -> BTreeMap<ItemIndex, ItemIndex> {
    let mut found = BTreeMap::new();
    for item in items.filter(|item| artifact(plan, *item) == Some(made)) {
        let mesh =
            single_inputs(plan, item).find(|input| artifact(plan, *input) == Some(artifacts::Mesh::TYPE));
        if let Some(mesh) = mesh {
            found.entry(mesh).or_insert(item);
        }
    }
    found
}

/// Which items are made from which.
struct Connections {
    /// For each item, the items that receive it at a port for one item.
    consumers: Vec<Vec<ItemIndex>>,
    /// For each stage, whether a later stage exports its items, each by itself.
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

    /// The entry of an item that reflects a light, or shades vertices under it.
    fn entry(&self, plan: &Plan, item: ItemIndex, parts: &EntryParts) -> Option<CatalogEntry> {
        let mut origin = Origin::default();
        let reflection = match artifact(plan, item)? {
            artifacts::Reflection::TYPE | artifacts::Shrm::TYPE => {
                origin.follow(plan, item, Rotation::IDENTITY);
                Some(item)
            }
            artifacts::VertexRadiance::TYPE => {
                // Any mesh can be shown, so its own are no part of the entry.
                let is_part = |item: &ItemIndex| {
                    use artifacts::{BrdfTable, LightField, Lighting};
                    let parts = [BrdfTable::TYPE, Lighting::TYPE, LightField::TYPE];
                    artifact(plan, *item).is_some_and(|made| parts.contains(&made))
                };
                single_inputs(plan, item)
                    .filter(is_part)
                    .for_each(|part| origin.follow(plan, part, Rotation::IDENTITY));
                None
            }
            _ => return None,
        };
        self.with_parts(plan, item, origin, reflection, parts)
            .filter(|entry| entry.reflection.is_some() || entry.table.is_some())
    }

    /// The entry of an item that takes a scale space and taps.
    fn compact_entry(&self, plan: &Plan, item: ItemIndex, parts: &EntryParts) -> Option<CatalogEntry> {
        let input = |made: &str| single_inputs(plan, item).find(|input| artifact(plan, *input) == Some(made));
        let compact_map = CompactMapItems {
            scales: input(artifacts::ScaleSpace::TYPE)?,
            taps: input(artifacts::Taps::TYPE)?,
        };
        let mut origin = Origin { compact_map: Some(compact_map), ..Origin::default() };
        for part in [compact_map.scales, compact_map.taps] {
            origin.follow(plan, part, Rotation::IDENTITY);
        }
        self.with_parts(plan, item, origin, None, parts)
    }

    /// The entry of an item with this origin, with the table and the compact map of its material and its
    /// light.
    fn with_parts(
        &self,
        plan: &Plan,
        item: ItemIndex,
        mut origin: Origin,
        reflection: Option<ItemIndex>,
        parts: &EntryParts,
    ) -> Option<CatalogEntry> {
        let mut disks = std::mem::take(&mut origin.disks);
        let (environment, turn) = match origin.environment {
            Some(environment) => environment,
            // All disks and their turns are in the lighting that arrives.
            None => (disks.drain(..).next()?.0, Rotation::IDENTITY),
        };
        let table =
            origin.table.or(origin.material.and_then(|material| parts.tables.get(&material).copied()));
        let is_plain = disks.is_empty() && turn.matrix() == Rotation::IDENTITY.matrix();
        let compact_map = parts.compact_map(environment, origin.material).filter(|_| is_plain);
        let compact_map = origin.compact_map.or(compact_map);
        let compact_items = compact_map.map(|map| [map.scales, map.taps]);
        for part in table.into_iter().chain(compact_items.into_iter().flatten()) {
            origin.follow(plan, part, Rotation::IDENTITY);
        }
        let mut exports = self.exports(plan, item);
        exports.extend(compact_map.into_iter().flat_map(|map| self.compact_exports(plan, map)));
        exports.sort_unstable();
        exports.dedup();
        let ancestry = origin.all();
        let (lighting, material, light_field) = (origin.lighting, origin.material, origin.light_field);
        let mut sources = Origin::default();
        for source in [Some(environment), material].into_iter().flatten() {
            sources.follow(plan, source, Rotation::IDENTITY);
        }
        let maps = ancestry.iter().copied().filter(|item| !sources.ancestry.contains(item)).collect();
        let exported = exports.iter().map(|export| ExportedMaps::of(&plan.stages[plan.items[*export].stage]));
        let all_say = |what: fn(ExportedMaps) -> Option<bool>| {
            let said: Vec<bool> = exported.clone().filter_map(what).collect();
            !said.is_empty() && said.into_iter().all(|is_so| is_so)
        };
        let [holds_lamps, joins_parts] = [all_say(|maps| maps.holds_lamps), all_say(|maps| maps.joins_parts)];
        let sizes = sizes(exported);
        Some(CatalogEntry {
            reflection,
            table,
            compact_map,
            added: disks,
            lighting,
            light_field,
            material,
            turn,
            sizes,
            holds_lamps,
            joins_parts,
            exports,
            ancestry,
            maps,
            ..CatalogEntry::of_light(environment)
        })
    }

    /// The items that export a compact map.
    fn compact_exports(&self, plan: &Plan, map: CompactMapItems) -> impl Iterator<Item = ItemIndex> {
        let is_export = move |item: &ItemIndex| {
            matches!(plan.stages[plan.items[*item].stage].product, Product::Files(_))
                && self.consumers[map.taps].contains(item)
        };
        self.consumers[map.scales].iter().copied().filter(is_export)
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

/// The first sizes that exports fix, and the default for the rest.
fn sizes(exports: impl Iterator<Item = ExportedMaps> + Clone) -> MapSizes {
    let default = MapSizes::default();
    MapSizes {
        edge: exports.clone().find_map(|maps| maps.edge).unwrap_or(default.edge),
        slices: exports.clone().find_map(|maps| maps.slices).unwrap_or(default.slices),
    }
}
