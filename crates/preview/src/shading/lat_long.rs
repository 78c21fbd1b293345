//! Look-ups on a lat-long image: four texels around a direction, across the seam and the poles.
//!
//! The grid is `sphere::LatLong`, with the taps of `envmap::Texels`: the centre is along +X, u = 0.25 along
//! +Y, and row 0 is at the top. A row beyond a pole is the first row half a turn away.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::angles::angle;
use super::cube::below;

/// Two neighbouring columns, and the share of the second.
fn pair(width: i32, x: f32) -> (i32, i32, f32) {
    let left = below(x);
    // x is between -1 / 2 and 3 / 2 of the width.
    let column = (left + width) % width;
    (column, (column + 1) % width, x - left as f32)
}

/// The bilinear value of a lat-long image, RGB by rows from the top, in a direction of any length.
pub fn sample(size: [u32; 2], pixels: &[[f32; 3]], direction: Vec3) -> Vec3 {
    let [width, height] = size.map(|side| side as i32);
    let phi = angle(direction.y, direction.x);
    let theta = angle(direction.truncate().length(), direction.z);
    let x = (0.5 - phi / TAU) * width as f32 - 0.5;
    let y = theta / PI * height as f32 - 0.5;
    let top = below(y);
    let lower = y - top as f32;
    let mut sum = Vec3::ZERO;
    for k in 0..2 {
        let row = top + k;
        let past = row < 0 || row >= height;
        let (left, right, share) = pair(width, if past { x + 0.5 * width as f32 } else { x });
        let start = row.clamp(0, height - 1) * width;
        let weight = if k == 0 { 1.0 - lower } else { lower };
        sum += Vec3::from(pixels[(start + left) as usize]) * ((1.0 - share) * weight);
        sum += Vec3::from(pixels[(start + right) as usize]) * (share * weight);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, apart, directions, noise_map, rounded};
    use envmap::Texels;
    use sphere::LatLong;

    /// Angles of up to pi are off by about 4 roundings: 4 roundings of the width or height in texels, and
    /// neighbours differ by at most 1. Next to the poles the error of a column is that of x and y, which are
    /// rounded alike.
    #[test]
    fn values_match_envmap_across_the_seam_and_the_poles() {
        for (width, height) in [(1, 1), (2, 1), (3, 2), (8, 4), (7, 5), (64, 32), (1024, 512)] {
            let map = noise_map(width * height);
            let grid = LatLong { width, height };
            let allowed = (8.0 * (width + height) as f64 + 16.0) * ROUNDING;
            for direction in directions() {
                let (short, exact) = rounded(direction);
                let expected = grid.taps(exact).blend(&map);
                let found = sample([width as u32, height as u32], &map, short * 0.2);
                assert!(apart(found, expected) < allowed, "{grid:?} at {short}: {found} {expected:?}");
            }
        }
    }
}
