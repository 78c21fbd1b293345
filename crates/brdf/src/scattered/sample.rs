//! A measurement of a BRDF, and what many of them must have.

use sphere::Direction;

use crate::MeasuredError;

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The direction toward the light, in the frame of the surface (+Z the normal).
    pub incident: Direction,
    /// The direction toward the viewer, in the frame of the surface.
    pub outgoing: Direction,
    /// The BRDF in 1/sr, RGB, without the cosine.
    pub value: [f64; 3],
}

impl Sample {
    /// The logarithm of the factor by which the value exceeds the base, both raised by a floor.
    pub(super) fn log_ratio(&self, base: [f64; 3], floor: f64) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let ratio = (self.value[channel] + floor) / (base[channel] + floor);
            // A black material has no floor and no residual.
            if ratio > 0.0 { math::ln(ratio) } else { 0.0 }
        })
    }
}

/// Why a table cannot be made from measurements.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ScatteredError {
    /// There are too few samples to interpolate.
    #[error("{found} samples; expected {FEWEST} or more")]
    TooFew {
        /// The number of samples.
        found: usize,
    },
    /// A measurement is impossible.
    #[error("sample {sample} is negative or not finite, or one of its directions lies below the horizon")]
    Sample {
        /// The index of the measurement.
        sample: usize,
    },
    /// The table is impossible.
    #[error(transparent)]
    Table(#[from] MeasuredError),
}

/// The fewest samples that are interpolated.
pub const FEWEST: usize = 16;

/// The samples, or as many evenly spaced ones if there are more than `most`.
///
/// # Errors
/// If there are too few, or one is impossible.
pub(super) fn checked(samples: &[Sample], most: usize) -> Result<Vec<Sample>, ScatteredError> {
    if samples.len() < FEWEST {
        return Err(ScatteredError::TooFew { found: samples.len() });
    }
    let good = |sample: &Sample| {
        let above = sample.incident.vector().z >= 0.0 && sample.outgoing.vector().z >= 0.0;
        above && sample.value.iter().all(|value| value.is_finite() && *value >= 0.0)
    };
    if let Some(sample) = samples.iter().position(|sample| !good(sample)) {
        return Err(ScatteredError::Sample { sample });
    }
    Ok(samples.iter().step_by(samples.len().div_ceil(most)).copied().collect())
}

/// The typical value: the median over samples of the brightest channel, or if that is 0, a share of the
/// greatest.
pub(super) fn typical(samples: &[Sample]) -> f64 {
    let mut bright: Vec<f64> =
        samples.iter().map(|sample| sample.value.into_iter().fold(0.0, f64::max)).collect();
    bright.sort_by(f64::total_cmp);
    let (middle, greatest) = (bright[bright.len() / 2], bright[bright.len() - 1]);
    if middle > 0.0 { middle } else { 0.01 * greatest }
}
