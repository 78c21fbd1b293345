//! Reflection models and their spherical-harmonic coefficients.

mod coefficients;

pub use coefficients::{BrdfCoefficients, Centre};
