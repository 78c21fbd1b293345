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
    /// Colatitudes.
    pub(super) alphas: &'a [f64],
    /// For each colatitude, a series [orders, padded values].
    pub(super) north: &'a mut [f64],
    /// The same for pi minus each.
    pub(super) south: &'a mut [f64],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let (f, p) = (self.plan.f, self.plan.reflection.brdf().p().get());
        let (mut sine, mut cosine) = (F64x4::ZERO, F64x4::ZERO);
        for (lane, alpha) in self.alphas.iter().enumerate() {
            (sine.0[lane], cosine.0[lane]) = (alpha / 2.0).sin_cos();
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
        let most = if self.plan.terms == Terms::Zonal { 0 } else { p.min(f) };
        for q in 0..=most {
            let mut start = [Scaled::ZERO; 2];
            for m in 0..=f {
                if m <= q {
                    // T_q,m = sqrt(binomial(2q, q+m)) c^(q+m) s^(q-m)
                    let size = F64x4([binomial(2 * q, q + m).sqrt(); LANES]);
                    start = [(q + m, q - m), (q - m, q + m)]
                        .map(|(c, s)| cosines[c].times(sines[s]).times_plain(size));
                } else {
                    let ratio = self.plan.recurrence.ratio_of_starts(m, q);
                    start = start.map(|value| value.times_plain(F64x4(both.0.map(|both| ratio * both))));
                }
                let signs = [sign(m < q && (q + m) % 2 == 1), sign(q % 2 == 1)];
                let pair = Pair::new(simd, [0, 1].map(|i| start[i].with_sign(signs[i])));
                self.climb(simd, t, [q, m], pair, &mut sums);
                self.store(simd, [q, m], &sums);
            }
        }
    }
}

/// Cosine and sine coefficients of (p, q), then of (p, -q), of three channels each.
const PARTS: usize = 12;

impl Rows<'_> {
    /// The sums over l of one (q, m), into `sums` [p - q, parity of l + m].
    #[inline(always)]
    fn climb<S: Simd>(
        &self,
        simd: S,
        t: S::f64s,
        [q, m]: [usize; 2],
        mut pair: Pair<S>,
        sums: &mut [[S::f64s; PARTS]],
    ) {
        let (f, p) = (self.plan.f, self.plan.reflection.brdf().p().get());
        let zero = simd.splat_f64s(0.0);
        sums[..2 * (p + 1 - q)].fill([zero; PARTS]);
        let norm = [1.0, FRAC_1_SQRT_2, 0.5][usize::from(q == 0) + usize::from(m == 0)];
        let orders = simd.splat_f64s((q * m) as f64);
        let recurrence = &self.plan.recurrence;
        for l in q.max(m)..=f {
            if let Some(values) = pair.values(simd) {
                self.add(simd, [l, m, q], values, norm, sums);
            }
            let ([a, b, product], steps) = (recurrence.degree(l), recurrence.steps(l));
            let ([inverse_q, ratio_q], [inverse_m, ratio_m]) = (steps[q], steps[m]);
            let [ahead, behind, product] =
                [a * inverse_q * inverse_m, b * ratio_q * ratio_m, product].map(|v| simd.splat_f64s(v));
            let centre = simd.negate_mul_add_f64s(product, t, product);
            pair.climb(simd, [ahead, behind], centre, orders);
        }
    }

    /// Adds the terms of one l.
    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        [l, m, q]: [usize; 3],
        [g, h]: [S::f64s; 2],
        norm: f64,
        sums: &mut [[S::f64s; PARTS]],
    ) {
        let (brdf, zero) = (self.plan.reflection.brdf(), simd.splat_f64s(0.0));
        let middle = l * l + l;
        let rows = self.lighting.coefficients();
        let cosine = rows[middle + m].map(|v| simd.splat_f64s(v * norm));
        let sine = if m == 0 { [zero; 3] } else { rows[middle - m].map(|v| simd.splat_f64s(v * norm)) };
        let (even, odd) = (simd.add_f64s(g, h), simd.sub_f64s(g, h));
        let parity = (l + m) % 2;
        let parts: [[S::f64s; 3]; 4] = [
            cosine.map(|c| simd.mul_f64s(even, c)),
            sine.map(|s| simd.mul_f64s(even, s)),
            sine.map(|s| simd.mul_f64s(odd, s)),
            cosine.map(|c| simd.neg_f64s(simd.mul_f64s(odd, c))),
        ];
        for p in q..=brdf.p().get() {
            let rho = brdf.get(l, p, q).map(|v| simd.splat_f64s(v));
            let sum = &mut sums[2 * (p - q) + parity];
            for part in 0..if q == 0 { 2 } else { 4 } {
                for channel in 0..3 {
                    let place = 3 * part + channel;
                    sum[place] = simd.mul_add_f64s(rho[channel], parts[part][channel], sum[place]);
                }
            }
        }
    }

    /// Writes the sums of one (q, m) into the series.
    #[inline(always)]
    fn store<S: Simd>(&mut self, simd: S, [q, m]: [usize; 2], sums: &[[S::f64s; PARTS]]) {
        let (padded, fourier) = (self.plan.padded, self.plan.fourier);
        let series = self.plan.series();
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
                    let target = place * padded + 3 * row + channel;
                    for (lane, value) in self.north.chunks_exact_mut(series).zip(&lanes[0].0) {
                        lane[target] = *value;
                    }
                    for (lane, value) in self.south.chunks_exact_mut(series).zip(&lanes[1].0) {
                        lane[target] = *value;
                    }
                }
            }
        }
    }
}

/// n over k, in f64.
fn binomial(n: usize, k: usize) -> f64 {
    (1..=k.min(n - k)).fold(1.0, |value, i| value * (n + 1 - i) as f64 / i as f64)
}
