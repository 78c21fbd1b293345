//! What a renderer makes, and when two pictures are the same.

/// A picture, rows from the top, pixels from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// sRGB, 8 bits, developed: exposure and tone curve are in it.
    pub codes: Vec<[u8; 3]>,
    /// The mean linear radiance of each pixel's samples before exposure, and the share of them that see a surface.
    /// Of a difference: the mean absolute difference, not amplified.
    pub radiance: Vec<[f32; 4]>,
    /// Of a difference: the root of the mean squared difference over the samples that see a surface and over channels,
    /// divided by the root of the mean square of what is compared with.
    pub relative_rms: Option<f64>,
}

/// How far two pictures of one scene by two renderers may be apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sameness {
    /// Pixels whose codes differ by more than this many steps of 255 are counted.
    pub codes: u8,
    /// The largest share of pixels that may be counted: outlines, and texels of the sun on their edge.
    pub outliers: f64,
    /// The largest root mean square of the difference of radiance, over pixels that are not counted and over channels,
    /// divided by that of the first picture.
    pub relative_rms: f64,
}

/// The tolerance between the CPU's pictures and those of any graphics device.
///
/// Both compute in f32 by the same formulas, so that they differ by rounding, the precision of a device's sine and arc
/// tangent, and the eight bits that it rasterises with.
pub const SAME_PICTURE: Sameness = Sameness { codes: 2, outliers: 0.002, relative_rms: 2e-3 };
