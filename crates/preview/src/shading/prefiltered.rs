//! A plain reflection map: a look-up in the central direction, the same for every view.

use brdf::Centre;
use glam::Vec3;

use super::cube;
use super::surface::Surface;

/// The radiance toward the viewer; texels are in the order of `sphere::Cube`.
pub fn prefiltered(edge: u32, texels: &[[f32; 3]], centre: Centre, surface: &Surface) -> Vec3 {
    cube::sample(edge, texels, surface.central(centre))
}
