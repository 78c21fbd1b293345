//! Pictures through wgpu, on Vulkan, Metal, Direct3D 12 or OpenGL.

mod device;

use crate::{Picture, RenderError, Renderer, Scene, Shot};
use device::Device;
pub use device::Health;

/// Draws through a graphics device.
///
/// What it has put on the device for a mesh, a look or a light is kept while scenes use it, by the identity of their
/// `Arc`s, and dropped with the first scene that does not.
#[derive(Debug)]
pub struct Gpu {
    device: Device,
}

/// How far a picture has come that is drawn again and again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// The light samples that are in it, of each sample of a pixel: 0 where no brute force is shown.
    pub light_samples: u32,
    /// Whether the same call again would show more.
    pub unfinished: bool,
    /// Of a difference: [`Picture::relative_rms`] as it was lately.
    pub relative_rms: Option<f64>,
}

impl Gpu {
    /// The format of [`Gpu::draw`]'s target: sRGB codes, as egui wants its textures.
    pub const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

    /// The best graphics device of this machine, a software one where there is no other. `WGPU_BACKEND` (`vulkan`,
    /// `dx12`, `metal`, `gl`) says which backends are looked at.
    ///
    /// # Errors
    /// [`RenderError::Device`] where there is none that will do.
    pub fn new() -> Result<Self, RenderError> {
        Self::on(Device::best()?)
    }

    /// Draws through a device that exists already, made by [`Gpu::device_descriptor`]. Its handlers of uncaptured errors
    /// and of its loss become those of this renderer, which turns both into errors of the next call.
    ///
    /// # Errors
    /// [`RenderError::Device`] where it will not do.
    pub fn with_device(
        info: wgpu::AdapterInfo,
        device: wgpu::Device,
        queue: wgpu::Queue,
    ) -> Result<Self, RenderError> {
        Self::on(Device::new(info, device, queue))
    }

    /// What must be asked of an adapter for [`Gpu::with_device`].
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        device::descriptor(adapter)
    }

    fn on(device: Device) -> Result<Self, RenderError> {
        device.sound()?;
        Ok(Self { device })
    }

    /// What tells of the loss of the device.
    pub fn health(&self) -> Health {
        self.device.health()
    }

    /// Draws a scene into a texture of [`Gpu::TARGET`] with [`wgpu::TextureUsages::RENDER_ATTACHMENT`], of the shot's
    /// size, without waiting for the device.
    ///
    /// Brute force comes bit by bit: each call adds some light samples, as many as a frame has time for, while scene,
    /// size, samples, camera, turn, modes and [`Shot::light_samples`] stay the same; exposure, tone and background may change.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn draw(
        &mut self,
        _scene: &Scene,
        _shot: &Shot,
        target: &wgpu::TextureView,
    ) -> Result<Drawn, RenderError> {
        let Device { device, queue, .. } = &self.device;
        self.device.guarded(|| {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let attachment = wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            };
            drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(attachment)],
                ..wgpu::RenderPassDescriptor::default()
            }));
            queue.submit([encoder.finish()]);
            Ok(Drawn { light_samples: 0, unfinished: false, relative_rms: None })
        })
    }
}

impl Renderer for Gpu {
    fn name(&self) -> String {
        self.device.name()
    }

    fn render(
        &mut self,
        _scene: &Scene,
        _shot: &Shot,
        _stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        self.device.guarded(|| self.device.wait())?;
        Err(RenderError::Device(format!("{}: there are no pictures yet", self.device.name())))
    }
}
