//! A map on another grid, interpolated.

use rayon::prelude::*;
use sh::{Degree, Expansion, rotate};

use crate::{MapGrid, Shrm, Terms, View, frame};

impl Shrm {
    /// The same map on another grid: at each new texel the bilinear blend of four old ones, in the world's frame, local
    /// again where it was; a copy where the grid is the same.
    ///
    /// Zonal terms are numbers that do not depend on the texels' frames, and are blended as they are. A grid that is coarser by
    /// more than two skips texels: make such a map from the reflection instead. Rounded to f32 once for global and zonal
    /// maps, twice for local ones; work is O(P^3) per texel.
    pub fn resampled(&self, grid: MapGrid) -> Self {
        if grid == self.grid() {
            return self.clone();
        }
        let zonal = self.terms() == Terms::Zonal;
        let blended = if zonal { self.clone() } else { self.to_global() };
        let rows = self.rows();
        let mut values = vec![[0.0_f32; 3]; grid.len() * rows];
        values.par_chunks_mut(64 * rows).enumerate().for_each(|(block, values)| {
            for (texel, out) in (block * 64..).zip(values.chunks_exact_mut(rows)) {
                let central = grid.direction(texel);
                let taps = blended.grid().taps(central);
                let mut sums = vec![[0.0; 3]; rows];
                for (index, weight) in taps.index.into_iter().zip(taps.weight) {
                    for (sum, value) in sums.iter_mut().zip(blended.texel(index)) {
                        for channel in 0..3 {
                            sum[channel] += weight * f64::from(value[channel]);
                        }
                    }
                }
                if self.view() == View::Local && !zonal {
                    sums = into_frame_of(central, self.p(), sums);
                }
                out.iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum.map(|value| value as f32));
            }
        });
        Self { grid, values, ..*self }
    }
}

/// Coefficients over the world's views as ones over views in the frame of a central direction.
fn into_frame_of(central: sphere::Direction, p: Degree, rows: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    match Expansion::from_rows(p, rows) {
        Some(expansion) => rotate(&expansion, frame(central).inverse()).rows().to_vec(),
        None => Vec::new(),
    }
}
