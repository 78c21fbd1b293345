//! From linear radiance to 8-bit display values: exposure, a tone curve and the sRGB transfer function.
//!
//! The filmic curve is Stephen Hill's fit of the ACES RRT and sRGB ODT (`ACES.hlsl` in MJP's BakingLab): v =
//! A L, then (v (v + 0.0245786) - 0.000090537) / (v (0.983729 v + 0.4329510) + 0.238081) in each channel,
//! then a second matrix. The fit maps middle grey to 0.105; here L is scaled first, so that 0.18 stays 0.18
//! and both curves show a scene equally bright.

use std::sync::LazyLock;

use rayon::prelude::*;

/// The curve from exposed radiance to display values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneMap {
    /// Values above 1 are clipped: colours are accurate, highlights are lost.
    Plain,
    /// A film-like shoulder and toe: highlights keep their shape and lose their colour.
    #[default]
    Filmic,
}

impl ToneMap {
    /// The linear display value of an exposed linear value, each channel in [0, 1].
    ///
    /// NaN and negative values become 0, and infinity becomes the brightest value.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Plain => rgb.map(unit),
            Self::Filmic => filmic(rgb),
        }
    }
}

/// The 8-bit sRGB colours of linear Rec. 709 radiance, after an exposure in stops (+1 doubles).
///
/// Each code is the nearest to the sRGB value of the tone-mapped radiance. NaN becomes black.
/// # Example: one more stop shows half the radiance as the same code
/// ```
/// use envmap::{ToneMap, to_srgb8};
/// assert_eq!(to_srgb8(&[[0.25; 3]], 1.0, ToneMap::Plain), to_srgb8(&[[0.5; 3]], 0.0, ToneMap::Plain));
/// ```
pub fn to_srgb8(pixels: &[[f32; 3]], exposure: f64, tone: ToneMap) -> Vec<[u8; 3]> {
    const BLOCK: usize = 4096;
    let gain = math::exp2(exposure) as f32;
    let mut codes = vec![[0; 3]; pixels.len()];
    codes.par_chunks_mut(BLOCK).zip(pixels.par_chunks(BLOCK)).for_each(|(codes, pixels)| {
        for (code, pixel) in codes.iter_mut().zip(pixels) {
            *code = tone.apply(pixel.map(|value| value * gain)).map(srgb_code);
        }
    });
    codes
}

