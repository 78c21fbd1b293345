//! Lines through the colours of a block, fitted by least squares in the integers of halves.
//!
//! All numbers are the bits of halves less their mean over the block, as 32-bit floats, which hold them
//! exactly. Each function goes through all sixteen texels by the same steps, without a branch, so that the
//! compiler makes vectors of them; its sums have an order that does not depend on these.

use super::block::{BlockMode, Colours, TEXELS, TexelSet, contains, quantise, unquantise};

/// A number for each texel of a block.
pub(crate) type Lane = [f32; TEXELS];

/// All texels count alike.
pub(crate) const EVEN: Lane = [1.0; TEXELS];

/// The colours of a block, by channel.
pub(crate) struct Block {
    /// The bits of halves, less `mean`.
    pub(crate) around: [Lane; 3],
    /// The mean of the bits over the texels that count, rounded.
    pub(crate) mean: [f32; 3],
    /// How much the square of each texel counts.
    pub(crate) weights: Lane,
}

/// A line through colour space, as it is stored.
#[derive(Clone, Copy)]
pub(crate) struct ColourLine {
    pub(crate) ends: [[i32; 3]; 2],
    /// The place of each texel on the line, also of those that are not on it.
    pub(crate) indices: [u32; TEXELS],
    /// The weighted sum of squares over the texels on the line and channels.
    pub(crate) error: f32,
    /// The sum of the texels' red, green and blue, not of their bits.
    pub(crate) light: [f32; 3],
}

impl ColourLine {
    /// A line without texels.
    pub(crate) const NONE: Self =
        Self { ends: [[0; 3]; 2], indices: [0; TEXELS], error: 0.0, light: [0.0; 3] };

    /// Lets the line run the other way if a texel is not in its first half: the highest bit of that index is
    /// not stored, and is 0.
    #[inline(always)]
    pub(crate) fn turned<const PLACES: usize>(mut self, texel: usize) -> Self {
        if self.indices[texel] as usize >= PLACES / 2 {
            self.ends.reverse();
            self.indices = self.indices.map(|index| PLACES as u32 - 1 - index);
        }
        self
    }
}

impl Block {
    /// Colours, of which those of some texels count, each with a weight.
    #[inline(always)]
    pub(crate) fn new(colours: &Colours, texels: TexelSet, weights: &Lane) -> Self {
        let mut sum = [0; 3];
        for texel in (0..TEXELS).filter(|&texel| contains(texels, texel)) {
            for channel in 0..3 {
                sum[channel] += colours[texel][channel];
            }
        }
        let mean = sum.map(|sum| sum / texels.count_ones().max(1) as i32);
        let mut around = [[0.0; TEXELS]; 3];
        for (channel, lane) in around.iter_mut().enumerate() {
            for texel in 0..TEXELS {
                lane[texel] = (colours[texel][channel] - mean[channel]) as f32;
            }
        }
        Self { around, mean: mean.map(|mean| mean as f32), weights: *weights }
    }
}

/// 1 for each texel in a set, and 0 for the rest.
#[inline(always)]
pub(crate) fn mask(texels: TexelSet) -> Lane {
    let mut mask = [0.0; TEXELS];
    for (texel, mask) in mask.iter_mut().enumerate() {
        *mask = (u32::from(texels) >> texel & 1) as f32;
    }
    mask
}

