//! Where the pixels of a picture lie on the sphere: all over it, or on a part.

use sphere::{Direction, Face};

use crate::error::Error;
use crate::image::Image;
use crate::layout::Layout;
use crate::part::Part;

/// Where the pixels of a picture lie on the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coverage {
    /// The picture shows the whole sphere.
    Whole(Layout),
    /// The picture shows a part of the sphere.
    Part(Part),
}

impl From<Layout> for Coverage {
    fn from(layout: Layout) -> Self {
        Self::Whole(layout)
    }
}

impl From<Part> for Coverage {
    fn from(part: Part) -> Self {
        Self::Part(part)
    }
}

impl Coverage {
    /// Checks the shape of a picture.
    pub(crate) fn check(self, image: &Image) -> Result<(), Error> {
        let size = [image.width(), image.height()];
        match self {
            Self::Whole(layout) => layout.check(size[0], size[1]),
            Self::Part(part) if part.size() == size => Ok(()),
            Self::Part(part) => Err(Error::PartSize { part: part.size(), picture: size }),
        }
    }

    /// The direction of a pixel; `None` if the picture does not use it.
    pub(crate) fn direction(self, image: &Image, row: usize, column: usize) -> Option<Direction> {
        match self {
            Self::Whole(layout) => layout.direction(image.width(), image.height(), row, column),
            Self::Part(part) => part.direction(row, column),
        }
    }

    /// The solid angle of a pixel, in steradians; 0 if the picture does not use it.
    pub(crate) fn solid_angle(self, image: &Image, row: usize, column: usize) -> f64 {
        match self {
            Self::Whole(layout) => layout.solid_angle(image.width(), image.height(), row, column),
            Self::Part(part) => part.solid_angle(row, column),
        }
    }

    /// The face that holds a pixel.
    pub(crate) fn face(self, image: &Image, row: usize, column: usize) -> Option<Face> {
        match self {
            Self::Whole(layout) => layout.face(image.width(), image.height(), row, column),
            Self::Part(_) => None,
        }
    }
}
