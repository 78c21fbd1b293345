//! Draws pictures on the window's graphics device, into textures that egui shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::renderer_adapter::{FrameImage, PartialFrame, RenderRequest, RendererAdapter};
use preview::{DeviceStatus, Gpu, Picture, RenderError, Renderer, Shot};
use sh::Stop;

/// Draws through wgpu.
pub(crate) struct GpuAdapter {
    gpu: Gpu,
    status: DeviceStatus,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// The textures, of which egui shows one while the other is drawn.
    textures: [Option<wgpu::Texture>; 2],
    /// The index of the texture that is drawn.
    next: usize,
}

/// How long to sleep between polls. A blocking wait would keep the window's thread from submitting.
const POLL_INTERVAL: Duration = Duration::from_micros(500);

impl GpuAdapter {
    pub(crate) fn new(
        info: wgpu::AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        let gpu = Gpu::with_device(info, device.clone(), queue.clone())?;
        Ok(Self { status: gpu.status(), gpu, device, queue, textures: [None, None], next: 0 })
    }

    /// Reports the loss of the device.
    pub(crate) fn status(&self) -> DeviceStatus {
        self.status.clone()
    }

    /// A view of the texture that is not on the screen, in this size.
    fn target(&mut self, size: [u32; 2]) -> wgpu::TextureView {
        self.next = 1 - self.next;
        let texture = &mut self.textures[self.next];
        let [width, height] = size;
        if texture.as_ref().is_none_or(|texture| (texture.width(), texture.height()) != (width, height)) {
            *texture = None;
        }
        let texture = texture.get_or_insert_with(|| {
            self.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: Gpu::TARGET,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        });
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Returns when the submitted work is done or the device is lost.
    fn finish(&self) {
        let done = Arc::new(AtomicBool::new(false));
        let set = Arc::clone(&done);
        self.queue.on_submitted_work_done(move || set.store(true, Ordering::Release));
        while !done.load(Ordering::Acquire) && self.status.lost().is_none() {
            if self.device.poll(wgpu::PollType::Poll).is_err() {
                return;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

impl RendererAdapter for GpuAdapter {
    fn name(&self) -> String {
        self.gpu.name()
    }

    fn draw(
        &mut self,
        request: &RenderRequest,
        shot: &Shot,
        _stop: Stop<'_>,
    ) -> Result<PartialFrame, RenderError> {
        let target = self.target(shot.size);
        let drawn = self.gpu.draw(&request.scene, shot, &target)?;
        self.finish();
        Ok(PartialFrame {
            image: FrameImage::Texture(target),
            light_samples: drawn.light_samples,
            unfinished: drawn.unfinished,
            relative_rms: drawn.relative_rms,
        })
    }

    fn picture(&mut self, request: &RenderRequest, stop: Stop<'_>) -> Result<Picture, RenderError> {
        self.gpu.render(&request.scene, &request.shot, stop)
    }

    fn lost(&self) -> Option<String> {
        self.status.lost()
    }
}