/// The sum of a lane, by halves.
#[inline(always)]
pub(crate) fn total(lane: &Lane) -> f32 {
    let mut eight = [0.0; 8];
    for i in 0..8 {
        eight[i] = lane[i] + lane[i + 8];
    }
    let mut four = [0.0; 4];
    for i in 0..4 {
        four[i] = eight[i] + eight[i + 4];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

/// The sum of the products of two lanes.
#[inline(always)]
fn dot(a: &Lane, b: &Lane) -> f32 {
    let mut product = [0.0; TEXELS];
    for i in 0..TEXELS {
        product[i] = a[i] * b[i];
    }
    total(&product)
}

/// The ends of the extent of some texels' colours along their principal axis.
#[inline(always)]
pub(crate) fn ends(block: &Block, mask: &Lane) -> [[f32; 3]; 2] {
    let count = total(mask).max(1.0);
    let mean = [0, 1, 2].map(|channel: usize| dot(&block.around[channel], mask) / count);
    let mut around = block.around;
    for channel in 0..3 {
        for i in 0..TEXELS {
            around[channel][i] = (around[channel][i] - mean[channel]) * mask[i];
        }
    }
    let [r, g, b] = &around;
    let (rg, rb, gb) = (dot(r, g), dot(r, b), dot(g, b));
    let covariance = [[dot(r, r), rg, rb], [rg, dot(g, g), gb], [rb, gb, dot(b, b)]];
    let Some(axis) = principal(&covariance) else { return [mean; 2] };
    let mut along = [0.0; TEXELS];
    for i in 0..TEXELS {
        along[i] = r[i] * axis[0] + g[i] * axis[1] + b[i] * axis[2];
    }
    // What does not count is at 0, the mean, which is between the ends.
    let (low, high) = along.iter().fold((0.0_f32, 0.0_f32), |(low, high), &t| (low.min(t), high.max(t)));
    [low, high].map(|t| [0, 1, 2].map(|channel| mean[channel] + t * axis[channel]))
}

/// The axis of the largest eigenvalue of a covariance, by the power method from the axis of the widest
/// channel on; `None` if nothing varies.
#[inline(always)]
fn principal(covariance: &[[f32; 3]; 3]) -> Option<[f32; 3]> {
    let mut widest = 0;
    for channel in 1..3 {
        if covariance[channel][channel] > covariance[widest][widest] {
            widest = channel;
        }
    }
    let trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
    if trace <= 0.0 {
        return None;
    }
    let scaled = covariance.map(|row| row.map(|value| value / trace));
    let mut axis = scaled[widest];
    for _ in 0..6 {
        let [a, b, c] = axis;
        axis = scaled.map(|row| row[0] * a + row[1] * b + row[2] * c);
    }
    let length = (axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]).sqrt();
    (length > 0.0).then(|| axis.map(|value| value / length))
}

/// The stored numbers nearest to two ends.
#[inline(always)]
pub(crate) fn quantised(mode: &BlockMode, block: &Block, ends: [[f32; 3]; 2]) -> [[i32; 3]; 2] {
    ends.map(|end| [0, 1, 2].map(|channel| quantise(end[channel] + block.mean[channel], mode.bits)))
}

/// The place of an index on a line, in 64ths.
#[inline(always)]
fn place<const PLACES: usize>(index: i32) -> i32 {
    if PLACES == 8 { 9 * index + (index >> 2) } else { 4 * index + ((index + 2) >> 2) }
}

/// The line between two stored ends, with the place of each texel that is nearest along it.
#[inline(always)]
pub(crate) fn through<const PLACES: usize, const LIGHT: bool>(
    mode: &BlockMode,
    block: &Block,
    mask: &Lane,
    ends: [[i32; 3]; 2],
) -> ColourLine {
    // Adding it rounds a number below 2^22 to an integer, which is then in the lowest bits.
    const TO_INTEGER: f32 = 8_388_608.0;
    let wide = ends.map(|end| end.map(|value| unquantise(value, mode.bits)));
    let mut start = [0.0; 3];
    let mut axis = [0.0; 3];
    for channel in 0..3 {
        start[channel] = wide[0][channel] as f32 * (31.0 / 64.0) - 0.5 - block.mean[channel];
        axis[channel] = (wide[1][channel] - wide[0][channel]) as f32 * (31.0 / 64.0);
    }
    let squared = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    let last = PLACES as f32 - 1.0;
    let scale = if squared > 0.0 { last / squared } else { 0.0 };
    let [r, g, b] = &block.around;
    let mut indices = [0; TEXELS];
    for i in 0..TEXELS {
        let along = (r[i] - start[0]) * axis[0] + (g[i] - start[1]) * axis[1] + (b[i] - start[2]) * axis[2];
        let nearest = (along * scale).max(0.0).min(last) + TO_INTEGER;
        indices[i] = nearest.to_bits() & 15;
    }
    let mut errors = [0.0; TEXELS];
    let mut light = [0.0; 3];
    for channel in 0..3 {
        let [low, high] = [wide[0][channel], wide[1][channel]];
        let (base, step) = (64 * low + 32, high - low);
        let mean = block.mean[channel] as i32;
        let mut values = [0.0; TEXELS];
        for i in 0..TEXELS {
            // As `between` of the block.
            let wide = (base + step * place::<PLACES>(indices[i] as i32)) >> 6;
            let bits = ((wide << 5) - wide) >> 6;
            let off = (bits - mean) as f32 - block.around[channel][i];
            errors[i] += off * off;
            if LIGHT {
                values[i] = of_half(bits) * mask[i];
            }
        }
        if LIGHT {
            light[channel] = total(&values);
        }
    }
    for i in 0..TEXELS {
        errors[i] *= block.weights[i];
    }
    ColourLine { ends, indices, error: dot(&errors, mask), light }
}

/// The number of a half that is neither negative nor infinite.
#[inline(always)]
pub(crate) fn of_half(bits: i32) -> f32 {
    // 2^112 is between the biases of the exponents.
    f32::from_bits((bits as u32) << 13) * f32::from_bits((112 + 127) << 23)
}

/// The ends that suit the indices of some texels best.
#[inline(always)]
pub(crate) fn least_squares<const PLACES: usize>(
    block: &Block,
    mask: &Lane,
    indices: &[u32; TEXELS],
) -> Option<[[f32; 3]; 2]> {
    let mut near = [0.0; TEXELS];
    let mut far = [0.0; TEXELS];
    for i in 0..TEXELS {
        let share = place::<PLACES>(indices[i] as i32) as f32 * (1.0 / 64.0);
        near[i] = (1.0 - share) * mask[i];
        far[i] = share * mask[i];
    }
    // What the equations of a texel count.
    let (mut weighted_near, mut weighted_far) = (near, far);
    for i in 0..TEXELS {
        weighted_near[i] *= block.weights[i];
        weighted_far[i] *= block.weights[i];
    }
    let (aa, ab, bb) = (dot(&weighted_near, &near), dot(&weighted_near, &far), dot(&weighted_far, &far));
    let determinant = aa * bb - ab * ab;
    if determinant < 1e-4 {
        return None;
    }
    let mut ends = [[0.0; 3]; 2];
    for channel in 0..3 {
        let lane = &block.around[channel];
        let (a, b) = (dot(lane, &weighted_near), dot(lane, &weighted_far));
        ends[0][channel] = (a * bb - b * ab) / determinant;
        ends[1][channel] = (b * aa - a * ab) / determinant;
    }
    Some(ends)
}
