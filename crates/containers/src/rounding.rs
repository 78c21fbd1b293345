//! Rounds the numbers of a texture so that a tile of texels keeps its light.
//!
//! The nearest number of a small float is up to 3 % away, and the few texels in which the light of a
//! photograph is are not enough for these errors to cancel. So each number takes one of the two that enclose
//! it: first the nearer one; then those that lie closest to the middle change sides, one after another, as
//! long as that brings the sum of the tile nearer to what was given.

use rayon::prelude::*;

/// Texels along the edge of a tile.
const EDGE: usize = 8;

/// The order in which equally good texels change sides: their bits interleaved and reversed, as in an
/// ordered dither, so that those that changed lie apart.
fn place(x: usize, y: usize) -> usize {
    (0..3).fold(0, |place, bit| {
        let (x, y) = (x >> bit & 1, y >> bit & 1);
        place | (x ^ y) << (5 - 2 * bit) | y << (4 - 2 * bit)
    })
}

/// The other side that a number of a tile can take.
#[derive(Clone, Copy)]
struct Step {
    /// How far the number is from the middle, in steps.
    off: f64,
    /// Its place among equally good ones.
    order: usize,
    /// Its texel.
    at: usize,
    /// What the step adds to the sum.
    size: f64,
}

impl Step {
    fn is_before(&self, other: &Self) -> bool {
        (self.off, self.order) < (other.off, other.order)
    }
}

/// The step nearest to the middle, of those after the last one, that makes an error smaller.
fn next_step(steps: &[Step], last: Option<Step>, error: f64) -> Option<Step> {
    // A step that all texels of a tile could not make up the error with only adds noise.
    let helps =
        |size: f64| (error + size).abs() < error.abs() && size.abs() * (EDGE * EDGE) as f64 > error.abs();
    let mut next: Option<Step> = None;
    for step in steps {
        let is_next = next.is_none_or(|next| step.is_before(&next));
        if is_next && helps(step.size) && last.is_none_or(|last| last.is_before(step)) {
            next = Some(*step);
        }
    }
    next
}

/// Whether each number of images of `width` x `height` texels takes the upper of the two that enclose it.
///
/// `enclosing` gives the two of a texel by channel; what lies outside of them takes the nearer.
pub(crate) fn upper(
    width: usize,
    height: usize,
    texels: &[[f32; 3]],
    enclosing: impl Fn(&[f32; 3]) -> [[f64; 2]; 3] + Sync,
) -> Vec<[bool; 3]> {
    let mut upper = vec![[false; 3]; texels.len()];
    let strip = (width * EDGE).max(1);
    let images = texels.par_chunks((width * height).max(1));
    images.zip(upper.par_chunks_mut((width * height).max(1))).for_each(|(texels, upper)| {
        texels.par_chunks(strip).zip(upper.par_chunks_mut(strip)).for_each(|(texels, upper)| {
            for left in (0..width).step_by(EDGE) {
                let columns = left..width.min(left + EDGE);
                let tile: Vec<usize> = (0..texels.len() / width)
                    .flat_map(|row| columns.clone().map(move |x| row * width + x))
                    .collect();
                let around: Vec<[[f64; 2]; 3]> = tile.iter().map(|&at| enclosing(&texels[at])).collect();
                for channel in 0..3 {
                    let mut error = 0.0;
                    let mut steps: Vec<Step> = Vec::with_capacity(tile.len());
                    for (&at, around) in tile.iter().zip(&around) {
                        let [low, high] = around[channel];
                        // NaN is 0 by `max`.
                        let value = f64::from(texels[at][channel].max(0.0)).clamp(low, high);
                        let rises = high - value < value - low;
                        upper[at][channel] = rises;
                        error += if rises { high - value } else { low - value };
                        if low < value && value < high {
                            let off = ((value - low) / (high - low) - 0.5).abs();
                            let order = place(at % width - left, at / width);
                            let size = if rises { low - high } else { high - low };
                            steps.push(Step { off, order, at, size });
                        }
                    }
                    // Few steps are taken, so that finding each is faster than sorting all.
                    let mut last = None;
                    while let Some(step) = next_step(&steps, last, error) {
                        error += step.size;
                        upper[step.at][channel] ^= true;
                        last = Some(step);
                    }
                }
            }
        });
    });
    upper
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole numbers.
    fn whole(texel: &[f32; 3]) -> [[f64; 2]; 3] {
        texel.map(|value| [f64::from(value.floor()), f64::from(value.floor()) + 1.0])
    }

    #[test]
    fn a_tile_keeps_its_sum() {
        // 0.25 of a step: a quarter of the texels rises, one of each block of 2 x 2.
        let upper = upper(16, 8, &[[3.25, 3.0, 3.9]; 128], whole);
        for channel in 0..3 {
            let risen = upper.iter().filter(|upper| upper[channel]).count();
            assert!(risen.abs_diff([32, 0, 115][channel]) <= 1, "{channel}: {risen}");
        }
        for (y, x) in (0..4).flat_map(|y| (0..8).map(move |x| (2 * y, 2 * x))) {
            let block = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(v, u)| upper[(y + v) * 16 + x + u][0]);
            assert_eq!(block.iter().filter(|risen| **risen).count(), 1, "{y} {x}");
        }
    }

    #[test]
    fn each_number_takes_one_of_those_around_it_and_the_nearer_where_the_sum_is_kept() {
        let texels: Vec<[f32; 3]> = (0..64).map(|i| [(i * 37 % 64) as f32 / 64.0 + 5.0; 3]).collect();
        let upper = upper(8, 8, &texels, whole);
        let sum: f32 = texels.iter().map(|texel| texel[0]).sum();
        let found: f32 = upper.iter().map(|upper| if upper[0] { 6.0 } else { 5.0 }).sum();
        assert!((found - sum).abs() <= 0.5, "{found} {sum}");
        for (texel, upper) in texels.iter().zip(&upper) {
            let share = texel[0] - 5.0;
            assert!(upper[0] == (share > 0.5) || (share - 0.5).abs() < 0.05, "{share}");
        }
    }

    /// The dark texels beside a lamp are not changed to make up for what they never could.
    #[test]
    fn a_lamp_does_not_move_its_neighbours() {
        let mut texels = vec![[0.3; 3]; 64];
        texels[20] = [1e4 + 400.0; 3];
        let around =
            |texel: &[f32; 3]| texel.map(|value| if value > 1.0 { [1e4, 1.1e4] } else { [0.0, 1.0] });
        assert!(upper(8, 8, &texels, around).iter().all(|upper| *upper == [false; 3]));
    }
}
