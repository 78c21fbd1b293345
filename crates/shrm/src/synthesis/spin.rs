//! Rows of constant colatitude: the Fourier series in beta of every coefficient, as many alphas at once as a vector
//! has lanes.
//!
//! Real rows c_lm, s_lm of the lighting (m > 0: cosine and sine) enter the frame R_z(beta) R_y(alpha) as
//!
//! > a_l,q - i a_l,-q = sum over m of (E^l_qm Re + i O^l_qm Im) (c_lm - i s_lm) e^(i m beta),
//!
//! with E = d_qm + (-1)^m d_q,-m and O = d_qm - (-1)^m d_q,-m, each times 1 / sqrt(2) for q = 0 and for m = 0. Hence the
//! series of b_p,q has the cosine and sine coefficients sum over l of rho_lpq E (c_lm, s_lm), that of b_p,-q
//! sum over l of rho_lpq O (s_lm, -c_lm).
//!
//! Both families G = d_qm and H = (-1)^m d_q,-m climb in l, upper sign for G (Varshalovich, Moskalev and Khersonskii
//! 1988, 4.8, eq. 14; w_ln = sqrt(l^2 - n^2)):
//!
//! w_l+1,m w_l+1,q f^(l+1) = ((2l+1) / l) (l (l+1) cos(alpha) -+ m q) f^l - ((l+1) / l) w_lm w_lq f^(l-1)
//!
//! from l = max(q, m), with T_lk = sqrt(binomial(2l, l+k)) c^(l+k) s^(l-k), c and s of alpha / 2: where m > q,
//! G = T_mq and H = (-1)^q T_m,-q; where m <= q, G = (-1)^(q+m) T_qm and H = (-1)^q T_q,-m. Starts are carried times 2^600:
//! what still underflows then never matters below degree 2048 (as in `sh::Basis`, sin^m(alpha) at most).
//!
//! At pi - alpha, E takes the sign (-1)^(l+m+q) and O the opposite one: terms with even and odd l + m, summed apart,
//! give both rows.

use std::f64::consts::FRAC_1_SQRT_2;

use pulp::{Simd, WithSimd};
use sh::Expansion;

use super::Plan;
use crate::Terms;

const LIFT: f64 = f64::from_bits((1023 + 600) << 52);
const LOWER: f64 = f64::from_bits((1023 - 600) << 52);

/// More lanes than any vector of f64 has here.
const MOST_LANES: usize = 16;

/// The constants of the recurrence up to a degree.
pub(super) struct Spin {
    f: usize,
    /// w_ln and 1 / w_ln in row l, place n <= P; row F + 1 included.
    roots: Vec<[f64; 2]>,
}

impl Spin {
    pub(super) fn new(f: usize) -> Self {
        let mut roots = Vec::with_capacity((f + 2) * (f + 2));
        for l in 0..f + 2 {
            for n in 0..f + 2 {
                let w = if n < l { (((l - n) * (l + n)) as f64).sqrt() } else { 0.0 };
                roots.push([w, if n < l { 1.0 / w } else { 0.0 }]);
            }
        }
        Self { f, roots }
    }

    fn root(&self, l: usize, n: usize) -> [f64; 2] {
        self.roots[l * (self.f + 2) + n]
    }
}

