//! The maps of looks and lights on the device: cubes in layers, or a lat-long image, with uniforms.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use shrm::Shrm;
use taps::ScaleSpace;
use wgpu::{BufferUsages, TextureUsages, TextureViewDescriptor, TextureViewDimension};

use super::device::Device;
use super::layouts::{Layouts, Pipelines};
use super::memory::TEXELS;
use super::product::ProductBuffer;
use crate::layered_map::{LayeredMap, MapProperties};
use crate::shading::brute_force::Prepared;
use crate::shading::harmonics::Harmonics;
use crate::shading::irradiance::Irradiance;
use crate::shading::lamps::PackedLamps;
use crate::shading::material::PackedMaterial;
use crate::shading::product_tables::{HEADER, ProductTables};
use crate::shading::taps::{Levels, PackedTaps};
use crate::{CompactMap, Light, Look, Mode, RenderError};

/// `MapUniforms` of map.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct MapUniforms {
    parts: [MapPart; LayeredMap::MOST_PARTS],
    count: u32,
    unused: [u32; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct MapPart {
    centre: u32,
    edge: u32,
    degree: u32,
    zonal: u32,
    slices: u32,
    first: u32,
    weight: f32,
    unused: u32,
}

impl MapUniforms {
    fn new(properties: impl IntoIterator<Item = MapProperties>) -> Self {
        let mut uniforms = Self::default();
        for (part, of) in uniforms.parts.iter_mut().zip(properties) {
            let MapProperties { centre, edge, degree, zonal, slices, first, weight } = of;
            let zonal = zonal.into();
            *part = MapPart { centre, edge, degree, zonal, slices, first, weight, unused: 0 };
            uniforms.count += 1;
        }
        uniforms
    }
}

/// The bind group of a map and its uniforms.
#[derive(Debug)]
pub(super) struct Map {
    pub(super) bound: wgpu::BindGroup,
}

/// The maps of a light, each made when a mode first needs it.
#[derive(Debug, Default)]
pub(super) struct LightMaps {
    /// The lat-long environment.
    pub(super) environment: Option<Map>,
    /// The cube of [`Light::reconstruction`].
    pub(super) reconstruction: Option<Map>,
    /// Nine coefficients of irradiance over pi, side by side.
    pub(super) irradiance: Option<Map>,
    samples: Option<wgpu::Buffer>,
}

#[derive(Debug, Default)]
pub(super) struct LookMaps {
    /// The maps of the modes that have one.
    pub(super) modes: HashMap<Mode, Map>,
    /// The highest degree of the harmonics of those maps.
    pub(super) degree: usize,
    /// Light, material and lobes of brute force, which has no map.
    pub(super) samples: Option<LightSampling>,
    /// The tables of the product of light and material; `None` inside if there are none.
    product: Option<Option<ProductBuffer>>,
    /// The lights beside the maps of the modes that add them, and the material that reflects them.
    pub(super) lamps: HashMap<Mode, LampBuffers>,
    /// The buffers of [`Mode::Taps`].
    pub(super) taps: Option<wgpu::BindGroup>,
    /// The update of [`Mode::GlobalShrm`], whose map is recomputed for each view.
    pub(super) update: Option<Update>,
}

/// The buffers of a look that brute force reads.
#[derive(Debug)]
pub(super) struct LightSampling {
    pub(super) bound: wgpu::BindGroup,
    /// Light, material, lobes and product: [`LightSampling::BINDINGS`].
    pub(super) buffers: [wgpu::Buffer; 4],
}

impl LightSampling {
    /// The bindings of the buffers.
    pub(super) const BINDINGS: [u32; 4] = [0, 1, 2, 8];

    fn new(device: &Device, layouts: &Layouts, buffers: [wgpu::Buffer; 4]) -> Self {
        let entries = Self::BINDINGS.into_iter().zip(&buffers);
        let entries = entries
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light and material"),
            layout: &layouts.light,
            entries: &entries.collect::<Vec<_>>(),
        });
        Self { bound, buffers }
    }
}

