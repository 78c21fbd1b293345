//! The light at an object's vertices, on the device, where it changes only with the light. The shader of
//! surfaces turns it into the frame of each sample, and adds the view there.

use transfer::Frames;
use wgpu::{BindGroupEntry, BufferUsages};

use super::device::Device;
use super::layouts::Layouts;
use super::mesh::Shape;
use crate::shading::table::TableUniforms;
use crate::vertex_light::{LightAtVertices, MeshLight, MeshView, ShadedMesh};
use crate::{Object, RenderError, Shot};

/// The struct `ShadedUniforms` of shaded.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct ShadedUniforms {
    viewer: [f32; 3],
    lights_of_vertices: u32,
    table: TableUniforms,
    unused: u32,
}

/// A light at the vertices of a mesh, on the device.
#[derive(Debug)]
struct LightOnDevice {
    of: MeshLight,
    table: TableUniforms,
    of_vertices: bool,
    values: wgpu::Buffer,
    quarter_turns: wgpu::Buffer,
}

/// The inputs of a shader that shades an object with a BRDF table, and what is kept of them between pictures.
#[derive(Debug)]
pub(super) struct VertexLight {
    of: ShadedMesh,
    frames: Frames,
    view: Option<MeshView>,
    /// The light whose values are on the device.
    light: Option<LightOnDevice>,
    placed: wgpu::Buffer,
    table: wgpu::Buffer,
    /// All of them, for the view of the last picture.
    pub(super) bound: Option<wgpu::BindGroup>,
    /// The number of times that a light was brought to the vertices.
    pub(super) passes: u32,
}

impl VertexLight {
    /// The buffers of a mesh to which no light was brought before.
    pub(super) fn new(device: &Device, of: ShadedMesh) -> Result<Self, RenderError> {
        let frames = of.frames()?;
        let placed: Vec<[[f32; 4]; 4]> = (0..frames.len())
            .map(|vertex| {
                let [x, y, n] = frames.axes(vertex);
                let mut placed = [frames.positions()[vertex], x, y, n].map(|[a, b, c]| [a, b, c, 0.0]);
                [placed[0][3], placed[1][3]] = frames.blend(vertex);
                placed
            })
            .collect();
        Ok(Self {
            placed: device.filled("the frames of vertices", BufferUsages::STORAGE, &placed)?,
            table: device.filled("a BRDF table", BufferUsages::STORAGE, of.table.values())?,
            of,
            frames,
            view: None,
            light: None,
            bound: None,
            passes: 0,
        })
    }

    /// Whether the buffers are those of this mesh.
    pub(super) fn is_of(&self, mesh: &ShadedMesh) -> bool {
        self.of.is_same(mesh)
    }

    /// Brings light and view of a shot to the vertices of an object, unless they are there.
    pub(super) fn update(
        &mut self,
        device: &Device,
        layouts: &Layouts,
        shape: &Shape,
        object: &Object,
        shot: &Shot,
    ) -> Result<(), RenderError> {
        let view = self.of.view(object, shot);
        if self.bound.is_some() && self.view.as_ref() == Some(&view) {
            return Ok(());
        }
        if self.light.as_ref().is_none_or(|light| light.of != view.light) {
            let LightAtVertices { rows, values, of_vertices, mut quarter_turns } =
                self.of.light(&self.frames, &view.light);
            // No binding may be empty.
            quarter_turns.resize(quarter_turns.len().max(1), [0.0; 2]);
            self.light = Some(LightOnDevice {
                of: view.light.clone(),
                table: TableUniforms::new(&self.of.table, rows),
                of_vertices,
                values: device.filled("the light of vertices", BufferUsages::STORAGE, &values)?,
                quarter_turns: device.filled("quarter turns", BufferUsages::STORAGE, &quarter_turns)?,
            });
            self.passes += 1;
        }
        let Some(light) = &self.light else { return Ok(()) };
        let uniforms = ShadedUniforms {
            viewer: view.viewer.map(|coordinate| coordinate as f32),
            lights_of_vertices: u32::from(light.of_vertices),
            table: light.table,
            unused: 0,
        };
        let uniforms = device.filled("a view of a mesh", BufferUsages::UNIFORM, &[uniforms])?;
        let buffers =
            [&uniforms, &self.placed, &self.table, &light.values, &shape.indices, &light.quarter_turns];
        let entries: Vec<BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        self.bound = Some(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("the light of vertices"),
            layout: &layouts.vertex_light,
            entries: &entries,
        }));
        self.view = Some(view);
        Ok(())
    }
}
