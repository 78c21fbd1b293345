//! The gain map of a picture: the factor in stops between its rendition in SDR and the one in HDR, pixel by
//! pixel.
//!
//! ISO 21496-1 and Adobe's Gain Map 1.0, on which Ultra HDR is built, have one formula. With the code g of
//! the map, from 0 to 1, and the base's linear value b, in which the white of SDR is 1, each channel is
//!
//! HDR = (b + k_base) 2^(w G) - k_alternate, G = min + (max - min) g^(1 / gamma)
//!
//! w follows the headroom of a display. It is 1 here: the full rendition, as on a display that has the
//! headroom for which the picture was made. What the offsets leave below 0 becomes 0.
//!
//! A map of another size is interpolated between the centres of its pixels, before its gamma, as graphics
//! hardware does.

use rayon::prelude::*;

use crate::error::Error;

/// Stops and offsets beyond this are damage: 2^64 is more than any light of a picture.
const MAX_STOPS: f64 = 64.0;

/// The metadata of one channel of a gain map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gain {
    /// Stops at the code 0.
    pub(crate) min: f64,
    /// Stops at the code 1.
    pub(crate) max: f64,
    /// The exponent by which the map was encoded.
    pub(crate) gamma: f64,
    /// The offset that is added to the base's value.
    pub(crate) base_offset: f64,
    /// The offset that is subtracted from the result.
    pub(crate) alternate_offset: f64,
}

/// How the map of a file is applied.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Parameters {
    /// The metadata from which the parameters come, in words.
    pub(crate) source: &'static str,
    /// The gains of red, green and blue.
    pub(crate) gains: [Gain; 3],
    /// Whether the base is the rendition in HDR already, from which the map leads to SDR.
    pub(crate) base_is_hdr: bool,
    /// Whether the formula holds for the base's primaries, not for those of the map's ICC profile.
    pub(crate) in_base_primaries: bool,
}

impl Parameters {
    pub(crate) fn checked(self) -> Result<Self, Error> {
        let damaged = |channel: usize, what: String| {
            let channel = ["red", "green", "blue"][channel];
            Error::damaged(format!(
                "{what} ({channel}); the gain map is damaged: export the picture again, or remove the map to \
                 read the picture in SDR"
            ))
        };
        for (channel, gain) in self.gains.iter().enumerate() {
            let Gain { min, max, gamma, base_offset, alternate_offset } = *gain;
            for (name, value) in [
                ("GainMapMin", min),
                ("GainMapMax", max),
                ("the offset of the base", base_offset),
                ("the offset of the alternate rendition", alternate_offset),
            ] {
                // NaN is in no range.
                if !(-MAX_STOPS..=MAX_STOPS).contains(&value) {
                    let what = format!("{name} is {value}, expected from -{MAX_STOPS} to {MAX_STOPS}");
                    return Err(damaged(channel, what));
                }
            }
            if min > max {
                let what = format!("GainMapMin is {min} and GainMapMax {max}, expected at least as much");
                return Err(damaged(channel, what));
            }
            if !(gamma > 0.0 && gamma.is_finite()) {
                return Err(damaged(channel, format!("its gamma is {gamma}, expected more than 0")));
            }
        }
        Ok(self)
    }
}

/// A gain map with its pixels.
pub(crate) struct GainMap {
    pub(crate) parameters: Parameters,
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// RGB, a byte each, row by row from the top.
    pub(crate) samples: Vec<u8>,
    /// The ICC profile of the alternate rendition.
    pub(crate) profile: Option<Vec<u8>>,
}

impl GainMap {
    /// Makes the linear values of the base those of the rendition in HDR, row by row of `width` pixels.
    pub(crate) fn apply(&self, pixels: &mut [[f32; 3]], width: usize) {
        let height = pixels.len() / width.max(1);
        let across = Places::of(width, self.width);
        let down = Places::of(height, self.height);
        pixels.par_chunks_exact_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            let [above, below, v] = down.at(y);
            for (x, pixel) in row.iter_mut().enumerate() {
                let [left, right, u] = across.at(x);
                for (channel, value) in pixel.iter_mut().enumerate() {
                    let code = |x: f64, y: f64| {
                        f64::from(self.samples[(y as usize * self.width + x as usize) * 3 + channel])
                    };
                    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
                    let top = mix(code(left, above), code(right, above), u);
                    let bottom = mix(code(left, below), code(right, below), u);
                    let gain = &self.parameters.gains[channel];
                    *value = gain.apply((*value).into(), mix(top, bottom, v) / 255.0) as f32;
                }
            }
        });
    }

    pub(crate) fn description(&self) -> String {
        let Parameters { source, gains, base_is_hdr, .. } = &self.parameters;
        let least = gains.iter().fold(f64::INFINITY, |least, gain| least.min(gain.min));
        let most = gains.iter().fold(f64::NEG_INFINITY, |most, gain| most.max(gain.max));
        let is_grey = self.samples.chunks_exact(3).all(|pixel| pixel.iter().all(|&code| code == pixel[0]));
        let colours = if is_grey { "grey" } else { "RGB" };
        let unused = if *base_is_hdr { "; not needed, as the base is in HDR" } else { "" };
        let (width, height) = (self.width, self.height);
        format!("{source}, {width} x {height}, {colours}, from {least:.2} to {most:.2} stops{unused}")
    }
}

