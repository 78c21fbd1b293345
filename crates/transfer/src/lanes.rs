//! From one vertex after another to eight vertices side by side.

use sh::f64x4;

use crate::frames::LANES;
use crate::rotation::Lanes;

/// Takes eight looked-up texels, [lane][row, channel], to [channel][row][lane], cut to the rows that there is
/// room for.
#[inline(always)]
pub(crate) fn by_lane<L: f64x4::Lanes>(simd: L, texels: &[f32], channels: usize, c: &mut Lanes) {
    // With a known number of channels nothing is divided.
    match channels {
        1 => transpose_all(simd, texels, 1, c),
        _ => transpose_all(simd, texels, channels, c),
    }
}

/// Takes eight vectors, one after another, to [element][lane], cut to the elements that there is room for.
#[inline(always)]
fn transpose_all<L: f64x4::Lanes>(simd: L, texels: &[f32], channels: usize, c: &mut Lanes) {
    let (texel, length, rows) = (texels.len() / LANES, c.len(), c.len() / channels);
    let place = |element: usize| element % channels * rows + element / channels;
    let whole = length - length % LANES;
    for start in (0..whole).step_by(LANES) {
        let mut vectors = [[0.0; LANES]; LANES];
        for lane in 0..LANES {
            vectors[lane].copy_from_slice(&texels[lane * texel + start..][..LANES]);
        }
        let vectors = simd.transpose_f32s(vectors);
        if channels == 1 {
            c[start..][..LANES].copy_from_slice(&vectors);
            continue;
        }
        for k in 0..LANES {
            c[place(start + k)] = vectors[k];
        }
    }
    for element in whole..length {
        for lane in 0..LANES {
            c[place(element)][lane] = texels[lane * texel + element];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sh::f64x4::{SimdLevel, WithLanes};

    struct Transposed<'a>(&'a [f32], usize, &'a mut Lanes);

    impl WithLanes for Transposed<'_> {
        type Output = ();

        #[inline(always)]
        fn with_lanes<L: f64x4::Lanes>(self, simd: L) {
            by_lane(simd, self.0, self.1, self.2);
        }
    }

    #[test]
    fn texels_lie_side_by_side() {
        for level in [SimdLevel::detect(), SimdLevel::Portable] {
            for (rows, kept, channels) in
                [(25, 25, 1), (25, 16, 3), (9, 9, 1), (4, 1, 3), (4, 4, 1), (1, 1, 3)]
            {
                let texel = rows * channels;
                let texels: Vec<f32> = (0..LANES * texel).map(|k| k as f32).collect();
                let mut c = vec![[-1.0; LANES]; kept * channels];
                level.run_lanes(Transposed(&texels, channels, &mut c));
                for (index, lanes) in c.iter().enumerate() {
                    let (channel, row) = (index / kept, index % kept);
                    let expected = |lane: usize| (lane * texel + row * channels + channel) as f32;
                    assert_eq!(*lanes, std::array::from_fn(expected), "{channel} {row}");
                }
            }
        }
    }
}
