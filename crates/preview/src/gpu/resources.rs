//! The device's resources that do not depend on the picture's size.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::iter::once;

use taps::ScaleSpace;
use wgpu::BufferUsages;

use super::device::Device;
use super::identity_cache::IdentityCache;
use super::layouts::{Layouts, Pipelines};
use super::maps::{LightMaps, LookMaps, Map, scale_space};
use super::mesh::Shape;
use super::shader_sources::models;
use super::shadow_tree::{ShadowTree, ShadowUniforms};
use super::textures::Textures;
use super::vertex_light::VertexLight;
use crate::shading::harmonics::Harmonics;
use crate::shading::product_samples;
use crate::vertex_light::ShadedMesh;
use crate::{Background, Light, Look, Mode, Object, RenderError, Scene, Shot, ViewTransform};

/// The pipelines, and the resources of scenes.
#[derive(Debug)]
pub(super) struct Resources {
    pub(super) device: Device,
    pub(super) layouts: Layouts,
    pub(super) pipelines: Pipelines,
    /// The buffers of meshes; `None` for a mesh without triangles.
    pub(super) meshes: IdentityCache<mesh::Mesh, Option<Shape>>,
    pub(super) looks: IdentityCache<Look, LookMaps>,
    pub(super) lights: IdentityCache<Light, LightMaps>,
    /// The buffers of scale spaces.
    scale_spaces: IdentityCache<ScaleSpace, wgpu::Buffer>,
    /// The triangles that cast the shadows of a mesh, as a tree.
    trees: IdentityCache<mesh::Mesh, ShadowTree>,
    /// Light, material and shadows of each object in the present shot, by its number.
    pub(super) shadowed: HashMap<usize, wgpu::BindGroup>,
    /// The lamps of each object that a table shades with its transfer: their number; they, their material and
    /// its shadows.
    pub(super) shadowed_lamps: HashMap<usize, (u32, wgpu::BindGroup)>,
    /// The light at the vertices of objects that a BRDF table shades, by the object's number, and the mode.
    pub(super) vertex_lights: HashMap<(usize, Mode), VertexLight>,
    /// The constants of the harmonics, up to a degree.
    pub(super) textures: Textures,
    pub(super) harmonics: wgpu::Buffer,
    degree: usize,
    /// A map for passes that read none.
    pub(super) empty_map: Map,
}

/// The first degree of the harmonics, which suffices for most maps.
const DEGREE: usize = 16;

impl Resources {
    pub(super) fn new(device: Device, target: wgpu::TextureFormat) -> Result<Self, RenderError> {
        let layouts = Layouts::new(&device.device);
        let pipelines = Pipelines::new(&device.device, &layouts, target);
        let empty_map = Map::empty(&device, &layouts)?;
        let harmonics = constants(&device, DEGREE)?;
        Ok(Self {
            device,
            layouts,
            pipelines,
            meshes: IdentityCache::default(),
            looks: IdentityCache::default(),
            lights: IdentityCache::default(),
            scale_spaces: IdentityCache::default(),
            trees: IdentityCache::default(),
            shadowed: HashMap::new(),
            shadowed_lamps: HashMap::new(),
            vertex_lights: HashMap::new(),
            textures: Textures::default(),
            harmonics,
            degree: DEGREE,
            empty_map,
        })
    }

