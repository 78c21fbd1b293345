//! One reflection map: a plain look-up about the central direction, whatever the view.

use brdf::Centre;
use glam::Vec3;

use super::cube;
use super::surface::Surface;

/// Radiance toward the viewer; `map` has texels as `sphere::Cube` counts them.
pub fn prefiltered(edge: u32, map: &[[f32; 3]], centre: Centre, surface: &Surface) -> Vec3 {
    cube::sample(edge, map, surface.central(centre))
}
