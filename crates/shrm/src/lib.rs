//! Reflected light: convolution in spherical harmonics and its evaluation; prefilters of engines.
//!
//! # Example: `examples/reflection_map.rs`
#![doc = concat!("```\n", include_str!("../examples/reflection_map.rs"), "```")]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

pub mod accuracy;
mod azimuth;
mod baking;
mod blocks;
pub mod components;
mod degree_rule;
pub mod degrees;
mod evaluation;
mod fit;
mod global;
pub mod icosahedron;
mod lamps;
mod lookup;
mod map;
mod map_degree;
mod mean_lobe;
mod plain;
mod prefilter;
pub mod reference;
mod reflection;
mod resample;
mod resolution;
pub mod ringing;
mod samples;
pub mod shader;
mod sphere_map;
pub mod stops;
mod synthesis;
pub mod truncation;
mod turned_light;
mod view_set;
mod view_table;

pub use azimuth::azimuthal_share;
pub use baking::{BAKED_AT_ONCE, LampTables};
pub use blocks::blocks;
pub use degree_rule::{DegreeRule, MapDegree, MapTolerance, SMALL_P};
pub use fit::{Fit, FitError, GOOD_CONDITION, WORST_CONDITION, fit_angles, fit_views};
pub use lamps::{LampLevels, LampPoints, Lamps};
pub use lookup::Lookup;
pub use map::{MapGrid, Shrm, Terms, View, frame, into_frame};
pub use map_degree::MapContent;
pub use mean_lobe::{DiskMeans, MeanLight, MeanLobe};
pub use plain::Plain;
pub use prefilter::{
    Distribution, LevelMethod, LightBlocks, MethodChoice, PrefilterError, PrefilterKernel, Prefiltered,
    PrefilteredLevel, RoughnessOutOfRange, prefilter, prefilter_series,
};
pub use reflection::{MOST_P, Reflection, ViewDependent};
pub use resolution::{ByteBudget, MapLayout, Resolution};
pub use sphere_map::{
    SphereMapError, add_to_sphere_maps, from_sphere_maps, sphere_map_axes, sphere_map_rows, sphere_maps,
};
pub use synthesis::{MOST_VALUES, SynthesisError};
pub use turned_light::TurnedLight;
pub use view_set::{MapViews, ViewSet};

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::baking::REVISION as BAKING;
    pub use crate::components::REVISION as COMPONENTS;
    pub use crate::degrees::REVISION as DEGREES;
    pub use crate::fit::REVISION as FIT;
    pub use crate::mean_lobe::REVISION as MEAN_LOBE;
    pub use crate::prefilter::REVISION as PREFILTER;
    pub use crate::reference::REVISION as REFERENCE;
    pub use crate::resample::REVISION as RESAMPLING;
    pub use crate::synthesis::REVISION as SYNTHESIS;
    pub use crate::truncation::REVISION as TRUNCATION;
}
