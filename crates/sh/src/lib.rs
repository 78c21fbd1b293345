//! Real spherical harmonics: basis, quadrature, transform, rotation and windows.

mod basis;
mod energy;
mod expansion;
mod legendre;
pub mod quadrature;
mod rotation;
#[cfg(test)]
mod testkit;
mod transform;
mod wigner;

pub use basis::{Basis, lambda, zonal_into};
pub use energy::{Tolerance, ToleranceOutOfRange, degree_holding, energy_per_degree};
pub use expansion::{Degree, DegreeTooHigh, Expansion};
pub use rotation::{rotate, rotate_into};
pub use transform::{GaussGrid, Grid, Sample, Synthesis, Transform, TransformError};
