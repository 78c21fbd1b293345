//! Reflection models and their spherical-harmonic coefficients.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod base_color_texture;
mod checks;
mod clamped_cosine;
mod coefficients;
mod environment_brdf;
mod measured;
mod measured_anisotropic;
mod models;
mod non_negative;
pub mod packed;
mod projection;
mod quadrature;
pub mod scattered;
mod table;
mod view_expansion;
mod view_values;
pub mod zernike;

pub use base_color_texture::{BaseColorTexture, TexturePlacement, Wrap};
pub use checks::{Albedo, Checks, albedo, checks};
pub use clamped_cosine::ClampedCosine;
pub use coefficients::{BrdfCoefficients, Centre, SurfaceView};
pub use environment_brdf::{ScaleBias, Visibility, environment_brdf, sheen_albedo};
pub use measured::{
    Measured, MeasuredConstants, MeasuredError, MeasuredTableConstants, from_half_difference, half_difference,
};
pub use measured_anisotropic::{
    MeasuredAnisotropic, MeasuredAnisotropicConstants, from_half_and_difference, half_and_difference,
};
pub use models::*;
pub use non_negative::{MOST_UNKNOWNS, NearestBrdf, NearestBrdfError, nearest_non_negative, unknowns};
pub use projection::{Choice, MOST_COEFFICIENTS, Projection, ProjectionError, project};
pub use table::{BelowHorizon, BrdfTable, TableError, ViewCoefficients, Views, captured, tabulate};
pub use view_values::ViewValues;

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::environment_brdf::REVISION as ENVIRONMENT_BRDF;
    pub use crate::models::REVISION as MODELS;
    pub use crate::non_negative::REVISION as NON_NEGATIVE;
    pub use crate::projection::REVISION as PROJECTION;
    pub use crate::table::REVISION as TABLE;
}
