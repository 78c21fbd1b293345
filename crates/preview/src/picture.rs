//! What a renderer makes, and when two pictures are the same.

use crate::{Mode, Show};

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

/// The tolerance between the CPU's pictures and those of any graphics device, of modes that read maps.
///
/// Both compute in f32 by the same formulas, so that they differ by rounding and by where a pixel's middle lies on a triangle.
/// Both snap corners to 1/256 of a sample; some devices interpolate normals between corners as they were before. Then
/// these are those of a place up to sqrt(2) / 512 of a sample aside. Where the normal turns by k a sample, and a map's
/// radiance changes by g a radian, a reflection is off by 2 k g / 362: with k = 0.1, as on a tube of ten pixels' radius, and
/// g = 2, as maps of degree 12 have it on average, by 1e-3. lavapipe does so; the worst that was measured over the tests' scenes
/// is an RMS of 1.7e-3 and outliers of 0.0012.
pub const SAME_PICTURE: Sameness = Sameness { codes: 2, outliers: 0.002, relative_rms: 2e-3 };

/// The tolerance of modes that read light itself: mirror and brute force.
///
/// Light changes from texel to texel without bound: with texels of h radians, as in [`SAME_PICTURE`], a reflection is off by
/// 2 k / (362 h) of the difference of neighbours, 1 percent at k = 0.1 and h = 0.05. Brute force takes each texel as
/// a patch of one radiance, so that some of its samples fall on another one. The worst that was measured with lavapipe
/// is an RMS of 1.3e-2 and outliers of 0.0065.
pub const SAME_LIGHT: Sameness = Sameness { codes: 2, outliers: 0.01, relative_rms: 2e-2 };

impl Sameness {
    /// The tolerance of pictures that show these modes.
    pub fn of(show: Show) -> Self {
        let light = show.modes().any(|mode| matches!(mode, Mode::Mirror | Mode::BruteForce));
        if light { SAME_LIGHT } else { SAME_PICTURE }
    }
}
