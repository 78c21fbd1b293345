//! Reflection models and their spherical-harmonic coefficients.

mod clamped_cosine;
mod coefficients;
mod models;
mod projection;

pub use clamped_cosine::ClampedCosine;
pub use coefficients::{BrdfCoefficients, Centre};
pub use models::{
    Absent, Lambert, MODELS, Material, Model, ModelText, Parameter, ParameterError, Phong, Shape, Value,
    Values,
};
pub use projection::{Choice, MOST_COEFFICIENTS, Projection, ProjectionError, project};
