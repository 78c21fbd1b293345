//! Means of a lat-long image over the texels of a coarser one, exactly.
//!
//! Solid angle on a lat-long grid is a product, dw = dphi d(cos theta), so that the texels of one grid
//! overlap those of another in rectangles: each new value is the mean of the old ones weighted by the
//! overlaps, and the integral over the sphere is preserved up to rounding.

use rayon::prelude::*;
use std::f64::consts::PI;

use sphere::LatLong;

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
pub(crate) fn means(grid: LatLong, pixels: &[[f32; 3]], onto: LatLong) -> Vec<[f32; 3]> {
    let columns = overlaps(grid.width, onto.width, |u| u);
    let rows = overlaps(grid.height, onto.height, |v| -math::cos(PI * v));
    let mut out = vec![[0.0; 3]; onto.len()];
    out.par_chunks_mut(onto.width).zip(&rows).for_each(|(values, rows)| {
        for (value, columns) in values.iter_mut().zip(&columns) {
            let mut sum = [0.0; 3];
            for &(row, down) in rows {
                for &(column, across) in columns {
                    let pixel = pixels[row * grid.width + column];
                    for channel in 0..3 {
                        sum[channel] += down * across * f64::from(pixel[channel]);
                    }
                }
            }
            *value = sum.map(|sum| sum as f32);
        }
    });
    out
}
