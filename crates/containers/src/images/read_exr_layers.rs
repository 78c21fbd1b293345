//! Reading all layers of a file that should be OpenEXR.

use super::open_exr;
use super::open_exr::ExrLayers;
use super::recognition::identify;
use crate::error::Error;
use crate::format::Format;

/// Reads every layer with colour of an OpenEXR file; names are as [`crate::images::decoded::ReadOptions`]
/// takes them.
///
/// # Errors
/// The errors of [`crate::images::read_image::read_image`], and an error if all layers together have more
/// than [`crate::limits::MAX_PIXELS`].
pub fn read_exr_layers(bytes: &[u8]) -> Result<ExrLayers, Error> {
    identify(bytes)
        .and_then(|format| match format {
            Format::OpenExr => open_exr::read_layers(bytes),
            other => {
                Err(Error::unsupported(format!("{} has no layers; expected an OpenEXR file", other.name())))
            }
        })
        .map_err(|error| error.within(Format::OpenExr.name()))
}
