//! Resampling from any layout to any grid, antialiased.
//!
//! The value of a new texel is the mean over its area of the bilinearly interpolated picture, taken at points
//! so dense that at least [`PER_TEXEL`]^2 of them fall on each of the picture's texels (if those are so large
//! that one point per new texel suffices for this, one is taken). The weights of a new texel sum to 1, so
//! that a constant picture stays constant up to rounding. [`BrightTexels`] preserves the energy of small
//! bright lights.
//!
//! If f is smooth, interpolation over texels of size h adds h^2 / 12 of the Laplacian of f and the mean over
//! new texels of size g adds g^2 / 24: both are second order. Interpolation at one point is off by no more
//! than h^2 / 8 of the larger second derivative in each of two directions.

use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::bright_texels::BrightTexels;
use crate::canvas::{Canvas, MOST_POINTS};
use crate::texels::Texels;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 0;

/// The number of points along the side of a square texel of the picture.
const PER_TEXEL: f64 = 3.0;

/// The picture `pixels`, of `width` columns, on another grid, row by row. All values must be finite.
pub(crate) fn resample<T: Texels, C: Canvas>(
    picture: T,
    width: usize,
    pixels: &[[f32; 3]],
    canvas: &C,
) -> Vec<[f32; 3]> {
    resample_unless(picture, width, pixels, canvas, &|| false)
}

/// [`resample`], which ends early once `stop` says so, and then leaves rows black. It is asked before each
/// row.
pub(crate) fn resample_unless<T: Texels, C: Canvas>(
    picture: T,
    width: usize,
    pixels: &[[f32; 3]],
    canvas: &C,
    stop: &(dyn Fn() -> bool + Sync),
) -> Vec<[f32; 3]> {
    let bright = BrightTexels::find(picture, width, pixels);
    let lit: Vec<AtomicBool> = (0..if bright.is_empty() { 0 } else { canvas.width() * canvas.rows() })
        .map(|_| AtomicBool::new(false))
        .collect();
    let mut out = vec![[0.0; 3]; canvas.width() * canvas.rows()];
    out.par_chunks_mut(canvas.width()).enumerate().filter(|_| !stop()).for_each(|(row, values)| {
        for (column, value) in values.iter_mut().enumerate() {
            if bright.is_empty() {
                *value = mean(picture, pixels, canvas, row, column, |_, _| {});
            } else {
                let mut is_lit = false;
                *value = mean(picture, pixels, canvas, row, column, |texel, solid_angle| {
                    is_lit |= bright.give(texel, solid_angle);
                });
                lit[row * canvas.width() + column].store(is_lit, Ordering::Relaxed);
            }
        }
    });
    if bright.is_empty() {
        return out;
    }

    let mut balanced = pixels.to_vec();
    let unseen = bright.balance(picture, &mut balanced);
    out.par_chunks_mut(canvas.width()).enumerate().filter(|_| !stop()).for_each(|(row, values)| {
        for (column, value) in values.iter_mut().enumerate() {
            if lit[row * canvas.width() + column].load(Ordering::Relaxed) {
                *value = mean(picture, &balanced, canvas, row, column, |_, _| {});
            }
        }
    });
    for (texel, solid_angle) in unseen {
        let Some(direction) = picture.direction(texel) else { continue };
        let (row, column) = canvas.texel(direction);
        let share = solid_angle / canvas.solid_angle(row, column);
        let value = &mut out[row * canvas.width() + column];
        for channel in 0..3 {
            value[channel] = (f64::from(value[channel]) + share * f64::from(pixels[texel][channel]))
                .clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        }
    }
    out
}

/// The mean of the picture over one texel of the canvas; `give` is called with the solid angle that each tap
/// received.
fn mean<T: Texels, C: Canvas>(
    picture: T,
    pixels: &[[f32; 3]],
    canvas: &C,
    row: usize,
    column: usize,
    mut give: impl FnMut(usize, f64),
) -> [f32; 3] {
    let (centre, across, down) = canvas.extent(row, column);
    let side = picture.side(centre, across.hypot(down) / 2.0);
    // If both grids are equal, rounding must not add a point.
    let points =
        |extent: f64| (PER_TEXEL * extent / side - 0.01).ceil().clamp(1.0, MOST_POINTS as f64) as usize;
    let mut sum = [0.0; 3];
    let mut total = 0.0;
    canvas.points(row, column, points(across), points(down), |direction, solid_angle| {
        let taps = picture.taps(direction);
        let value = taps.blend(pixels);
        for channel in 0..3 {
            sum[channel] += solid_angle * value[channel];
        }
        total += solid_angle;
        for (texel, weight) in taps.index.into_iter().zip(taps.weight) {
            give(texel, weight * solid_angle);
        }
    });
    sum.map(|sum| (sum / total) as f32)
}
