//! Sums of harmonics at the views of eight texels at once, and their adjoints: over p and then over q.

use pulp::Simd;

use super::view_grid::{MIRRORED, ViewGrid};

/// Texels that are solved at once.
pub(super) const LANES: usize = 8;

/// One number of each texel.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct F32x8(pub(super) [f32; LANES]);

impl F32x8 {
    pub(super) const ZERO: Self = Self([0.0; LANES]);
}

#[inline(always)]
pub(super) fn load<S: Simd>(_: S, value: &F32x8) -> S::f32s {
    pulp::cast(value.0)
}

#[inline(always)]
pub(super) fn store<S: Simd>(_: S, vector: S::f32s, value: &mut F32x8) {
    value.0 = pulp::cast(vector);
}

/// The sum over all pairs of coefficients at each view.
#[inline(always)]
pub(super) fn synthesise<S: Simd>(simd: S, views: &ViewGrid, x: &[[F32x8; 2]], out: &mut [F32x8]) {
    let mut terms = vec![[F32x8::ZERO; 2]; views.padded];
    for (row, out) in out.chunks_exact_mut(views.quarter.len() * MIRRORED).enumerate() {
        let (mut functions, mut x) = (views.functions_of(row), x);
        for (term, count) in terms.iter_mut().zip(views.counts()) {
            let (of_q, others) = functions.split_at(count);
            let (x_q, rest) = x.split_at(count);
            (functions, x) = (others, rest);
            let (mut cosine, mut sine) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
            for (function, [c, s]) in of_q.iter().zip(x_q) {
                let function = simd.splat_f32s(*function);
                cosine = simd.mul_add_f32s(function, load(simd, c), cosine);
                sine = simd.mul_add_f32s(function, load(simd, s), sine);
            }
            store(simd, cosine, &mut term[0]);
            store(simd, sine, &mut term[1]);
        }
        for (waves, out) in views.waves.chunks_exact(views.padded).zip(out.chunks_exact_mut(MIRRORED)) {
            // Cosines and sines of even and of odd q.
            let (mut c0, mut c1) = (simd.splat_f32s(0.0), simd.splat_f32s(0.0));
            let (mut s0, mut s1) = (c0, c1);
            for (waves, terms) in waves.chunks_exact(2).zip(terms.chunks_exact(2)) {
                let ([[cos0, sin0], [cos1, sin1]], [even, odd]) = (pair(waves), pair_of(terms));
                c0 = simd.mul_add_f32s(simd.splat_f32s(cos0), load(simd, &even[0]), c0);
                s0 = simd.mul_add_f32s(simd.splat_f32s(sin0), load(simd, &even[1]), s0);
                c1 = simd.mul_add_f32s(simd.splat_f32s(cos1), load(simd, &odd[0]), c1);
                s1 = simd.mul_add_f32s(simd.splat_f32s(sin1), load(simd, &odd[1]), s1);
            }
            let (even, odd) = (simd.add_f32s(c0, s1), simd.add_f32s(c1, s0));
            let (even_less, odd_less) = (simd.sub_f32s(c0, s1), simd.sub_f32s(c1, s0));
            // phi: all; pi - phi: odd cosines and even sines change sign; pi + phi: all odd; -phi: all sines.
            store(simd, simd.add_f32s(even, odd), &mut out[0]);
            store(simd, simd.sub_f32s(even, odd), &mut out[1]);
            store(simd, simd.sub_f32s(even_less, odd_less), &mut out[2]);
            store(simd, simd.add_f32s(even_less, odd_less), &mut out[3]);
        }
    }
}

/// The adjoint of the synthesis: for each pair of coefficients the sum over all views.
#[inline(always)]
pub(super) fn adjoin<S: Simd>(simd: S, views: &ViewGrid, seen: &[F32x8], out: &mut [[F32x8; 2]]) {
    out.fill([F32x8::ZERO; 2]);
    let mut terms = vec![[F32x8::ZERO; 2]; views.padded];
    for (row, seen) in seen.chunks_exact(views.quarter.len() * MIRRORED).enumerate() {
        terms.fill([F32x8::ZERO; 2]);
        for (waves, seen) in views.waves.chunks_exact(views.padded).zip(seen.chunks_exact(MIRRORED)) {
            let (a, b) = (load(simd, &seen[0]), load(simd, &seen[1]));
            let (c, d) = (load(simd, &seen[2]), load(simd, &seen[3]));
            let (ab, cd) = (simd.add_f32s(a, b), simd.add_f32s(c, d));
            let (ab_less, dc_less) = (simd.sub_f32s(a, b), simd.sub_f32s(d, c));
            let (c0, c1) = (simd.add_f32s(ab, cd), simd.add_f32s(ab_less, dc_less));
            let (s0, s1) = (simd.sub_f32s(ab_less, dc_less), simd.sub_f32s(ab, cd));
            for (waves, terms) in waves.chunks_exact(2).zip(terms.chunks_exact_mut(2)) {
                let [[cos0, sin0], [cos1, sin1]] = pair(waves);
                let [even, odd] = terms else { continue };
                accumulate(simd, cos0, c0, &mut even[0]);
                accumulate(simd, sin0, s0, &mut even[1]);
                accumulate(simd, cos1, c1, &mut odd[0]);
                accumulate(simd, sin1, s1, &mut odd[1]);
            }
        }
        let (mut functions, mut out) = (views.functions_of(row), &mut *out);
        for (term, count) in terms.iter().zip(views.counts()) {
            let (of_q, others) = functions.split_at(count);
            let (out_q, rest) = out.split_at_mut(count);
            (functions, out) = (others, rest);
            let (cosine, sine) = (load(simd, &term[0]), load(simd, &term[1]));
            for (function, [c, s]) in of_q.iter().zip(out_q) {
                accumulate(simd, *function, cosine, c);
                accumulate(simd, *function, sine, s);
            }
        }
    }
}

