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
use sh::{Stop, Stopped, unstopped};

use crate::bright_texels::{BrightTexels, EnergyBalance};
use crate::canvas::{Canvas, MOST_POINTS};
use crate::pixels::Pixels;
use crate::texels::{Taps, Texels};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The number of points along the side of a square texel of the picture.
const PER_TEXEL: f64 = 3.0;

/// Takes the picture `pixels` to another grid, row by row. All values must be finite.
pub(crate) fn resample<T: Texels, C: Canvas>(picture: T, pixels: &Pixels, canvas: &C) -> Vec<[f32; 3]> {
    unstopped(|stop| resample_points(picture, pixels, &OnCanvas { picture, canvas }, stop))
}

/// The points of a picture under the texels of a grid.
pub(crate) trait Points: Sync + Sized {
    /// The type of the grid.
    type Canvas: Canvas;

    /// The grid of the points' texels.
    fn canvas(&self) -> &Self::Canvas;

    /// Calls `visit` with the taps that make up the picture at each point of a texel, and the point's solid
    /// angle.
    fn visit(&self, row: usize, column: usize, visit: impl FnMut(Taps, f64));

    /// Gives the bright texels of the picture the solid angles of their points. `stop` is asked before each
    /// row.
    fn give_to(&self, bright: &BrightTexels, stop: Stop<'_>) -> Result<(), Stopped> {
        let canvas = self.canvas();
        (0..canvas.rows()).into_par_iter().try_for_each(|row| {
            stop.check()?;
            for column in 0..canvas.width() {
                self.visit(row, column, |taps, solid_angle| bright.give_taps(taps, solid_angle));
            }
            Ok(())
        })
    }

    /// The means of the picture over the points of each texel. `stop` is asked before each row.
    fn means(&self, pixels: &Pixels, out: &mut [[f32; 3]], stop: Stop<'_>) -> Result<(), Stopped> {
        let pixels = pixels.whole();
        out.par_chunks_mut(self.canvas().width()).enumerate().try_for_each(|(row, values)| {
            stop.check()?;
            for (column, value) in values.iter_mut().enumerate() {
                *value = by_taps(self, |texel| pixels[texel], row, column);
            }
            Ok(())
        })
    }
}

/// The mean of a picture over the points of a texel, by the pixel of each of its texels.
pub(crate) fn by_taps<P: Points>(
    points: &P,
    pixel: impl Fn(usize) -> [f32; 3],
    row: usize,
    column: usize,
) -> [f32; 3] {
    let mut sum = [0.0; 3];
    let mut total = 0.0;
    points.visit(row, column, |taps, solid_angle| {
        let value = taps.blend_by(&pixel);
        (0..3).for_each(|channel| sum[channel] += solid_angle * value[channel]);
        total += solid_angle;
    });
    sum.map(|sum| (sum / total) as f32)
}

/// The points of a picture by their directions.
pub(crate) struct OnCanvas<'a, T, C> {
    pub(crate) picture: T,
    pub(crate) canvas: &'a C,
}

impl<T: Texels, C: Canvas> Points for OnCanvas<'_, T, C> {
    type Canvas = C;

    fn canvas(&self) -> &C {
        self.canvas
    }

    fn visit(&self, row: usize, column: usize, mut visit: impl FnMut(Taps, f64)) {
        let (across, down) = points_of_texel(self.picture, self.canvas, row, column);
        self.canvas.points(row, column, across, down, |direction, solid_angle| {
            visit(self.picture.taps(direction), solid_angle);
        });
    }
}

/// The number of points that a texel needs across and down.
fn points_of_texel(picture: impl Texels, canvas: &impl Canvas, row: usize, column: usize) -> (usize, usize) {
    let (centre, across, down) = canvas.extent(row, column);
    let side = picture.side(centre, math::hypot(across, down) / 2.0);
    // If both grids are equal, rounding must not add a point.
    let points =
        |extent: f64| (PER_TEXEL * extent / side - 0.01).ceil().clamp(1.0, MOST_POINTS as f64) as usize;
    (points(across), points(down))
}

/// The means of a picture over the texels of a grid, by points. `stop` is asked before each row.
pub(crate) fn resample_points<T: Texels, P: Points>(
    picture: T,
    pixels: &Pixels,
    points: &P,
    stop: Stop<'_>,
) -> Result<Vec<[f32; 3]>, Stopped> {
    let canvas = points.canvas();
    let mut out = vec![[0.0; 3]; canvas.width() * canvas.rows()];
    let bright = BrightTexels::find(picture, pixels);
    if bright.is_empty() {
        points.means(pixels, &mut out, stop)?;
        return Ok(out);
    }
    points.give_to(&bright, stop)?;
    let EnergyBalance { scaled, unseen } = bright.balance(picture);
    match scaled.is_empty() {
        true => points.means(pixels, &mut out, stop)?,
        false => points.means(&pixels.clone().replaced(scaled), &mut out, stop)?,
    }
    for (texel, radiance) in unseen {
        let Some(direction) = picture.direction(texel) else { continue };
        let (row, column) = canvas.texel(direction);
        let share = picture.solid_angle(texel) / canvas.solid_angle(row, column);
        let value = &mut out[row * canvas.width() + column];
        for channel in 0..3 {
            value[channel] = (f64::from(value[channel]) + share * f64::from(radiance[channel]))
                .clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        }
    }
    Ok(out)
}
