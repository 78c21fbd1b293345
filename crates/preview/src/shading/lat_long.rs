//! Look-ups on a lat-long image: four texels around a direction, over the seam and the poles.
//!
//! The grid is that of `sphere::LatLong`, the taps are those of `envmap::Texels` for it: the centre looks along +X, u = 0.25
//! along +Y, row 0 is at the top. A row past a pole is the first row seen from the other side, half a turn away.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

/// Two neighbours in a row, and the share of the second.
fn pair(width: i32, x: f32) -> (i32, i32, f32) {
    let left = x.floor();
    // x lies between -1 / 2 and 3 / 2 of the width.
    let column = (left as i32 + width) % width;
    (column, (column + 1) % width, x - left)
}

/// The bilinear value of a lat-long image, RGB by rows from the top, in a direction of any length.
pub fn sample(size: [u32; 2], pixels: &[[f32; 3]], direction: Vec3) -> Vec3 {
    let [width, height] = size.map(|side| side as i32);
    let level = direction.truncate().length();
    let phi = if level > 0.0 { direction.y.atan2(direction.x) } else { 0.0 };
    let theta = level.atan2(direction.z);
    let x = (0.5 - phi / TAU) * width as f32 - 0.5;
    let y = theta / PI * height as f32 - 0.5;
    let top = y.floor();
    let lower = y - top;
    let mut sum = Vec3::ZERO;
    for k in 0..2 {
        let row = top as i32 + k;
        let past = row < 0 || row >= height;
        let (left, right, share) = pair(width, if past { x + 0.5 * width as f32 } else { x });
        let start = row.clamp(0, height - 1) * width;
        let weight = if k == 0 { 1.0 - lower } else { lower };
        sum += Vec3::from(pixels[(start + left) as usize]) * ((1.0 - share) * weight);
        sum += Vec3::from(pixels[(start + right) as usize]) * (share * weight);
    }
    sum
}
