//! Pictures of light: what is read of each format, how its colours and directions are meant, and what is
//! written.

mod block_writer;
pub(crate) mod chromaticity;
mod cicp;
mod codec;
mod colour_space;
mod data_texture;
mod decoded;
mod decoder_level;
mod gain_map;
mod gain_map_metadata;
mod gpano;
mod icc;
mod image_header;
mod jpeg;
mod jpeg_segments;
mod open_exr;
mod orientation;
mod outside_gamut;
mod panorama;
mod pfm;
pub(crate) mod png;
mod radiance;
mod radiance_view;
mod raster;
mod read_exr_layers;
mod read_image;
mod recognition;
mod tga;
mod tiff;
pub(crate) mod webp;
mod xmp;

use crate::format::Format;

/// Makes the list of the formats from that of their modules.
macro_rules! codecs {
    ($($format:ident => $module:ident),* $(,)?) => {
        impl Format {
            /// Every format, in the order in which texts list them.
            pub const ALL: &'static [Self] = &[$(Self::$format),*];

            /// How the format is known and read.
            pub(crate) const fn codec(self) -> &'static codec::Codec {
                match self {
                    $(Self::$format => &$module::CODEC,)*
                }
            }
        }
    };
}

// Everything that holds for each format comes from this list.
codecs! {
    OpenExr => open_exr,
    Radiance => radiance,
    Png => png,
    Jpeg => jpeg,
    Tiff => tiff,
    Tga => tga,
    WebP => webp,
    Pfm => pfm,
}

pub(crate) use chromaticity::Chromaticities;
pub use colour_space::ColourSpace;
pub use data_texture::DataTexture;
pub(crate) use data_texture::raster_of_texture;
pub use decoded::{Decoded, Encoded, OpenExrEnvmap, ReadOptions};
pub use decoder_level::decoder_level;
pub(crate) use icc::srgb_to_linear;
pub use image_header::{ImageHeader, declares_high_dynamic_range, read_image_header};
pub use open_exr::{ExrLayers, write_exr, write_exr_layers, write_exr_rgba};
pub use panorama::{Panorama, Shows};
pub use png::{write_apng, write_png};
pub use radiance::write_rgbe;
pub(crate) use raster::Raster;
pub use read_exr_layers::read_exr_layers;
pub use read_image::{read_image, read_image_until};
