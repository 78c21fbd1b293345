//! Reflection models and their spherical-harmonic coefficients.

mod clamped_cosine;
mod coefficients;
mod models;
mod projection;

pub use coefficients::{BrdfCoefficients, Centre};
pub use models::{Lambert, Material, ParameterError, Phong};
pub use projection::{Choice, MOST_COEFFICIENTS, Projection, ProjectionError, project};