/// The buffers of the lights beside a map.
#[derive(Debug)]
pub(super) struct LampBuffers {
    pub(super) bound: wgpu::BindGroup,
    /// Material and lamps: bindings 1 and 3.
    pub(super) buffers: [wgpu::Buffer; 2],
    /// The number of lamps.
    pub(super) count: u32,
}

/// The update of a reflection map from global coefficients.
#[derive(Debug)]
pub(super) struct Update {
    pub(super) coefficients: Map,
    pub(super) bound: wgpu::BindGroup,
    pub(super) edge: u32,
    /// The faces of all maps.
    pub(super) faces: u32,
    harmonics: Harmonics,
    view: wgpu::Buffer,
}

impl LightMaps {
    /// The buffer of light samples.
    fn samples(&mut self, device: &Device, prepared: &Prepared) -> Result<&wgpu::Buffer, RenderError> {
        Ok(match self.samples.take() {
            Some(samples) => self.samples.insert(samples),
            None => {
                let elements = prepared.light().elements();
                let samples = device.filled("the light's samples", BufferUsages::STORAGE, elements)?;
                self.samples.insert(samples)
            }
        })
    }

    /// Makes [`LightMaps::environment`] unless it exists.
    pub(super) fn prepare_environment(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        light: &Light,
    ) -> Result<(), RenderError> {
        if self.environment.is_none() {
            let grid = light.environment().grid();
            let shape = [grid.width, grid.height, 1].map(|side| side as u64);
            let texture = device.texture("the environment", TEXELS, USAGE, shape)?;
            device.write_layers(&texture, 0, &padded(light.environment().pixels().iter().copied()));
            self.environment = Some(Map::new(device, layouts, texture, MapUniforms::default())?);
        }
        Ok(())
    }

    /// Makes [`LightMaps::reconstruction`] unless it exists.
    pub(super) fn prepare_reconstruction(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        light: &Light,
    ) -> Result<(), RenderError> {
        if self.reconstruction.is_none() {
            self.reconstruction = Some(cubes(device, layouts, &LayeredMap::reconstruction(light))?);
        }
        Ok(())
    }

    /// Makes [`LightMaps::irradiance`] unless it exists.
    pub(super) fn prepare_irradiance(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        light: &Light,
    ) -> Result<(), RenderError> {
        if self.irradiance.is_none() {
            let irradiance = Irradiance::new(light.lighting());
            let texture = device.texture("irradiance", TEXELS, USAGE, [9, 1, 1])?;
            device.write_layers(&texture, 0, &padded(irradiance.rows().iter().map(|row| row.to_array())));
            self.irradiance = Some(Map::new(device, layouts, texture, MapUniforms::default())?);
        }
        Ok(())
    }
}

impl LookMaps {
    /// Makes [`LookMaps::samples`] unless they exist.
    pub(super) fn prepare_samples(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        look: &Look,
        lights: &mut LightMaps,
    ) -> Result<(), RenderError> {
        if self.samples.is_none() {
            let prepared = Prepared::new(look)?;
            let usage = BufferUsages::STORAGE;
            let material = PackedMaterial::new(Some(prepared.material()))?;
            let material = device.filled("the material", usage, material.words())?;
            let lobes = device.filled("the material's lobes", usage, &prepared.lobes().words())?;
            let light = lights.samples(device, &prepared)?.clone();
            let product = device.filled("no product", usage, &[0.0_f32; HEADER as usize])?;
            self.samples = Some(LightSampling::new(device, layouts, [light, material, lobes, product]));
        }
        Ok(())
    }

