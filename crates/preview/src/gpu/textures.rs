//! The textures of base colours on the device.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

use mesh::Mesh;
use wgpu::{BindGroupEntry, BufferUsages, TextureUsages, TextureViewDescriptor};

use super::device::Device;
use super::identity_cache::{Identity, IdentityCache};
use super::layouts::Layouts;
use super::memory::TEXELS;
use crate::shading::base_color::BaseColorMap;
use crate::shading::texture::PackedTexture;
use crate::{Look, Mode, Object, RenderError, Scene, Shot};

/// The textures of a scene's objects.
#[derive(Debug, Default)]
pub(super) struct Textures {
    /// Whether a mode of the present shot shows one.
    pub(super) is_shown: bool,
    of_looks: IdentityCache<Look, wgpu::BindGroup>,
    /// The vertices' coordinates, by the number of the object.
    coordinates: HashMap<usize, Coordinates>,
    responses: Option<Responses>,
}

/// The coordinates of a mesh's vertices in the texture of a look.
#[derive(Debug)]
struct Coordinates {
    mesh: Identity<Mesh>,
    look: Identity<Look>,
    buffer: wgpu::Buffer,
}

/// The numbers of the objects' materials, a row of texels for each.
#[derive(Debug)]
struct Responses {
    looks: Vec<Identity<Look>>,
    view: wgpu::TextureView,
}

impl Textures {
    /// Makes what a shot of a scene needs, and drops what the scene does not use.
    pub(super) fn prepare(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        scene: &Scene,
        shot: &Shot,
    ) -> Result<(), RenderError> {
        let objects = || scene.objects.iter().enumerate();
        let textured =
            || objects().filter_map(|(number, object)| Some((number, object, object.base_color_map()?)));
        self.of_looks.retain(textured().map(|(_, object, _)| &object.look));
        self.coordinates
            .retain(|number, of| scene.objects.get(*number).is_some_and(|object| of.are_of(object)));
        self.is_shown = shot.show.modes().any(Mode::shows_material) && textured().next().is_some();
        if !self.is_shown {
            self.responses = None;
            return Ok(());
        }
        for (number, object, map) in textured() {
            self.of_looks.get_or_make(&object.look, || bound(device, layouts, &map.texture))?;
            if let Entry::Vacant(entry) = self.coordinates.entry(number) {
                entry.insert(Coordinates::new(device, object, map)?);
            }
        }
        let looks: Vec<_> = objects().map(|(_, object)| Identity::of(&object.look)).collect();
        if self.responses.as_ref().is_none_or(|responses| responses.looks != looks) {
            self.responses = Some(Responses { looks, view: responses(device, scene)? });
        }
        Ok(())
    }

    /// The texture of an object and its vertices' coordinates, if it has one.
    pub(super) fn of(&self, number: usize, look: &Arc<Look>) -> Option<(&wgpu::BindGroup, &wgpu::Buffer)> {
        Some((self.of_looks.get(look)?, &self.coordinates.get(&number)?.buffer))
    }

    /// The numbers of the objects' materials: `base_color_numbers` of base_color.wgsl.
    pub(super) fn responses(&self) -> Option<&wgpu::TextureView> {
        self.responses.as_ref().map(|responses| &responses.view)
    }
}

impl Coordinates {
    fn new(device: &Device, object: &Object, map: &BaseColorMap) -> Result<Self, RenderError> {
        let of_mesh = object.mesh.coordinates().unwrap_or_default().iter();
        let placement = map.texture.placement();
        let values: Vec<[f32; 2]> = of_mesh.map(|at| placement.coordinates(*at)).collect();
        let buffer = device.filled("the coordinates of a mesh", BufferUsages::VERTEX, &values)?;
        Ok(Self { mesh: Identity::of(&object.mesh), look: Identity::of(&object.look), buffer })
    }

    fn are_of(&self, object: &Object) -> bool {
        self.mesh == Identity::of(&object.mesh) && self.look == Identity::of(&object.look)
    }
}

fn bound(
    device: &Device,
    layouts: &Layouts,
    texture: &PackedTexture,
) -> Result<wgpu::BindGroup, RenderError> {
    let uniforms = device.filled("the uniforms of a texture", BufferUsages::UNIFORM, &texture.uniforms())?;
    let texels = device.filled("a texture", BufferUsages::STORAGE, texture.words())?;
    Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("a texture"),
        layout: &layouts.texture,
        entries: &[
            BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: texels.as_entire_binding() },
        ],
    }))
}

/// The numbers of every object's material, zeros of one without a texture.
fn responses(device: &Device, scene: &Scene) -> Result<wgpu::TextureView, RenderError> {
    let row = |object: &Object| object.base_color_map().map(|map| map.response.texels());
    let mut rows: Vec<_> = scene.objects.iter().map(|object| row(object).unwrap_or_default()).collect();
    let width = rows.iter().map(Vec::len).max().unwrap_or(1);
    rows.iter_mut().for_each(|row| row.resize(width, [0.0; 4]));
    let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
    let size = [width as u64, rows.len() as u64, 1];
    let texture = device.texture("the materials' base colours", TEXELS, usage, size)?;
    device.write_layers(&texture, 0, &rows.concat());
    Ok(texture.create_view(&TextureViewDescriptor::default()))
}
