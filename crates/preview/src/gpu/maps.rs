//! The maps of looks and lights on the device: cubes in layers, or one lat-long image, each with what a mode must know of it.

use std::collections::HashMap;

use shrm::{Shrm, Terms};
use wgpu::{BufferUsages, TextureUsages, TextureViewDescriptor, TextureViewDimension};

use super::device::Device;
use super::layouts::Layouts;
use super::memory::TEXELS;
use super::numbers::centre;
use crate::shading::brute_force::Prepared;
use crate::shading::harmonics::Harmonics;
use crate::shading::irradiance::Irradiance;
use crate::{Light, Look, Mode, RenderError};

/// What a mode must know of its map: `Facts` of map.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Facts {
    centre: u32,
    edge: u32,
    degree: u32,
    zonal: u32,
    slices: u32,
    unused: [u32; 3],
}

/// A map, bound with its facts.
#[derive(Debug)]
pub(super) struct Map {
    pub(super) bound: wgpu::BindGroup,
}

/// The maps of a light, each made when a mode first wants it.
#[derive(Debug, Default)]
pub(super) struct LightMaps {
    environment: Option<Map>,
    reconstruction: Option<Map>,
    irradiance: Option<Map>,
    samples: Option<wgpu::Buffer>,
}

/// The maps of a look.
#[derive(Debug, Default)]
pub(super) struct LookMaps {
    modes: HashMap<Mode, Map>,
    degree: usize,
    /// Of [`Mode::BruteForce`], which has no map: light, material and lobes.
    samples: Option<wgpu::BindGroup>,
    /// Of [`Mode::GlobalShrm`], whose map is made anew for each view.
    update: Option<Update>,
}

/// What turns global coefficients into a reflection map.
#[derive(Debug)]
pub(super) struct Update {
    pub(super) coefficients: Map,
    pub(super) bound: wgpu::BindGroup,
    pub(super) edge: u32,
    harmonics: Harmonics,
    view: wgpu::Buffer,
}

impl LightMaps {
    /// The environment, lat-long.
    pub(super) fn environment(&self) -> Option<&Map> {
        self.environment.as_ref()
    }

    /// What the coefficients hold of it, a cube.
    pub(super) fn reconstruction(&self) -> Option<&Map> {
        self.reconstruction.as_ref()
    }

    /// Nine coefficients of irradiance over pi, side by side.
    pub(super) fn irradiance(&self) -> Option<&Map> {
        self.irradiance.as_ref()
    }

    /// What samples of the light are drawn from.
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

    /// Sees to it that [`LightMaps::environment`] is there.
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
            self.environment = Some(Map::new(device, layouts, texture, Facts::default())?);
        }
        Ok(())
    }

    /// Sees to it that [`LightMaps::reconstruction`] is there.
    pub(super) fn prepare_reconstruction(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        light: &Light,
    ) -> Result<(), RenderError> {
        if self.reconstruction.is_none() {
            let (cube, texels) = light.reconstruction();
            let facts = Facts { edge: cube.edge as u32, ..Facts::default() };
            self.reconstruction =
                Some(cubes(device, layouts, "the background", facts, 1, |_, texel| texels[texel])?);
        }
        Ok(())
    }

    /// Sees to it that [`LightMaps::irradiance`] is there.
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
            self.irradiance = Some(Map::new(device, layouts, texture, Facts::default())?);
        }
        Ok(())
    }
}

impl LookMaps {
    /// The map of a mode that has one of its own.
    pub(super) fn mode(&self, mode: Mode) -> Option<&Map> {
        self.modes.get(&mode)
    }

    /// The highest degree of a map's harmonics.
    pub(super) fn degree(&self) -> usize {
        self.degree
    }

    /// What [`Mode::BruteForce`] samples.
    pub(super) fn samples(&self) -> Option<&wgpu::BindGroup> {
        self.samples.as_ref()
    }

    /// Sees to it that [`LookMaps::samples`] are there.
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
            let material = device.filled("the material", usage, prepared.material().words())?;
            let lobes = device.filled("the material's lobes", usage, &prepared.lobes().words())?;
            let light = lights.samples(device, &prepared)?;
            let buffers = [light, &material, &lobes];
            let entries = [0, 1, 2].map(|binding| wgpu::BindGroupEntry {
                binding,
                resource: buffers[binding as usize].as_entire_binding(),
            });
            self.samples = Some(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("light and material"),
                layout: &layouts.light,
                entries: &entries,
            }));
        }
        Ok(())
    }

    /// What makes the map of [`Mode::GlobalShrm`].
    pub(super) fn update(&self) -> Option<&Update> {
        self.update.as_ref()
    }

    /// Sees to it that the map of a mode is there, where the mode has one of its own.
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
        let facts =
            Facts { centre: centre(look.centre()), edge: look.cube().edge as u32, ..Facts::default() };
        let map = match mode {
            Mode::LocalShrm => {
                let map = look.local()?;
                self.degree = map.p().get();
                coefficients(device, layouts, map)?
            }
            Mode::GlobalShrm => {
                let (update, map) = Update::new(device, layouts, look.global()?)?;
                self.update = Some(update);
                map
            }
            Mode::Cabral => {
                let maps = look.cabral()?;
                cubes(device, layouts, "Cabral's maps", facts, 12, |vertex, texel| maps.map(vertex)[texel])?
            }
            Mode::KautzMcCool => {
                let texture = look.kautz_mccool()?;
                let count = texture.angles().len();
                let facts = Facts { slices: count as u32, ..facts };
                cubes(device, layouts, "Kautz and McCool's texture", facts, count, |k, texel| {
                    texture.slice(k)[texel]
                })?
            }
            Mode::Prefiltered => {
                let texels = look.prefiltered()?;
                cubes(device, layouts, "the reflection map", facts, 1, |_, texel| texels[texel])?
            }
            Mode::Irradiance | Mode::Mirror | Mode::BruteForce => return Ok(()),
        };
        self.modes.insert(mode, map);
        Ok(())
    }
}

