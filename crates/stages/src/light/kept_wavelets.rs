//! Which wavelets are kept, and the error that the others leave.

use sampling::Haar;

use crate::values::percent;

/// How many wavelets are wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wanted {
    /// This many.
    Count(usize),
    /// As many as this error needs: a root mean square, relative to that of the light.
    Error(f64),
}

/// The error of a tolerance that is given though a count is.
pub(crate) fn given_twice(count: Option<usize>, tolerance: Option<f64>) -> Option<(&'static str, String)> {
    let why = "count already gives the number of wavelets; leave out one of the two";
    (count.is_some() && tolerance.is_some()).then(|| ("tolerance", why.into()))
}

/// The wavelets that are kept.
pub(crate) struct KeptWavelets {
    /// Their numbers: that of the mean, then the largest first.
    pub(crate) indices: Vec<u32>,
    /// The root mean square of the error, relative to that of the light.
    pub(crate) error: f64,
    whole: usize,
}

impl KeptWavelets {
    pub(crate) fn of(haar: &Haar<3>, wanted: Wanted) -> Self {
        let mut indices = haar.by_size();
        let whole = indices.len();
        let count = match wanted {
            Wanted::Count(count) => count.clamp(1, whole),
            Wanted::Error(tolerance) => haar.needed(&indices, tolerance),
        };
        let error = haar.error_without(&indices[count..]);
        indices.truncate(count);
        Self { indices, error, whole }
    }

    /// What a build says of them.
    pub(crate) fn note(&self) -> String {
        let (count, whole) = (self.indices.len(), self.whole);
        let error = percent(self.error);
        format!(
            "{count} of {whole} wavelets ({}) have an error of {error}",
            percent(count as f64 / whole as f64)
        )
    }
}
