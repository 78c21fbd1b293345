//! The tables of the product of light and material of a look, made by a pass when the view changes.

use wgpu::BufferUsages;

use super::device::Device;
use super::layouts::{Layouts, Pipelines};
use crate::RenderError;
use crate::shading::product_tables::{CELLS, HEADER, ProductTables, ViewAxes};

/// The tables of a look.
#[derive(Debug)]
pub(super) struct ProductBuffer {
    tables: ProductTables,
    /// All numbers: binding 8 of brute force.
    pub(super) buffer: wgpu::Buffer,
    bound: wgpu::BindGroup,
    /// The view that the tables are for.
    made_for: Option<ViewAxes>,
}

impl ProductBuffer {
    /// The buffer of a look, whose cells are not made.
    pub(super) fn new(
        device: &Device,
        layouts: &Layouts,
        tables: ProductTables,
    ) -> Result<Self, RenderError> {
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let buffer = device.buffer("the product of light and material", usage, 4 * tables.count() as u64)?;
        device.queue.write_buffer(&buffer, 4 * u64::from(HEADER), bytemuck::cast_slice(tables.fixed()));
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("the product of light and material"),
            layout: &layouts.product,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        Ok(Self { tables, buffer, bound, made_for: None })
    }

    /// Makes the tables of a view, a unit vector in the light's frame, unless they are made.
    pub(super) fn update(&mut self, device: &Device, pipelines: &Pipelines, view: glam::Vec3) {
        let axes = ViewAxes::new(view);
        if self.made_for == Some(axes) {
            return;
        }
        device.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&self.tables.header(axes)));
        let mut encoder = device.encoder();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipelines.product);
        pass.set_bind_group(0, &self.bound, &[]);
        pass.dispatch_workgroups(CELLS, CELLS, 1);
        drop(pass);
        device.queue.submit([encoder.finish()]);
        self.made_for = Some(axes);
    }

    /// Says that there are no tables.
    pub(super) fn clear(&mut self, device: &Device) {
        if self.made_for.take().is_some() {
            device.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&0.0_f32));
        }
    }
}
