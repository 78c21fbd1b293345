//! A map on another grid, and over other views.

use rayon::prelude::*;
use sh::{Degree, Expansion, rotate};
use sphere::Direction;

use crate::{MapGrid, Shrm, Terms, View, frame};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

impl Shrm {
    /// Returns the same map on another grid, local or global.
    ///
    /// Each new texel is the bilinear blend of four old ones in the world's frame, rotated into its own frame
    /// for a local map. Zonal terms of a local map do not depend on the texels' frames; they are blended as
    /// they are and stay zonal. On the map's own grid nothing is blended. A grid that is coarser by more than
    /// two skips texels: make such a map from the reflection instead. Work is O(P^3) per texel, in f64
    /// between roundings of at most two steps.
    pub fn resampled(&self, grid: MapGrid, view: View) -> Self {
        if grid == self.grid() && view == self.view() {
            return self.clone();
        }
        let zonal = self.terms() == Terms::Zonal && view == View::Local;
        let blended = if zonal { self.clone() } else { self.to_global() };
        if grid == self.grid() && view == View::Global {
            return blended;
        }
        let rows = blended.rows();
        let mut values = vec![[0.0_f32; 3]; grid.len() * rows];
        values.par_chunks_mut(64 * rows).enumerate().for_each(|(block, values)| {
            for (texel, out) in (block * 64..).zip(values.chunks_exact_mut(rows)) {
                let central = grid.direction(texel);
                let mut sums = match grid == self.grid() {
                    true => blended.texel(texel).iter().map(|value| value.map(f64::from)).collect(),
                    false => blend(&blended, central),
                };
                if view == View::Local && !zonal {
                    sums = into_frame_of(central, self.p(), sums);
                }
                out.iter_mut().zip(&sums).for_each(|(out, sum)| *out = sum.map(|value| value as f32));
            }
        });
        Self { grid, view, values, ..blended }
    }
}

/// Blends coefficients between the texels of a map.
fn blend(map: &Shrm, central: Direction) -> Vec<[f64; 3]> {
    let taps = map.grid().taps(central);
    let mut sums = vec![[0.0; 3]; map.rows()];
    for (index, weight) in taps.index.into_iter().zip(taps.weight) {
        for (sum, value) in sums.iter_mut().zip(map.texel(index)) {
            for channel in 0..3 {
                sum[channel] += weight * f64::from(value[channel]);
            }
        }
    }
    sums
}

/// Turns coefficients over the world's views into ones over views in the frame of a central direction.
fn into_frame_of(central: Direction, p: Degree, rows: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    // A map has (P + 1)^2 rows, so that they always make an expansion.
    let expansion = Expansion::from_coefficients(p, rows).unwrap_or_else(|| Expansion::zero(p));
    rotate(&expansion, frame(central).inverse()).coefficients().to_vec()
}
