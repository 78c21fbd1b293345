//! A perfect mirror: the environment in the direction of the reflected view.

use brdf::Centre;
use glam::Vec3;

use super::lat_long;
use super::surface::Surface;

/// The radiance toward the viewer; the environment is a lat-long image, RGB by rows from the top.
pub fn mirror(size: [u32; 2], environment: &[[f32; 3]], surface: &Surface) -> Vec3 {
    lat_long::sample(size, environment, surface.central(Centre::Reflection))
}
