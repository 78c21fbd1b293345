//! The latest picture where egui finds it.

use std::sync::Arc;

use eframe::egui::mutex::RwLock;
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};
use eframe::egui_wgpu;

use crate::render_thread::Frame;
use crate::renderer_adapter::Canvas;

/// The latest picture.
pub(crate) struct Screen {
    device: wgpu::Device,
    painter: Arc<RwLock<egui_wgpu::Renderer>>,
    seen: Option<(TextureId, Frame)>,
    /// The texture of pictures in this machine's memory.
    memory: Option<TextureHandle>,
    /// Of those on the device.
    native: Option<TextureId>,
}

impl Screen {
    pub(crate) fn new(state: &egui_wgpu::RenderState) -> Self {
        let (device, painter) = (state.device.clone(), Arc::clone(&state.renderer));
        Self { device, painter, seen: None, memory: None, native: None }
    }

    /// The picture, once there is one.
    pub(crate) fn seen(&self) -> Option<(TextureId, &Frame)> {
        self.seen.as_ref().map(|(texture, frame)| (*texture, frame))
    }

    /// Shows a picture from now on.
    pub(crate) fn put(&mut self, context: &Context, frame: Frame) {
        let texture = match &frame.canvas {
            Canvas::Codes(picture) => {
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
            Canvas::Texture(view) => {
                // A full picture has a pixel for each of the window's, so that its codes arrive as they are.
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
        self.seen = Some((texture, frame));
    }
}
