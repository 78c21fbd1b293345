//! Means of an image over the texels of a coarser one, exactly.
//!
//! Solid angle on a lat-long grid is a product, dw = dphi d(cos theta), so that the texels of one grid
//! overlap those of another in rectangles: each new value is the mean of the old ones weighted by the
//! overlaps, and the integral over the sphere is preserved up to rounding.

use rayon::prelude::*;
use std::f64::consts::PI;

use sphere::LatLong;

use crate::pixels::Pixels;

/// For each new cell, the old cells that it overlaps and the part of the new cell that each covers.
type Overlaps = Vec<Vec<(usize, f64)>>;

/// The overlaps of `new` cells with `old` ones; `edge` is the coordinate of a cell's edge, as a fraction of
/// the whole.
fn overlaps(old: usize, new: usize, edge: impl Fn(f64) -> f64) -> Overlaps {
    (0..new)
        .map(|cell| {
            let (first, last) = (cell * old / new, ((cell + 1) * old).div_ceil(new));
            // Edges are compared as whole numbers, so that equal ones coincide exactly.
            let whole: f64 = edge((cell + 1) as f64 / new as f64) - edge(cell as f64 / new as f64);
            (first..last)
                .map(|k| {
                    let low =
                        if k * new <= cell * old { cell as f64 / new as f64 } else { k as f64 / old as f64 };
                    let high = if (k + 1) * new >= (cell + 1) * old {
                        (cell + 1) as f64 / new as f64
                    } else {
                        (k + 1) as f64 / old as f64
                    };
                    (k, (edge(high) - edge(low)) / whole)
                })
                .collect()
        })
        .collect()
}

/// The means of `pixels` on `grid` over the texels of another grid.
pub(crate) fn means(grid: LatLong, pixels: &Pixels, onto: LatLong) -> Vec<[f32; 3]> {
    let columns = overlaps(grid.width, onto.width, |u| u);
    let rows = overlaps(grid.height, onto.height, |v| -math::cos(PI * v));
    averaged_rows(pixels, &columns, &rows)
}

/// The means of `pixels` on `grid` over cells of equal area: rows equal in z from +Z down, an even number of
/// columns equal in azimuth, from 0, toward +X, upward.
pub(crate) fn equal_area_means(grid: LatLong, pixels: &Pixels, rows: usize, columns: usize) -> Vec<[f32; 3]> {
    let down = |edges: usize, z: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..=edges).map(|edge| z(edge as f64 / edges as f64)).collect()
    };
    let parallels = down(grid.height, &|v| -math::cos(PI * v));
    let rows = overlaps_of_edges(&parallels, &down(rows, &|v| 2.0 * v - 1.0));
    // The image begins at azimuth pi and falls.
    let mut mirrored = overlaps(grid.width, columns, |u| u);
    mirrored.reverse();
    mirrored.rotate_left(columns / 2);
    averaged_rows(pixels, &mirrored, &rows)
}

/// The overlaps of new cells with old ones, whose edges rise from the same number to the same.
fn overlaps_of_edges(old: &[f64], new: &[f64]) -> Overlaps {
    let cell = |edges: &[f64; 2]| {
        let [low, high] = *edges;
        let first = old.partition_point(|edge| *edge <= low).saturating_sub(1);
        let parts = old.array_windows().enumerate().skip(first).take_while(|(_, [from, _])| *from < high);
        parts.map(|(k, [from, to])| (k, (to.min(high) - from.max(low)) / (high - low))).collect()
    };
    new.array_windows().map(cell).collect()
}

/// The means of a flat picture over the texels of another grid with no more rows and columns.
///
/// Sizes are width and height, texels lie row by row, and `texel` returns that of an index. A texel that
/// belongs to several of the other grid counts in each by its share, so that the mean of the picture stays.
///
/// # Panics
/// If a side of the other grid is 0.
///
/// # Example: three texels become two
/// ```
/// let row: [[f32; 3]; 3] = [[0.0; 3], [3.0; 3], [6.0; 3]];
/// assert_eq!(envmap::box_filtered([3, 1], [2, 1], |k| row[k]), [[1.0; 3], [5.0; 3]]);
/// ```
pub fn box_filtered(
    size: [usize; 2],
    coarse: [usize; 2],
    texel: impl Fn(usize) -> [f32; 3] + Sync,
) -> Vec<[f32; 3]> {
    assert!(coarse.iter().all(|side| *side > 0), "a picture has texels");
    let [columns, rows] = [0, 1].map(|axis| overlaps(size[axis], coarse[axis], |place| place));
    averaged(size[0], &columns, &rows, texel)
}

