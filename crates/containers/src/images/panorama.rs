//! What a file says about the part of the sphere that its picture shows.

use envmap::Part;
use sphere::Rotation;

/// The part of the sphere that a picture shows, as its file says.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    /// The metadata that says so, such as "XMP GPano".
    pub source: &'static str,
    /// The part of the sphere.
    pub shows: Shows,
    /// How the sphere must be turned for the horizon to be level. The picture of a [`Shows::Part`] that is a
    /// fisheye is turned already.
    pub turn: Rotation,
    /// Notes of what was assumed or ignored, in whole sentences.
    pub warnings: Vec<String>,
    /// Notes of what else the file says, in whole sentences.
    pub notes: Vec<String>,
}

/// The part of the sphere that a picture shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Shows {
    /// All of the sphere, as a lat-long image.
    Whole,
    /// A part, and what that is in words: "180 x 90 degrees of a lat-long panorama".
    Part(Part, String),
    /// A part that cannot be read from the file, or contradicts itself or the picture: why, in a whole
    /// sentence.
    Unclear(String),
}

impl Panorama {
    pub(crate) fn new(source: &'static str, shows: Shows) -> Self {
        Self { source, shows, turn: Rotation::IDENTITY, warnings: Vec::new(), notes: Vec::new() }
    }
}
