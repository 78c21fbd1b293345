//! Rows of constant colatitude: the Fourier series in beta of every coefficient, as many alphas at once as a
//! vector has lanes.
//!
//! Real rows c_lm, s_lm of the lighting (m > 0: cosine and sine) enter the frame R_z(beta) R_y(alpha) as
//!
//! > a_l,q - i a_l,-q = sum over m of (E^l_qm Re + i O^l_qm Im) (c_lm - i s_lm) e^(i m beta),
//!
//! with E = d_qm + (-1)^m d_q,-m and O = d_qm - (-1)^m d_q,-m, each times 1 / sqrt(2) for q = 0 and for m =
//! 0. Hence the series of b_p,q has the cosine and sine coefficients sum over l of rho_lpq E (c_lm, s_lm),
//! that of b_p,-q sum over l of rho_lpq O (s_lm, -c_lm).
//!
//! The families G = d_qm and H = (-1)^m d_q,-m climb in l ([`sh::wigner`]): from T_mq and (-1)^q
//! T_m,-q if q < m, otherwise from (-1)^(q+m) T_qm and (-1)^q T_q,-m.
//!
//! At pi - alpha, E takes the sign (-1)^(l+m+q) and O the opposite one: terms with even and odd l + m, summed
//! apart, give both rows.

use std::f64::consts::FRAC_1_SQRT_2;

use pulp::{Simd, WithSimd};
use sh::Expansion;
use sh::f64x4::{F64x4, LANES, load, store};
use sh::scaled::Scaled;
use sh::wigner::Pair;

use super::plan::SynthesisPlan;
use crate::Terms;

/// The series at up to four colatitudes, and at pi minus each.
pub(super) struct Rows<'a> {
    pub(super) plan: &'a SynthesisPlan<'a>,
    /// The lighting of the plan's reflection, or that lighting rotated.
    pub(super) lighting: &'a Expansion,
    /// The colatitudes of the rows.
    pub(super) alphas: &'a [f64],
    /// For each colatitude, a series: for each group of the plan [orders, padded values].
    pub(super) north: &'a mut [f32],
    /// For pi minus each colatitude, a series.
    pub(super) south: &'a mut [f32],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (f, p) = (self.plan.f, self.plan.reflection.brdf().p().get());
        let (mut sine, mut cosine) = (F64x4::ZERO, F64x4::ZERO);
        for (lane, alpha) in self.alphas.iter().enumerate() {
            (sine.0[lane], cosine.0[lane]) = math::sin_cos(alpha / 2.0);
        }
        let both = F64x4::from_fn(|lane| sine.0[lane] * cosine.0[lane]);
        let t = load(simd, &F64x4::from_fn(|lane| 2.0 * sine.0[lane] * sine.0[lane]));
        let powers = |base: F64x4| {
            let next = move |power: &Scaled| Some(power.times_plain(base));
            std::iter::successors(Some(Scaled::ONE), next).take(2 * p + 1).collect::<Vec<_>>()
        };
        let (sines, cosines) = (powers(sine), powers(cosine));
        let sign = |odd: bool| if odd { -1.0 } else { 1.0 };
        let mut sums = vec![[simd.splat_f64s(0.0); PARTS]; 2 * (p + 1)];
        let mut lit = Lit { first: [0; 2], values: Default::default() };
        let most = if self.plan.terms == Terms::Zonal { 0 } else { p.min(f) };
        // m in the outer loop: a term's values lie close together in memory.
        let mut starts = vec![[Scaled::ZERO; 2]; most + 1];
        for m in 0..=f {
            for (q, start) in starts.iter_mut().enumerate() {
                if m <= q {
                    // T_q,m = sqrt(binomial(2q, q+m)) c^(q+m) s^(q-m)
                    let size = F64x4([binomial(2 * q, q + m).sqrt(); LANES]);
                    *start = [(q + m, q - m), (q - m, q + m)]
                        .map(|(c, s)| cosines[c].times(sines[s]).times_plain(size));
                } else {
                    let ratio = self.plan.recurrence.ratio_of_starts(m, q);
                    *start = start.map(|value| value.times_plain(F64x4(both.0.map(|both| ratio * both))));
                }
                let signs = [sign(m < q && (q + m) % 2 == 1), sign(q % 2 == 1)];
                let pair = Pair::new(simd, [0, 1].map(|i| start[i].with_sign(signs[i])));
                self.climb(simd, t, [q, m], pair, &mut lit);
                self.sum(simd, [q, m], &lit, &mut sums);
                self.store(simd, [q, m], &sums);
            }
        }
    }
}

/// Cosine and sine coefficients of (p, q), then of (p, -q), of three channels each.
const PARTS: usize = 12;

/// Terms without rho, of one (q, m): E and O times cosine and sine of the lighting.
struct Lit<V> {
    /// For even and for odd l, the first l / 2.
    first: [usize; 2],
    /// For even and for odd l and each channel, by l / 2 from the first on: coefficients of (p, q), then of
    /// (p, -q).
    values: [[Vec<[V; 4]>; 3]; 2],
}

