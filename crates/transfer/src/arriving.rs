//! What arrives at each vertex past the mesh, in the world's frame.
//!
//! T L is in the frames of the vertices, as tables of views need it. Turned back by R_p^-1 it is a light
//! like any other, one for each vertex.

use rayon::prelude::*;
use sh::Expansion;

use crate::frames::{Frames, LANES};
use crate::light_field::LightField;
use crate::rotation::FrameRotation;
use crate::shading::FixedLight;
use crate::transfer::Transfer;

/// The light at each vertex in the world's frame, R_p^-1 (T L): [V, (O+1)^2, 3], row l*l + l + m. The
/// transfer is one for all channels, or one for each of red, green and blue.
///
/// An open vertex has the light itself, up to the lower of O and F.
///
/// # Panics
/// If there is no transfer, or it has not as many vertices as there are frames.
pub fn arriving(frames: &Frames, transfer: &[Transfer], light: &Expansion) -> Vec<f32> {
    let local = FixedLight::with_transfer(transfer, light);
    let (degree, rows) = (local.degree(), local.degree().rows());
    let mut values = local.values();
    assert_eq!(values.len(), frames.len() * 3 * rows, "the frames of this transfer");
    let rotation = FrameRotation::new(degree);
    values.par_chunks_mut(LANES * 3 * rows).zip(frames.blocks()).for_each(|(vertices, block)| {
        let mut c = vec![[0.0; LANES]; rows];
        let mut world = vec![0.0; vertices.len()];
        for channel in 0..3 {
            for (lane, vertex) in vertices.chunks_exact(3 * rows).enumerate() {
                c.iter_mut().zip(&vertex[channel * rows..]).for_each(|(lanes, value)| lanes[lane] = *value);
            }
            rotation.turn_to_world(&block.angles, &mut c);
            for (lane, vertex) in world.chunks_exact_mut(3 * rows).enumerate() {
                c.iter().enumerate().for_each(|(row, lanes)| vertex[3 * row + channel] = lanes[lane]);
            }
        }
        vertices.copy_from_slice(&world);
    });
    values
}

impl LightField {
    /// The light at each vertex that arrives past the mesh, as [`arriving`] has it.
    ///
    /// # Panics
    /// In the cases of [`arriving`].
    pub fn arriving(&self, frames: &Frames, transfer: &[Transfer]) -> Vec<f32> {
        let mut sum = Vec::new();
        for (point, light) in self.lights().iter().enumerate() {
            let mut own = arriving(frames, transfer, light);
            let length = own.len() / frames.len().max(1);
            let of_vertex = own.par_chunks_exact_mut(length.max(1)).zip(frames.positions());
            of_vertex.for_each(|(values, place)| {
                let weight = self.weights(place.map(f64::from)).nth(point).unwrap_or(0.0) as f32;
                values.iter_mut().for_each(|value| *value *= weight);
            });
            if sum.is_empty() {
                sum = own;
            } else {
                sum.iter_mut().zip(own).for_each(|(sum, own): (&mut f32, f32)| *sum += own);
            }
        }
        sum
    }
}
