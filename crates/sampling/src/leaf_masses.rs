//! Masses of a row of leaves, from integrals and values of f at 3 x 3 points of each leaf (corners, middles
//! of edges, centre).
//!
//! A leaf in which f has one sign, by its integral and the values at its corners, has that mass. Any other
//! has as mass its area times what f does not exceed in it, and is flat: the largest coefficient of the
//! biquadratic polynomial through the values in Bernstein's form, and the polynomial's error. Half a leaf
//! is at most x = pi / 6 rad of the shortest wave, and x^3 / (9 sqrt(3)) of the range of values bounds the
//! error.

use pulp::{Simd, WithSimd};

use crate::cell_distribution::LEAST_MASS;
use crate::f32x8::LANES;

/// A row of leaves of which the masses are wanted.
pub(crate) struct LeafMasses<'a> {
    /// f at the corners along the northern and the southern edge: one more than leaves.
    pub(crate) corners: [&'a [f32]; 2],
    /// f half-way along the northern and the southern edge.
    pub(crate) edges: [&'a [f32]; 2],
    /// f half-way down: between corners, one more than leaves, and between them.
    pub(crate) sides: &'a [f32],
    pub(crate) centres: &'a [f32],
    pub(crate) areas: &'a [f32],
    /// Whether |f| is the density rather than max(f, 0).
    pub(crate) is_absolute: bool,
    /// Whether leaves that are not flat must be free of zeros between the corners too.
    pub(crate) is_strict: bool,
    /// The integrals of f over the leaves, which become masses.
    pub(crate) masses: &'a mut [f32],
    /// Whether each leaf is flat, which is written here.
    pub(crate) flat: &'a mut [bool],
}

impl WithSimd for LeafMasses<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { corners, edges, sides, centres, areas, is_absolute, is_strict, masses, flat } = self;
        let count = masses.len();
        let splat = |value| simd.splat_f32s(value);
        let (min, max) = (|a, b| simd.min_f32s(a, b), |a, b| simd.max_f32s(a, b));
        // a, 2 b - (a + c) / 2, c
        let control = |[a, b, c]: [S::f32s; 3]| {
            let outer = simd.mul_f32s(splat(0.5), simd.add_f32s(a, c));
            [a, simd.sub_f32s(simd.add_f32s(b, b), outer), c]
        };
        for i in (0..count).step_by(LANES) {
            let at = |values: &[f32], first: usize| block(simd, &values[first..]);
            let rows = [
                [at(corners[0], i), at(edges[0], i), at(corners[0], i + 1)],
                [at(sides, i), at(centres, i), at(sides, i + 1)],
                [at(corners[1], i), at(edges[1], i), at(corners[1], i + 1)],
            ];
            let (mass, area) = (at(masses, i), at(areas, i));
            let (mut values, mut bounds) = ([rows[0][0]; 2], [rows[0][0]; 2]);
            // Loops over numbers, which are unrolled; iterators would leave the vectors in memory.
            for i in 0..3 {
                for k in 0..3 {
                    values = [min(values[0], rows[i][k]), max(values[1], rows[i][k])];
                }
            }
            let [northern, southern] = [[rows[0][0], rows[0][2]], [rows[2][0], rows[2][2]]];
            let mut least = min(min(northern[0], northern[1]), min(southern[0], southern[1]));
            let mut greatest = max(max(northern[0], northern[1]), max(southern[0], southern[1]));
            let rows = [control(rows[0]), control(rows[1]), control(rows[2])];
            for k in 0..3 {
                let points = control([rows[0][k], rows[1][k], rows[2][k]]);
                for i in 0..3 {
                    bounds = [min(bounds[0], points[i]), max(bounds[1], points[i])];
                }
            }
            if is_strict {
                (least, greatest) = (min(least, bounds[0]), max(greatest, bounds[1]));
            }
            let zero = splat(0.0);
            let mut peak = bounds[1];
            let mut size = simd.select_f32s(simd.less_than_f32s(zero, least), mass, zero);
            if is_absolute {
                peak = max(peak, simd.sub_f32s(zero, bounds[0]));
                let opposite = simd.sub_f32s(zero, mass);
                size = simd.select_f32s(simd.less_than_f32s(greatest, zero), opposite, size);
            }
            let error = simd.mul_f32s(splat(0.01), simd.sub_f32s(values[1], values[0]));
            let bound = simd.mul_f32s(simd.add_f32s(peak, error), area);
            let no_mass = splat(LEAST_MASS);
            let bound = simd.select_f32s(simd.less_than_f32s(no_mass, bound), bound, zero);
            let has_sign = simd.less_than_f32s(no_mass, size);
            let found: [f32; LANES] = pulp::cast(simd.select_f32s(has_sign, size, bound));
            let is_flat: [f32; LANES] = pulp::cast(simd.select_f32s(has_sign, zero, splat(1.0)));
            let is_flat = is_flat.map(|is_flat| is_flat != 0.0);
            let here = i..(i + LANES).min(count);
            masses[here.clone()].copy_from_slice(&found[..here.len()]);
            flat[here.clone()].copy_from_slice(&is_flat[..here.len()]);
        }
    }
}

/// The first numbers of a slice, then zeros.
#[inline(always)]
fn block<S: Simd>(_: S, values: &[f32]) -> S::f32s {
    if let Some((block, _)) = values.split_first_chunk::<LANES>() {
        return pulp::cast(*block);
    }
    let mut block = [0.0; LANES];
    block.iter_mut().zip(values).for_each(|(to, from)| *to = *from);
    pulp::cast(block)
}