impl Rows<'_> {
    /// The terms of every l of one (q, m).
    #[inline(always)]
    fn climb<S: Simd>(
        &self,
        simd: S,
        t: S::f64s,
        [q, m]: [usize; 2],
        mut pair: Pair<S>,
        lit: &mut Lit<S::f64s>,
    ) {
        let zero = simd.splat_f64s(0.0);
        let norm = [1.0, FRAC_1_SQRT_2, 0.5][usize::from(q == 0) + usize::from(m == 0)];
        let orders = simd.splat_f64s((q * m) as f64);
        let recurrence = &self.plan.recurrence;
        lit.values.as_flattened_mut().iter_mut().for_each(Vec::clear);
        for l in q.max(m)..=self.plan.f {
            let [g, h] = pair.values(simd).unwrap_or([zero; 2]);
            if lit.values[l % 2][0].is_empty() {
                lit.first[l % 2] = l / 2;
            }
            let rows = self.lighting.coefficients();
            let (cosine, sine) = (rows[l * l + l + m], rows[l * l + l - m]);
            let (even, odd) = (simd.add_f64s(g, h), simd.sub_f64s(g, h));
            for (channel, values) in lit.values[l % 2].iter_mut().enumerate() {
                let cosine = simd.splat_f64s(norm * cosine[channel]);
                let sine = simd.splat_f64s(if m == 0 { 0.0 } else { norm * sine[channel] });
                values.push([
                    simd.mul_f64s(even, cosine),
                    simd.mul_f64s(even, sine),
                    simd.mul_f64s(odd, sine),
                    simd.neg_f64s(simd.mul_f64s(odd, cosine)),
                ]);
            }
            let ([a, b, product], steps) = (recurrence.degree(l), recurrence.steps(l));
            let ([inverse_q, ratio_q], [inverse_m, ratio_m]) = (steps[q], steps[m]);
            let [ahead, behind, product] =
                [a * inverse_q * inverse_m, b * ratio_q * ratio_m, product].map(|v| simd.splat_f64s(v));
            let centre = simd.negate_mul_add_f64s(product, t, product);
            pair.climb(simd, [ahead, behind], centre, orders);
        }
    }

    /// The sums over l of one (q, m), [p - q, parity of l + m].
    #[inline(always)]
    fn sum<S: Simd>(&self, simd: S, [q, m]: [usize; 2], lit: &Lit<S::f64s>, sums: &mut [[S::f64s; PARTS]]) {
        let most = self.plan.reflection.brdf().p().get();
        for (parity, values) in lit.values.iter().enumerate() {
            for (channel, values) in values.iter().enumerate() {
                let rho = |p| &self.plan.rho([q, p], channel, parity)[lit.first[parity]..][..values.len()];
                let mut write = |p: usize, total: [S::f64s; 4]| {
                    let sums = &mut sums[2 * (p - q) + (parity + m) % 2];
                    (0..4).for_each(|part| sums[3 * part + channel] = total[part]);
                };
                for p in (q..=most).step_by(2) {
                    if p < most {
                        let totals = products(simd, [rho(p), rho(p + 1)], values);
                        (0..2).for_each(|i| write(p + i, totals[i]));
                    } else {
                        let [total] = products(simd, [rho(p)], values);
                        write(p, total);
                    }
                }
            }
        }
    }

    /// Writes the sums of one (q, m) into the series.
    #[inline(always)]
    fn store<S: Simd>(&mut self, simd: S, [q, m]: [usize; 2], sums: &[[S::f64s; PARTS]]) {
        let (fourier, series) = (self.plan.fourier, self.plan.series());
        let places = [Some(fourier.cosine(m)), (m > 0).then(|| fourier.sine(m))];
        for p in q..=self.plan.reflection.brdf().p().get() {
            let [even, odd] = [sums[2 * (p - q)], sums[2 * (p - q) + 1]];
            let row = if self.plan.terms == Terms::Zonal { p } else { p * p + p };
            for part in 0..if q == 0 { 2 } else { 4 } {
                let Some(place) = places[part % 2] else { continue };
                let row = if part < 2 { row + q } else { row - q };
                // (-1)^q for E, the opposite for O.
                let negate = (q + part / 2) % 2 == 1;
                for channel in 0..3 {
                    let (even, odd) = (even[3 * part + channel], odd[3 * part + channel]);
                    let south = if negate { simd.sub_f64s(odd, even) } else { simd.sub_f64s(even, odd) };
                    let mut lanes = [F64x4::ZERO; 2];
                    store(simd, simd.add_f64s(even, odd), &mut lanes[0]);
                    store(simd, south, &mut lanes[1]);
                    let target = self.plan.place(3 * row + channel, place);
                    for (lane, value) in self.north.chunks_exact_mut(series).zip(&lanes[0].0) {
                        lane[target] = *value as f32;
                    }
                    for (lane, value) in self.south.chunks_exact_mut(series).zip(&lanes[1].0) {
                        lane[target] = *value as f32;
                    }
                }
            }
        }
    }
}

/// The inner products of some rows of factors with the four columns of values.
#[inline(always)]
fn products<S: Simd, const COUNT: usize>(
    simd: S,
    factors: [&[f64]; COUNT],
    values: &[[S::f64s; 4]],
) -> [[S::f64s; 4]; COUNT] {
    let mut totals = [[simd.splat_f64s(0.0); 4]; COUNT];
    let factors = factors.map(|factors| &factors[..values.len()]);
    for (index, value) in values.iter().enumerate() {
        for i in 0..COUNT {
            let factor = simd.splat_f64s(factors[i][index]);
            for part in 0..4 {
                totals[i][part] = simd.mul_add_f64s(factor, value[part], totals[i][part]);
            }
        }
    }
    totals
}

/// n over k, in f64.
fn binomial(n: usize, k: usize) -> f64 {
    (1..=k.min(n - k)).fold(1.0, |value, i| value * (n + 1 - i) as f64 / i as f64)
}
