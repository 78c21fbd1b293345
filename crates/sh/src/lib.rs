//! Real spherical harmonics: basis, quadrature, transform, rotation and windows.

mod expansion;

pub use expansion::{Degree, DegreeTooHigh, Expansion};
