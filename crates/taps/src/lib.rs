//! Compact reflection maps: a few look-ups into a scale space of the light.

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may compute with std

mod fit;
mod kernels;
mod scale_space;
mod table;
mod widths;

pub use fit::{FitError, Fitted, fit};
pub use kernels::NORMAL_KERNELS;
pub use scale_space::{ScaleSpace, ScaleSpaceError};
pub use table::{NormalTap, ROWS, Tap, TapRow, TapTable};
pub use widths::Widths;
