//! How far a sphere is off, and what is good enough.

use serde::Serialize;

/// The largest standard error of a known figure, as a share of the figure.
const KNOWN: f64 = 0.02;

/// The number of standard errors between a figure and a limit that make certain on which side it is.
const CERTAIN: f64 = 3.0;

/// The errors in stops up to which an export is good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Limits {
    pub(crate) p95: f64,
    pub(crate) p99: f64,
}

impl Limits {
    /// The factor from the limit for 95 of 100 samples to that for 99.
    const P99: f64 = 10.0 / 3.0;

    /// The limits with this one for 95 of 100 samples.
    pub(crate) fn new(p95: f64) -> Self {
        Self { p95, p99: Self::P99 * p95 }
    }

    /// Whether the figures are known well enough: `p95` to 2 % of it, or of its limit if that is larger, and
    /// `p99` as well or so that it is certain on which side of its limit it is.
    pub(crate) fn are_known(&self, errors: &Errors) -> bool {
        let known = |uncertainty: f64, figure: f64, limit: f64| uncertainty <= KNOWN * figure.max(limit);
        let is_certain = (errors.p99 - self.p99).abs() > CERTAIN * errors.p99_uncertainty;
        known(errors.p95_uncertainty, errors.p95, self.p95)
            && (is_certain || known(errors.p99_uncertainty, errors.p99, self.p99))
    }

    /// The limits for 95 and for 99 of 100 samples.
    pub(crate) fn stops(&self) -> [f64; 2] {
        [self.p95, self.p99]
    }

    /// The factor by which an error is larger than its limit, the worse of both: at most 1 if it is good.
    pub(crate) fn excess(&self, errors: &Errors) -> f64 {
        (errors.p95 / self.p95).max(errors.p99 / self.p99)
    }
}

/// The difference of an export from brute force over the sphere's pixels and channels, the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Errors {
    /// The RMS difference divided by the RMS radiance.
    pub(crate) rms: f64,
    /// The error in stops that 95 of 100 samples stay below: |log2((value + e) / (truth + e))|, e being 1 %
    /// of the environment's mean radiance, so that black is black. Negative values count as 0.
    pub(crate) p95: f64,
    /// The error in stops that 99 of 100 samples stay below.
    pub(crate) p99: f64,
    /// The share of samples below -e / 10.
    pub(crate) negative: f64,
    /// The standard error of `p95`, because not every direction was looked at.
    pub(crate) p95_uncertainty: f64,
    /// The standard error of `p99`.
    pub(crate) p99_uncertainty: f64,
}
