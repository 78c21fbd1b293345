//! What draws the pictures of the window, a bit at a time.

use std::sync::Arc;

use crate::{Mode, Picture, RenderError, Renderer, Scene, Shot};

/// What is to be drawn.
#[derive(Clone, Debug)]
pub(super) struct Order {
    /// Another for every scene.
    pub(super) edition: u64,
    pub(super) scene: Arc<Scene>,
    /// Of the whole picture, as it is at rest.
    pub(super) shot: Shot,
}

/// Where a picture is.
#[derive(Clone, Debug)]
pub(super) enum Canvas {
    /// In this machine's memory.
    Codes(Arc<Picture>),
    /// On the graphics device that draws the window, as egui wants it.
    Texture(wgpu::TextureView),
}

/// A picture as far as it has come.
#[derive(Clone, Debug)]
pub(super) struct Stroke {
    pub(super) canvas: Canvas,
    /// The light samples that are in it, of a mode by brute force.
    pub(super) light_samples: u32,
    /// Whether the same call again shows more.
    pub(super) unfinished: bool,
    /// Of a difference: [`Picture::relative_rms`].
    pub(super) relative_rms: Option<f64>,
}

/// Draws for the window.
pub(super) trait Easel: Send {
    /// As [`Renderer::name`].
    fn name(&self) -> String;

    /// Draws an order by another shot of it, coarser perhaps. Brute force comes bit by bit, while it is asked for the same
    /// again.
    fn draw(
        &mut self,
        order: &Order,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Stroke, RenderError>;

    /// The whole picture, to keep.
    fn picture(&mut self, order: &Order, stop: &(dyn Fn() -> bool + Sync)) -> Result<Picture, RenderError>;

    /// Why it will never draw again.
    fn lost(&self) -> Option<String>;
}

/// Draws by any renderer, in this machine's memory.
pub(super) struct MemoryEasel {
    renderer: Box<dyn Renderer + Send>,
    /// What was drawn last, and with how many light samples.
    last: Option<(u64, Shot, u32)>,
}

impl MemoryEasel {
    /// The light samples of a first picture by brute force; each after it has four times as many.
    const FIRST: u32 = 4;

    pub(super) fn new(renderer: Box<dyn Renderer + Send>) -> Self {
        Self { renderer, last: None }
    }
}

impl Easel for MemoryEasel {
    fn name(&self) -> String {
        self.renderer.name()
    }

    fn draw(
        &mut self,
        order: &Order,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Stroke, RenderError> {
        let brute = shot.show.modes().any(|mode| mode == Mode::BruteForce);
        let samples = match &self.last {
            _ if !brute => shot.light_samples,
            Some((edition, last, samples)) if *edition == order.edition && last == shot => {
                samples.saturating_mul(4).min(shot.light_samples)
            }
            _ => Self::FIRST.min(shot.light_samples),
        };
        self.last = None;
        let picture =
            self.renderer.render(&order.scene, &Shot { light_samples: samples, ..shot.clone() }, stop)?;
        self.last = Some((order.edition, shot.clone(), samples));
        Ok(Stroke {
            relative_rms: picture.relative_rms,
            canvas: Canvas::Codes(Arc::new(picture)),
            light_samples: if brute { samples } else { 0 },
            unfinished: samples < shot.light_samples,
        })
    }

    fn picture(&mut self, order: &Order, stop: &(dyn Fn() -> bool + Sync)) -> Result<Picture, RenderError> {
        self.renderer.render(&order.scene, &order.shot, stop)
    }

    fn lost(&self) -> Option<String> {
        None
    }
}
