//! Importance sampling of functions on the sphere that are given by spherical harmonics, and of their
//! products with environments; points in the unit square to sample them with; and light rigs: a few lights in
//! place of distant light; and Haar wavelets.
//!
//! # Example: `examples/sample_light.rs`
#![doc = concat!("```\n", include_str!("../examples/sample_light.rs"), "```")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod batches;
mod cell_distribution;
mod error;
mod exact;
mod f32x8;
mod haar;
mod leaf_grid;
mod leaf_masses;
mod leaves;
mod mass_tree;
mod piece_values;
mod pieces;
mod points;
mod points_of_four;
mod product;
mod rig;
mod sampler;
mod synthesis;
mod tables;
mod texel_distribution;
mod texel_light;
mod weights;

pub use error::Error;
pub use haar::Haar;
pub use leaf_grid::LeafGrid;
pub use leaves::Density;
pub use points::{GivenPoints, GivenPointsError, Points};
pub use points_of_four::PointsOfFour;
pub use product::{ProductMasses, ProductOptions, ProductSampler, ProductTables};
pub use rig::{Irradiance, LightMasses, Method, Rig, rig, rig_within};
pub use sampler::{ChannelWeights, LeafShape, Options, SUM, Sample, Sampler, UniformShare, Warp, weigh};
pub use tables::Tables;
pub use texel_light::TexelLight;
pub use weights::{Integrand, Moments};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::haar::REVISION as HAAR;
    pub use crate::rig::REVISION as RIG;
    pub use crate::sampler::REVISION as SAMPLERS;
}