impl Update {
    /// Of a global map, and the reflection map that it is turned into.
    fn new(device: &Device, layouts: &Layouts, map: &Shrm) -> Result<(Self, Map), RenderError> {
        let source = coefficients(device, layouts, map)?;
        let edge = map.grid().shape()[1] as u32;
        let shape = [u64::from(edge), u64::from(edge), 6];
        let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING;
        let texture = device.texture("the reflection map of a view", TEXELS, usage, shape)?;
        let harmonics = Harmonics::new(map.p().get());
        let view = device.buffer(
            "the harmonics of a view",
            BufferUsages::STORAGE | BufferUsages::COPY_DST,
            4 * map.rows() as u64,
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
        let facts = Facts { centre: centre(map.centre()), edge, ..Facts::default() };
        let reflection = Map::new(device, layouts, texture, facts)?;
        Ok((Self { coefficients: source, bound, edge, harmonics, view }, reflection))
    }

    /// Sets the view, a unit vector in the light's frame.
    pub(super) fn look(&self, device: &Device, view: glam::Vec3) {
        let degree = self.harmonics.degree();
        let mut rows = vec![0.0; (degree + 1) * (degree + 1)];
        self.harmonics.evaluate_into(view, &mut rows);
        device.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&rows));
    }
}

/// How many bytes are written before the device must have them.
const STAGED: usize = 64 << 20;

const USAGE: TextureUsages = TextureUsages::TEXTURE_BINDING.union(TextureUsages::COPY_DST);

impl Map {
    /// A map of one black texel, where a pass is given one that it does not read.
    pub(super) fn nothing(device: &Device, layouts: &Layouts) -> Result<Self, RenderError> {
        let texture = device.texture("no map", TEXELS, USAGE, [1, 1, 1])?;
        Self::new(device, layouts, texture, Facts::default())
    }

    fn new(
        device: &Device,
        layouts: &Layouts,
        texture: wgpu::Texture,
        facts: Facts,
    ) -> Result<Self, RenderError> {
        let facts = device.filled("the facts of a map", BufferUsages::UNIFORM, &[facts])?;
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("a map"),
            layout: &layouts.map,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: facts.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&layers(&texture)),
                },
            ],
        });
        Ok(Self { bound })
    }
}

/// The map of a spherical harmonic reflection map on a cube: row after row of coefficients.
fn coefficients(device: &Device, layouts: &Layouts, map: &Shrm) -> Result<Map, RenderError> {
    let facts = Facts {
        centre: centre(map.centre()),
        edge: map.grid().shape()[1] as u32,
        degree: map.p().get() as u32,
        zonal: u32::from(map.terms() == Terms::Zonal),
        ..Facts::default()
    };
    cubes(device, layouts, "the SHRM", facts, map.rows(), |row, texel| map.texel(texel)[row])
}

/// `count` cubes, one after the other; `texel` is asked for each texel of each, as `sphere::Cube` counts them.
fn cubes(
    device: &Device,
    layouts: &Layouts,
    what: &str,
    facts: Facts,
    count: usize,
    texel: impl Fn(usize, usize) -> [f32; 3],
) -> Result<Map, RenderError> {
    let edge = u64::from(facts.edge);
    if edge == 0 || count == 0 {
        return Err(RenderError::maps(format!("{what}: a map without texels")));
    }
    let texture = device.texture(what, TEXELS, USAGE, [edge, edge, 6 * count as u64])?;
    let mut staged = 0;
    for k in 0..count {
        let texels = padded((0..6 * (edge * edge) as usize).map(|at| texel(k, at)));
        device.write_layers(&texture, 6 * k as u32, &texels);
        staged += size_of_val(texels.as_slice());
        if staged >= STAGED {
            // What was written waits in a copy until it is submitted, and goes when the device has it.
            device.queue.submit([]);
            device.wait()?;
            staged = 0;
        }
    }
    Map::new(device, layouts, texture, facts)
}

/// All layers of a texture.
fn layers(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        ..TextureViewDescriptor::default()
    })
}

/// RGB in four channels.
fn padded(texels: impl Iterator<Item = [f32; 3]>) -> Vec<[f32; 4]> {
    texels.map(|[r, g, b]| [r, g, b, 1.0]).collect()
}
