//! How the texels of engines' files are stored.

use containers::TexelFormat;
use engine::{Choice, choice};

choice! {
    /// How the texels of an engine's file are stored.
    pub(crate) enum EngineFormat {
        /// Four halves.
        Rgba16F = "rgba16f",
        /// Four floats.
        Rgba32F = "rgba32f",
        /// Three mantissas with one exponent, 4 bytes.
        Rgb9E5 = "rgb9e5",
        /// Three small floats, 4 bytes.
        R11G11B10F = "r11g11b10f",
        /// Blocks of BC6H, 1 byte.
        Bc6h = "bc6h",
        /// PNG with a divisor in its alpha, up to 255.
        Rgbd = "rgbd",
        /// An OpenEXR image in halves, or in 32-bit floats if halves cannot hold a value.
        Exr = "exr",
        /// A Radiance image.
        Hdr = "hdr",
    }
}

impl EngineFormat {
    /// The format's word in a manifest.
    pub(crate) fn name(self) -> &'static str {
        Self::words().into_iter().find(|(.., format)| *format == self).map_or("", |(word, ..)| word)
    }

    /// The format of a texture's texels; `None` for RGBD and for lat-long images.
    pub(crate) fn texels(self) -> Option<TexelFormat> {
        match self {
            Self::Rgba16F => Some(TexelFormat::Rgba16F),
            Self::Rgba32F => Some(TexelFormat::Rgba32F),
            Self::Rgb9E5 => Some(TexelFormat::Rgb9E5),
            Self::R11G11B10F => Some(TexelFormat::R11G11B10F),
            Self::Bc6h => Some(TexelFormat::Bc6h),
            Self::Rgbd | Self::Exr | Self::Hdr => None,
        }
    }

    /// The ending of a lat-long image; `None` for formats of textures.
    pub(crate) fn image_ending(self) -> Option<&'static str> {
        match self {
            Self::Exr => Some(".exr"),
            Self::Hdr => Some(".hdr"),
            Self::Rgba16F | Self::Rgba32F | Self::Rgb9E5 | Self::R11G11B10F | Self::Bc6h | Self::Rgbd => None,
        }
    }

    /// The largest number of the format.
    pub(crate) fn largest(self) -> f32 {
        match self.texels() {
            Some(texels) => texels.largest(),
            None if self == Self::Rgbd => 255.0,
            // The last exponent of RGBE is 2^127, and OpenEXR has 32-bit floats.
            None => f32::MAX,
        }
    }
}
