//! Wigner's d functions: what a rotation about +Y does to the harmonics of one degree.
//!
//! d^l_mn(beta) is the matrix of R_y(beta) between complex harmonics with the Condon-Shortley phase
//! (Varshalovich, Moskalev and Khersonskii 1988, chapter 4: d^1_10 = -sin(beta) / sqrt(2)). For R = R_z(b)
//! R_y(a) those harmonics obey Y_lm(R w) = sum over n of D^l_mn(R) Y_ln(w), D^l_mn = e^(i m b) d^l_mn(a).
//!
//! For m, n >= 0 there are two families, g with m n > 0 and h with m times -n: up to signs that do not depend
//! on l, g^l = d^l_mn and h^l = d^l_m,-n. For fixed (m, n) both climb in l by a three-term recurrence (ibid.
//! 4.8, eq. 14), with w_ln = sqrt(l^2 - n^2), t = 1 - cos(beta) = 2 sin^2(beta / 2) and the upper sign for g:
//!
//! w_l+1,m w_l+1,n f^(l+1) = ((2l+1) / l) (l (l+1) (1 - t) -+ m n) f^l - ((l+1) / l) w_lm w_ln f^(l-1)
//!
//! from f^l at l = max(m, n), where d^l_lk = T_lk times a sign: T_lk = sqrt(binomial(2l, l+k)) c^(l+k)
//! s^(l-k), c = cos(beta / 2), s = sin(beta / 2). Upward is the stable direction: f grows until l (l+1)
//! sin^2(beta) passes m^2 + n^2 - 2 m n cos(beta) and oscillates from there. Starts may lie far below what a
//! double holds ([`Scaled`]).
//!
//! Sums over l run along with the recurrence, four functions at a time, so that no matrix is ever held.

use pulp::Simd;

use crate::f64x4::{F64x4, LANES, load, store};
use crate::scaled::{HIGH, INVERSE_UNIT, Scaled};

/// The constants of the recurrence up to a degree.
pub struct Recurrence {
    /// 1 / w_l+1,n and w_ln / w_l+1,n at `triangle(l) + n`.
    steps: Vec<[f64; 2]>,
    /// (2l+1) / l, -(l+1) / l, l (l+1) and sqrt(2l (2l-1)) for each l. From l = 0 the step is d^1_00 =
    /// cos(beta): 1, 0 and 1.
    degrees: Vec<[f64; 4]>,
}

impl Recurrence {
    /// The constants for l up to `degree`.
    pub fn new(degree: usize) -> Self {
        let steps = (0..=degree).flat_map(|l| (0..=l).map(move |n| (l, n))).map(|(l, n)| {
            let above = ((l + 1 - n) * (l + 1 + n)) as f64;
            let here = ((l - n) * (l + n)) as f64;
            [1.0 / above.sqrt(), (here / above).sqrt()]
        });
        let degrees = (0..=degree).map(|l| match l as f64 {
            0.0 => [1.0, 0.0, 1.0, 0.0],
            l => [(2.0 * l + 1.0) / l, -(l + 1.0) / l, l * (l + 1.0), (2.0 * l * (2.0 * l - 1.0)).sqrt()],
        });
        Self { steps: steps.collect(), degrees: degrees.collect() }
    }

    /// 1 / w_l+1,n and w_ln / w_l+1,n for n = 0 ..= l.
    #[inline]
    pub fn steps(&self, l: usize) -> &[[f64; 2]] {
        &self.steps[triangle(l)..][..=l]
    }

    /// The factors of f^l and of f^(l-1), each without its w, and 1 - t.
    #[inline]
    pub fn degree(&self, l: usize) -> [f64; 3] {
        let [ahead, behind, product, _] = self.degrees[l];
        [ahead, behind, product]
    }

    /// sqrt(2l (2l-1)) / w_ln for l > n, which times s c is T_ln / T_l-1,n.
    #[inline]
    pub fn ratio_of_starts(&self, l: usize, n: usize) -> f64 {
        self.degrees[l][3] * self.steps(l - 1)[n][0]
    }
}

/// Where row l of a triangle of rows 0 ..= l starts.
pub(crate) const fn triangle(l: usize) -> usize {
    l * (l + 1) / 2
}