    /// Makes the resources that a shot of a scene needs for so many of its light samples, and drops those
    /// that the scene does not use.
    pub(super) fn prepare(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        light_samples: u32,
    ) -> Result<(), RenderError> {
        let view = ViewTransform::new(shot).view;
        let objects = || scene.objects.iter();
        self.meshes.retain(objects().map(|object| &object.mesh));
        self.trees.retain(objects().map(Object::occluder));
        self.shadowed.clear();
        self.shadowed_lamps.clear();
        self.looks.retain(objects().map(|object| &object.look));
        self.lights.retain(objects().map(|object| object.look.light()).chain(once(&scene.light)));
        let compact_maps = objects().filter_map(|object| object.look.compact_map().ok());
        self.scale_spaces.retain(compact_maps.map(|map| &map.scales));
        self.vertex_lights.retain(|(number, mode), light| {
            let mesh = scene.objects.get(*number).and_then(|object| ShadedMesh::new(object, *mode).ok());
            mesh.is_some_and(|mesh| light.is_of(&mesh))
        });
        let Self { device, layouts, .. } = self;
        self.textures.prepare(device, layouts, scene, shot)?;
        if self.textures.is_shown {
            self.pipelines.prepare_textured(layouts);
        }
        let lights = self.lights.get_or_make(&scene.light, || Ok(LightMaps::default()))?;
        match shot.background {
            Background::Environment => lights.prepare_environment(device, layouts, &scene.light)?,
            Background::Harmonics => lights.prepare_reconstruction(device, layouts, &scene.light)?,
            Background::Flat(_) => {}
        }
        for (number, object) in objects().enumerate() {
            self.meshes.get_or_make(&object.mesh, || Shape::new(device, &object.mesh))?;
            for mode in shot.show.modes() {
                self.pipelines.prepare(layouts, mode, models(mode, &object.look));
                let light = object.look.light();
                let lights = self.lights.get_or_make(light, || Ok(LightMaps::default()))?;
                match mode {
                    Mode::Mirror => lights.prepare_environment(device, layouts, light)?,
                    Mode::Irradiance => lights.prepare_irradiance(device, layouts, light)?,
                    Mode::Table | Mode::Transfer => {
                        let Some(Some(shape)) = self.meshes.get(&object.mesh) else { continue };
                        let light = match self.vertex_lights.entry((number, mode)) {
                            Entry::Occupied(entry) => entry.into_mut(),
                            Entry::Vacant(entry) => {
                                entry.insert(VertexLight::new(device, ShadedMesh::new(object, mode)?)?)
                            }
                        };
                        light.update(device, layouts, shape, object, shot)?;
                        let maps = self.looks.get_or_make(&object.look, || Ok(LookMaps::default()))?;
                        maps.prepare_lamps(device, layouts, &object.look, mode)?;
                        if mode == Mode::Transfer && object.look.beside_table().is_some() {
                            let tree = self.trees.get_or_make(object.occluder(), || {
                                ShadowTree::new(device, object.occluder())
                            })?;
                            let uniforms = ShadowUniforms::new(tree, object, shot);
                            let lamps = &maps.lamps[&mode];
                            let bound = tree.bound_with_lamps(device, layouts, lamps, uniforms)?;
                            self.shadowed_lamps.insert(number, (lamps.count, bound));
                            self.pipelines.prepare_shadowed_lamps(layouts, &object.look);
                        }
                    }
                    Mode::Taps => {
                        let map = object.look.compact_map()?;
                        let levels = self
                            .scale_spaces
                            .get_or_make(&map.scales, || scale_space(device, &map.scales))?;
                        let maps = self.looks.get_or_make(&object.look, || Ok(LookMaps::default()))?;
                        maps.prepare_taps(device, layouts, map, levels)?;
                    }
                    Mode::BruteForce | Mode::ShadowedBruteForce => {
                        let maps = self.looks.get_or_make(&object.look, || Ok(LookMaps::default()))?;
                        maps.prepare_samples(device, layouts, &object.look, lights)?;
                        if !product_samples::is_worth(shot) {
                            maps.clear_product(device);
                        } else if light_samples > product_samples::FIRST {
                            maps.prepare_product(device, layouts, &self.pipelines, &object.look, view)?;
                        }
                        if let (Mode::ShadowedBruteForce, Some(samples)) = (mode, &maps.samples) {
                            let tree = self.trees.get_or_make(object.occluder(), || {
                                ShadowTree::new(device, object.occluder())
                            })?;
                            let uniforms = ShadowUniforms::new(tree, object, shot);
                            let bound = tree.bound(device, layouts, samples, uniforms)?;
                            self.shadowed.insert(number, bound);
                        }
                    }
                    _ => {
                        let maps = self.looks.get_or_make(&object.look, || Ok(LookMaps::default()))?;
                        maps.prepare(device, layouts, &object.look, mode)?;
                        if mode.adds_lamps() {
                            maps.prepare_lamps(device, layouts, &object.look, mode)?;
                        }
                        if maps.degree > self.degree {
                            let degree = maps.degree.next_power_of_two();
                            self.harmonics = constants(device, degree)?;
                            self.degree = degree;
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

fn constants(device: &Device, degree: usize) -> Result<wgpu::Buffer, RenderError> {
    device.filled("the harmonics", BufferUsages::STORAGE, &Harmonics::new(degree).constants())
}
