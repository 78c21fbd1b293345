//! The camera of balls: it looks along +X at the middle of a ball, up is +Z, and the picture's right is -Y.

use rayon::prelude::*;
use sh::{Stop, Stopped};
use sphere::{DVec3, Direction};

/// The position of a point of a pixel across the picture: -1 at the left or the top, 1 at the right or the
/// bottom. `offset` is where it lies in the pixel, from 0 to 1.
pub(crate) fn across(pixel: usize, offset: f64, edge: usize) -> f64 {
    2.0 * (pixel as f64 + offset) / edge as f64 - 1.0
}

/// The distance from the middle of a pixel out to a ball's outline, in pixels; below 0 outside of the ball.
/// `outline` is the ball's radius in units of half the picture's width.
pub(crate) fn inside(outline: f64, column: usize, row: usize, edge: usize) -> f64 {
    (outline - math::hypot(across(column, 0.5, edge), across(row, 0.5, edge))) * edge as f64 / 2.0
}

/// The tangent along the circles of latitude, Z x N.
pub(crate) fn tangent(normal: DVec3) -> Direction {
    Direction::new(DVec3::Z.cross(normal)).unwrap_or(Direction::Y)
}

/// A picture of `edge` x `edge` pixels, each the mean of what its points see, black if none sees anything.
///
/// `side` is the number of points along each side of a pixel, by column and row. `see` returns the radiance
/// from a point [across](across) and down the picture, of which it gets the index in the pixel; each row of
/// pixels has a state of its own.
pub(crate) fn draw<T>(
    edge: usize,
    stop: Stop<'_>,
    side: impl Fn(usize, usize) -> usize + Sync,
    state: impl Fn() -> T + Sync,
    see: impl Fn(&mut T, [f64; 2], usize) -> Option<[f64; 3]> + Sync,
) -> Result<Vec<[f32; 3]>, Stopped> {
    let mut picture = vec![[0.0; 3]; edge * edge];
    picture.par_chunks_mut(edge.max(1)).enumerate().try_for_each(|(row, line)| {
        stop.check()?;
        let mut state = state();
        for (column, pixel) in line.iter_mut().enumerate() {
            let side = side(column, row);
            let offset = |i: usize| (i as f64 + 0.5) / side as f64;
            let (mut sum, mut count) = ([0.0; 3], 0);
            for point in 0..side * side {
                let x = across(column, offset(point % side), edge);
                let y = across(row, offset(point / side), edge);
                if let Some(radiance) = see(&mut state, [x, y], point) {
                    count += 1;
                    (0..3).for_each(|channel| sum[channel] += radiance[channel]);
                }
            }
            *pixel = sum.map(|sum| (sum / f64::from(count.max(1))) as f32);
        }
        Ok(())
    })?;
    Ok(picture)
}
