//! Errors as an eye sees them, in stops: what reports, previews and warnings say.

use rayon::prelude::*;

/// The radiance below which black is black, as a share of the light's mean: e of [`error`].
pub const BLACK_SHARE: f64 = 0.01;

/// The error |log2((value + e) / (truth + e))| in stops, e being `dark`. A value below 0 is black.
pub fn error(value: f64, truth: f64, dark: f64) -> f64 {
    let e = dark.max(f64::MIN_POSITIVE);
    let seen = |value: f64| value.max(0.0) + e;
    math::log2(seen(value) / seen(truth)).abs()
}

/// The values that 95 and 99 of 100 numbers stay below; changes their order.
pub fn quantiles(numbers: &mut [f64]) -> [f64; 2] {
    let count = numbers.len();
    let mut at = |share: f64| {
        let index = (share * count as f64) as usize;
        if index < count { *numbers.select_nth_unstable_by(index, f64::total_cmp).1 } else { 0.0 }
    };
    [at(0.95), at(0.99)]
}

/// The fewest samples that are a task of their own: each takes about a tenth of a microsecond.
const SAMPLES_PER_TASK: usize = 128;

/// [`quantiles`] of the errors of samples, one for each channel, which are computed on all threads from a
/// sample's place and the sample.
pub(crate) fn quantiles_of<T: Sync>(
    samples: &[T],
    errors: impl Fn(usize, &T) -> [f64; 3] + Sync,
) -> [f64; 2] {
    let samples = samples.par_iter().enumerate().with_min_len(SAMPLES_PER_TASK);
    let mut errors: Vec<[f64; 3]> = samples.map(|(index, sample)| errors(index, sample)).collect();
    quantiles(errors.as_flattened_mut())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_as_bright_is_a_stop_and_black_is_black() {
        assert!((error(2.0, 1.0, 0.0) - 1.0).abs() < 1e-12 && (error(0.5, 1.0, 0.0) - 1.0).abs() < 1e-12);
        assert_eq!(error(-3.0, 0.0, 0.01), 0.0);
        assert!(error(1e-6, 2e-6, 0.01) < 1e-3);
        let mut numbers: Vec<f64> = (0..1000).rev().map(f64::from).collect();
        assert_eq!(quantiles(&mut numbers), [950.0, 990.0]);
        assert_eq!(quantiles(&mut []), [0.0, 0.0]);
    }
}
