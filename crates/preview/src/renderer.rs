//! What draws.

use crate::{Picture, RenderError, Scene, Shot};

/// Draws pictures of scenes.
pub trait Renderer {
    /// What it is, for people: `CPU, 8 threads`, or `Vulkan, AMD Radeon ...`.
    fn name(&self) -> String;

    /// The picture of a scene, whole: with all light samples of a brute-force mode.
    ///
    /// `stop` is asked now and then, at least once for every million samples of light.
    ///
    /// # Errors
    /// Where a map cannot be made, the scene lacks what a mode needs, the device cannot do it
    /// ([`RenderError::is_of_the_device`]: then another renderer may), or `stop` said so.
    fn render(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError>;
}

/// The graphics device.
///
/// # Errors
/// If there is none, or if this program was built without the feature `gpu`.
pub fn graphics_device() -> Result<Box<dyn Renderer>, RenderError> {
    #[cfg(feature = "gpu")]
    return Ok(Box::new(crate::Gpu::new()?));
    #[cfg(not(feature = "gpu"))]
    return Err(RenderError::Device("this program was built without the feature `gpu`".into()));
}
