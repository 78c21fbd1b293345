//! The interface of renderers.

use sh::Stop;

use crate::{Picture, RenderError, Scene, Shot};

/// Draws pictures of scenes.
pub trait Renderer {
    /// A name for messages: `CPU, 8 threads`, or `Vulkan, AMD Radeon ...`.
    fn name(&self) -> String;

    /// The finished picture of a scene, with all light samples of a brute-force mode. Modes that need maps
    /// which the scene does not have are replaced ([`Shot::of`]).
    ///
    /// `stop` is asked at least once for every million light samples.
    ///
    /// # Errors
    /// If a map cannot be made, the scene lacks what a mode needs, the device cannot draw the picture (then
    /// [`RenderError::is_of_the_device`]), or it was stopped ([`RenderError::Cancelled`]).
    fn render(&mut self, scene: &Scene, shot: &Shot, stop: Stop<'_>) -> Result<Picture, RenderError>;
}
