//! What casts the shadows of a mesh, on the device.

use mesh::Mesh;
use transfer::Occluders;
use wgpu::{BindGroupEntry, BufferUsages};

use super::device::Device;
use super::layouts::Layouts;
use super::maps::{LampBuffers, LightSampling};
use super::memory::within;
use crate::shading::shadows::to_mesh;
use crate::{Object, RenderError, Shot};

/// The tree of a mesh's triangles, as shadows.wgsl reads it.
#[derive(Debug)]
pub(super) struct ShadowTree {
    buffer: wgpu::Buffer,
    nodes: u32,
}

/// The struct `ShadowUniforms` of shadows.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct ShadowUniforms {
    to_mesh: [[f32; 4]; 3],
    nodes: u32,
    unused: [u32; 3],
}

impl ShadowTree {
    /// The tree of a mesh.
    pub(super) fn new(device: &Device, mesh: &Mesh) -> Result<Self, RenderError> {
        let occluders = Occluders::of(mesh);
        let (nodes, triangles) = occluders.nodes();
        within("shadows: the triangles of a mesh".to_owned(), triangles.len() as u64, 1 << 24)?;
        let mut words: Vec<[u32; 4]> = Vec::with_capacity(2 * nodes.len() + 3 * triangles.len());
        let word = |[x, y, z]: [f32; 3], last: u32| [x.to_bits(), y.to_bits(), z.to_bits(), last];
        for node in &nodes {
            words.push(word(node.min, node.skip));
            words.push(word(node.max, node.first << 8 | node.count));
        }
        words.extend(triangles.as_flattened().iter().map(|corner| word(*corner, 0)));
        let buffer = device.filled("the triangles that cast shadows", BufferUsages::STORAGE, &words)?;
        Ok(Self { buffer, nodes: nodes.len() as u32 })
    }

    /// Binds the buffers that shadowed brute force reads of an object.
    pub(super) fn bound(
        &self,
        device: &Device,
        layouts: &Layouts,
        samples: &LightSampling,
        uniforms: ShadowUniforms,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let buffers: Vec<_> = LightSampling::BINDINGS.into_iter().zip(&samples.buffers).collect();
        self.bound_with(device, &layouts.shadowed, &buffers, uniforms)
    }

    /// Binds the buffers that shadowed lamps of an object read.
    pub(super) fn bound_with_lamps(
        &self,
        device: &Device,
        layouts: &Layouts,
        lamps: &LampBuffers,
        uniforms: ShadowUniforms,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let [material, lamps] = &lamps.buffers;
        self.bound_with(device, &layouts.shadowed_lamps, &[(1, material), (3, lamps)], uniforms)
    }

    fn bound_with(
        &self,
        device: &Device,
        layout: &wgpu::BindGroupLayout,
        buffers: &[(u32, &wgpu::Buffer)],
        uniforms: ShadowUniforms,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let uniforms = device.filled("the shadows of an object", BufferUsages::UNIFORM, &[uniforms])?;
        let buffers = buffers.iter().copied().chain([(4, &self.buffer), (5, &uniforms)]);
        let entries: Vec<BindGroupEntry<'_>> = buffers
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("light, material and shadows"),
            layout,
            entries: &entries,
        }))
    }
}

impl ShadowUniforms {
    /// The shadows of an object on itself in a shot.
    pub(super) fn new(tree: &ShadowTree, object: &Object, shot: &Shot) -> Self {
        let [x, y, z] = to_mesh(object, shot).as_mat3().to_cols_array_2d();
        Self { to_mesh: [x, y, z].map(|[a, b, c]| [a, b, c, 0.0]), nodes: tree.nodes, unused: [0; 3] }
    }
}
