//! What the section on light rigs shows: numbers of lights, and their pictures.

use sphere::LatLong;

use crate::picture::report::figures::RigMethod;

/// The numbers of lights that are tried.
pub(crate) const LIGHTS: [u32; 5] = [1, 4, 16, 64, 256];

/// The method whose spheres are shown.
pub(crate) const SHOWN: RigMethod = RigMethod::MedianCut;

/// The grid of a picture of light.
pub(crate) const PICTURE: LatLong = LatLong::with_rows(66);

/// 8-bit sRGB pictures of the section, for each environment.
#[derive(Default)]
pub(crate) struct RigPictures {
    /// The environment with the lights of each of [`LIGHTS`], and without them.
    pub(crate) lights: Vec<Vec<[u8; 3]>>,
    /// The spheres under each of [`LIGHTS`], and by brute force, for each material.
    pub(crate) spheres: Vec<Vec<Vec<[u8; 3]>>>,
}