/// Adds a factor times a vector.
#[inline(always)]
fn accumulate<S: Simd>(simd: S, factor: f32, vector: S::f32s, sum: &mut F32x8) {
    store(simd, simd.mul_add_f32s(simd.splat_f32s(factor), vector, load(simd, sum)), sum);
}

/// A chunk of two waves.
#[inline(always)]
fn pair(waves: &[[f32; 2]]) -> [[f32; 2]; 2] {
    [waves[0], waves[1]]
}

/// A chunk of two terms.
#[inline(always)]
fn pair_of(terms: &[[F32x8; 2]]) -> [&[F32x8; 2]; 2] {
    [&terms[0], &terms[1]]
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use pulp::WithSimd;
    use sh::f64x4::SimdLevel;
    use sh::{Basis, Degree};
    use sphere::Direction;

    use super::*;
    use crate::Terms;

    struct Both<'a>(&'a ViewGrid, &'a [[F32x8; 2]], &'a [F32x8], &'a mut [F32x8], &'a mut [[F32x8; 2]]);

    impl WithSimd for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            synthesise(simd, self.0, self.1, self.3);
            adjoin(simd, self.0, self.2, self.4);
        }
    }

    fn noise(count: usize, seed: usize) -> Vec<F32x8> {
        let value = |i: usize| ((((i + seed) * 2_654_435_761) >> 7) % 1000) as f32 / 500.0 - 1.0;
        (0..count).map(|i| F32x8(std::array::from_fn(|lane| value(i * LANES + lane)))).collect()
    }

    /// The sums are those of the basis, and <synthesis of x, v> = <x, adjoint of v>.
    #[test]
    fn synthesis_is_the_sum_of_harmonics_and_adjoint_to_the_sum_over_views() {
        for (p, terms) in [(5, Terms::All), (8, Terms::Zonal), (16, Terms::All)] {
            let views = ViewGrid::new(p, p, terms, Centre::Reflection);
            let rows = views.rows_of_pairs();
            let (mut x, v) = (noise(2 * rows.len(), 3).as_chunks().0.to_vec(), noise(views.len(), 11));
            // Order 0 has no sine.
            x.iter_mut().zip(&rows).filter(|(_, row)| row[1].is_none()).for_each(|(x, _)| x[1] = F32x8::ZERO);
            let (mut seen, mut sums) = (vec![F32x8::ZERO; views.len()], vec![[F32x8::ZERO; 2]; rows.len()]);
            SimdLevel::detect().run(Both(&views, &x, &v, &mut seen, &mut sums));
            let inner = |a: &[F32x8], b: &[F32x8]| -> f64 {
                a.iter().zip(b).map(|(a, b)| f64::from(a.0[2]) * f64::from(b.0[2])).sum()
            };
            let (left, right) = (inner(&seen, &v), inner(x.as_flattened(), sums.as_flattened()));
            assert!((left - right).abs() < 1e-4 * (rows.len() * views.len()) as f64, "{left} {right}");

            let degree = Degree::new(p).unwrap();
            let mut y = vec![0.0; degree.rows()];
            for (row, (theta, _)) in views.rows.iter().enumerate().step_by(7) {
                for (k, phi) in views.azimuths(0).into_iter().enumerate() {
                    Basis::new(degree).evaluate_into(Direction::from_angles(*theta, phi), &mut y);
                    let row_of = |row: usize| if terms == Terms::Zonal { row * row + row } else { row };
                    let expected: f64 = rows
                        .iter()
                        .zip(&x)
                        .flat_map(|(rows, x)| rows.iter().zip(x))
                        .filter_map(|(row, x)| Some(f64::from(x.0[5]) * y[row_of((*row)?)]))
                        .sum();
                    let found = f64::from(seen[row * views.quarter.len() * MIRRORED + k].0[5]);
                    assert!((found - expected).abs() < 1e-4 * rows.len() as f64, "{found} {expected}");
                }
            }
        }
    }
}
