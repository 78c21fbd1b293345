//! Scenes, read from the results of the last build. The latest values are kept: a window switches between a
//! few of them, and a renderer recognises what is on its device by the value's address.

use std::sync::Arc;

use brdf::{BrdfTable, Material};
use engine::{Artifact, Digest, ExportedFiles, Failure, ItemIndex, Plan, Reporter, ResultsSnapshot};
use mesh::{MaterialRange, Mesh};
use preview::{CompactMap, Light, Look, MapSizes, Scene, ScenePart};
use sh::{Degree, Expansion, Lighting, unstopped};
use shrm::Reflection;
use taps::ScaleSpace;
use transfer::{Frames, Transfer};

use super::last_build::{handle, handle_of, is_current};
use super::light_alone::{LightAlone, ROUGHNESSES};
use super::light_files::{LightFiles, LitBy, lit_by};
use super::mesh_part::MeshPart;
use super::recent::Recent;
use super::{CatalogEntry, CompactMapItems, MeshSource, PreviewCatalog, artifact};
use crate::map::ShrmSettings;
use crate::values::artifacts;

/// The number of looks that are kept, with their maps.
const LOOKS: usize = 4;
/// The number of lights that are kept.
const LIGHTS: usize = 4;
/// The number of meshes that are kept.
const MESHES: usize = 4;
/// The number of tables, transfers and blends that are kept.
const TABLES: usize = 2;
/// The number of meshes whose parts by materials are kept.
const DRESSED: usize = 2;

/// The looks, lights and meshes that were shown last.
#[derive(Default)]
pub struct SceneCache {
    looks: Recent<LookKey, Look>,
    white_metals: Recent<(LightKey, Option<LightFiles>), Vec<Arc<Look>>>,
    lights: Recent<LightKey, Light>,
    meshes: Recent<MeshKey, Mesh>,
    tables: Recent<Digest, BrdfTable>,
    scale_spaces: Recent<Digest, ScaleSpace>,
    compact_maps: Recent<[Digest; 2], CompactMap>,
    transfers: Recent<Digest, Vec<Transfer>>,
    blends: Recent<Digest, Vec<[f32; 2]>>,
    parts: Recent<PartsKey, Vec<MeshPart>>,
    /// The number of further looks, tables and compact maps that the shown mesh has: those of its own
    /// materials.
    more: usize,
    /// The look of the material that was edited last.
    edited: Option<(LightKey, Material, Arc<Look>)>,
}

/// The source that a mesh is made from.
#[derive(PartialEq)]
enum MeshKey {
    Made(Digest),
    BuiltIn(&'static str),
}

/// The inputs that a light is made from: environment, lighting, turn, added lights.
type LightKey = (Digest, Option<Digest>, [u64; 9], Vec<Digest>);
/// The inputs that a look is made from: light, reflection, material, table and light field, scale space and
/// taps, sizes, whether its maps hold the lamps and both parts, and it has the material's
/// texture, and the parameters of the stage that exports its SHRM.
type LookKey = (
    LightKey,
    Option<Digest>,
    Option<Digest>,
    [Option<Digest>; 2],
    Option<[Digest; 2]>,
    (MapSizes, [bool; 3], Option<Digest>),
);

/// What the parts of a mesh are made from: the mesh, its transfer, its blend, and the part of each of its
/// materials.
type PartsKey = (Digest, [Option<Digest>; 2], Vec<usize>);

/// The look of an entry, with the texture of its material if it has one for the mesh, and without.
struct EntryLook {
    textured: Option<Arc<Look>>,
    plain: Arc<Look>,
}

/// What a mesh has at its vertices beside itself.
#[derive(Default)]
struct AtVertices {
    transfer: Option<Arc<Vec<Transfer>>>,
    blend: Option<Arc<Vec<[f32; 2]>>>,
}

impl SceneCache {
    /// An entry on a mesh. If the entry's material is one that the mesh has in its own file, every triangle
    /// has its own material as far as it has been made, with its texture, and the entry's otherwise.
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
        if let Some(light) = entry.light_alone {
            return self.light_alone(catalog, results, entry, light, mesh);
        }
        let own = catalog.own_entries(entry, mesh).len();
        self.more = own;
        let mut look = EntryLook { textured: None, plain: self.look(catalog.plan(), results, entry)? };
        if own > 0 {
            let textured = self.look_with(catalog.plan(), results, entry, true)?;
            look.textured = Some(textured).filter(|look| look.base_color().is_some());
        }
        let transfer = self.transfer(catalog, results, mesh);
        let blend = self.blend(catalog, results, mesh);
        self.dressed(catalog, results, entry, mesh, look, AtVertices { transfer, blend })
    }

