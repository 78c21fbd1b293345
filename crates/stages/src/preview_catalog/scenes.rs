//! Scenes, read from the results of the last build. The latest values are kept: a window switches between a
//! few of them, and a renderer recognises what is on its device by the value's address.

use std::sync::Arc;

use engine::{Artifact, Digest, Failure, ItemIndex, Plan, ResultsSnapshot};
use mesh::Mesh;
use preview::{Export, SubjectDetails};
use preview::{Light, Look, MapSizes, Scene};

use super::{CatalogEntry, MeshSource, PreviewCatalog, artifact};
use crate::artifacts;

/// How many looks are kept, with their maps.
const LOOKS: usize = 4;
/// How many lights are kept.
const LIGHTS: usize = 4;
/// How many meshes are kept.
const MESHES: usize = 4;

/// The looks, lights and meshes that were shown last.
#[derive(Default)]
pub struct SceneCache {
    looks: Recent<LookKey, Look>,
    lights: Recent<LightKey, Light>,
    meshes: Recent<MeshKey, Mesh>,
}

/// What a mesh is made from.
#[derive(PartialEq)]
enum MeshKey {
    Made(Digest),
    BuiltIn(&'static str),
}

/// What a light is made from: environment, lighting, turn.
type LightKey = (Digest, Option<Digest>, [u64; 9]);
/// What a look is made from: light, reflection, material, sizes.
type LookKey = (LightKey, Digest, Option<Digest>, MapSizes);

impl SceneCache {
    /// An entry on a mesh.
    ///
    /// # Errors
    /// If something that it needs has not been built or cannot be read.
    pub fn scene(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
        mesh: &str,
    ) -> Result<Scene, Failure> {
        let look = self.look(catalog.plan(), results, entry)?;
        Ok(Scene::of(self.mesh(catalog, results, mesh)?, look))
    }

    /// The look of an entry. It is the same value as long as nothing that it is made from has changed, or its
    /// reflection has not been rebuilt since such a change.
    ///
    /// # Errors
    /// As [`SceneCache::scene`].
    pub fn look(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
    ) -> Result<Arc<Look>, Failure> {
        let light_key = light_key(plan, results, entry)?;
        let reflection = handle(plan, results, entry.reflection)?;
        let is_same =
            |(_, digest, _, sizes): &LookKey| *digest == reflection.digest() && *sizes == entry.sizes;
        if let Some(look) = self.looks.find(is_same)
            && outdated(plan, results, entry).next().is_some()
        {
            return Ok(look);
        }
        let material = entry.material.map(|item| handle(plan, results, item)).transpose()?;
        let key = (
            light_key,
            reflection.digest(),
            material.as_ref().map(|material| material.digest()),
            entry.sizes,
        );
        let lights = &mut self.lights;
        self.looks.get(LOOKS, key, || {
            let light = lights.get(LIGHTS, light_key, || light(plan, results, entry))?;
            let material = material.map(|material| material.get::<artifacts::Material>()).transpose()?;
            let material = material.map(|material| material.0.clone());
            Ok(if artifact(plan, entry.reflection) == Some(artifacts::Shrm::TYPE) {
                let map = reflection.get::<artifacts::Shrm>()?.0.clone();
                Look::from_map(light, map, material, entry.sizes)
            } else {
                let reflection = reflection.get::<artifacts::Reflection>()?.0.clone();
                Look::new(light, reflection, material, entry.sizes)
            })
        })
    }

