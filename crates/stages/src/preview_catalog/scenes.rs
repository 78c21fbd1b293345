//! Values for pictures, read from the shelf. What was shown last is kept: a window goes back and forth between few, and a
//! renderer knows what it has on its device by the value's place in memory.

use std::sync::Arc;

use engine::{Artifact, Digest, Failure, ItemIndex, Plan, ResultsSnapshot};
use mesh::Mesh;
use preview::{Export, SubjectDetails};
use preview::{Light, Look, MapSizes, Scene};

use super::{CatalogEntry, PreviewCatalog, Shape, artifact};
use crate::artifacts;

/// So many looks are kept, with their maps.
const LOOKS: usize = 4;
/// So many lights.
const LIGHTS: usize = 4;
/// So many meshes.
const MESHES: usize = 4;

/// The looks, lights and meshes that were shown last.
#[derive(Default)]
pub struct SceneCache {
    looks: Recent<LookKey, Look>,
    lights: Recent<LightKey, Light>,
    meshes: Recent<MeshKey, Mesh>,
}

/// What a mesh is.
#[derive(PartialEq)]
enum MeshKey {
    Made(Digest),
    BuiltIn(&'static str),
}

/// What a light is made of: environment, lighting, turn.
type LightKey = (Digest, Option<Digest>, [u64; 9]);
/// What a look is made of: light, reflection, material, sizes.
type LookKey = (LightKey, Digest, Option<Digest>, MapSizes);

impl SceneCache {
    /// An exhibit on a mesh.
    ///
    /// # Errors
    /// Where something that it needs is not on the shelf or cannot be read.
    pub fn scene(
        &mut self,
        showcase: &PreviewCatalog,
        shelf: &ResultsSnapshot,
        exhibit: &CatalogEntry,
        mesh: &str,
    ) -> Result<Scene, Failure> {
        let look = self.look(showcase.plan(), shelf, exhibit)?;
        Ok(Scene::of(self.mesh(showcase, shelf, mesh)?, look))
    }

    /// The look of an exhibit: the same value for as long as nothing that it is made of has changed, and while its reflection
    /// has not followed such a change yet.
    ///
    /// # Errors
    /// As [`SceneCache::scene`].
    pub fn look(
        &mut self,
        plan: &Plan,
        shelf: &ResultsSnapshot,
        exhibit: &CatalogEntry,
    ) -> Result<Arc<Look>, Failure> {
        let light_key = light_key(plan, shelf, exhibit)?;
        let reflection = handle(plan, shelf, exhibit.reflection)?;
        let is_of_it =
            |(_, digest, _, sizes): &LookKey| *digest == reflection.digest() && *sizes == exhibit.sizes;
        if let Some(look) = self.looks.find(is_of_it)
            && behind(plan, shelf, exhibit).next().is_some()
        {
            return Ok(look);
        }
        let material = exhibit.material.map(|item| handle(plan, shelf, item)).transpose()?;
        let key = (
            light_key,
            reflection.digest(),
            material.as_ref().map(|material| material.digest()),
            exhibit.sizes,
        );
        let lights = &mut self.lights;
        self.looks.get(LOOKS, key, || {
            let light = lights.get(LIGHTS, light_key, || light(plan, shelf, exhibit))?;
            let material = material.map(|material| material.get::<artifacts::Material>()).transpose()?;
            let material = material.map(|material| material.0.clone());
            Ok(if artifact(plan, exhibit.reflection) == Some(artifacts::Shrm::TYPE) {
                let map = reflection.get::<artifacts::Shrm>()?.0.clone();
                Look::from_map(light, map, material, exhibit.sizes)
            } else {
                let reflection = reflection.get::<artifacts::Reflection>()?.0.clone();
                Look::new(light, reflection, material, exhibit.sizes)
            })
        })
    }