    /// A mesh with the look of an entry, or with those of its own materials.
    fn dressed(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
        name: &str,
        EntryLook { textured, plain }: EntryLook,
        AtVertices { transfer, blend }: AtVertices,
    ) -> Result<Scene, Failure> {
        let mesh = self.mesh(catalog, results, name)?;
        let names = mesh.materials();
        // The first look is the entry's; materials without one have it, too, but not its texture. Triangles
        // without a material count as those of one more.
        let (mut looks, mut part_of) = (vec![Arc::clone(&plain)], vec![0; names.len() + 1]);
        let mut own_place = None;
        for (reference, other) in catalog.own_entries(entry, name) {
            let Some(place) = reference.place(names) else { continue };
            let is_used = |range: &MaterialRange| range.material == Some(place as u32);
            if !mesh.material_ranges().iter().any(is_used) {
                continue;
            }
            if other.material == entry.material {
                own_place = Some(place);
            } else if let Ok(other) = self.look_with(catalog.plan(), results, other, true) {
                part_of[place] = looks.len();
                looks.push(other);
            }
        }
        let slot = |material: Option<u32>| material.map_or(names.len(), |place| place as usize);
        if let (Some(own), Some(textured)) = (own_place, textured) {
            let is_left = |slot: usize| slot != own && part_of[slot] == 0;
            if mesh.material_ranges().iter().any(|range| is_left(slot(range.material))) {
                let left: Vec<usize> = (0..part_of.len()).filter(|slot| is_left(*slot)).collect();
                left.into_iter().for_each(|slot| part_of[slot] = looks.len());
                looks.push(Arc::clone(&plain));
            }
            looks[0] = textured;
        }
        if own_place.is_none() || looks.len() == 1 {
            let look = looks.swap_remove(0);
            return Ok(Scene::of(mesh, look).with_transfer(transfer).with_blend(blend));
        }
        let digest = |item: Option<ItemIndex>| Some(results.get(item?)?.digest());
        let digests = [
            digest(catalog.transfer_item(name).filter(|_| transfer.is_some())),
            digest(catalog.blend_item(name).filter(|_| blend.is_some())),
        ];
        let key = (handle_of(catalog, results, name)?.digest(), digests, part_of.clone());
        let parts = self.parts.get(DRESSED, key, || {
            let part = |number: usize| {
                MeshPart::of(&mesh, |material| part_of[slot(material)] == number, &transfer, &blend)
            };
            Ok((0..looks.len()).map(part).collect())
        })?;
        let part = |(part, look): (&MeshPart, Arc<Look>)| ScenePart {
            mesh: Arc::clone(&part.mesh),
            look,
            transfer: part.transfer.clone(),
            blend: part.blend.clone(),
        };
        let parts = parts.iter().zip(looks).map(part).collect();
        Ok(Scene::of_parts(&mesh, Arc::clone(plain.light()), parts))
    }

    /// How many values of a kind are kept of which a scene has one for each material, beside the usual.
    fn kept(&self, usual: usize) -> usize {
        usual + self.more
    }

