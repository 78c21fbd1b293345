//! OpenEXR, through the `exr` crate.

mod guard;
mod layer;
mod read;
mod subsampled;
mod write;

pub use read::{ExrLayers, read_exr_layers};
pub(crate) use read::{header, read, read_recipe};
pub use write::{write_exr, write_exr_layers};