    /// Makes the tables of the product of a look for a view, unless they exist or there are none.
    /// [`LookMaps::samples`] are made before.
    pub(super) fn prepare_product(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        pipelines: &Pipelines,
        look: &Look,
        view: glam::Vec3,
    ) -> Result<(), RenderError> {
        if self.product.is_none() {
            let tables = ProductTables::new(look);
            let product = tables.map(|tables| ProductBuffer::new(device, layouts, tables)).transpose()?;
            if let (Some(product), Some(samples)) = (&product, &mut self.samples) {
                let [light, material, lobes, _] = samples.buffers.clone();
                let buffers = [light, material, lobes, product.buffer.clone()];
                *samples = LightSampling::new(device, layouts, buffers);
            }
            self.product = Some(product);
        }
        if let Some(Some(product)) = &mut self.product {
            product.update(device, pipelines, view);
        }
        Ok(())
    }

    /// From now on no samples follow the product, until [`LookMaps::prepare_product`] is called.
    pub(super) fn clear_product(&mut self, device: &Device) {
        if let Some(Some(product)) = &mut self.product {
            product.clear(device);
        }
    }

    /// Makes the [`LookMaps::lamps`] of a mode unless they exist.
    pub(super) fn prepare_lamps(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        look: &Look,
        mode: Mode,
    ) -> Result<(), RenderError> {
        if let Entry::Vacant(unmade) = self.lamps.entry(mode) {
            let packed = PackedLamps::beside_map(look, mode);
            let usage = BufferUsages::STORAGE;
            let material = PackedMaterial::new(packed.material())?;
            let material = device.filled("the material", usage, material.words())?;
            let lamps = device.filled("the lamps", usage, packed.elements())?;
            let entries = [(1, &material), (3, &lamps)].map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("lamps and material"),
                layout: &layouts.lamps,
                entries: &entries,
            });
            unmade.insert(LampBuffers { bound, buffers: [material, lamps], count: packed.count() });
        }
        Ok(())
    }

    /// Makes [`LookMaps::taps`] unless they exist; `levels` is the buffer of [`scale_space`].
    pub(super) fn prepare_taps(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        map: &CompactMap,
        levels: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        if self.taps.is_none() {
            let packed = PackedLamps::beside(map);
            let usage = BufferUsages::STORAGE;
            let material = PackedMaterial::new(packed.material())?;
            let material = device.filled("the material", usage, material.words())?;
            let lamps = device.filled("the lamps", usage, packed.elements())?;
            let taps = device.filled("the taps", usage, PackedTaps::new(map.taps.table()).elements())?;
            let buffers = [(1, &material), (3, &lamps), (6, levels), (7, &taps)];
            let entries = buffers.map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            self.taps = Some(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("a compact map"),
                layout: &layouts.taps,
                entries: &entries,
            }));
        }
        Ok(())
    }

    /// Makes the look's map for a mode, unless it exists or the mode has none.
    pub(super) fn prepare(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        look: &Look,
        mode: Mode,
    ) -> Result<(), RenderError> {
        if self.modes.contains_key(&mode) {
            return Ok(());
        }
        let map = match mode {
            Mode::GlobalShrm => {
                let (update, map) = Update::new(device, layouts, look.global()?)?;
                self.update = Some(update);
                map
            }
            mode => match LayeredMap::of(look, mode)? {
                Some(map) => {
                    self.degree = self.degree.max(map.degree());
                    cubes(device, layouts, &map)?
                }
                None => return Ok(()),
            },
        };
        self.modes.insert(mode, map);
        Ok(())
    }
}

/// The buffer of a scale space, which all looks under one light share.
pub(super) fn scale_space(device: &Device, scales: &ScaleSpace) -> Result<wgpu::Buffer, RenderError> {
    device.filled("the scale space", BufferUsages::STORAGE, &Levels::new(scales).elements())
}