impl Gain {
    /// The value of the rendition in HDR for one of the base and a code of the map from 0 to 1.
    fn apply(&self, base: f64, code: f64) -> f64 {
        let code = if self.gamma == 1.0 { code } else { math::pow(code, 1.0 / self.gamma) };
        let stops = self.min + (self.max - self.min) * code;
        ((base + self.base_offset) * math::exp2(stops) - self.alternate_offset).max(0.0)
    }
}

/// The places of the base's pixels between those of the map, along one side.
struct Places {
    /// Pixels of the map for one of the base.
    scale: f64,
    last: f64,
}

impl Places {
    fn of(base: usize, map: usize) -> Self {
        Self { scale: map as f64 / base as f64, last: map.saturating_sub(1) as f64 }
    }

    /// The map's pixels before and behind the centre of the base's pixel `index`, and the weight of the
    /// latter.
    fn at(&self, index: usize) -> [f64; 3] {
        let place = ((index as f64 + 0.5) * self.scale - 0.5).clamp(0.0, self.last);
        let before = place.floor();
        [before, (before + 1.0).min(self.last), place - before]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAIN: Gain = Gain { min: -1.0, max: 3.0, gamma: 0.5, base_offset: 0.25, alternate_offset: 0.125 };

    fn parameters(gain: Gain) -> Parameters {
        Parameters { source: "test", gains: [gain; 3], base_is_hdr: false, in_base_primaries: true }
    }

    #[test]
    fn the_formula_is_that_of_the_standard() {
        // 0.5^(1 / 0.5) = 0.25; -1 + 4 x 0.25 = 0 stops: 0.75 + 0.25 - 0.125.
        assert!((GAIN.apply(0.75, 0.5) - 0.875).abs() < 1e-12);
        // 3 stops: 8 x 1.25 - 0.125.
        assert!((GAIN.apply(1.0, 1.0) - 9.875).abs() < 1e-12);
        // -1 stop: 0.25 / 2 - 0.125 = 0, and less is 0 too.
        assert!(GAIN.apply(0.0, 0.0).abs() < 1e-12);
        assert_eq!(Gain { alternate_offset: 0.5, ..GAIN }.apply(0.0, 0.0), 0.0);
    }

    #[test]
    fn a_smaller_map_is_interpolated_between_centres() {
        let linear = Gain { min: 0.0, max: 1.0, gamma: 1.0, base_offset: 0.0, alternate_offset: 0.0 };
        let map = GainMap {
            parameters: parameters(linear),
            width: 2,
            height: 1,
            samples: vec![0, 0, 255, 255, 255, 0],
            profile: None,
        };
        let mut pixels = vec![[1.0; 3]; 8];
        map.apply(&mut pixels, 4);
        // The centres of the base lie at -0.25, 0.25, 0.75 and 1.25 pixels of the map.
        for (i, pixel) in pixels.iter().enumerate() {
            let weight = [0.0, 0.25, 0.75, 1.0][i % 4];
            let expected = [2.0_f64.powf(weight), 2.0_f64.powf(weight), 2.0_f64.powf(1.0 - weight)];
            for (found, expected) in pixel.iter().zip(expected) {
                assert!((f64::from(*found) - expected).abs() < 1e-6, "{i}: {pixel:?}");
            }
        }
    }

    #[test]
    fn numbers_that_cannot_be_are_damage() {
        assert!(parameters(GAIN).checked().is_ok());
        for (gain, words) in [
            (Gain { min: f64::NAN, ..GAIN }, "GainMapMin is NaN"),
            (Gain { max: f64::INFINITY, ..GAIN }, "GainMapMax is inf"),
            (Gain { max: 1000.0, ..GAIN }, "GainMapMax is 1000, expected from -64 to 64 (red)"),
            (Gain { min: 4.0, ..GAIN }, "GainMapMin is 4 and GainMapMax 3"),
            (Gain { gamma: 0.0, ..GAIN }, "gamma is 0"),
            (Gain { gamma: -1.0, ..GAIN }, "gamma is -1"),
            (Gain { gamma: f64::NAN, ..GAIN }, "gamma is NaN"),
            (Gain { base_offset: f64::NEG_INFINITY, ..GAIN }, "the offset of the base is -inf"),
            (Gain { alternate_offset: f64::NAN, ..GAIN }, "the offset of the alternate rendition is NaN"),
        ] {
            let error = parameters(gain).checked().unwrap_err();
            assert!(error.to_string().contains(words), "{error}");
        }
    }
}
