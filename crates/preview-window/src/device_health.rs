//! Checks before each frame whether the window's device still works: egui's painter panics on a lost one.

use preview::DeviceStatus;

/// The smallest write.
const FOUR_BYTES: wgpu::BufferSize = match wgpu::BufferSize::new(wgpu::COPY_BUFFER_ALIGNMENT) {
    Some(size) => size,
    None => wgpu::BufferSize::MIN,
};

/// Checks whether a device still works.
pub(crate) struct DeviceHealth {
    device: wgpu::Device,
    queue: wgpu::Queue,
    buffer: wgpu::Buffer,
    /// The status that the preview's renderer keeps; `None` if the CPU draws the pictures.
    status: Option<DeviceStatus>,
}

impl DeviceHealth {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, status: Option<DeviceStatus>) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("device health"),
            size: wgpu::COPY_BUFFER_ALIGNMENT,
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { device: device.clone(), queue: queue.clone(), buffer, status }
    }

    /// Why the device stopped working.
    pub(crate) fn lost(&self) -> Option<String> {
        // The device's callbacks run inside `poll`.
        let _ = self.device.poll(wgpu::PollType::Poll);
        // The painter panics if this call returns `None`.
        let view = self.queue.write_buffer_with(&self.buffer, 0, FOUR_BYTES);
        let reason = self.status.as_ref().and_then(DeviceStatus::lost);
        reason.or_else(|| view.is_none().then(|| "it accepts no data".to_owned()))
    }

    pub(crate) fn destroy(&self) {
        self.device.destroy();
    }
}
