//! The bad values of an image: NaN, infinite and negative ones.

use std::fmt;

use sphere::{Direction, Face};

/// The place of a value: its pixel, its channel and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The face of a cube that holds the pixel, if the layout has the faces of [`sphere::Cube`].
    pub face: Option<Face>,
    /// Row of the image, from the top; with [`crate::Layout::Cube`], of that face's own image.
    pub row: usize,
    /// Column of the image, from the left.
    pub column: usize,
    /// The channel: 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// The direction of the pixel.
    pub direction: Direction,
}

/// The number of values that are bad in one way, and the first of them in the order of rows, columns,
/// channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The number of values (of channels, not of pixels).
    pub count: usize,
    /// The first of the bad values.
    pub first: Place,
}

/// The bad values of an image, among the pixels that its layout uses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelAudit {
    /// The values that are NaN.
    pub nan: Option<Finding>,
    /// The values that are +infinity or -infinity.
    pub infinite: Option<Finding>,
    /// The finite values below 0.
    pub negative: Option<Finding>,
    /// The share that the negative values have in the integral of the absolute value over the sphere.
    pub negative_share: f64,
}

impl PixelAudit {
    /// Whether all values are good.
    pub fn is_clean(&self) -> bool {
        self.nan.is_none() && self.infinite.is_none() && self.negative.is_none()
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let channel = ["red", "green", "blue"][self.channel.min(2)];
        let (theta, phi) = (self.direction.theta().to_degrees(), self.direction.phi().to_degrees());
        if let Some(face) = self.face {
            write!(f, "face {}, ", face.name())?;
        }
        write!(
            f,
            "row {}, column {}, {channel} (theta {theta:.1}, phi {phi:.1} degrees)",
            self.row, self.column
        )
    }
}

impl fmt::Display for PixelAudit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_clean() {
            return write!(f, "none");
        }
        let mut separator = "";
        for (finding, name) in [(self.nan, "NaN"), (self.infinite, "infinite"), (self.negative, "negative")] {
            if let Some(Finding { count, first }) = finding {
                write!(f, "{separator}{count} {name}, the first at {first}")?;
                separator = "; ";
            }
        }
        Ok(())
    }
}
