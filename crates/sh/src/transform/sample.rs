//! The transforms of each precision.
//!
//! They are compiled here, once for `f32` and once for `f64`. A crate that calls a generic function compiles
//! it again, in parts of its own between which nothing is inlined: then these take up to three times as long.

use super::analysis::{Colatitude, analyse};
use super::fourier::ImageRows;
use super::plan::TransformPlan;
use super::precision::Precision;
use super::synthesis::synthesise;
use crate::{Expansion, Stop, Stopped};

/// A channel of a pixel: `f32` or `f64`.
pub trait Sample: Precision {
    /// [`super::Transform::analyse_rows`] into `expansion`.
    #[doc(hidden)]
    fn analyse(
        plan: &TransformPlan,
        colatitude: &Colatitude,
        image: &dyn ImageRows<Self>,
        stop: Stop<'_>,
        expansion: &mut Expansion,
    ) -> Result<(), Stopped>;

    /// [`super::Synthesis::synthesise_into`] with the plan.
    #[doc(hidden)]
    fn synthesise(plan: &TransformPlan, expansion: &Expansion, pixels: &mut [[Self; 3]]);
}

macro_rules! sample {
    ($sample:ty) => {
        impl Sample for $sample {
            fn analyse(
                plan: &TransformPlan,
                colatitude: &Colatitude,
                image: &dyn ImageRows<Self>,
                stop: Stop<'_>,
                expansion: &mut Expansion,
            ) -> Result<(), Stopped> {
                analyse(plan, colatitude, image, stop, expansion)
            }

            fn synthesise(plan: &TransformPlan, expansion: &Expansion, pixels: &mut [[Self; 3]]) {
                synthesise(plan, expansion, pixels);
            }
        }
    };
}

sample!(f32);
sample!(f64);
