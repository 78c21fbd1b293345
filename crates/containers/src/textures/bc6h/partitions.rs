//! Which partitions of a block promise most.
//!
//! For each of the 32, the squares off the principal axes of its two parts and those of the steps along them
//! are estimated from sums over the texels, eight partitions at a time.

use super::block::{PARTITIONS, TEXELS, contains};
use super::line::{Block, Lane};

/// Partitions that are summed at a time.
const LANES: usize = 8;

/// A number for each of some partitions.
type Lanes = [f32; LANES];

/// For eight partitions at a time, whether each texel is on the second line.
const SECOND: [[Lanes; TEXELS]; 4] = {
    let mut second = [[[0.0; LANES]; TEXELS]; 4];
    let mut number = 0;
    while number < PARTITIONS.len() {
        let mut texel = 0;
        while texel < TEXELS {
            if contains(PARTITIONS[number].second, texel) {
                second[number / LANES][texel][number % LANES] = 1.0;
            }
            texel += 1;
        }
        number += 1;
    }
    second
};

/// The squares that each partition leaves, about.
#[inline(always)]
pub(crate) fn promises(block: &Block, mask: &Lane) -> [f32; 32] {
    // The count, the sums and the sums of products of the texels.
    let mut terms = [[0.0; TEXELS]; 10];
    for i in 0..TEXELS {
        let [r, g, b] = [0, 1, 2].map(|channel: usize| block.around[channel][i] * mask[i]);
        let all = [mask[i], r, g, b, r * r, g * g, b * b, r * g, r * b, g * b];
        for (term, value) in terms.iter_mut().zip(all) {
            term[i] = value;
        }
    }
    let mut promises = [0.0; 32];
    for (group, texels) in SECOND.iter().enumerate() {
        let mut second = [[0.0; LANES]; 10];
        let mut whole = [0.0; 10];
        for (term, (second, whole)) in terms.iter().zip(second.iter_mut().zip(&mut whole)) {
            for (value, lanes) in term.iter().zip(texels) {
                *whole += value;
                for lane in 0..LANES {
                    second[lane] += value * lanes[lane];
                }
            }
        }
        let mut first = [[0.0; LANES]; 10];
        for term in 0..10 {
            for lane in 0..LANES {
                first[term][lane] = whole[term] - second[term][lane];
            }
        }
        let (first, second) = (left(&first), left(&second));
        for lane in 0..LANES {
            promises[LANES * group + lane] = first[lane] + second[lane];
        }
    }
    promises
}

/// The squares off the principal axes of parts, and those of the steps along them if a part fills its axis
/// evenly: the variance of an even spread is a twelfth of its width squared, of a step a 49th of that.
#[inline(always)]
fn left(sums: &[Lanes; 10]) -> Lanes {
    let mut left = [0.0; LANES];
    for i in 0..LANES {
        let [n, r, g, b, rr, gg, bb, rg, rb, gb] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|k: usize| sums[k][i]);
        let share = 1.0 / n.max(1.0);
        let [xx, yy, zz] = [rr - r * r * share, gg - g * g * share, bb - b * b * share];
        let [xy, xz, yz] = [rg - r * g * share, rb - r * b * share, gb - g * b * share];
        let trace = xx + yy + zz;
        let scale = 1.0 / trace.max(1.0);
        let scaled = [xx, yy, zz, xy, xz, yz].map(|value| value * scale);
        // The largest eigenvalue is about the ratio of the traces of the 9th and the 8th power.
        let power = squared(squared(squared(scaled)));
        let inner = |a: [f32; 6], b: [f32; 6]| {
            (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
        };
        let eighth = (power[0] + power[1] + power[2]).max(1e-30);
        left[i] = trace * (1.0 - inner(scaled, power) / eighth * (1.0 - 1.0 / 49.0));
    }
    left
}

/// The square of a symmetric matrix: its diagonal, and what is beside it.
#[inline(always)]
fn squared([xx, yy, zz, xy, xz, yz]: [f32; 6]) -> [f32; 6] {
    [
        xx * xx + xy * xy + xz * xz,
        xy * xy + yy * yy + yz * yz,
        xz * xz + yz * yz + zz * zz,
        xx * xy + xy * yy + xz * yz,
        xx * xz + xy * yz + xz * zz,
        xy * xz + yy * yz + yz * zz,
    ]
}
