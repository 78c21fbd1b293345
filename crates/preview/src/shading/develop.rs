//! Development, from radiance to sRGB codes: exposure and tone curve (`envmap::ToneMap`) for each sample, the
//! mean of a pixel's samples in linear display light, and the nearest code of the sRGB transfer function.

use envmap::{ToneMap, to_srgb8};
use glam::Vec3;

/// The linear display value of a sample, 0 to 1; NaN is black. `gain` is 2^exposure, or 1 (flat background).
pub fn develop(radiance: Vec3, gain: f32, tone: ToneMap) -> Vec3 {
    Vec3::from(tone.apply((radiance * gain).to_array()))
}

/// The codes of pixels with these mean display values.
pub fn codes(display: &[[f32; 3]]) -> Vec<[u8; 3]> {
    to_srgb8(display, 0.0, ToneMap::Plain)
}
