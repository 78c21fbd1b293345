//! Lines through the colours of a block, fitted by least squares in the integers of halves.

use super::block::{BlockMode, Colours, TEXELS, TexelSet, between, contains, quantise, unquantise};

/// A line through colour space, as it is stored.
#[derive(Clone, Copy)]
pub(crate) struct ColourLine {
    pub(crate) ends: [[i32; 3]; 2],
    pub(crate) indices: [usize; TEXELS],
    /// The sum of squares over the texels on the line and channels.
    pub(crate) error: f64,
}

impl ColourLine {
    /// Lets the line run the other way if a texel is not in its first half: the highest bit of that index is
    /// not stored, and is 0.
    pub(crate) fn turned(mut self, mode: &BlockMode, texel: usize) -> Self {
        let count = mode.places().len();
        if self.indices[texel] >= count / 2 {
            self.ends.reverse();
            self.indices = self.indices.map(|index| count - 1 - index);
        }
        self
    }
}

/// The ends of the extent of some texels' colours along their principal axis.
pub(crate) fn ends(colours: &Colours, texels: TexelSet) -> [[f64; 3]; 2] {
    let count = f64::from(texels.count_ones());
    let chosen = || (0..TEXELS).filter(|&texel| contains(texels, texel));
    let colours = colours.map(|colour| colour.map(f64::from));
    let mean: [f64; 3] = std::array::from_fn(|channel| {
        chosen().map(|texel| colours[texel][channel]).sum::<f64>() / count.max(1.0)
    });
    let around =
        colours.map(|colour| std::array::from_fn::<f64, 3, _>(|channel| colour[channel] - mean[channel]));
    let covariance: [[f64; 3]; 3] = std::array::from_fn(|i| {
        std::array::from_fn(|j| chosen().map(|texel| around[texel][i] * around[texel][j]).sum())
    });
    let Some((axis, _)) = principal(&covariance) else { return [mean; 2] };
    let along = |texel: usize| (0..3).map(|channel| around[texel][channel] * axis[channel]).sum::<f64>();
    let (low, high) =
        chosen().map(along).fold((f64::MAX, f64::MIN), |(low, high), t| (low.min(t), high.max(t)));
    [low, high].map(|t| std::array::from_fn(|channel| mean[channel] + t * axis[channel]))
}

/// The axis of the largest eigenvalue of a covariance, and that eigenvalue, by the power method from the axis
/// of the widest channel on; `None` if nothing varies.
pub(crate) fn principal(covariance: &[[f64; 3]; 3]) -> Option<([f64; 3], f64)> {
    let length = |axis: [f64; 3]| axis.iter().map(|value| value * value).sum::<f64>().sqrt();
    let widest = (0..3).max_by(|&a, &b| covariance[a][a].total_cmp(&covariance[b][b])).unwrap_or(0);
    let mut axis = covariance[widest];
    for _ in 0..8 {
        let length = length(axis);
        if length == 0.0 {
            return None;
        }
        axis = axis.map(|value| value / length);
        axis = std::array::from_fn(|i| (0..3).map(|j| covariance[i][j] * axis[j]).sum());
    }
    let length = length(axis);
    (length != 0.0).then(|| (axis.map(|value| value / length), length))
}

/// The best line through all of a block, in a mode that has one, from these ends on, refined by least
/// squares; `None` if a difference between its ends does not fit. The error is that of some texels.
pub(crate) fn fit(
    mode: &BlockMode,
    colours: &Colours,
    texels: TexelSet,
    mut ends: [[f64; 3]; 2],
) -> Option<ColourLine> {
    let mut best: Option<ColourLine> = None;
    for _ in 0..3 {
        let line = through(mode, colours, texels, quantised(mode, ends)).turned(mode, 0);
        if !mode.stores(&line.ends) {
            break;
        }
        ends = least_squares(mode, colours, texels, &line.indices).unwrap_or(ends);
        if best.as_ref().is_none_or(|best| line.error < best.error) {
            best = Some(line);
        }
    }
    best
}

/// The stored numbers nearest to two ends.
pub(crate) fn quantised(mode: &BlockMode, ends: [[f64; 3]; 2]) -> [[i32; 3]; 2] {
    ends.map(|end| end.map(|value| quantise(value, mode.bits)))
}

/// The line between two stored ends, with the nearest index of each texel in the set.
pub(crate) fn through(
    mode: &BlockMode,
    colours: &Colours,
    texels: TexelSet,
    ends: [[i32; 3]; 2],
) -> ColourLine {
    match mode.lines {
        2 => through_places::<8>(mode, colours, texels, ends),
        _ => through_places::<16>(mode, colours, texels, ends),
    }
}

/// The line of a mode with so many places.
fn through_places<const PLACES: usize>(
    mode: &BlockMode,
    colours: &Colours,
    texels: TexelSet,
    ends: [[i32; 3]; 2],
) -> ColourLine {
    let wide = ends.map(|end| end.map(|value| unquantise(value, mode.bits)));
    // By channel, so that the distances to all places are computed at once.
    let mut palette = [[0; PLACES]; 3];
    for (channel, entries) in palette.iter_mut().enumerate() {
        for (entry, &weight) in entries.iter_mut().zip(mode.places()) {
            *entry = between([wide[0][channel], wide[1][channel]], weight);
        }
    }
    let (mut indices, mut error) = ([0; TEXELS], 0);
    for texel in (0..TEXELS).filter(|&texel| contains(texels, texel)) {
        let [r, g, b] = colours[texel];
        // Halves are below 2^15, so that three squares fit.
        let square = |value: i32| value.unsigned_abs().wrapping_mul(value.unsigned_abs());
        let distances: [u32; PLACES] = std::array::from_fn(|place| {
            square(palette[0][place] - r) + square(palette[1][place] - g) + square(palette[2][place] - b)
        });
        let nearest = (1..PLACES).fold(0, |a, b| if distances[b] < distances[a] { b } else { a });
        indices[texel] = nearest;
        error += u64::from(distances[nearest]);
    }
    ColourLine { ends, indices, error: error as f64 }
}

/// The ends that suit the indices of some texels best, in the integers of halves.
pub(crate) fn least_squares(
    mode: &BlockMode,
    colours: &Colours,
    texels: TexelSet,
    indices: &[usize; TEXELS],
) -> Option<[[f64; 3]; 2]> {
    let share = indices.map(|index| f64::from(mode.places()[index]) / 64.0);
    let sum = |value: &dyn Fn(usize) -> f64| {
        (0..TEXELS).filter(|&texel| contains(texels, texel)).map(value).sum::<f64>()
    };
    let (aa, ab, bb) = (
        sum(&|i| math::powi(1.0 - share[i], 2)),
        sum(&|i| (1.0 - share[i]) * share[i]),
        sum(&|i| math::powi(share[i], 2)),
    );
    let determinant = aa * bb - ab * ab;
    if determinant < 1e-9 {
        return None;
    }
    let mut ends = [[0.0; 3]; 2];
    for channel in 0..3 {
        let value = |i: usize| f64::from(colours[i][channel]);
        let (a, b) = (sum(&|i| (1.0 - share[i]) * value(i)), sum(&|i| share[i] * value(i)));
        ends[0][channel] = (a * bb - b * ab) / determinant;
        ends[1][channel] = (b * aa - a * ab) / determinant;
    }
    Some(ends)
}
