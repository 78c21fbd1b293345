//! The memory of a picture on the device.

use wgpu::{BufferUsages, TextureUsages, TextureViewDescriptor};

use super::device::Device;
use super::layouts::{DEPTH, Layouts};
use super::memory::{TEXELS, within};
use crate::RenderError;

/// Pixels along each side of a group of the compute passes.
pub(super) const GROUP: u32 = 8;

/// What a picture is drawn in: one sample of each pixel at a time, and sums over those that are done.
#[derive(Debug)]
pub(super) struct Canvas {
    pub(super) size: [u32; 2],
    pub(super) samples: u32,
    pub(super) normals: wgpu::TextureView,
    pub(super) tangents: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    /// Sums over samples of pixels: radiance and how many see a surface; display light.
    pub(super) radiances: wgpu::Buffer,
    pub(super) displays: wgpu::Buffer,
    /// Of each sample of pixels and group: squared differences, squares of what is compared with, how many
    /// samples see a surface.
    pub(super) squares: wgpu::Buffer,
    pub(super) codes: wgpu::Buffer,
    /// The codes, for the pass that presents them.
    pub(super) presented: wgpu::BindGroup,
    /// Of each side, the light of its mode: one buffer for all samples of pixels, or one for each where light gathers.
    sides: [Vec<wgpu::Buffer>; 2],
}

impl Canvas {
    /// Of a picture that has pixels.
    pub(super) fn new(
        device: &Device,
        layouts: &Layouts,
        size: [u32; 2],
        samples: u32,
    ) -> Result<Self, RenderError> {
        let groups = size.map(|side| side.div_ceil(GROUP));
        let most = device.device.limits().max_compute_workgroups_per_dimension;
        within("the picture: groups of pixels".to_owned(), groups[0].max(groups[1]).into(), most.into())?;
        let side = |what: &str, format, usage| {
            let [width, height] = size.map(u64::from);
            let texture =
                device.texture(what, format, usage | TextureUsages::RENDER_ATTACHMENT, [width, height, 1])?;
            Ok::<_, RenderError>(texture.create_view(&TextureViewDescriptor::default()))
        };
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let sums = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let codes = device.buffer("the picture", sums, 4 * pixels)?;
        let shape = device.filled("the picture's size", BufferUsages::UNIFORM, &size)?;
        let presented = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("codes"),
            layout: &layouts.present,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: shape.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: codes.as_entire_binding() },
            ],
        });
        let squares = 16 * u64::from(groups[0] * groups[1]) * u64::from(samples * samples);
        Ok(Self {
            size,
            samples,
            normals: side("the picture", TEXELS, TextureUsages::TEXTURE_BINDING)?,
            tangents: side("the picture", TEXELS, TextureUsages::TEXTURE_BINDING)?,
            depth: side("the picture", DEPTH, TextureUsages::empty())?,
            radiances: device.buffer("the picture", sums, 16 * pixels)?,
            displays: device.buffer("the picture", sums, 16 * pixels)?,
            squares: device.buffer("the picture", sums, squares)?,
            codes,
            presented,
            sides: [Vec::new(), Vec::new()],
        })
    }

    /// Groups of pixels across and down.
    pub(super) fn groups(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(GROUP))
    }

    /// Sees to it that a side has so many buffers of light.
    pub(super) fn reserve(&mut self, device: &Device, side: usize, count: usize) -> Result<(), RenderError> {
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        let buffers = &mut self.sides[side];
        buffers.truncate(count);
        while buffers.len() < count {
            let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
            buffers.push(device.buffer("the picture", usage, 16 * pixels)?);
        }
        Ok(())
    }

    /// The light of a side's mode at a sample of pixels; the first side's where the second has none.
    pub(super) fn light(&self, side: usize, sample: usize) -> Option<&wgpu::Buffer> {
        let buffers = if self.sides[side].is_empty() { &self.sides[0] } else { &self.sides[side] };
        buffers.get(sample.min(buffers.len().saturating_sub(1)))
    }
}