    /// A mesh by its name in [`PreviewCatalog::meshes`].
    ///
    /// # Errors
    /// If there is none of that name, it has not been built or cannot be read.
    pub fn mesh(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        name: &str,
    ) -> Result<Arc<Mesh>, Failure> {
        let missing = || Failure::new(format!("there is no mesh {name:?}"));
        let (_, source) = catalog.meshes.iter().find(|(known, _)| known == name).ok_or_else(missing)?;
        match *source {
            MeshSource::Item(item) => {
                let mesh = handle(catalog.plan(), results, item)?;
                self.meshes.get(MESHES, MeshKey::Made(mesh.digest()), || {
                    Ok(mesh.get::<artifacts::Mesh>()?.0.clone())
                })
            }
            MeshSource::BuiltIn(name) => {
                self.meshes.get(MESHES, MeshKey::BuiltIn(name), || mesh::shape(name).ok_or_else(missing))
            }
        }
    }
}

impl PreviewCatalog {
    /// What the inspector shows about an entry: the sizes of its exported files, and the warnings and notes
    /// of its stages.
    pub fn facts(&self, results: &ResultsSnapshot, entry: &CatalogEntry) -> SubjectDetails {
        let plan = self.plan();
        let exports = entry.exports.iter().filter_map(|&item| {
            let stage = &plan.stages[plan.items[item].stage];
            let parameters = stage.configured.canonical();
            let format =
                parameters["format"].as_str().map_or_else(String::new, |format| format!(", {format}"));
            let sizes = results.file_sizes(item);
            let name = format!("{}{format}", stage.kind.name());
            (!sizes.is_empty()).then(|| Export { name, bytes: sizes.iter().sum() })
        });
        let messages = entry.ancestry.iter().flat_map(|&item| {
            let stage = super::stage_name(plan, item);
            let warnings =
                results.warnings(item).iter().map(move |warning| format!("{stage}: warning: {warning}"));
            warnings.chain(results.notes(item).iter().map(move |note| format!("{stage}: {note}")))
        });
        let outdated = outdated(plan, results, entry).map(|item| {
            let stage = super::stage_name(plan, item);
            format!("{stage}: this is older than its inputs; the picture may mix old and new results")
        });
        SubjectDetails { exports: exports.collect(), notes: outdated.chain(messages).collect() }
    }
}

/// What the last build made of an item.
fn handle(plan: &Plan, results: &ResultsSnapshot, item: ItemIndex) -> Result<Arc<engine::Handle>, Failure> {
    results.get(item).ok_or_else(|| {
        let (stage, key) = (super::stage_name(plan, item), &plan.items[item].key);
        Failure::new(format!("{stage} [{key}] has not been built yet, or its result was removed"))
            .help("run `specula build` and fix what it reports")
    })
}

/// The items of an entry that are older than their inputs.
fn outdated(plan: &Plan, results: &ResultsSnapshot, entry: &CatalogEntry) -> impl Iterator<Item = ItemIndex> {
    entry.ancestry.iter().copied().filter(|item| !results.is_consistent(plan, *item))
}

fn light_key(plan: &Plan, results: &ResultsSnapshot, entry: &CatalogEntry) -> Result<LightKey, Failure> {
    let environment = handle(plan, results, entry.environment)?.digest();
    let lighting = entry.lighting.map(|item| handle(plan, results, item)).transpose()?;
    let turn = entry.turn.matrix().to_cols_array().map(f64::to_bits);
    Ok((environment, lighting.map(|lighting| lighting.digest()), turn))
}

fn light(plan: &Plan, results: &ResultsSnapshot, entry: &CatalogEntry) -> Result<Light, Failure> {
    let environment = handle(plan, results, entry.environment)?.get::<artifacts::Environment>()?;
    let is_turned = entry.turn.matrix() != sphere::Rotation::IDENTITY.matrix();
    let environment = if is_turned { environment.0.rotated(entry.turn) } else { environment.0.clone() };
    let lighting = entry.lighting.map(|item| handle(plan, results, item)?.get::<artifacts::Lighting>());
    Ok(Light::new(environment, lighting.transpose()?.map(|lighting| lighting.0.whole())))
}

/// The values that were used last, the latest first.
struct Recent<K, V>(Vec<(K, Arc<V>)>);

impl<K, V> Default for Recent<K, V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: PartialEq, V> Recent<K, V> {
    /// The latest value of such a key.
    fn find(&self, matches: impl Fn(&K) -> bool) -> Option<Arc<V>> {
        self.0.iter().find(|(key, _)| matches(key)).map(|(_, value)| Arc::clone(value))
    }

    /// The value of a key, made if it is not there; at most `most` values are kept.
    fn get(
        &mut self,
        most: usize,
        key: K,
        make: impl FnOnce() -> Result<V, Failure>,
    ) -> Result<Arc<V>, Failure> {
        let found = self.0.iter().position(|(known, _)| *known == key);
        let entry = match found {
            Some(place) => self.0.remove(place),
            None => (key, Arc::new(make()?)),
        };
        self.0.insert(0, entry);
        self.0.truncate(most);
        Ok(Arc::clone(&self.0[0].1))
    }
}
