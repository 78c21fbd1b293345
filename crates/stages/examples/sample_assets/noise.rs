//! Smooth noise from a hash of whole coordinates, and samples within a texel.

use rayon::prelude::*;
use sphere::{DVec3, LatLong};

/// Value noise in [0, 1]: random at whole coordinates, smooth between.
pub(crate) fn noise(x: f64, y: f64) -> f64 {
    let (cx, cy) = (x.floor(), y.floor());
    let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (smooth(x - cx), smooth(y - cy));
    let at = |dx: i64, dy: i64| random(cx as i64 + dx, cy as i64 + dy);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    mix(mix(at(0, 0), at(1, 0), fx), mix(at(0, 1), at(1, 1), fx), fy)
}

/// Octaves of noise, in [0, 1].
pub(crate) fn octaves(x: f64, y: f64, count: u32) -> f64 {
    let sum: f64 = (0..count)
        .map(|octave| {
            let scale = 2.03_f64.powi(octave as i32);
            noise(scale * x + 17.0 * f64::from(octave), scale * y) / 2_f64.powi(octave as i32 + 1)
        })
        .sum();
    sum / (1.0 - 0.5_f64.powi(count as i32))
}

/// A number in [0, 1) for a whole point.
pub(crate) fn random(x: i64, y: i64) -> f64 {
    let mut bits =
        (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    bits = (bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 29)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// The mean radiance of each texel, from `side` x `side` samples in its area.
pub(crate) fn sampled(grid: LatLong, side: usize, radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Vec<[f32; 3]> {
    let fine = LatLong { width: grid.width * side, height: grid.height * side };
    let mut pixels = vec![[0.0; 3]; grid.len()];
    pixels.par_chunks_mut(grid.width).enumerate().for_each(|(row, line)| {
        for (column, pixel) in line.iter_mut().enumerate() {
            let mut sum = DVec3::ZERO;
            for sample in 0..side * side {
                let (i, j) = (row * side + sample / side, column * side + sample % side);
                sum += radiance(fine.direction(i, j).vector());
            }
            *pixel = (sum / (side * side) as f64).to_array().map(|value| value.max(0.0) as f32);
        }
    });
    pixels
}