/// The sRGB transfer function (IEC 61966-2-1), from linear [0, 1] to encoded [0, 1].
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * math::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`], from encoded [0, 1] to linear [0, 1].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { math::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// The value clamped to [0, 1]; NaN becomes 0.
fn unit(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// sRGB to AP1 with the RRT's desaturation, by rows.
const INTO_ACES: [[f32; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];

/// The matrix from the ODT's output to sRGB, by rows.
const FROM_ACES: [[f32; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];

/// The fit maps 0.18 times this to 0.18: the positive root of its quadratic, over 0.18.
const MIDDLE_GREY: f32 = 1.461_93;

fn filmic(rgb: [f32; 3]) -> [f32; 3] {
    // The curve is flat to 8 bits far below 1e6, and the squares stay finite.
    let exposed = rgb.map(|value| if value > 0.0 { (value * MIDDLE_GREY).min(1e6) } else { 0.0 });
    let v = product(&INTO_ACES, exposed)
        .map(|v| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081));
    product(&FROM_ACES, v).map(unit)
}

fn product(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The linear value for each code c from which code c + 1 is nearer than code c.
static THRESHOLDS: LazyLock<[f32; 255]> = LazyLock::new(|| {
    std::array::from_fn(|code| {
        let encoded = (code as f64 + 0.5) / 255.0;
        (if encoded <= 0.040_45 { encoded / 12.92 } else { math::pow((encoded + 0.055) / 1.055, 2.4) }) as f32
    })
});

/// The number of parts that [0, 1] is divided into to find codes. Each is narrower than the distance of two
/// thresholds, 3e-4 or more.
const PARTS: f32 = 4096.0;

/// The code of the least linear value of each part.
static FIRST: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let code = |least: f32| THRESHOLDS.partition_point(|threshold| *threshold <= least) as u8;
    (0..=PARTS as usize).map(|part| code(part as f32 / PARTS)).collect()
});

/// The nearest 8-bit sRGB code of a linear value in [0, 1].
fn srgb_code(linear: f32) -> u8 {
    let first = FIRST[(linear * PARTS) as usize];
    let is_next = THRESHOLDS.get(usize::from(first)).is_some_and(|threshold| *threshold <= linear);
    first + u8::from(is_next)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(value: f32, tone: ToneMap) -> u8 {
        to_srgb8(&[[value; 3]], 0.0, tone)[0][1]
    }

    #[test]
    fn srgb_codes_round_the_transfer_function() {
        for step in 0..=100_000 {
            let linear = step as f32 / 100_000.0;
            let exact = 255.0 * srgb_encode(linear);
            // Half a code, plus the rounding of powf in f32 (a few 1e-7 of 255).
            assert!((exact - f32::from(srgb_code(linear))).abs() <= 0.5 + 2e-4, "{linear}");
        }
        // By the standard's formula 0.18 is 117.6 and 0.5 is 187.5.
        assert_eq!((shown(0.18, ToneMap::Plain), shown(0.5, ToneMap::Plain)), (118, 188));
    }

    #[test]
    fn a_code_begins_at_its_threshold() {
        for (code, threshold) in THRESHOLDS.iter().enumerate() {
            assert_eq!(usize::from(srgb_code(threshold.next_down())), code);
            assert_eq!(usize::from(srgb_code(*threshold)), code + 1);
        }
        assert_eq!((srgb_code(0.0), srgb_code(1.0)), (0, 255));
    }

    #[test]
    fn every_code_comes_back_from_its_linear_value() {
        for code in 0..=255_u8 {
            assert_eq!(srgb_code(srgb_decode(f32::from(code) / 255.0)), code);
        }
    }

    #[test]
    fn bad_values_are_black_and_infinity_is_white() {
        for tone in [ToneMap::Plain, ToneMap::Filmic] {
            for bad in [f32::NAN, -1.0, f32::NEG_INFINITY, -0.0] {
                assert_eq!(shown(bad, tone), 0, "{bad} {tone:?}");
            }
            for bright in [f32::INFINITY, f32::MAX, 1e30, 1e6] {
                assert_eq!(shown(bright, tone), 255, "{bright} {tone:?}");
            }
            assert_eq!(to_srgb8(&[[f32::NAN, 0.0, 0.0]], 400.0, tone), [[0; 3]]);
        }
        assert!(to_srgb8(&[], 0.0, ToneMap::Filmic).is_empty());
    }

    #[test]
    fn the_filmic_curve_keeps_middle_grey_and_rises() {
        let grey = ToneMap::Filmic.apply([0.18; 3]);
        // The constants are given to 5 digits.
        assert!(grey.iter().all(|value| (value - 0.18).abs() < 2e-5), "{grey:?}");
        let mut last = 0.0;
        for step in 1..2000 {
            let value = ToneMap::Filmic.apply([(step as f32 / 100.0).exp2() * 1e-3; 3])[0];
            assert!(value >= last, "{step}");
            last = value;
        }
        assert_eq!(last, 1.0);
    }

    #[test]
    fn a_stop_is_a_factor_of_two() {
        let pixels = [[0.01, 0.2, 0.4], [3.0, 0.0, 0.07]];
        let doubled = pixels.map(|pixel| pixel.map(|value: f32| 2.0 * value));
        for tone in [ToneMap::Plain, ToneMap::Filmic] {
            assert_eq!(to_srgb8(&pixels, 1.0, tone), to_srgb8(&doubled, 0.0, tone));
        }
    }
}
