//! The background: the radiance along rays that hit no surface.

use glam::Vec3;

use super::{cube, lat_long};
use crate::{Background, Light};

/// The radiance along a ray of any length, in the light's frame.
pub fn background(background: Background, light: &Light, ray: Vec3) -> Vec3 {
    match background {
        Background::Environment => {
            let grid = light.environment().grid();
            lat_long::sample([grid.width as u32, grid.height as u32], light.environment().pixels(), ray)
        }
        Background::Harmonics => {
            let (cube, texels) = light.reconstruction();
            cube::sample(cube.edge as u32, texels, ray)
        }
        Background::Flat(radiance) => radiance.into(),
    }
}