impl Update {
    /// The update of a global map, and the reflection map that it writes.
    fn new(device: &Device, layouts: &Layouts, maps: &[Shrm]) -> Result<(Self, Map), RenderError> {
        let coefficients = LayeredMap::coefficients(maps).checked()?;
        let source = cubes(device, layouts, &coefficients)?;
        let (edge, faces) = (coefficients.edge() as u32, 6 * maps.len() as u32);
        let shape = [edge, edge, faces].map(u64::from);
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING;
        let texture = device.texture("the reflection map of a view", TEXELS, usage, shape)?;
        let degree = coefficients.degree();
        let harmonics = Harmonics::new(degree);
        let view = device.buffer(
            "the harmonics of a view",
            BufferUsages::STORAGE | BufferUsages::COPY_DST,
            4 * (degree as u64 + 1) * (degree as u64 + 1),
        )?;
        let target = layers(&texture);
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("equation 12"),
            layout: &layouts.update,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&target) },
                wgpu::BindGroupEntry { binding: 2, resource: view.as_entire_binding() },
            ],
        });
        let parts = coefficients.parts().zip(0..);
        let parts = parts.map(|(part, place)| MapProperties { first: 6 * place, ..part });
        let reflection = Map::new(device, layouts, texture, MapUniforms::new(parts))?;
        Ok((Self { coefficients: source, bound, edge, faces, harmonics, view }, reflection))
    }

    /// Sets the view, a unit vector in the light's frame.
    pub(super) fn set_view(&self, device: &Device, view: glam::Vec3) {
        let degree = self.harmonics.degree();
        let mut rows = vec![0.0; (degree + 1) * (degree + 1)];
        self.harmonics.evaluate_into(view, &mut rows);
        device.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&rows));
    }
}

/// The most bytes in staging buffers before they are submitted.
const STAGED: usize = 64 << 20;

const USAGE: TextureUsages = TextureUsages::TEXTURE_BINDING.union(TextureUsages::COPY_DST);

impl Map {
    /// A map of one black texel, for passes that need a binding but read no map.
    pub(super) fn empty(device: &Device, layouts: &Layouts) -> Result<Self, RenderError> {
        let texture = device.texture("no map", TEXELS, USAGE, [1, 1, 1])?;
        Self::new(device, layouts, texture, MapUniforms::default())
    }

    /// A texture of the size of a picture, for passes that draw into it, and then read it as a map.
    pub(super) fn picture(
        device: &Device,
        layouts: &Layouts,
        [width, height]: [u32; 2],
    ) -> Result<(Self, wgpu::TextureView), RenderError> {
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT;
        let texture = device.texture("the picture", TEXELS, usage, [width.into(), height.into(), 1])?;
        let view = texture.create_view(&TextureViewDescriptor::default());
        Ok((Self::new(device, layouts, texture, MapUniforms::default())?, view))
    }

    fn new(
        device: &Device,
        layouts: &Layouts,
        texture: wgpu::Texture,
        uniforms: MapUniforms,
    ) -> Result<Self, RenderError> {
        let uniforms = device.filled("the uniforms of a map", BufferUsages::UNIFORM, &[uniforms])?;
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("a map"),
            layout: &layouts.map,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&layers(&texture)),
                },
            ],
        });
        Ok(Self { bound })
    }
}

/// A map in the layers of a texture.
fn cubes(device: &Device, layouts: &Layouts, map: &LayeredMap<'_>) -> Result<Map, RenderError> {
    let edge = map.edge() as u64;
    let texture = device.texture(map.what, TEXELS, USAGE, [edge, edge, 6 * map.count() as u64])?;
    let mut staged = 0;
    for (k, cube) in map.cubes().enumerate() {
        let texels = padded(cube);
        device.write_layers(&texture, 6 * k as u32, &texels);
        staged += size_of_val(texels.as_slice());
        if staged >= STAGED {
            // wgpu keeps a copy of the written texels until they are submitted and the device has read them.
            device.queue.submit([]);
            device.wait()?;
            staged = 0;
        }
    }
    Map::new(device, layouts, texture, MapUniforms::new(map.parts()))
}

fn layers(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        ..TextureViewDescriptor::default()
    })
}

/// Pads RGB to four channels.
fn padded(texels: impl Iterator<Item = [f32; 3]>) -> Vec<[f32; 4]> {
    texels.map(|[r, g, b]| [r, g, b, 1.0]).collect()
}
