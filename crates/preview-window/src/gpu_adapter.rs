//! Draws on the graphics device that draws the window, into textures that egui shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::renderer_adapter::{Canvas, PartialFrame, RenderRequest, RendererAdapter};
use preview::{Gpu, Health, Picture, RenderError, Renderer, Shot};

/// Draws by wgpu.
pub(crate) struct GpuAdapter {
    gpu: Gpu,
    health: Health,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// Two of them: egui shows the one while the other is drawn.
    textures: [Option<wgpu::Texture>; 2],
    turn: usize,
}

/// How long to sleep between looks at the device. It must not be waited for: while one thread does, no other may submit.
const LOOK: Duration = Duration::from_micros(500);

impl GpuAdapter {
    pub(crate) fn new(
        info: wgpu::AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        let gpu = Gpu::with_device(info, device.clone(), queue.clone())?;
        Ok(Self { health: gpu.health(), gpu, device, queue, textures: [None, None], turn: 0 })
    }

    /// What tells of the loss of the device.
    pub(crate) fn health(&self) -> Health {
        self.health.clone()
    }

    /// A view of the texture that is not seen now, of this size.
    fn target(&mut self, size: [u32; 2]) -> wgpu::TextureView {
        self.turn = 1 - self.turn;
        let texture = &mut self.textures[self.turn];
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

    /// Returns when the device has done what it was given, or is lost.
    fn finish(&self) {
        let done = Arc::new(AtomicBool::new(false));
        let tell = Arc::clone(&done);
        self.queue.on_submitted_work_done(move || tell.store(true, Ordering::Release));
        while !done.load(Ordering::Acquire) && self.health.lost().is_none() {
            if self.device.poll(wgpu::PollType::Poll).is_err() {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl RendererAdapter for GpuAdapter {
    fn name(&self) -> String {
        self.gpu.name()
    }

    fn draw(
        &mut self,
        order: &RenderRequest,
        shot: &Shot,
        _stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<PartialFrame, RenderError> {
        let target = self.target(shot.size);
        let drawn = self.gpu.draw(&order.scene, shot, &target)?;
        self.finish();
        Ok(PartialFrame {
            canvas: Canvas::Texture(target),
            light_samples: drawn.light_samples,
            unfinished: drawn.unfinished,
            relative_rms: drawn.relative_rms,
        })
    }

    fn picture(
        &mut self,
        order: &RenderRequest,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        self.gpu.render(&order.scene, &order.shot, stop)
    }

    fn lost(&self) -> Option<String> {
        self.health.lost()
    }
}