    /// White metal of a few roughnesses under a light alone: as its export lights it, or else its
    /// environment.
    fn light_alone(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
        LightAlone { export }: LightAlone,
        mesh: &str,
    ) -> Result<Scene, Failure> {
        let plan = catalog.plan();
        let (key, light) = self.light(plan, results, entry)?;
        // Files of a light before are not shown.
        let export = export.filter(|item| is_current(plan, results, entry, *item));
        let files = export.and_then(|item| Some((item, LightFiles::of(plan, results, item)?)));
        let key = (key, files.map(|(_, files)| files));
        let looks = self.white_metals.get(LOOKS, key, || {
            let lit = files.map(|(item, files)| lit_by(plan, results, item, files)).transpose()?;
            let (lit, suns) = lit.unzip();
            let suns = suns.unwrap_or_default();
            let (light, cube) = match lit {
                Some(LitBy::Image(image)) => {
                    let suns = Lighting { series: Expansion::zero(Degree::ZERO), lights: suns.clone() };
                    let image = preview::lit(&image, &suns).ok_or_else(not_finite)?;
                    (Arc::new(Light::new(image, None)), None)
                }
                Some(LitBy::Cube(cube, levels)) => (Arc::clone(&light), Some((Arc::new(cube), levels))),
                None => (Arc::clone(&light), None),
            };
            let look = |(number, roughness)| {
                let cube = cube.as_ref().map(|(cube, levels)| (Arc::clone(cube), levels[number]));
                let look = Look::of_white_metal(Arc::clone(&light), roughness, cube);
                let look = look.map_err(|error| Failure::new(error.to_string()))?;
                Ok(Arc::new(look.with_suns(suns.clone())))
            };
            ROUGHNESSES.into_iter().enumerate().map(look).collect()
        })?;
        Ok(Scene::row(light, &self.mesh(catalog, results, mesh)?, &looks))
    }

    /// The place of each vertex of a mesh between the materials of a table, if it was made of the present
    /// mesh and can be read.
    fn blend(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        mesh: &str,
    ) -> Option<Arc<Vec<[f32; 2]>>> {
        let (mesh, item) = (catalog.mesh_item(mesh)?, catalog.blend_item(mesh)?);
        let made = results.get(item)?;
        let of_mesh = results.get(mesh)?.digest().to_string();
        let found = self.blends.get(TABLES, made.digest(), || {
            let blend = made.get::<artifacts::VertexBlend>()?;
            let is_same = blend.0.mesh == of_mesh;
            is_same.then(|| blend.0.value.clone()).ok_or_else(|| Failure::new("it belongs to another mesh"))
        });
        found.ok()
    }

    /// The transfer of a mesh, if it was made of the present one, can be read and stands for matrices.
    fn transfer(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        mesh: &str,
    ) -> Option<Arc<Vec<Transfer>>> {
        let shape = self.mesh(catalog, results, mesh).ok()?;
        let (mesh, item) = (catalog.mesh_item(mesh)?, catalog.transfer_item(mesh)?);
        let made = results.get(item)?;
        let of_mesh = results.get(mesh)?.digest().to_string();
        let found = self.transfers.get(TABLES, made.digest(), || {
            let transfer = made.get::<artifacts::Transfer>()?;
            let is_same = transfer.0.mesh == of_mesh;
            let matrices = is_same.then(|| transfer.0.value.matrices(&Frames::of(&shape).ok()?)).flatten();
            matrices.ok_or_else(|| Failure::new("it belongs to another mesh, or is matte"))
        });
        found.ok()
    }

    /// An entry on a mesh with another material, whose maps do not exist.
    ///
    /// # Errors
    /// If the environment or the mesh has not been built or cannot be read.
    pub fn edited(
        &mut self,
        catalog: &PreviewCatalog,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
        mesh: &str,
        material: &Material,
    ) -> Result<Scene, Failure> {
        let (key, light) = self.light(catalog.plan(), results, entry)?;
        let same = self.edited.take().filter(|(of, edited, _)| *of == key && edited == material);
        let (_, _, look) = self.edited.insert(same.unwrap_or_else(|| {
            let look = Look::without_maps(light, material.clone(), entry.sizes);
            (key, material.clone(), Arc::new(look))
        }));
        let look = EntryLook { textured: None, plain: Arc::clone(look) };
        self.more = catalog.own_entries(entry, mesh).len();
        self.dressed(catalog, results, entry, mesh, look, AtVertices::default())
    }

    /// The look of an entry. It has no maps if they were not made from the present light and material, and
    /// both of these are known. It is the same value as long as nothing that it is made from has changed.
    ///
    /// If the material is unknown, there must be maps: those of the last build, as long as there are no newer
    /// ones.
    ///
    /// # Errors
    /// The errors of [`SceneCache::scene`].
    pub fn look(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
    ) -> Result<Arc<Look>, Failure> {
        self.look_with(plan, results, entry, false)
    }