/// g^l and h^l of four functions, by rising l.
#[derive(Clone, Copy)]
pub struct Pair<S: Simd> {
    g: S::f64s,
    h: S::f64s,
    g_below: S::f64s,
    h_below: S::f64s,
    exponent: [F64x4; 2],
    all_in_range: bool,
}

impl<S: Simd> Pair<S> {
    /// The functions at the l at which they start, with these values.
    #[inline(always)]
    pub fn new(simd: S, [g, h]: [Scaled; 2]) -> Self {
        let (zero, exponent) = (simd.splat_f64s(0.0), [g.exponent, h.exponent]);
        Self {
            g: load(simd, &g.value),
            h: load(simd, &h.value),
            g_below: zero,
            h_below: zero,
            exponent,
            all_in_range: exponent == [F64x4::ZERO; 2],
        }
    }

    /// g^l and h^l, zero in the lanes that are out of range; nothing if all are.
    #[inline(always)]
    pub fn values(&self, simd: S) -> Option<[S::f64s; 2]> {
        if self.all_in_range {
            return Some([self.g, self.h]);
        }
        let in_range = self.exponent.map(|exponent| F64x4(exponent.0.map(|e| f64::from(u8::from(e == 0.0)))));
        let [g, h] = in_range.map(|lanes| load(simd, &lanes));
        (in_range != [F64x4::ZERO; 2]).then(|| [simd.mul_f64s(self.g, g), simd.mul_f64s(self.h, h)])
    }

    /// Climbs from l to l + 1: f^(l+1) = `ahead` (`centre` -+ `product`) f^l + `behind` f^(l-1), where
    /// `product` is m n.
    #[inline(always)]
    pub fn climb(&mut self, simd: S, [ahead, behind]: [S::f64s; 2], centre: S::f64s, product: S::f64s) {
        let to_g = simd.mul_f64s(ahead, simd.sub_f64s(centre, product));
        let to_h = simd.mul_f64s(ahead, simd.add_f64s(centre, product));
        let g = simd.mul_add_f64s(to_g, self.g, simd.mul_f64s(behind, self.g_below));
        let h = simd.mul_add_f64s(to_h, self.h, simd.mul_f64s(behind, self.h_below));
        (self.g_below, self.h_below, self.g, self.h) = (self.g, self.h, g, h);
        if !self.all_in_range {
            let size = simd.max_f64s(simd.abs_f64s(g), simd.abs_f64s(h));
            if simd.reduce_max_f64s(size) > HIGH {
                (self.g, self.g_below) = rescale(simd, [self.g, self.g_below], &mut self.exponent[0]);
                (self.h, self.h_below) = rescale(simd, [self.h, self.h_below], &mut self.exponent[1]);
                self.all_in_range = self.exponent == [F64x4::ZERO; 2];
            }
        }
    }

    /// Sets the functions of some lanes, which start at this l.
    #[inline(always)]
    pub(crate) fn enter(&mut self, simd: S, starts: [Scaled; 2], lanes: impl Fn(usize) -> bool) {
        let mut values = [F64x4::ZERO; 2];
        store(simd, self.g, &mut values[0]);
        store(simd, self.h, &mut values[1]);
        for lane in (0..LANES).filter(|&lane| lanes(lane)) {
            for family in 0..2 {
                values[family].0[lane] = starts[family].value.0[lane];
                self.exponent[family].0[lane] = starts[family].exponent.0[lane];
            }
        }
        (self.g, self.h) = (load(simd, &values[0]), load(simd, &values[1]));
        self.all_in_range = self.exponent == [F64x4::ZERO; 2];
    }
}

/// Takes a unit off the exponents of the values that have grown past 2^80.
#[inline(always)]
fn rescale<S: Simd>(simd: S, vectors: [S::f64s; 2], exponent: &mut F64x4) -> (S::f64s, S::f64s) {
    let mut values = [F64x4::ZERO; 2];
    (0..2).for_each(|i| store(simd, vectors[i], &mut values[i]));
    for i in 0..LANES {
        if values[0].0[i].abs() > HIGH && exponent.0[i] > 0.0 {
            values.iter_mut().for_each(|value| value.0[i] *= INVERSE_UNIT);
            exponent.0[i] -= 1.0;
        }
    }
    (load(simd, &values[0]), load(simd, &values[1]))
}
