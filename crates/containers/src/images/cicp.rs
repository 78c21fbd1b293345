//! Coding-independent code points (ITU-T H.273), which PNG's chunk cICP and a tag of ICC profiles hold:
//! primaries and transfer.
//!
//! PQ (SMPTE ST 2084) says absolute luminances: 203 cd/m2, the reference white of ITU-R BT.2408, is 1. HLG
//! (ITU-R BT.2100) is light of the scene: its inverse OETF without a display's OOTF, scaled so that the
//! reference white of BT.2408, a signal of 75 %, is 1.

use super::chromaticity::Chromaticities;
use super::icc::Encoding;

const D65: [f64; 2] = [0.3127, 0.3290];
const C: [f64; 2] = [0.310, 0.316];

/// The encoding of these primaries, transfer, matrix and range, and whether it holds high dynamic range.
///
/// # Errors
/// A text of what is not read, for a warning.
pub(crate) fn encoding([primaries, transfer, matrix, full]: [u8; 4]) -> Result<(Encoding, bool), String> {
    if full != 1 {
        return Err("it declares the narrow range of video, which is not read".into());
    }
    if matrix != 0 {
        return Err(format!("it declares matrix {matrix}; a PNG holds RGB, which is matrix 0"));
    }
    let primaries = match primaries {
        1 | 2 => Chromaticities::REC_709,
        4 => Chromaticities([[0.67, 0.33], [0.21, 0.71], [0.14, 0.08], C]),
        5 => Chromaticities([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], D65]),
        6 | 7 => Chromaticities([[0.630, 0.340], [0.310, 0.595], [0.155, 0.070], D65]),
        8 => Chromaticities([[0.681, 0.319], [0.243, 0.692], [0.145, 0.049], C]),
        9 => Chromaticities::REC_2020,
        10 => Chromaticities::XYZ,
        11 => Chromaticities([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], [0.314, 0.351]]),
        12 => Chromaticities::P3_D65,
        22 => Chromaticities([[0.630, 0.340], [0.295, 0.605], [0.155, 0.077], D65]),
        other => return Err(format!("its primaries, number {other}, are not known")),
    };
    let (curve, bright): (fn(f64) -> f64, bool) = match transfer {
        1 | 6 | 14 | 15 => (bt_709, false),
        2 | 13 => (crate::images::icc::srgb_to_linear, false),
        4 => (|value| math::pow(value, 2.2), false),
        5 => (|value| math::pow(value, 2.8), false),
        8 => (|value| value, true),
        16 => (pq, true),
        18 => (hlg, true),
        other => return Err(format!("its transfer, number {other}, is not known")),
    };
    let matrix = primaries.to_rec_709().ok_or("its primaries span no colour space")?;
    Ok((Encoding::of_curve_and_matrix(curve, matrix), bright))
}

/// The inverse of ITU-R BT.709's OETF.
fn bt_709(value: f64) -> f64 {
    if value < 0.081 { value / 4.5 } else { math::pow((value + 0.099) / 1.099, 1.0 / 0.45) }
}

/// SMPTE ST 2084, equation 4.1, over 203 cd/m2.
fn pq(value: f64) -> f64 {
    const M1: f64 = 2610.0 / 16384.0;
    const M2: f64 = 2523.0 / 4096.0 * 128.0;
    const C1: f64 = 3424.0 / 4096.0;
    const C2: f64 = 2413.0 / 4096.0 * 32.0;
    const C3: f64 = 2392.0 / 4096.0 * 32.0;
    let power = math::pow(value.max(0.0), 1.0 / M2);
    math::pow((power - C1).max(0.0) / (C2 - C3 * power), 1.0 / M1) * 10_000.0 / 203.0
}

/// The inverse OETF of HLG (ITU-R BT.2100, table 5), over its value at 0.75.
fn hlg(value: f64) -> f64 {
    const A: f64 = 0.178_832_77;
    const B: f64 = 1.0 - 4.0 * A;
    const C: f64 = 0.559_910_73;
    let scene = |value: f64| match value {
        low if low <= 0.5 => low * low / 3.0,
        high => (math::exp((high - C) / A) + B) / 12.0,
    };
    scene(value) / scene(0.75)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ITU-R BT.2408, table 1: reference white is 58 % of PQ and 75 % of HLG; 10 000 and 1000 cd/m2 are 100 %
    /// and
    /// 75.2 % of PQ.
    #[test]
    fn reference_white_is_one() {
        assert!((pq(0.5807) - 1.0).abs() < 2e-3, "{}", pq(0.5807));
        assert!((pq(0.7518) - 1000.0 / 203.0).abs() < 2e-2, "{}", pq(0.7518));
        assert!((pq(1.0) - 10_000.0 / 203.0).abs() < 1e-9 && pq(0.0) == 0.0);
        assert!((hlg(0.75) - 1.0).abs() < 1e-12 && (hlg(1.0) - 3.7743).abs() < 1e-3, "{}", hlg(1.0));
        assert!((bt_709(0.5) - 0.259_589).abs() < 1e-4, "{}", bt_709(0.5));
    }

    #[test]
    fn what_is_not_read_is_named() {
        for (points, words) in
            [([9, 16, 0, 0], "narrow range"), ([9, 16, 9, 1], "matrix 9"), ([99, 13, 0, 1], "number 99")]
        {
            assert!(encoding(points).is_err_and(|why| why.contains(words)), "{words}");
        }
    }
}
