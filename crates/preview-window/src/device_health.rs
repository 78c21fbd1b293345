//! Whether the device of the window still works, asked before each frame: egui's painter panics on a lost one.

use preview::Health;

/// The least that can be written.
const FOUR: wgpu::BufferSize = match wgpu::BufferSize::new(wgpu::COPY_BUFFER_ALIGNMENT) {
    Some(size) => size,
    None => wgpu::BufferSize::MIN,
};

/// Feels the pulse of a device.
pub(crate) struct DeviceHealth {
    device: wgpu::Device,
    queue: wgpu::Queue,
    buffer: wgpu::Buffer,
    /// None where nobody else draws on the device.
    health: Option<Health>,
}

impl DeviceHealth {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, health: Option<Health>) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pulse"),
            size: wgpu::COPY_BUFFER_ALIGNMENT,
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { device: device.clone(), queue: queue.clone(), buffer, health }
    }

    /// Why the device does nothing any more.
    pub(crate) fn lost(&self) -> Option<String> {
        // Callbacks of the device run within.
        let _ = self.device.poll(wgpu::PollType::Poll);
        // The very call that the painter relies on.
        let taken = self.queue.write_buffer_with(&self.buffer, 0, FOUR);
        let told = self.health.as_ref().and_then(Health::lost);
        told.or_else(|| taken.is_none().then(|| "it takes no more data".to_owned()))
    }

    /// Destroys the device.
    pub(crate) fn stop(&self) {
        self.device.destroy();
    }
}
