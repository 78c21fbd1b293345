//! The pictures of the section on degrees: 8-bit sRGB, all of an environment with the same exposure.

use sphere::LatLong;

/// The grid of a picture of light.
pub(crate) const PICTURE: LatLong = LatLong::with_rows(66);

/// The pixels of a picture.
pub(crate) type Pixels = Vec<[u8; 3]>;

/// All pictures of the section.
#[derive(Default)]
pub(crate) struct DegreePictures {
    /// The light of each environment, then blurred as its spheres are; and the environment's name.
    pub(crate) lights: Vec<(String, Vec<Pixels>)>,
    /// The spheres of each pair.
    pub(crate) pairs: Vec<PairPictures>,
}

/// The spheres of a pair.
pub(crate) struct PairPictures {
    pub(crate) truth: Pixels,
    /// The spheres at each degree P, in the order of the figures.
    pub(crate) cuts: Vec<Pixels>,
    /// The spheres under blurred light, in the order of the figures.
    pub(crate) blurred: Vec<Pixels>,
}