    /// The look of an entry, for meshes of its material's own file with the texture of the material.
    fn look_with(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
        has_texture: bool,
    ) -> Result<Arc<Look>, Failure> {
        let is_made = entry.reflection.is_some_and(|item| is_current(plan, results, entry, item));
        let reflection = entry.reflection.and_then(|item| results.get(item));
        let reflection_digest = reflection.as_ref().map(|reflection| reflection.digest());
        let shrm = exported_shrm(plan, entry);
        let of_shrm = shrm.as_ref().map(|files| Digest::of(files.parameters.to_string().as_bytes()));
        let kept = (entry.sizes, [entry.holds_lamps, entry.joins_parts, has_texture], of_shrm);
        let is_same =
            |(_, of, .., sizes): &LookKey| of.is_some() && *of == reflection_digest && *sizes == kept;
        if !is_made
            && entry.material.is_none()
            && let Some(look) = self.looks.find(is_same)
        {
            return Ok(look);
        }
        let (light_key, light) = self.light(plan, results, entry)?;
        let material = entry.material.map(|item| handle(plan, results, item)).transpose()?;
        let material_digest = material.as_ref().map(|material| material.digest());
        let read = |material: &engine::Handle| -> Result<_, Failure> {
            let texture = if has_texture { artifacts::Material::texture(&material.bytes()?)? } else { None };
            Ok((material.get::<artifacts::Material>()?.0.clone(), texture))
        };
        let table = self.table(plan, results, entry);
        let field = entry.light_field.filter(|item| is_current(plan, results, entry, *item));
        let field = field.and_then(|item| results.get(item));
        let at_vertices =
            [table.as_ref().map(|(digest, _)| *digest), field.as_ref().map(|field| field.digest())];
        let read_field = || -> Result<_, Failure> {
            let field = field.as_ref().map(|field| field.get::<artifacts::LightField>()).transpose()?;
            Ok(field.map(|field| Arc::new(field.0.clone())))
        };
        let table = table.map(|(_, table)| table);
        let compact_map = self.compact_map(plan, results, entry);
        let compact_digests = compact_map.as_ref().map(|(digests, _)| *digests);
        let compact_map = compact_map.map(|(_, map)| map);
        if let (false, Some(material)) = (is_made, &material) {
            let key = (light_key, None, material_digest, at_vertices, compact_digests, kept);
            let make = || {
                let (material, texture) = read(material)?;
                let look = Look::without_maps(light, material, entry.sizes);
                let look = look.with_compact_map(compact_map).with_base_color(texture);
                Ok(look.with_table(table).with_light_field(read_field()?))
            };
            return self.looks.get(self.kept(LOOKS), key, make);
        }
        let item =
            entry.reflection.ok_or_else(|| Failure::new("no stage reflects light off this material"))?;
        let reflection = handle(plan, results, item)?;
        let key = (light_key, Some(reflection.digest()), material_digest, at_vertices, compact_digests, kept);
        self.looks.get(self.kept(LOOKS), key, || {
            let (material, texture) = material.as_deref().map(read).transpose()?.unzip();
            let look = if artifact(plan, item) == Some(artifacts::Shrm::TYPE) {
                let map = reflection.get::<artifacts::Shrm>()?.0.clone();
                Look::from_map(light, map, material, entry.sizes)
            } else {
                let reflection = reflection.get::<artifacts::Reflection>()?.0.clone();
                let degrees = shrm.and_then(|files| degrees_in_view(&files, &reflection, entry.joins_parts));
                let look = Look::new(light, reflection, material, entry.sizes);
                let look = look.with_parts_in_one_map(entry.joins_parts);
                look.with_lamps_in_maps(entry.holds_lamps).with_degrees_in_view(degrees)
            };
            let look = look.with_base_color(texture.flatten()).with_compact_map(compact_map);
            Ok(look.with_table(table).with_light_field(read_field()?))
        })
    }

    /// The table of an entry, if it was made of the present material and can be read.
    fn table(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
    ) -> Option<(Digest, Arc<BrdfTable>)> {
        let item = entry.table.filter(|item| is_current(plan, results, entry, *item))?;
        let made = results.get(item)?;
        let digest = made.digest();
        let read = || Ok(made.get::<artifacts::BrdfTable>()?.0.clone());
        Some((digest, self.tables.get(self.kept(TABLES), digest, read).ok()?))
    }

