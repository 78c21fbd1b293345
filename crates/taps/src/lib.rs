//! Compact reflection maps: a few look-ups into a scale space of the light.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod accuracy;
mod any_table;
mod facets;
mod fit;
mod kernels;
mod scale_space;
mod shader;
mod table;
mod varied;
mod widths;

pub use accuracy::{Accuracy, LightPoints, Taps, Trade, Truth};
pub use any_table::AnyTable;
pub use facets::{FacetNode, FacetTable, FacetTap, SurfaceFrame};
pub use fit::{
    Fitted, FittedFacets, FittedVaried, fit, fit_by_reflectance, fit_each, fit_facets, fit_varied, least_fit,
    widths_for,
};
pub use kernels::NORMAL_KERNELS;
pub use scale_space::{ScaleSpace, ScaleSpaceError};
pub use shader::{
    Language, LookUp, Source, TableShape, atlas_picture, facet_texels, table_texels, varied_texels,
};
pub use table::{NormalTap, ROWS, Tap, TapRow, TapTable};
pub use varied::{VariedTable, Weights};
pub use widths::Widths;

/// The revisions of the kernels, for the kinds of stage that call them.
pub mod revisions {
    pub use crate::fit::REVISION as FIT;
    pub use crate::scale_space::REVISION as SCALE_SPACE;
}
