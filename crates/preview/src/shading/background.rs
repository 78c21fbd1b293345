//! What is seen along a ray that meets no surface.

use glam::Vec3;

use super::{cube, lat_long};

/// What lies behind everything.
#[derive(Clone, Copy, Debug)]
pub enum Behind<'a> {
    /// A lat-long image, RGB by rows from the top: the environment.
    LatLong {
        /// Columns and rows.
        size: [u32; 2],
        /// The texels.
        pixels: &'a [[f32; 3]],
    },
    /// A cube map, texels as `sphere::Cube` counts them: [`crate::Light::reconstruction`].
    Cube {
        /// Texels along an edge.
        edge: u32,
        /// The texels.
        texels: &'a [[f32; 3]],
    },
    /// One radiance.
    Flat(Vec3),
}

/// Radiance along a ray of any length, in the light's frame.
pub fn background(behind: Behind<'_>, ray: Vec3) -> Vec3 {
    match behind {
        Behind::LatLong { size, pixels } => lat_long::sample(size, pixels, ray),
        Behind::Cube { edge, texels } => cube::sample(edge, texels, ray),
        Behind::Flat(radiance) => radiance,
    }
}
