//! The renderer on the graphics device, whether or not this program was built with one.

use crate::{RenderError, Renderer};

/// The graphics device.
///
/// # Errors
/// If there is no usable device, or if this program was built without the feature `gpu`.
pub fn graphics_device() -> Result<Box<dyn Renderer>, RenderError> {
    #[cfg(feature = "gpu")]
    return Ok(Box::new(crate::Gpu::new()?));
    #[cfg(not(feature = "gpu"))]
    return Err(RenderError::Device("this program was built without the feature `gpu`".into()));
}