    /// The compact map of an entry, if it was made of the present light and material and can be read.
    fn compact_map(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
    ) -> Option<([Digest; 2], Arc<CompactMap>)> {
        let CompactMapItems { scales, taps } = entry.compact_map?;
        let is_made = |item| is_current(plan, results, entry, item);
        let made = [scales, taps].map(|item| results.get(item).filter(|_| is_made(item)));
        let [Some(scales), Some(taps)] = made else { return None };
        let digests = [scales.digest(), taps.digest()];
        let read = || Ok(scales.get::<artifacts::ScaleSpace>()?.0.space.clone());
        let scales = self.scale_spaces.get(LIGHTS, digests[0], read).ok()?;
        let read = || {
            let taps = taps.get::<artifacts::Taps>()?;
            let (table, material) = (taps.0.table().into(), taps.0.material.clone());
            Ok(CompactMap { scales, taps: Arc::new(table), material })
        };
        Some((digests, self.compact_maps.get(self.kept(LOOKS), digests, read).ok()?))
    }

    /// The light of an entry, and its key. Coefficients that were not made from the present environment are
    /// not part of it.
    fn light(
        &mut self,
        plan: &Plan,
        results: &ResultsSnapshot,
        entry: &CatalogEntry,
    ) -> Result<(LightKey, Arc<Light>), Failure> {
        let environment = handle(plan, results, entry.environment)?;
        let lighting = entry.lighting.filter(|item| is_current(plan, results, entry, *item));
        let lighting = lighting.and_then(|item| results.get(item));
        let turn = entry.turn.matrix().to_cols_array().map(f64::to_bits);
        let added = entry.added.iter().map(|(item, turn)| Ok((handle(plan, results, *item)?, *turn)));
        let added = added.collect::<Result<Vec<_>, Failure>>()?;
        let digests = added.iter().map(|(added, _)| added.digest()).collect();
        let key = (environment.digest(), lighting.as_ref().map(|lighting| lighting.digest()), turn, digests);
        let light = self.lights.get(LIGHTS, key.clone(), || {
            if artifact(plan, entry.environment) == Some(artifacts::Lighting::TYPE) {
                let lighting = lighting.as_ref().unwrap_or(&environment).get::<artifacts::Lighting>()?;
                return Light::of_lighting(lighting.0.clone()).ok_or_else(not_finite);
            }
            let environment = environment.get::<artifacts::Environment>()?;
            let is_turned = entry.turn.matrix() != sphere::Rotation::IDENTITY.matrix();
            let environment = if is_turned {
                unstopped(|stop| environment.0.rotated(entry.turn, stop))
            } else {
                environment.0.clone()
            };
            let mut environment = environment;
            for (added, turn) in &added {
                let added = added.get::<artifacts::Lighting>()?.0.rotated(*turn);
                environment = preview::lit(&environment, &added).ok_or_else(not_finite)?;
            }
            let lighting = lighting.map(|lighting| lighting.get::<artifacts::Lighting>()).transpose()?;
            let lamps = lighting.as_ref().map_or(Vec::new(), |lighting| lighting.0.lights.clone());
            let whole = lighting.map(|lighting| lighting.0.whole());
            Ok(Light::new(environment, whole).with_lamps(lamps))
        })?;
        Ok((key, light))
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

/// How the pipeline exports the SHRM of an entry: the first stage that does.
fn exported_shrm(plan: &Plan, entry: &CatalogEntry) -> Option<ExportedFiles> {
    let stages = entry.exports.iter().map(|item| &plan.stages[plan.items[*item].stage]);
    let mut files = stages.map(|stage| ExportedFiles {
        kind: stage.kind.name().to_owned(),
        parameters: stage.configured.canonical(),
        bytes: Vec::new(),
    });
    files.find(|files| matches!(ShrmSettings::of_files(files), Ok(Some(_))))
}

/// The degrees in the view of an exported SHRM, as one map or as one of each part of the material.
fn degrees_in_view(
    files: &ExportedFiles,
    reflection: &Reflection,
    joins_parts: bool,
) -> Option<Vec<[Degree; 2]>> {
    let settings = ShrmSettings::of_files(files).ok()??.with_parts_in_one_map(joins_parts);
    Some(settings.sizes(reflection, &Reporter::default()).ok()?.degrees_in_view)
}

/// The failure of a light that no picture can show.
fn not_finite() -> Failure {
    Failure::new("the light has a radiance that is not finite")
}
