//! The radiance of a reflection at fixed central directions and views, and how far it is from another one.

use crate::stops;

/// How far a reflection is from another, at views as a ball shows them to a distant camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CutError {
    /// The error in stops that 95 of 100 samples stay below.
    pub p95: f64,
    /// The error in stops that 99 of 100 samples stay below.
    pub p99: f64,
    /// The share of samples below zero by more than a tenth of what counts as black.
    pub negative: f64,
}

/// The radiance of a reflection, lamps included, at fixed central directions and views.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples(pub(crate) Vec<[f64; 3]>);

impl Samples {
    /// The error of these samples if `reference` is right. Radiance below zero is black, and `dark` is what
    /// counts as black: see [`crate::degrees`].
    pub fn error(&self, reference: &Self, dark: f64) -> CutError {
        let pairs = self.0.as_flattened().iter().zip(reference.0.as_flattened());
        let mut stops: Vec<f64> = pairs.map(|(cut, right)| stops::error(*cut, *right, dark)).collect();
        let [p95, p99] = stops::quantiles(&mut stops);
        CutError { p95, p99, negative: self.negative(dark) }
    }

    /// The share of samples below zero by more than a tenth of `dark`.
    pub fn negative(&self, dark: f64) -> f64 {
        let values = self.0.as_flattened();
        values.iter().filter(|value| **value < -0.1 * dark).count() as f64 / values.len().max(1) as f64
    }
}
