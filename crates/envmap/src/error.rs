//! What can be wrong with a picture of an environment.

use sphere::Face;

use crate::{Layout, PixelAudit};

/// Why a picture cannot become an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The picture has not the shape that its layout asks for.
    #[error("{rule}; this one is {width} x {height}{hint}", rule = .layout.rule(), hint = hint(.layout, *.width, *.height))]
    Shape {
        /// The layout that was asked for.
        layout: Layout,
        /// Columns of the picture.
        width: usize,
        /// Rows of the picture.
        height: usize,
    },
    /// One of six faces is not square, or not as large as the first.
    #[error(
        "the six faces of a cube are square and equally large; face {} is {width} x {height}, face px has {edge} columns",
        .face.name()
    )]
    FaceSize {
        /// The face that does not fit.
        face: Face,
        /// Its columns.
        width: usize,
        /// Its rows.
        height: usize,
        /// Columns of the first face.
        edge: usize,
    },
    /// The picture holds NaN, infinite or negative values.
    #[error("the image holds bad pixels: {0}")]
    BadPixels(Box<PixelAudit>),
    /// The resolution that was asked for is empty or too large to allocate.
    #[error(
        "a resolution of {width} x {height} is not between 1 and {} texels",
        crate::environment::MOST_TEXELS
    )]
    Resolution {
        /// Columns that were asked for.
        width: usize,
        /// Rows that were asked for.
        height: usize,
    },
}

/// A question that names the layout whose shape the picture has.
fn hint(layout: &Layout, width: usize, height: usize) -> String {
    Layout::ALL
        .into_iter()
        .find(|other| other != layout && other.check(width, height).is_ok())
        .map_or_else(String::new, |other| format!(": is it layout = \"{}\"?", other.name()))
}
