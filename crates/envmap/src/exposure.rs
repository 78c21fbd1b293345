//! The exposure that every picture of an environment has by default: reports, contact sheets, previews.
//!
//! Two numbers say how bright an environment is. Its log-average is what an eye adapts to, and what a
//! photographer's grey card stands for: it is shown as middle grey, 0.18 (Reinhard et al. 2002, "Photographic
//! Tone Reproduction for Digital Images", equation 1). Its mean is the radiance of a white matte surface that
//! faces all directions alike. If a few lamps in the dark give most of the light, the log-average sees the
//! dark alone, and everything that the lamps shine on would burn out; so the mean is shown at most as 0.72,
//! two stops above middle grey. Both scale with the environment: a file in other units has the same picture.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::Environment;

/// Middle grey, as a linear display value.
const MIDDLE_GREY: f64 = 0.18;

/// The mean of an environment is shown at most this bright.
const BRIGHTEST_MEAN: f64 = 0.72;

/// Luminances below this share of the mean count as this share, so that black pixels do not dominate the
/// log-average.
const DARKEST: f64 = 1e-4;

/// An exposure, and the measure it was derived from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// The exposure in stops: radiance is multiplied by 2 to this power.
    pub stops: f64,
    /// The measure that the exposure was derived from.
    pub basis: ExposureBasis,
}

/// The measure of an environment that an exposure was derived from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExposureBasis {
    /// The log-average is shown as middle grey.
    LogAverage,
    /// The mean is shown two stops above middle grey, because the log-average would show it brighter.
    Mean,
}

impl ExposureBasis {
    /// The name of the measure: `log-average` or `mean`.
    pub fn name(self) -> &'static str {
        match self {
            Self::LogAverage => "log-average",
            Self::Mean => "mean",
        }
    }
}

impl Environment {
    /// The exposure that shows this environment and what it lights; see the module's documentation. Averages
    /// are weighted by solid angle. A black environment has an exposure of 0.
    ///
    /// # Example: a constant environment is shown as middle grey, whatever its units
    /// ```
    /// use envmap::{Environment, ToneMap, to_srgb8};
    /// let grid = sphere::LatLong::with_rows(4);
    /// for level in [0.001, 50.0] {
    ///     let environment = Environment::new(grid, vec![[level; 3]; grid.len()]).unwrap();
    ///     let shown = to_srgb8(environment.pixels(), environment.exposure().stops, ToneMap::Filmic);
    ///     assert_eq!(shown[0], [118; 3]);
    /// }
    /// ```
    pub fn exposure(&self) -> Exposure {
        let mean = average(self, |y| y);
        let floor = DARKEST * mean;
        if !(floor > 0.0 && floor.is_finite()) {
            return Exposure { stops: 0.0, basis: ExposureBasis::LogAverage };
        }
        let of_log_average = math::log2(MIDDLE_GREY) - average(self, |y| math::log2(y.max(floor)));
        let of_mean = math::log2(BRIGHTEST_MEAN / mean);
        if of_mean < of_log_average {
            Exposure { stops: of_mean, basis: ExposureBasis::Mean }
        } else {
            Exposure { stops: of_log_average, basis: ExposureBasis::LogAverage }
        }
    }
}

/// The shares of red, green and blue of linear Rec. 709 in the luminance.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// The luminance of a linear Rec. 709 colour.
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b
}

/// The mean over the sphere of a function of luminance. Rows are added in order: the result does not depend
/// on the number of threads.
fn average(environment: &Environment, of: impl Fn(f64) -> f64 + Sync) -> f64 {
    let grid = environment.grid();
    let luminance = |pixel: &[f32; 3]| luminance(pixel.map(f64::from)).max(0.0);
    let rows = environment.pixels().par_chunks_exact(grid.width).enumerate();
    let sums: Vec<f64> = rows
        .map(|(row, pixels)| {
            grid.solid_angle(row) * pixels.iter().map(|pixel| of(luminance(pixel))).sum::<f64>()
        })
        .collect();
    sums.iter().sum::<f64>() / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use sphere::LatLong;

    use super::*;

    fn environment(pixel: impl Fn(usize) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(16);
        Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap()
    }

    #[test]
    fn a_constant_environment_is_exposed_to_middle_grey() {
        for level in [1e-3_f32, 0.18, 50.0] {
            let exposure = environment(|_| [level; 3]).exposure();
            let shown = f64::from(level) * exposure.stops.exp2();
            // The solid angles sum to 4 pi within rounding.
            assert!((shown - 0.18).abs() < 1e-7, "{shown}");
            assert_eq!(exposure.basis, ExposureBasis::LogAverage);
        }
        assert_eq!(environment(|_| [0.0; 3]).exposure().stops, 0.0);
    }

    #[test]
    fn a_scaled_environment_is_exposed_to_the_same_picture() {
        let pixel = |i: usize| [(i % 7) as f32, (i % 5) as f32, 0.0];
        let stops = environment(pixel).exposure().stops;
        let scaled = environment(|i| pixel(i).map(|value| 64.0 * value)).exposure().stops;
        assert!((stops - 6.0 - scaled).abs() < 1e-12);
    }

    #[test]
    fn the_mean_of_a_lamp_in_the_dark_is_two_stops_above_middle_grey() {
        let lamp = environment(|i| [if i == 8 * 32 { 1000.0 } else { 1e-3 }; 3]);
        let Exposure { stops, basis } = lamp.exposure();
        let mean = lamp.integral()[1] / (4.0 * PI);
        assert!((mean * stops.exp2() - 0.72).abs() < 1e-9, "{stops}");
        assert_eq!(basis.name(), "mean");
    }
}
