//! What arrives at each vertex past the mesh, in the world's frame, and light in the frames of vertices.
//!
//! T L is in the frames of the vertices, as tables of views need it. Turned back by R_p^-1 it is a light
//! like any other, one for each vertex.

use rayon::prelude::*;
use sh::{Degree, Expansion};

use crate::frames::{Angles, Frames, LANES};
use crate::light_field::LightField;
use crate::rotation::{FrameRotation, Lanes};
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
    let rows = local.degree().rows();
    let by_channel = local.values();
    assert_eq!(by_channel.len(), frames.len() * 3 * rows, "the frames of this transfer");
    let mut values = vec![0.0; by_channel.len()];
    for (vertex, by_channel) in values.chunks_exact_mut(3 * rows).zip(by_channel.chunks_exact(3 * rows)) {
        for (place, value) in vertex.iter_mut().enumerate() {
            *value = by_channel[place % 3 * rows + place / 3];
        }
    }
    turn_each(frames, local.degree(), &mut values, FrameRotation::turn_to_world);
    values
}

/// Turns a light at each vertex from the world's frame into that of the vertex: [V, (F+1)^2, 3], row l*l + l
/// + m.
///
/// # Panics
/// If there are not as many numbers as the frames need.
pub fn turn_into_frames(frames: &Frames, degree: Degree, values: &mut [f32]) {
    assert_eq!(values.len(), frames.len() * 3 * degree.rows(), "the light of these frames");
    turn_each(frames, degree, values, FrameRotation::turn_to_local);
}

fn turn_each(
    frames: &Frames,
    degree: Degree,
    values: &mut [f32],
    turn: impl Fn(&FrameRotation, &Angles, &mut Lanes) + Sync,
) {
    let (rows, rotation) = (degree.rows(), FrameRotation::new(degree));
    values.par_chunks_mut(LANES * 3 * rows).zip(frames.blocks()).for_each(|(vertices, block)| {
        let mut c = vec![[0.0; LANES]; rows];
        for channel in 0..3 {
            for (lane, vertex) in vertices.chunks_exact(3 * rows).enumerate() {
                c.iter_mut()
                    .zip(vertex.as_chunks::<3>().0)
                    .for_each(|(lanes, rgb)| lanes[lane] = rgb[channel]);
            }
            turn(&rotation, &block.angles, &mut c);
            for (lane, vertex) in vertices.chunks_exact_mut(3 * rows).enumerate() {
                let rows = vertex.as_chunks_mut::<3>().0;
                c.iter().zip(rows).for_each(|(lanes, rgb)| rgb[channel] = lanes[lane]);
            }
        }
    });
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
