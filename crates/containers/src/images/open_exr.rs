//! OpenEXR, through the `exr` crate.

mod guard;
mod layer;
mod read;
mod subsampled;
mod window;
mod write;

use super::codec::{Codec, KnownBy};
use read::{header, read, read_recipe};

pub use read::ExrLayers;
pub(crate) use read::read_layers;
pub use write::{write_exr, write_exr_layers, write_exr_rgba};

pub(crate) const CODEC: Codec = Codec {
    name: "OpenEXR",
    endings: &["exr"],
    known_by: KnownBy::Signature(|bytes| bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01])),
    high_dynamic_range: true,
    declares_high_dynamic_range: |_| false,
    has_layers: true,
    read,
    header: |file, length, options| header(file, length, options.layer.as_deref()),
    recipe: read_recipe,
};
