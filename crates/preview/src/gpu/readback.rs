//! Buffers of the device, read on the CPU: at once, or when they have come by themselves.

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
    came: Arc<Mutex<Option<Result<(), wgpu::BufferAsyncError>>>>,
}

impl Readback {
    /// Begins to read a buffer with [`BufferUsages::COPY_SRC`], after all that was submitted.
    pub(super) fn begin(device: &Device, buffer: &wgpu::Buffer) -> Result<Self, RenderError> {
        let usage = BufferUsages::COPY_DST | BufferUsages::MAP_READ;
        let copy = device.buffer("reading the picture", usage, buffer.size())?;
        let mut encoder = device.encoder();
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        device.queue.submit([encoder.finish()]);
        let came = Arc::new(Mutex::new(None));
        let tell = Arc::clone(&came);
        copy.map_async(MapMode::Read, .., move |result| {
            *tell.lock() = Some(result);
        });
        Ok(Self { copy, came })
    }

    /// Whether it has come, or will never come.
    pub(super) fn is_done(&self) -> bool {
        self.came.lock().is_some()
    }

    /// What has come.
    pub(super) fn take<T: bytemuck::Pod>(self, device: &Device) -> Result<Vec<T>, RenderError> {
        let came = self.came.lock().take();
        device.sound()?;
        match came {
            None => return Err(device.fault("the picture did not come back")),
            Some(Err(error)) => return Err(device.fault(&error.to_string())),
            Some(Ok(())) => {}
        }
        let range = self.copy.get_mapped_range(..).map_err(|error| device.fault(&error.to_string()))?;
        Ok(bytemuck::pod_collect_to_vec(&range))
    }
}

/// Of all parts of a picture: squared differences, squares of what is compared with, samples that see a surface.
pub(super) fn squares(parts: &[[f32; 4]]) -> Squares {
    let mut sum = Squares::default();
    for &[difference, from, samples, _] in parts {
        sum.join(Squares { samples: samples as u64, difference: difference.into(), from: from.into() });
    }
    sum
}
