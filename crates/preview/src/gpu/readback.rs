//! Copies buffers of the device to the CPU: waits for them, or takes them when they have arrived.

use std::sync::Arc;

use parking_lot::Mutex;
use wgpu::{BufferUsages, MapMode};

use super::device::Device;
use crate::RenderError;
use crate::shading::difference::Squares;

/// A copy of a buffer on its way to the CPU.
#[derive(Debug)]
pub(super) struct Readback {
    copy: wgpu::Buffer,
    result: Arc<Mutex<Option<Result<(), wgpu::BufferAsyncError>>>>,
}

impl Readback {
    /// Starts to read a buffer with [`BufferUsages::COPY_SRC`], after all submitted work.
    pub(super) fn start(device: &Device, buffer: &wgpu::Buffer) -> Result<Self, RenderError> {
        let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
        let copy = device.buffer("reading the picture", usage, buffer.size())?;
        let mut encoder = device.encoder();
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        device.queue.submit([encoder.finish()]);
        let result = Arc::new(Mutex::new(None));
        let set = Arc::clone(&result);
        copy.map_async(MapMode::Read, .., move |mapped| {
            *set.lock() = Some(mapped);
        });
        Ok(Self { copy, result })
    }

    /// Whether the copy has arrived or failed.
    pub(super) fn is_done(&self) -> bool {
        self.result.lock().is_some()
    }

    /// The contents of the buffer.
    pub(super) fn take<T: bytemuck::Pod>(self, device: &Device) -> Result<Vec<T>, RenderError> {
        let result = self.result.lock().take();
        device.check()?;
        match result {
            None => return Err(device.error("the picture was not read back")),
            Some(Err(error)) => return Err(device.error(&error.to_string())),
            Some(Ok(())) => {}
        }
        let range = self.copy.get_mapped_range(..).map_err(|error| device.error(&error.to_string()))?;
        Ok(bytemuck::pod_collect_to_vec(&range))
    }
}

/// The sums over all parts of a picture: squared differences, squares of the reference, and samples.
pub(super) fn squares(parts: &[[f32; 4]]) -> Squares {
    let mut sum = Squares::default();
    for &[difference, from, samples, _] in parts {
        sum.join(Squares { samples: samples as u64, difference: difference.into(), from: from.into() });
    }
    sum
}
