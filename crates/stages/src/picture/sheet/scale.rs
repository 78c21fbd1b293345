//! Scales lat-long radiance to the size at which it is shown.

use envmap::Environment;
use rayon::prelude::*;

/// The radiance of an environment on `width` x `height` pixels.
///
/// Each axis is filtered by a tent as wide as a pixel of the coarser grid on either side: this is bilinear
/// interpolation when the picture grows, and an average of all texels when it shrinks. Columns wrap around.
pub(crate) fn scaled(environment: &Environment, width: usize, height: usize) -> Vec<[f32; 3]> {
    let grid = environment.grid();
    if (grid.width, grid.height) == (width, height) {
        return environment.pixels().to_vec();
    }
    let (columns, rows) = (taps(grid.width, width, true), taps(grid.height, height, false));
    let mut narrow = vec![[0.0_f32; 3]; width * grid.height];
    narrow.par_chunks_mut(width).zip(environment.pixels().par_chunks(grid.width)).for_each(|(out, line)| {
        for (pixel, taps) in out.iter_mut().zip(&columns) {
            *pixel = weighted(taps.iter().map(|(column, weight)| (line[*column], *weight)));
        }
    });
    let mut picture = vec![[0.0_f32; 3]; width * height];
    picture.par_chunks_mut(width).zip(&rows).for_each(|(out, taps)| {
        for (column, pixel) in out.iter_mut().enumerate() {
            *pixel = weighted(taps.iter().map(|(row, weight)| (narrow[row * width + column], *weight)));
        }
    });
    picture
}

/// For each of `to` cells over `from` cells: the cells that it averages, with weights that add up to 1.
fn taps(from: usize, to: usize, wraps: bool) -> Vec<Vec<(usize, f32)>> {
    let ratio = from as f64 / to as f64;
    let reach = ratio.max(1.0);
    let cells = (0..to).map(|cell| {
        let centre = (cell as f64 + 0.5) * ratio - 0.5;
        let range = (centre - reach).ceil() as i64..=(centre + reach).floor() as i64;
        let tent = range.map(|tap| (tap, (1.0 - (tap as f64 - centre).abs() / reach).max(0.0)));
        let tent: Vec<_> = tent.filter(|(_, weight)| *weight > 0.0).collect();
        let total: f64 = tent.iter().map(|(_, weight)| weight).sum();
        let place = |tap: i64| {
            if wraps { tap.rem_euclid(from as i64) } else { tap.clamp(0, from as i64 - 1) }
        };
        tent.into_iter().map(|(tap, weight)| (place(tap) as usize, (weight / total) as f32)).collect()
    });
    cells.collect()
}

fn weighted(taps: impl Iterator<Item = ([f32; 3], f32)>) -> [f32; 3] {
    taps.fold([0.0; 3], |sum, (pixel, weight)| std::array::from_fn(|c| sum[c] + weight * pixel[c]))
}

#[cfg(test)]
mod tests {
    use sphere::LatLong;

    use super::*;

    fn ramp(grid: LatLong) -> Environment {
        let pixels = (0..grid.len()).map(|i| [(i / grid.width) as f32, 1.0, (i % 7) as f32]).collect();
        Environment::new(grid, pixels).unwrap()
    }

    #[test]
    fn scaling_keeps_constants_and_means() {
        let environment = ramp(LatLong::with_rows(64));
        for (width, height) in [(32, 16), (50, 25), (128, 64), (200, 100), (1, 1)] {
            let picture = scaled(&environment, width, height);
            assert_eq!(picture.len(), width * height);
            let mean = picture.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / picture.len() as f64;
            assert!(picture.iter().all(|pixel| (pixel[1] - 1.0).abs() < 1e-5));
            // A linear ramp keeps its mean by symmetry; clamped rows at both ends cancel.
            assert!((mean - 31.5).abs() < 1e-3, "{width} {mean}");
        }
    }
}
