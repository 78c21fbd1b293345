//! White balance: factors of the channels by which what was white in a picture becomes grey.

use crate::exposure::luminance;

/// The temperature that leaves a picture as it is: that of D65.
const NEUTRAL: f64 = 6504.0;

/// The factors of red, green and blue by which a thing of this colour becomes grey of the same luminance, in
/// linear Rec. 709; `None` if a channel of the colour is not a positive number.
///
/// # Example: what was orange becomes grey
/// ```
/// let factors = envmap::white_balance([0.4, 0.2, 0.1]).expect("a colour");
/// let grey = 0.2126 * 0.4 + 0.7152 * 0.2 + 0.0722 * 0.1;
/// assert!((0.4 * factors[0] - grey).abs() < 1e-12 && (0.1 * factors[2] - grey).abs() < 1e-12);
/// ```
pub fn white_balance(white: [f64; 3]) -> Option<[f64; 3]> {
    let sound = white.iter().all(|channel| channel.is_finite() && *channel > 0.0);
    let factors = white.map(|channel| luminance(white) / channel);
    (sound && factors.iter().all(|factor| factor.is_finite())).then_some(factors)
}

/// The colour of a black body from 2000 to 25000 kelvin in relation to one of 6504, which is the temperature
/// of D65 and gives a grey: linear Rec. 709 of luminance 1.
///
/// The chromaticity is that of Kang et al. 2002 (Design of Advanced Color Temperature Control System for HDTV
/// Applications), which is within 0.001 of the Planckian locus.
pub fn temperature_colour(kelvin: f64) -> [f64; 3] {
    let [colour, neutral] = [kelvin, NEUTRAL].map(black_body);
    let relative = [0, 1, 2].map(|c| colour[c] / neutral[c]);
    relative.map(|channel| channel / luminance(relative))
}

/// The colour of a black body in linear Rec. 709, of luminance 1.
fn black_body(kelvin: f64) -> [f64; 3] {
    let polynomial = |c: [f64; 4], x: f64| ((c[0] * x + c[1]) * x + c[2]) * x + c[3];
    let t = 1000.0 / kelvin;
    let x = match kelvin <= 4000.0 {
        true => polynomial([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910], t),
        false => polynomial([-3.025_846_9, 2.107_037_9, 0.222_634_7, 0.240_390], t),
    };
    let y = match kelvin {
        ..=2222.0 => polynomial([-1.106_381_4, -1.348_110_20, 2.185_558_32, -0.202_196_83], x),
        ..=4000.0 => polynomial([-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67], x),
        _ => polynomial([3.081_758, -5.873_386_70, 3.751_129_97, -0.370_014_83], x),
    };
    let [x, z] = [x / y, (1.0 - x - y) / y];
    [
        3.240_454_2 * x - 1.537_138_5 - 0.498_531_4 * z,
        -0.969_266_0 * x + 1.876_010_8 + 0.041_556_0 * z,
        0.055_643_4 * x - 0.204_025_9 + 1.057_225_2 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planck's law, with the fits of Wyman et al. 2013 to the CIE 1931 observer, summed by nanometre.
    fn planck(kelvin: f64) -> [f64; 2] {
        let lobe = |l: f64, mean: f64, below: f64, above: f64| {
            let t = (l - mean) * if l < mean { below } else { above };
            (-0.5 * t * t).exp()
        };
        let (mut sum, c2) = ([0.0; 3], 1.4388e7);
        for nanometre in 360..=830 {
            let l = f64::from(nanometre);
            let power = 1e15 / l.powi(5) / ((c2 / (l * kelvin)).exp() - 1.0);
            let x = 0.362 * lobe(l, 442.0, 0.0624, 0.0374) + 1.056 * lobe(l, 599.8, 0.0264, 0.0323)
                - 0.065 * lobe(l, 501.1, 0.0490, 0.0382);
            let y = 0.821 * lobe(l, 568.8, 0.0213, 0.0247) + 0.286 * lobe(l, 530.9, 0.0613, 0.0322);
            let z = 1.217 * lobe(l, 437.0, 0.0845, 0.0278) + 0.681 * lobe(l, 459.0, 0.0385, 0.0725);
            for (sum, response) in sum.iter_mut().zip([x, y, z]) {
                *sum += power * response;
            }
        }
        let all: f64 = sum.iter().sum();
        [sum[0] / all, sum[1] / all]
    }

    #[test]
    fn black_bodies_have_the_colours_of_plancks_law() {
        for kelvin in [2000.0, 2223.0, 2856.0, 4000.0, 4001.0, 5500.0, 6504.0, 9000.0, 25000.0] {
            let [r, g, b] = black_body(kelvin);
            let [x, y, z] = [
                0.412_456 * r + 0.357_576 * g + 0.180_437 * b,
                0.212_673 * r + 0.715_152 * g + 0.072_175 * b,
                0.019_334 * r + 0.119_192 * g + 0.950_304 * b,
            ];
            assert!((y - 1.0).abs() < 1e-5, "{y}");
            let found = [x / (x + y + z), y / (x + y + z)];
            // The fits of the observer are within 0.004 of its chromaticities.
            for (found, expected) in found.iter().zip(planck(kelvin)) {
                assert!((found - expected).abs() < 0.004, "{kelvin} K: {found} {expected}");
            }
        }
    }

    #[test]
    fn low_temperatures_are_orange_and_high_ones_blue() {
        assert_eq!(temperature_colour(NEUTRAL).map(|channel| (channel * 1e9).round() / 1e9), [1.0; 3]);
        let mut last = f64::INFINITY;
        for kelvin in [2000.0, 3000.0, 5000.0, 6500.0, 8000.0, 25000.0] {
            let [red, green, blue] = temperature_colour(kelvin);
            assert!(red > 0.0 && green > 0.0 && blue > 0.0 && red / blue < last, "{kelvin}");
            last = red / blue;
        }
    }

    #[test]
    fn colours_without_a_channel_have_no_balance() {
        for white in [[0.0, 1.0, 1.0], [1.0, -1.0, 1.0], [f64::NAN, 1.0, 1.0], [1e-320, 1e10, 1.0]] {
            assert_eq!(white_balance(white), None);
        }
        assert_eq!(white_balance([0.25; 3]).map(|f| f.map(|f| (f * 1e12).round())), Some([1e12; 3]));
    }
}
