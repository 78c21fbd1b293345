//! Reflection models and their spherical-harmonic coefficients.

mod clamped_cosine;
mod coefficients;
mod measured;
mod models;
mod projection;
pub mod scattered;
pub mod zernike;

pub use clamped_cosine::ClampedCosine;
pub use coefficients::{BrdfCoefficients, Centre};
pub use measured::{Measured, MeasuredError, from_half_difference, half_difference};
pub use models::{
    Absent, Lambert, MODELS, Material, Model, ModelText, Parameter, ParameterError, Phong, Shape, Value,
    Values,
};
pub use projection::{Choice, MOST_COEFFICIENTS, Projection, ProjectionError, project};
