//! Smaller pictures, each texel the mean of what it covers.

use std::ops::Range;

use rayon::prelude::*;

/// The means of a picture's linear texels over the texels of another grid with no more rows and columns.
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
    let columns: Vec<Span> = (0..coarse[0]).map(|column| Span::new(column, size[0], coarse[0])).collect();
    let row = |row: usize| {
        let rows = Span::new(row, size[1], coarse[1]);
        let mut sums = vec![[0.0; 3]; coarse[0]];
        for at in rows.range.clone() {
            let share = rows.share(at);
            for (sum, columns) in sums.iter_mut().zip(&columns) {
                let mut of_row = [0.0; 3];
                for column in columns.range.clone() {
                    let (share, rgb) = (columns.share(column), texel(at * size[0] + column));
                    (0..3).for_each(|channel| of_row[channel] += share * f64::from(rgb[channel]));
                }
                (0..3).for_each(|channel| sum[channel] += share * of_row[channel]);
            }
        }
        sums.into_iter().map(|sum| sum.map(|value| value as f32)).collect::<Vec<_>>()
    };
    (0..coarse[1]).into_par_iter().flat_map_iter(row).collect()
}

/// The part of a line of texels that a texel of a coarser line covers.
struct Span {
    range: Range<usize>,
    /// The ends of the part, in coarser steps of which a texel has `coarse`.
    ends: [usize; 2],
    size: usize,
    coarse: usize,
}

impl Span {
    fn new(index: usize, size: usize, coarse: usize) -> Self {
        let ends = [index * size, (index + 1) * size];
        Self { range: ends[0] / coarse..ends[1].div_ceil(coarse), ends, size, coarse }
    }

    /// The share of the part that a texel is.
    fn share(&self, texel: usize) -> f64 {
        let [start, end] = [texel * self.coarse, (texel + 1) * self.coarse];
        (end.min(self.ends[1]) - start.max(self.ends[0])) as f64 / self.size as f64
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
}
