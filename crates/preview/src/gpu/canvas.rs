//! The buffers and textures of a picture on the device.

use std::ops::Range;

use wgpu::{BufferUsages, TextureUsages, TextureViewDescriptor};

use super::device::{Device, GROUP};
use super::layouts::{DEPTH, Layouts};
use super::maps::Map;
use super::memory::{TEXELS, within};
use crate::RenderError;

/// The buffers of a picture: one sample of each pixel at a time, and sums over the samples drawn so far.
#[derive(Debug)]
pub(super) struct DeviceCanvas {
    pub(super) size: [u32; 2],
    pub(super) samples: u32,
    pub(super) normals: wgpu::TextureView,
    pub(super) tangents: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    /// The map that a mode has drawn to read it: the radiance of vertices, or positions in the mesh.
    pub(super) drawn_map: Option<(Map, wgpu::TextureView)>,
    /// The base colours of textures.
    pub(super) colours: Option<wgpu::TextureView>,
    /// Sums over the samples of pixels: radiance, and the number of samples that hit a surface.
    pub(super) radiances: wgpu::Buffer,
    /// Sums over the samples of pixels: display light.
    pub(super) displays: wgpu::Buffer,
    /// The squared differences, the squares of the reference, and the number of samples that hit a surface,
    /// for each sample of pixels and workgroup.
    pub(super) squares: wgpu::Buffer,
    pub(super) codes: wgpu::Buffer,
    /// The codes, for the pass that presents them.
    presented: wgpu::BindGroup,
    /// The radiance of each side's mode: one buffer, or one for each sample if light samples accumulate.
    sides: [Vec<wgpu::Buffer>; 2],
}

impl DeviceCanvas {
    /// The buffers of a picture, which must have pixels.
    pub(super) fn new(
        device: &Device,
        layouts: &Layouts,
        size: [u32; 2],
        samples: u32,
    ) -> Result<Self, RenderError> {
        let groups = size.map(|side| side.div_ceil(GROUP));
        let most = device.device.limits().max_compute_workgroups_per_dimension;
        within(
            "the picture: workgroups along a side".to_owned(),
            groups[0].max(groups[1]).into(),
            most.into(),
        )?;
        let side = |what: &str, format, usage| {
            let [width, height] = size.map(u64::from);
            let texture =
                device.texture(what, format, usage | TextureUsages::RENDER_ATTACHMENT, [width, height, 1])?;
            Ok::<_, RenderError>(texture.create_view(&TextureViewDescriptor::default()))
        };
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let sums = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let codes = device.buffer("the picture", sums | BufferUsages::COPY_DST, 4 * pixels)?;
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
            drawn_map: None,
            colours: None,
            radiances: device.buffer("the picture", sums, 16 * pixels)?,
            displays: device.buffer("the picture", sums, 16 * pixels)?,
            squares: device.buffer("the picture", sums, squares)?,
            codes,
            presented,
            sides: [Vec::new(), Vec::new()],
        })
    }

    /// Makes sure that [`DeviceCanvas::drawn_map`] exists.
    pub(super) fn reserve_drawn_map(
        &mut self,
        device: &Device,
        layouts: &Layouts,
    ) -> Result<(), RenderError> {
        if self.drawn_map.is_none() {
            self.drawn_map = Some(Map::picture(device, layouts, self.size)?);
        }
        Ok(())
    }

    /// Makes sure that [`DeviceCanvas::colours`] exist.
    pub(super) fn reserve_colours(&mut self, device: &Device) -> Result<(), RenderError> {
        if self.colours.is_none() {
            let [width, height] = self.size.map(u64::from);
            let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT;
            let texture = device.texture("the picture", TEXELS, usage, [width, height, 1])?;
            self.colours = Some(texture.create_view(&TextureViewDescriptor::default()));
        }
        Ok(())
    }

    /// Writes the codes of a diagram into some columns, after all work that was submitted before.
    pub(super) fn place_diagram(&self, device: &Device, columns: Range<u32>, codes: &[[u8; 3]]) {
        let bytes: Vec<[u8; 4]> = codes.iter().map(|[red, green, blue]| [*red, *green, *blue, 255]).collect();
        if columns == (0..self.size[0]) {
            return device.queue.write_buffer(&self.codes, 0, bytemuck::cast_slice(&bytes));
        }
        let rows = bytes.chunks_exact((columns.end - columns.start) as usize);
        for (row, bytes) in (0..).zip(rows) {
            let first = 4 * (row * u64::from(self.size[0]) + u64::from(columns.start));
            device.queue.write_buffer(&self.codes, first, bytemuck::cast_slice(bytes));
        }
    }

    /// Writes the codes into a texture.
    pub(super) fn present(
        &self,
        pipeline: &wgpu::RenderPipeline,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("present"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.presented, &[]);
        pass.draw(0..3, 0..1);
    }

    /// The number of workgroups across and down.
    pub(super) fn groups(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(GROUP))
    }

    /// Makes sure that a side has this many buffers of radiance.
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

    /// The radiance of a side's mode at a sample of pixels; that of the first side if the second has none.
    pub(super) fn light(&self, side: usize, sample: usize) -> Option<&wgpu::Buffer> {
        let buffers = if self.sides[side].is_empty() { &self.sides[0] } else { &self.sides[side] };
        buffers.get(sample.min(buffers.len().saturating_sub(1)))
    }
}
