//! A mesh on the device.

use std::array;

use glam::{Mat4, Vec3};
use mesh::Mesh;
use wgpu::BufferUsages;

use super::device::Device;
use super::memory::within;
use crate::RenderError;

/// Position, normal and tangent of a vertex.
type MeshVertex = [[f32; 3]; 3];

/// A mesh that has triangles.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) count: u32,
    corners: [Vec3; 8],
}

/// A rectangle of pixels: its upper left corner, its width and height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub(super) origin: [u32; 2],
    pub(super) extent: [u32; 2],
}

impl Shape {
    pub(super) const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
    pub(super) const LAYOUT: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<MeshVertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &Self::ATTRIBUTES,
    };

    /// The coordinates of vertices in a texture, in a buffer of their own.
    pub(super) const COORDINATES: wgpu::VertexBufferLayout<'static> = wgpu::VertexBufferLayout {
        array_stride: size_of::<[f32; 2]>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &wgpu::vertex_attr_array![3 => Float32x2],
    };

    /// The buffers of a mesh; `None` if it has no triangles.
    pub(super) fn new(device: &Device, mesh: &Mesh) -> Result<Option<Self>, RenderError> {
        if mesh.triangles().is_empty() {
            return Ok(None);
        }
        within(
            "a mesh: the corners of its triangles".to_owned(),
            3 * mesh.triangles().len() as u64,
            u32::MAX.into(),
        )?;
        let vertices: Vec<MeshVertex> = (0..mesh.positions().len())
            .map(|k| {
                let [x, y, z, _] = mesh.tangents()[k];
                [mesh.positions()[k], mesh.normals()[k], [x, y, z]]
            })
            .collect();
        let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &position in mesh.triangles().iter().flatten().map(|&vertex| &mesh.positions()[vertex as usize]) {
            (least, most) = (least.min(position.into()), most.max(position.into()));
        }
        Ok(Some(Self {
            vertices: device.filled("the vertices of a mesh", BufferUsages::VERTEX, &vertices)?,
            indices: device.filled(
                "the triangles of a mesh",
                BufferUsages::INDEX | BufferUsages::STORAGE,
                mesh.triangles(),
            )?,
            count: 3 * mesh.triangles().len() as u32,
            corners: array::from_fn(|corner| {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { least[axis] } else { most[axis] };
                Vec3::new(pick(0), pick(1), pick(2))
            }),
        }))
    }

    /// Draws the mesh, with whatever else is bound.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.count, 0, 0..1);
    }

    /// The pixels that the mesh may cover; `None` if there are none.
    pub(super) fn pixels(&self, clip: Mat4, size: [u32; 2]) -> Option<Rectangle> {
        let (mut least, mut most) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for corner in self.corners {
            let at = clip * corner.extend(1.0);
            if at.w <= 0.0 {
                // The projection of a point behind the eye is unknown.
                return Some(Rectangle { origin: [0, 0], extent: size });
            }
            for (axis, place) in [at.x / at.w, -at.y / at.w].into_iter().enumerate() {
                let pixel = (place + 1.0) / 2.0 * size[axis] as f32;
                (least[axis], most[axis]) = (least[axis].min(pixel), most[axis].max(pixel));
            }
        }
        // One pixel for the places of its samples, one for rounding.
        let origin = [0, 1].map(|axis| (least[axis] - 2.0).clamp(0.0, size[axis] as f32) as u32);
        let end = [0, 1].map(|axis| (most[axis] + 3.0).clamp(0.0, size[axis] as f32) as u32);
        let extent = [0, 1].map(|axis| end[axis].saturating_sub(origin[axis]));
        (extent[0] > 0 && extent[1] > 0).then_some(Rectangle { origin, extent })
    }
}

impl Rectangle {
    /// The part in some columns.
    pub(super) fn columns(self, columns: std::ops::Range<u32>) -> Option<Self> {
        let start = self.origin[0].max(columns.start);
        let width = (self.origin[0] + self.extent[0]).min(columns.end).saturating_sub(start);
        (width > 0).then_some(Self { origin: [start, self.origin[1]], extent: [width, self.extent[1]] })
    }
}