    /// A mesh by its name in [`PreviewCatalog::meshes`].
    ///
    /// # Errors
    /// Where there is none of that name, it is not on the shelf or cannot be read.
    pub fn mesh(
        &mut self,
        showcase: &PreviewCatalog,
        shelf: &ResultsSnapshot,
        name: &str,
    ) -> Result<Arc<Mesh>, Failure> {
        let missing = || Failure::new(format!("there is no mesh {name:?}"));
        let (_, shape) = showcase.meshes.iter().find(|(known, _)| known == name).ok_or_else(missing)?;
        match *shape {
            Shape::Item(item) => {
                let mesh = handle(showcase.plan(), shelf, item)?;
                self.meshes.get(MESHES, MeshKey::Made(mesh.digest()), || {
                    Ok(mesh.get::<artifacts::Mesh>()?.0.clone())
                })
            }
            Shape::BuiltIn(name) => {
                self.meshes.get(MESHES, MeshKey::BuiltIn(name), || mesh::shape(name).ok_or_else(missing))
            }
        }
    }
}

impl PreviewCatalog {
    /// What the inspector tells of an exhibit: the sizes of what was exported, what its stages warned of and noted.
    pub fn facts(&self, shelf: &ResultsSnapshot, exhibit: &CatalogEntry) -> SubjectDetails {
        let plan = self.plan();
        let exports = exhibit.exports.iter().filter_map(|&item| {
            let stage = &plan.stages[plan.items[item].stage];
            let parameters = stage.configured.canonical();
            let format =
                parameters["format"].as_str().map_or_else(String::new, |format| format!(", {format}"));
            let sizes = shelf.file_sizes(item);
            let name = format!("{}{format}", stage.kind.name());
            (!sizes.is_empty()).then(|| Export { name, bytes: sizes.iter().sum() })
        });
        let told = exhibit.ancestry.iter().flat_map(|&item| {
            let stage = super::stage_name(plan, item);
            let warnings =
                shelf.warnings(item).iter().map(move |warning| format!("{stage}: warning: {warning}"));
            warnings.chain(shelf.notes(item).iter().map(move |note| format!("{stage}: {note}")))
        });
        let behind = behind(plan, shelf, exhibit).map(|item| {
            let stage = super::stage_name(plan, item);
            format!("{stage}: this is older than what it is made of; what is shown may be of before or after")
        });
        SubjectDetails { exports: exports.collect(), notes: behind.chain(told).collect() }
    }
}

/// What is on the shelf of an item.
fn handle(plan: &Plan, shelf: &ResultsSnapshot, item: ItemIndex) -> Result<Arc<engine::Handle>, Failure> {
    shelf.get(item).ok_or_else(|| {
        let (stage, key) = (super::stage_name(plan, item), &plan.items[item].key);
        Failure::new(format!("{stage} [{key}] has not been made yet, or its result is gone"))
            .help("build the manifest; where that fails, mend what it tells")
    })
}

/// The items of an exhibit that have not followed a change of what they are made of.
fn behind(plan: &Plan, shelf: &ResultsSnapshot, exhibit: &CatalogEntry) -> impl Iterator<Item = ItemIndex> {
    exhibit.ancestry.iter().copied().filter(|item| !shelf.is_consistent(plan, *item))
}

fn light_key(plan: &Plan, shelf: &ResultsSnapshot, exhibit: &CatalogEntry) -> Result<LightKey, Failure> {
    let environment = handle(plan, shelf, exhibit.environment)?.digest();
    let lighting = exhibit.lighting.map(|item| handle(plan, shelf, item)).transpose()?;
    let turn = exhibit.turn.matrix().to_cols_array().map(f64::to_bits);
    Ok((environment, lighting.map(|lighting| lighting.digest()), turn))
}

fn light(plan: &Plan, shelf: &ResultsSnapshot, exhibit: &CatalogEntry) -> Result<Light, Failure> {
    let environment = handle(plan, shelf, exhibit.environment)?.get::<artifacts::Environment>()?;
    let is_turned = exhibit.turn.matrix() != sphere::Rotation::IDENTITY.matrix();
    let environment = if is_turned { environment.0.rotated(exhibit.turn) } else { environment.0.clone() };
    let lighting = exhibit.lighting.map(|item| handle(plan, shelf, item)?.get::<artifacts::Lighting>());
    Ok(Light::new(environment, lighting.transpose()?.map(|lighting| lighting.0.clone())))
}

/// The values that were asked for last, the latest first.
struct Recent<K, V>(Vec<(K, Arc<V>)>);

impl<K, V> Default for Recent<K, V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<K: PartialEq, V> Recent<K, V> {
    /// The latest value of such a key.
    fn find(&self, is_it: impl Fn(&K) -> bool) -> Option<Arc<V>> {
        self.0.iter().find(|(key, _)| is_it(key)).map(|(_, value)| Arc::clone(value))
    }

    /// The value of a key, made where it is not there; at most so many are kept.
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
