//! The vertices of an object that a BRDF table shades, on the device.
//!
//! The light in the frames of the vertices changes only with the light: the CPU turns it and uploads it. The
//! shader adds the view. While only the light moves, it is the other way round: the CPU keeps the table's
//! coefficients toward the viewer and uploads radiance, which is smaller than the light in all frames.

use sh::Expansion;
use transfer::{FixedView, Frames};
use wgpu::{BindGroupEntry, BufferUsages};

use super::device::Device;
use super::layouts::{Layouts, Pipelines};
use crate::shading::table::TableUniforms;
use crate::vertex_shading::{Change, ShadedMesh, VertexPasses, VertexView};
use crate::{Object, RenderError, Shot};

/// The struct `VertexUniforms` of vertices.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct VertexUniforms {
    viewer: [f32; 3],
    count: u32,
    table: TableUniforms,
    unused: [u32; 2],
}

/// The number of invocations of a workgroup of `shade_vertices`.
const WORKGROUP: u32 = 64;

/// The vertices of an object that a shader shades, and what it keeps of them between pictures.
#[derive(Debug)]
pub(super) struct ShadedVertices {
    of: ShadedMesh,
    frames: Frames,
    view: Option<VertexView>,
    seen: Option<FixedView>,
    /// The light whose values in the frames are on the device, the number of its coefficients there, and the
    /// buffer.
    light: Option<(Expansion, usize, wgpu::Buffer)>,
    placed: wgpu::Buffer,
    table: wgpu::Buffer,
    /// The radiance of each vertex, as a vertex buffer.
    pub(super) radiance: wgpu::Buffer,
    pub(super) passes: VertexPasses,
}

impl ShadedVertices {
    /// The buffers of a mesh that was not shaded before.
    pub(super) fn new(device: &Device, of: ShadedMesh) -> Result<Self, RenderError> {
        let frames = of.frames()?;
        let placed: Vec<[[f32; 4]; 4]> = (0..frames.len())
            .map(|vertex| {
                let [x, y, n] = frames.axes(vertex);
                let mut placed = [frames.positions()[vertex], x, y, n].map(|[a, b, c]| [a, b, c, 0.0]);
                placed[0][3] = frames.blend(vertex);
                placed
            })
            .collect();
        let usage = BufferUsages::STORAGE | BufferUsages::VERTEX | BufferUsages::COPY_DST;
        let (view, seen, light, passes) = (None, None, None, VertexPasses::default());
        Ok(Self {
            placed: device.filled("the frames of vertices", BufferUsages::STORAGE, &placed)?,
            table: device.filled("a BRDF table", BufferUsages::STORAGE, of.table.values())?,
            radiance: device.buffer("the radiance of vertices", usage, 16 * frames.len() as u64)?,
            of,
            frames,
            view,
            seen,
            light,
            passes,
        })
    }

    /// Whether the buffers are the shading of this mesh.
    pub(super) fn is_of(&self, mesh: &ShadedMesh) -> bool {
        self.of.is_same(mesh)
    }

    /// Shades the vertices of an object, unless nothing changed.
    pub(super) fn update(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        pipelines: &Pipelines,
        object: &Object,
        shot: &Shot,
    ) -> Result<(), RenderError> {
        let view = self.of.view(object, shot);
        match view.change(self.view.as_ref()) {
            Change::Nothing => return Ok(()),
            Change::Light => {
                let kept = self.seen.get_or_insert_with(|| self.of.fixed_view(&self.frames, view.viewer));
                let radiance: Vec<[f32; 4]> =
                    kept.shade(&view.light).into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect();
                device.queue.write_buffer(&self.radiance, 0, bytemuck::cast_slice(&radiance));
                self.passes.view_kept += 1;
            }
            change => {
                self.seen = None;
                self.shade(device, layouts, pipelines, &view)?;
                match change {
                    Change::View => self.passes.light_kept += 1,
                    _ => self.passes.both_new += 1,
                }
            }
        }
        self.view = Some(view);
        Ok(())
    }

    /// Runs the shader, after uploading the light if it is new.
    fn shade(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        pipelines: &Pipelines,
        view: &VertexView,
    ) -> Result<(), RenderError> {
        if self.light.as_ref().is_none_or(|(light, ..)| *light != view.light) {
            let kept = self.of.fixed_light(&self.frames, &view.light);
            let buffer = device.filled("the light of vertices", BufferUsages::STORAGE, &kept.values())?;
            self.light = Some((view.light.clone(), kept.degree().rows(), buffer));
        }
        let Some((_, rows, light)) = &self.light else { return Ok(()) };
        let count = self.frames.len() as u32;
        let uniforms = VertexUniforms {
            viewer: view.viewer.map(|coordinate| coordinate as f32),
            count,
            table: TableUniforms::new(&self.of.table, *rows),
            unused: [0; 2],
        };
        let uniforms = device.filled("the vertices of a mesh", BufferUsages::UNIFORM, &[uniforms])?;
        let buffers = [&uniforms, &self.placed, &self.table, light, &self.radiance];
        let entries: Vec<BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("the vertices of a mesh"),
            layout: &layouts.vertices,
            entries: &entries,
        });
        let mut encoder = device.encoder();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipelines.vertices);
        pass.set_bind_group(0, &bound, &[]);
        let most = device.device.limits().max_compute_workgroups_per_dimension;
        let groups = count.div_ceil(WORKGROUP);
        pass.dispatch_workgroups(groups.min(most), groups.div_ceil(most), 1);
        drop(pass);
        device.queue.submit([encoder.finish()]);
        Ok(())
    }
}