/// The means of the texels of an image of this width over the new cells that these columns and rows make.
fn averaged(
    width: usize,
    columns: &Overlaps,
    rows: &Overlaps,
    texel: impl Fn(usize) -> [f32; 3] + Sync,
) -> Vec<[f32; 3]> {
    let mut out = vec![[0.0; 3]; columns.len() * rows.len()];
    let values = out.par_chunks_mut(columns.len()).zip(rows);
    values.for_each(|(values, row)| average(values, columns, row, |row, column| texel(row * width + column)));
    out
}

/// [`averaged`] over the pixels of an image, of which a band is decoded at a time.
fn averaged_rows(pixels: &Pixels, columns: &Overlaps, rows: &Overlaps) -> Vec<[f32; 3]> {
    let mut out = vec![[0.0; 3]; columns.len() * rows.len()];
    let at_once = (pixels.rows_of_band() * rows.len() / pixels.height()).max(1);
    let mut scratch = Vec::new();
    for (out, rows) in out.chunks_mut(at_once * columns.len()).zip(rows.chunks(at_once)) {
        let olds = || rows.iter().flatten().map(|(old, _)| *old);
        let (first, last) = (olds().min().unwrap_or(0), olds().max().unwrap_or(0));
        let (pixels, width) = (pixels.band(first..last + 1, &mut scratch), pixels.width());
        out.par_chunks_mut(columns.len()).zip(rows).for_each(|(values, row)| {
            average(values, columns, row, |row, column| pixels[(row - first) * width + column]);
        });
    }
    out
}

/// The means over a row of new cells, which overlaps these old rows.
fn average(
    values: &mut [[f32; 3]],
    columns: &Overlaps,
    rows: &[(usize, f64)],
    texel: impl Fn(usize, usize) -> [f32; 3],
) {
    for (value, columns) in values.iter_mut().zip(columns) {
        let mut sum = [0.0; 3];
        for &(row, down) in rows {
            for &(column, across) in columns {
                let pixel = texel(row, column);
                for channel in 0..3 {
                    sum[channel] += down * across * f64::from(pixel[channel]);
                }
            }
        }
        *value = sum.map(|sum| sum as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_picture_stays() {
        let texel = |k: usize| [k as f32, (k * k % 17) as f32, 1.0];
        let mean = |texels: &[[f32; 3]]| {
            let sum = texels.iter().fold([0.0; 3], |sum, rgb| [0, 1, 2].map(|k| sum[k] + f64::from(rgb[k])));
            sum.map(|sum| sum / texels.len() as f64)
        };
        let size = [23, 14];
        let whole: Vec<_> = (0..size[0] * size[1]).map(texel).collect();
        for coarse in [[23, 14], [11, 7], [12, 13], [1, 5], [1, 1]] {
            let found = box_filtered(size, coarse, texel);
            assert_eq!(found.len(), coarse[0] * coarse[1]);
            for (found, expected) in mean(&found).into_iter().zip(mean(&whole)) {
                assert!((found - expected).abs() < 1e-5 * expected, "{coarse:?}: {found} {expected}");
            }
        }
        assert_eq!(box_filtered(size, size, texel), whole);
    }

    /// Against many points of each cell, of which each looks at its texel.
    #[test]
    fn cells_of_equal_area_have_the_means_of_their_points() {
        for (height, rows) in [(6, 4), (5, 8), (9, 1), (2, 16)] {
            let (grid, columns) = (LatLong { width: height + 3, height }, 2 * rows);
            let pixels: Vec<_> =
                (0..grid.len()).map(|k| [(k * k % 17) as f32, 1.0, (k % 5) as f32]).collect();
            let found = equal_area_means(grid, &Pixels::new(grid.width, pixels.clone()), rows, columns);
            let fine = 120;
            for (cell, found) in found.iter().enumerate() {
                let (row, column) = (cell / columns, cell % columns);
                let mut sum = [0.0; 3];
                for point in 0..fine * fine {
                    let place = |index: usize| (index as f64 + 0.5) / fine as f64;
                    let z: f64 = 1.0 - 2.0 * (row as f64 + place(point / fine)) / rows as f64;
                    let azimuth = (column as f64 + place(point % fine)) / columns as f64 * 2.0 * PI;
                    let down = z.acos() / PI * height as f64;
                    let along = (0.5 - azimuth / (2.0 * PI)).rem_euclid(1.0) * grid.width as f64;
                    let texel = pixels[down as usize * grid.width + along as usize];
                    (0..3).for_each(|c| sum[c] += f64::from(texel[c]) / (fine * fine) as f64);
                }
                for (found, sum) in found.iter().zip(sum) {
                    assert!((f64::from(*found) - sum).abs() < 0.1, "{height} {rows}, {cell}: {found} {sum}");
                }
            }
        }
    }
}
