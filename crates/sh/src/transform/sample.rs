//! The precisions of pixels, and what a plan holds for each of them.

use std::sync::OnceLock;

/// A channel of a pixel: `f32` or `f64`.
pub trait Sample: private::Sealed {}

mod private {
    use std::sync::OnceLock;

    use crate::transform::sample::{ForEachSample, PerSample, Sample};

    pub trait Sealed: crate::vector::Real {
        fn choose<P: PerSample>(values: &ForEachSample<P>) -> &OnceLock<P::Of<Self>>
        where
            Self: Sample;
    }

    impl Sealed for f32 {
        fn choose<P: PerSample>(values: &ForEachSample<P>) -> &OnceLock<P::Of<Self>> {
            &values.single
        }
    }

    impl Sealed for f64 {
        fn choose<P: PerSample>(values: &ForEachSample<P>) -> &OnceLock<P::Of<Self>> {
            &values.double
        }
    }
}

impl Sample for f32 {}
impl Sample for f64 {}

/// A type for each type of samples.
pub trait PerSample {
    /// The type for this one.
    type Of<T: Sample>;
}

/// A value for each type of samples, made when it is first used.
pub struct ForEachSample<P: PerSample> {
    single: OnceLock<P::Of<f32>>,
    double: OnceLock<P::Of<f64>>,
}

impl<P: PerSample> ForEachSample<P> {
    pub(super) const fn new() -> Self {
        Self { single: OnceLock::new(), double: OnceLock::new() }
    }

    /// The value for samples of type `T`.
    pub(super) fn get<T: Sample>(&self, make: impl FnOnce() -> P::Of<T>) -> &P::Of<T> {
        T::choose(self).get_or_init(make)
    }
}
