//! The precisions of pixels, and what a plan holds for each of them.

use std::sync::OnceLock;

use crate::vector::Real;

/// What works along the rows is of one precision: `f32` or `f64`.
pub trait Precision: Real {
    /// The value for this precision.
    fn choose<P: PerPrecision>(values: &ForEachPrecision<P>) -> &OnceLock<P::Of<Self>>;
}

impl Precision for f32 {
    fn choose<P: PerPrecision>(values: &ForEachPrecision<P>) -> &OnceLock<P::Of<Self>> {
        &values.single
    }
}

impl Precision for f64 {
    fn choose<P: PerPrecision>(values: &ForEachPrecision<P>) -> &OnceLock<P::Of<Self>> {
        &values.double
    }
}

/// A type for each precision.
pub trait PerPrecision {
    /// The type for this one.
    type Of<T: Precision>;
}

/// A value for each precision, made when it is first used.
pub struct ForEachPrecision<P: PerPrecision> {
    single: OnceLock<P::Of<f32>>,
    double: OnceLock<P::Of<f64>>,
}

impl<P: PerPrecision> ForEachPrecision<P> {
    pub(super) const fn new() -> Self {
        Self { single: OnceLock::new(), double: OnceLock::new() }
    }

    /// The value for the precision `T`.
    pub(super) fn get<T: Precision>(&self, make: impl FnOnce() -> P::Of<T>) -> &P::Of<T> {
        T::choose(self).get_or_init(make)
    }
}
