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
    degree: usize,
    /// 1 / w_l+1,n and w_ln / w_l+1,n for l = n ..= degree, n after n.
    steps: Vec<[f64; 2]>,
    /// (2l+1) / l, -(l+1) / l and l (l+1) for each l. From l = 0 the step is d^1_00 = cos(beta): 1, 0 and 1.
    degrees: Vec<[f64; 3]>,
}

impl Recurrence {
    /// The constants for l up to `degree`.
    pub fn new(degree: usize) -> Self {
        let steps = (0..=degree).flat_map(|n| (n..=degree).map(move |l| (n, l))).map(|(n, l)| {
            let above = ((l + 1 - n) * (l + 1 + n)) as f64;
            let here = ((l - n) * (l + n)) as f64;
            [1.0 / above.sqrt(), (here / above).sqrt()]
        });
        let degrees = (0..=degree).map(|l| match l as f64 {
            0.0 => [1.0, 0.0, 1.0],
            l => [(2.0 * l + 1.0) / l, -(l + 1.0) / l, l * (l + 1.0)],
        });
        Self { degree, steps: steps.collect(), degrees: degrees.collect() }
    }

    /// 1 / w_l+1,n and w_ln / w_l+1,n for l = n ..= degree.
    #[inline]
    pub fn steps(&self, n: usize) -> &[[f64; 2]] {
        &self.steps[column(self.degree, n)..][..self.degree + 1 - n]
    }

    /// What f^l and f^(l-1) are multiplied by beside w, and what 1 - t is.
    #[inline]
    pub fn degree(&self, l: usize) -> [f64; 3] {
        self.degrees[l]
    }

    /// T_ln / T_l-1,n = sqrt(2l (2l-1)) / w_ln times s c, for l > n: this without s c.
    #[inline]
    pub fn ratio_of_starts(&self, l: usize, n: usize) -> f64 {
        ((2 * l * (2 * l - 1)) as f64).sqrt() * self.steps(n)[l - 1 - n][0]
    }
}

/// Where column n starts when the columns l = n ..= degree lie one after the other.
pub(crate) const fn column(degree: usize, n: usize) -> usize {
    n * (degree + 1) - n * n.saturating_sub(1) / 2
}

/// g^l and h^l of four functions, by rising l.
pub struct Pair<S: Simd> {
    now: [S::f64s; 2],
    below: [S::f64s; 2],
    exponent: [F64x4; 2],
    /// 1 in the lanes whose values a double holds, 0 in the others.
    in_range: [S::f64s; 2],
    any_in_range: bool,
    all_in_range: bool,
}

impl<S: Simd> Pair<S> {
    /// Four zeros.
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let (zero, one) = ([simd.splat_f64s(0.0); 2], [simd.splat_f64s(1.0); 2]);
        let exponent = [F64x4::ZERO; 2];
        Self { now: zero, below: zero, exponent, in_range: one, any_in_range: true, all_in_range: true }
    }

    /// Adds the values that functions start from; those that have started or start later get a zero.
    #[inline(always)]
    pub fn start(&mut self, simd: S, starts: [Scaled; 2]) {
        for (family, start) in starts.into_iter().enumerate() {
            self.now[family] = simd.add_f64s(self.now[family], load(simd, &start.value));
            (0..LANES).for_each(|i| self.exponent[family].0[i] += start.exponent.0[i]);
        }
        self.find_range(simd);
    }

    #[inline(always)]
    fn find_range(&mut self, simd: S) {
        let lanes = self.exponent.map(|exponent| exponent.0.map(|e| f64::from(u8::from(e == 0.0))));
        self.in_range = lanes.map(|lanes| load(simd, &F64x4(lanes)));
        self.any_in_range = lanes != [[0.0; LANES]; 2];
        self.all_in_range = lanes == [[1.0; LANES]; 2];
    }

    /// g^l and h^l, zero in the lanes that are out of range; nothing if all are.
    #[inline(always)]
    pub fn values(&self, simd: S) -> Option<[S::f64s; 2]> {
        let value = |family: usize| simd.mul_f64s(self.now[family], self.in_range[family]);
        self.any_in_range.then(|| [value(0), value(1)])
    }

    /// From l to l + 1: f^(l+1) = `ahead` (`centre` -+ `product`) f^l + `behind` f^(l-1), where `product` is
    /// m n.
    #[inline(always)]
    pub fn climb(&mut self, simd: S, [ahead, behind]: [S::f64s; 2], centre: S::f64s, product: S::f64s) {
        let factors = [simd.sub_f64s(centre, product), simd.add_f64s(centre, product)];
        for family in 0..2 {
            let past = simd.mul_f64s(behind, self.below[family]);
            let factor = simd.mul_f64s(ahead, factors[family]);
            self.below[family] = self.now[family];
            self.now[family] = simd.mul_add_f64s(factor, self.now[family], past);
        }
        if !self.all_in_range {
            let size = simd.max_f64s(simd.abs_f64s(self.now[0]), simd.abs_f64s(self.now[1]));
            if simd.reduce_max_f64s(size) > HIGH {
                self.rescale(simd);
            }
        }
    }

    /// Takes a unit off the exponents of the values that have grown past 2^80.
    #[inline(always)]
    fn rescale(&mut self, simd: S) {
        for family in 0..2 {
            let mut values = [F64x4::ZERO; 2];
            store(simd, self.now[family], &mut values[0]);
            store(simd, self.below[family], &mut values[1]);
            for i in 0..LANES {
                if values[0].0[i].abs() > HIGH && self.exponent[family].0[i] > 0.0 {
                    values.iter_mut().for_each(|value| value.0[i] *= INVERSE_UNIT);
                    self.exponent[family].0[i] -= 1.0;
                }
            }
            [self.now[family], self.below[family]] = values.map(|value| load(simd, &value));
        }
        self.find_range(simd);
    }
}
