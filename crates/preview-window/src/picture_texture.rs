//! The latest picture as a texture of egui.

use std::sync::Arc;

use eframe::egui::mutex::RwLock;
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};
use eframe::egui_wgpu;

use crate::render_thread::RenderedFrame;
use crate::renderer_adapter::FrameImage;

/// The latest picture as a texture.
pub(crate) struct PictureTexture {
    device: wgpu::Device,
    painter: Arc<RwLock<egui_wgpu::Renderer>>,
    frame: Option<(TextureId, RenderedFrame)>,
    /// The texture for pictures in memory.
    memory: Option<TextureHandle>,
    /// The texture for pictures on the device.
    native: Option<TextureId>,
}

impl PictureTexture {
    pub(crate) fn new(state: &egui_wgpu::RenderState) -> Self {
        let (device, painter) = (state.device.clone(), Arc::clone(&state.renderer));
        Self { device, painter, frame: None, memory: None, native: None }
    }

    /// The latest picture and its texture.
    pub(crate) fn frame(&self) -> Option<(TextureId, &RenderedFrame)> {
        self.frame.as_ref().map(|(texture, frame)| (*texture, frame))
    }

    pub(crate) fn put(&mut self, context: &Context, frame: RenderedFrame) {
        let texture = match &frame.image {
            FrameImage::Codes(picture) => {
                let size = picture.size.map(|side| side as usize);
                let image = ColorImage::from_rgb(size, picture.codes.as_flattened());
                let options = if frame.full { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
                match &mut self.memory {
                    Some(handle) => handle.set(image, options),
                    none => *none = Some(context.load_texture("picture", image, options)),
                }
                let Some(handle) = &self.memory else { return };
                handle.id()
            }
            FrameImage::Texture(view) => {
                // A full picture has a pixel for each pixel of the window: its codes stay exact.
                let filter = if frame.full { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear };
                let mut painter = self.painter.write();
                match self.native {
                    Some(id) => {
                        painter.update_egui_texture_from_wgpu_texture(&self.device, view, filter, id);
                        id
                    }
                    None => *self.native.insert(painter.register_native_texture(&self.device, view, filter)),
                }
            }
        };
        self.frame = Some((texture, frame));
    }
}
