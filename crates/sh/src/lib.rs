//! Real spherical harmonics: basis, quadrature, transform, rotation and windows.

mod basis;
mod cube_synthesis;
mod energy;
mod expansion;
pub mod f64x4;
mod fft;
mod legendre;
mod light;
mod minimum;
mod non_negative;
pub mod quadrature;
mod rotation;
mod rotation_about_y;
pub mod scaled;
#[cfg(test)]
mod testkit;
mod transform;
pub mod wigner;
mod window;

pub use basis::{Basis, lambda, zonal_into};
pub use cube_synthesis::synthesise_cube;
pub use energy::{Tolerance, ToleranceOutOfRange, degree_holding, energy_per_degree, image_energy};
pub use expansion::{Degree, DegreeTooHigh, Expansion};
pub use light::{Light, Lighting};
pub use minimum::{Minimum, minimum};
pub use non_negative::{NoPositiveMean, NonNegative, non_negative};
pub use rotation::{rotate, rotate_into, rotate_orders};
pub use transform::{GaussGrid, Grid, Sample, Synthesis, Transform, TransformError};
pub use window::{Penalty, PenaltyOutOfRange, Window};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::rotation::REVISION as ROTATION;
    pub use crate::transform::REVISION as TRANSFORM;
    pub use crate::window::REVISION as WINDOW;
}