/// The series at some colatitudes, at most as many as there are lanes, and at pi minus each.
pub(super) struct Rows<'a> {
    pub(super) plan: &'a Plan<'a>,
    pub(super) spin: &'a Spin,
    /// The lighting of the plan's reflection, or that lighting turned.
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
        let mut half = [[0.0; MOST_LANES]; 3];
        for (lane, alpha) in self.alphas.iter().enumerate() {
            (half[0][lane], half[1][lane]) = (alpha / 2.0).sin_cos();
            half[2][lane] = alpha.cos();
        }
        let [sine, cosine, turn] = [0, 1, 2].map(|i| S::as_simd_f64s(&half[i]).0[0]);
        let both = simd.mul_f64s(sine, cosine);
        let powers = |base: S::f64s| {
            let mut value = simd.splat_f64s(1.0);
            let mut all = Vec::with_capacity(2 * p + 1);
            for _ in 0..=2 * p {
                all.push(value);
                value = simd.mul_f64s(value, base);
            }
            all
        };
        let (sines, cosines) = (powers(sine), powers(cosine));
        let mut sums = vec![[simd.splat_f64s(0.0); PARTS]; 2 * (p + 1)];
        let most = if self.plan.terms == Terms::Zonal { 0 } else { p.min(f) };
        for q in 0..=most {
            let mut start = [simd.splat_f64s(0.0); 2];
            for m in 0..=f {
                if m <= q {
                    // T_q,m = sqrt(binomial(2q, q+m)) c^(q+m) s^(q-m)
                    let size = simd.splat_f64s(LIFT * binomial(2 * q, q + m).sqrt());
                    let g = simd.mul_f64s(cosines[q + m], sines[q - m]);
                    let h = simd.mul_f64s(cosines[q - m], sines[q + m]);
                    start = [simd.mul_f64s(size, g), simd.mul_f64s(size, h)];
                } else {
                    // T_m,q / T_m-1,q = sqrt(2m (2m-1) / ((m+q) (m-q))) s c
                    let ratio = ((2 * m * (2 * m - 1)) as f64).sqrt() * self.spin.root(m, q)[1];
                    let ratio = simd.mul_f64s(simd.splat_f64s(ratio), both);
                    start = start.map(|value| simd.mul_f64s(value, ratio));
                }
                let g = if m < q && (q + m) % 2 == 1 { simd.neg_f64s(start[0]) } else { start[0] };
                let h = if q % 2 == 1 { simd.neg_f64s(start[1]) } else { start[1] };
                self.climb(simd, turn, [q, m], [g, h], &mut sums);
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
        turn: S::f64s,
        [q, m]: [usize; 2],
        [mut g, mut h]: [S::f64s; 2],
        sums: &mut [[S::f64s; PARTS]],
    ) {
        let (f, brdf) = (self.plan.f, self.plan.reflection.brdf());
        let p = brdf.p().get();
        let zero = simd.splat_f64s(0.0);
        sums[..2 * (p + 1 - q)].fill([zero; PARTS]);
        let norm = [1.0, FRAC_1_SQRT_2, 0.5][usize::from(q == 0) + usize::from(m == 0)];
        let (mut g_below, mut h_below) = (zero, zero);
        let product = simd.splat_f64s((q * m) as f64);
        for l in q.max(m)..=f {
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
            for p in q..=p {
                let rho = brdf.get(l, p, q).map(|v| simd.splat_f64s(v));
                let sum = &mut sums[2 * (p - q) + parity];
                for part in 0..if q == 0 { 2 } else { 4 } {
                    for channel in 0..3 {
                        let place = 3 * part + channel;
                        sum[place] = simd.mul_add_e_f64s(rho[channel], parts[part][channel], sum[place]);
                    }
                }
            }
            if l == f {
                break;
            }
            // From l = 0 the step is d^1_00 = cos(alpha).
            let degree = l as f64;
            let [ahead, behind, centre] = if l == 0 {
                [1.0, 0.0, 1.0]
            } else {
                let inverse = self.spin.root(l + 1, m)[1] * self.spin.root(l + 1, q)[1];
                let here = self.spin.root(l, m)[0] * self.spin.root(l, q)[0];
                [
                    (2.0 * degree + 1.0) / degree * inverse,
                    (degree + 1.0) / degree * here * inverse,
                    degree * (degree + 1.0),
                ]
            };
            let [ahead, behind, centre] = [ahead, behind, centre].map(|v| simd.splat_f64s(v));
            let centre = simd.mul_f64s(centre, turn);
            let to_g = simd.mul_f64s(ahead, simd.sub_f64s(centre, product));
            let to_h = simd.mul_f64s(ahead, simd.add_f64s(centre, product));
            let next_g = simd.sub_f64s(simd.mul_f64s(to_g, g), simd.mul_f64s(behind, g_below));
            let next_h = simd.sub_f64s(simd.mul_f64s(to_h, h), simd.mul_f64s(behind, h_below));
            (g_below, h_below, g, h) = (g, h, next_g, next_h);
        }
    }

    /// Writes the sums of one (q, m) into the series.
    #[inline(always)]
    fn store<S: Simd>(&mut self, simd: S, [q, m]: [usize; 2], sums: &[[S::f64s; PARTS]]) {
        let (padded, quarters) = (self.plan.padded, self.plan.quarters);
        let series = self.plan.series();
        let lower = simd.splat_f64s(LOWER);
        let places = [Some(quarters.cosine(m)), (m > 0).then(|| quarters.sine(m))];
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
                    let even = simd.mul_f64s(even, lower);
                    let odd = simd.mul_f64s(odd, lower);
                    let south = if negate { simd.sub_f64s(odd, even) } else { simd.sub_f64s(even, odd) };
                    let mut lanes = [[0.0; MOST_LANES]; 2];
                    S::as_mut_simd_f64s(&mut lanes[0]).0[0] = simd.add_f64s(even, odd);
                    S::as_mut_simd_f64s(&mut lanes[1]).0[0] = south;
                    let target = place * padded + 3 * row + channel;
                    for (lane, value) in self.north.chunks_exact_mut(series).zip(&lanes[0]) {
                        lane[target] = *value;
                    }
                    for (lane, value) in self.south.chunks_exact_mut(series).zip(&lanes[1]) {
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
