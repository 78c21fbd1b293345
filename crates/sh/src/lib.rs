//! Real spherical harmonics: basis, quadrature, transform, exact integrals over cells, rotation and windows.
//!
//! # Example: `examples/irradiance.rs`
#![doc = concat!("```\n", include_str!("../examples/irradiance.rs"), "```")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod basis;
mod cells;
mod cube_interpolation;
mod cube_synthesis;
mod energy;
pub mod exchange;
mod expansion;
pub mod f64x4;
mod fft;
mod half_spaces;
mod legendre;
mod light;
mod minimum;
mod nearest;
mod non_negative;
pub mod quadrature;
mod rectangle;
mod rotation;
mod rotation_about_y;
pub mod scaled;
mod stop;
#[cfg(test)]
mod testkit;
mod transform;
mod vector;
pub mod wigner;
mod window;

pub use basis::{Basis, lambda, zonal_into};
pub use cells::{CellGrid, CellTransform};
pub use cube_interpolation::interpolate_cube;
pub use cube_synthesis::synthesise_cube;
pub use energy::{
    Tolerance, ToleranceOutOfRange, degree_holding, energy_per_degree, image_energy, image_energy_of_rows,
};
pub use exchange::Mean;
pub use expansion::{Degree, DegreeTooHigh, Expansion};
pub use half_spaces::{HalfSpace, NearestInHalfSpaces};
pub use light::{Light, Lighting, MOST_RINGS, POINT};
pub use minimum::{Minimum, minimum};
pub use nearest::{Nearest, NearestError, nearest_non_negative};
pub use non_negative::{NoPositiveMean, NonNegative, non_negative};
pub use rectangle::{Parallel, ZoneIntegrals};
pub use rotation::{rotate, rotate_into, rotate_orders};
pub use stop::{Stop, Stopped, unstopped};
pub use transform::{GaussGrid, Grid, ImageRows, Sample, Synthesis, Transform, TransformError};
pub use window::{Penalty, PenaltyOutOfRange, Window};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::cells::REVISION as CELLS;
    pub use crate::nearest::REVISION as NEAREST;
    pub use crate::rotation::REVISION as ROTATION;
    pub use crate::transform::REVISION as TRANSFORM;
    pub use crate::window::REVISION as WINDOW;
}
