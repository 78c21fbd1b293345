//! The errors in a picture of an environment.

use sphere::Face;

use crate::canvas::MOST_TEXELS;
use crate::pixel_audit::PixelAudit;

/// Why a picture cannot become an environment.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The picture does not have the shape of its layout.
    #[error("{rule}; this one is {width} x {height}{}", question(*.fitting))]
    Shape {
        /// The shape that the layout needs, as a sentence.
        rule: &'static str,
        /// The number of columns of the picture.
        width: usize,
        /// The number of rows of the picture.
        height: usize,
        /// Another layout that has this shape.
        fitting: Option<&'static str>,
    },
    /// One of six faces is not square, or not as large as the first.
    #[error(
        "the six faces of a cube are square and equally large; face {} is {width} x {height}, face px has {edge} \
         columns",
        .face.name()
    )]
    FaceSize {
        /// The face that differs.
        face: Face,
        /// The number of columns of that face.
        width: usize,
        /// The number of rows of that face.
        height: usize,
        /// The number of columns of the first face.
        edge: usize,
    },
    /// The picture is not as large as the part that it is to be.
    #[error("a part of {} x {} pixels cannot be a picture of {} x {}", .part[0], .part[1], .picture[0], .picture[1])]
    PartSize {
        /// The number of columns and rows of the part.
        part: [usize; 2],
        /// The number of columns and rows of the picture.
        picture: [usize; 2],
    },
    /// The picture holds NaN, infinite or negative values.
    #[error("the image holds bad pixels: {0}")]
    BadPixels(Box<PixelAudit>),
    /// The resolution that was asked for is empty or too large to allocate.
    #[error("a resolution of {width} x {height} is not between 1 and {MOST_TEXELS} texels")]
    Resolution {
        /// The number of columns that were asked for.
        width: usize,
        /// The number of rows that were asked for.
        height: usize,
    },
}

/// A question that names the layout whose shape the picture has.
fn question(fitting: Option<&str>) -> String {
    fitting.map_or_else(String::new, |layout| format!(": is it layout = \"{layout}\"?"))
}
