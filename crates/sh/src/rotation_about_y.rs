//! The rotation of coefficients about +Y, by Wigner's d functions ([`crate::wigner`]).
//!
//! Between real harmonics the matrix of degree l splits: for m, n >= 0, and up to factors sqrt(2) where m or
//! n is 0, cosines mix by g + h and sines by g - h, with g^l_mn = (-1)^(m+n) d^l_mn and h^l_mn = (-1)^m
//! d^l_m,-n.
//!
//! A block is four adjacent orders m. For each n its functions climb in l while their terms are added to the
//! sums.

use pulp::{Simd, WithSimd};

use crate::f64x4::{F64x4, LANES, SimdLevel, load, store};
use crate::scaled::Scaled;
use crate::wigner::{Pair, Recurrence, triangle};

/// Values per (l, m): cosine and sine parts of three channels.
pub(crate) const PARTS: usize = 6;

/// The values of four orders at one degree.
pub(crate) type Row = [F64x4; PARTS];

/// A rotation about +Y by an angle beta in [0, pi / 2], for coefficients up to a degree.
pub(crate) struct RotationAboutY {
    level: SimdLevel,
    degree: usize,
    sine: f64,
    cosine: f64,
    recurrence: Recurrence,
    /// sqrt(k) and 1 / sqrt(k), k = 0 ..= 2 degree + 6.
    roots: Vec<[f64; 2]>,
    /// T_mm = c^(2m) of each block.
    peaks: Vec<Scaled>,
    /// Terms with |m - n| from here on are below 1e-36 and left out.
    reach: usize,
}

impl RotationAboutY {
    /// Prepares the rotation by the angle whose half has this sine and cosine.
    pub(crate) fn new(degree: usize, sine: f64, cosine: f64) -> Self {
        // |d^l_mn| <= (l beta)^a / a! with a = |m - n|: J_y has norm l and reaches from m to n only in a steps,
        // so that the first a terms of exp(-i beta J_y) vanish there. beta <= pi s / sqrt(2) on [0, pi / 2].
        let widest = degree as f64 * sine * 2.2215;
        let (mut reach, mut bound) = (0, 1.0);
        while bound > 1e-36 && reach <= 2 * degree {
            reach += 1;
            bound *= widest / reach as f64;
        }
        let roots = (0..=2 * (degree + LANES)).map(|k| (k as f64).sqrt()).map(|root| [root, 1.0 / root]);
        let square = cosine * cosine;
        let first =
            Scaled::ONE.times_plain(F64x4([1.0, square, math::powi(square, 2), math::powi(square, 3)]));
        let next = |block: &Scaled| Some(block.times_plain(F64x4([math::powi(square, 4); LANES])));
        Self {
            level: SimdLevel::detect(),
            degree,
            sine,
            cosine,
            recurrence: Recurrence::new(degree),
            roots: roots.collect(),
            peaks: std::iter::successors(Some(first), next).take(degree / LANES + 1).collect(),
            reach,
        }
    }

    /// Rotates coefficients; the result is for the orders m from 4 `block` on.
    ///
    /// `input` holds [`PARTS`] values at `triangle(l) + n`. The result is for l = m ..= degree
    /// with m the block's first order; entries with m > l are zero.
    pub(crate) fn apply(&self, block: usize, input: &[[f64; PARTS]]) -> Vec<Row> {
        let mut output = vec![[F64x4::ZERO; PARTS]; self.degree + 1 - block * LANES];
        self.level.run(Block { rotation: self, first: block * LANES, input, output: &mut output });
        output
    }

    /// Whether functions that start out of range stay so up to the last degree F; n counts as -n in the
    /// second family.
    ///
    /// Below its turning point l_t = sqrt(m^2 + n^2 - 2 m n cos(beta)) / sin(beta) a function falls by kappa
    /// each step, sinh(kappa) >= sin(beta) sqrt(l_t^2 - l^2) / l (the recurrence with slowly varying
    /// factors), so that it is below e^-84 = 1e-36 at F if l_t sin(beta) > F sin(beta) + 20 (F
    /// sin(beta))^(1/3).
    fn stays_small(&self, first: usize, n: usize, family: usize) -> bool {
        let turn = 1.0 - 2.0 * self.sine * self.sine;
        let horizon = self.degree as f64 * 2.0 * self.sine * self.cosine;
        let n = if family == 0 { n as f64 } else { -(n as f64) };
        // The order of the block that comes nearest.
        let m = (n * turn).clamp(first as f64, (first + LANES - 1) as f64);
        (m * m + n * n - 2.0 * m * n * turn).sqrt() > horizon + 20.0 * math::cbrt(horizon)
    }

    /// The starts of a block's functions, at l = max(m, n), for each n; zero if they never matter.
    #[inline(always)]
    fn starts(&self, first: usize) -> Vec<[Scaled; 2]> {
        let sign = |odd: usize| if odd.is_multiple_of(2) { 1.0 } else { -1.0 };
        let last = first + LANES - 1;
        let mut starts = vec![[Scaled::ZERO; 2]; self.degree + LANES];
        let tangent = self.sine / self.cosine;
        // T_m,k from T_m,k+1: the product with sqrt((m+k+1) / (m-k)) s / c.
        let factor = |up: usize, down: usize| self.roots[up][0] * self.roots[down][1] * tangent;
        // n <= m: from T_mm down to T_m0, and on to T_m,-m.
        let mut value = Scaled::ZERO;
        for n in (0..=last).rev() {
            value = value.times_plain(F64x4::from_fn(|lane| match first + lane {
                m if m > n => factor(m + n + 1, m - n),
                _ => 0.0,
            }));
            if n >= first {
                value.set_lane(n - first, self.peaks[first / LANES]);
            }
            starts[n][0] = value;
        }
        starts[0][1] = value;
        for n in 1..=last {
            value = value.times_plain(F64x4::from_fn(|lane| match first + lane {
                m if m >= n => factor(m - n + 1, m + n),
                _ => 0.0,
            }));
            starts[n][1] = value.with_sign(sign(n));
        }
        // n > m: T_n,m and T_n,-m.
        let mut corner = [Scaled::ZERO; 2];
        for n in first + 1..=self.degree {
            let signs = |m: usize, n: usize| [sign(n + m), sign(n)];
            if n <= last + 1 {
                let m = n - 1;
                (0..2).for_each(|i| corner[i].set_lane(m - first, starts[m][i].with_sign(signs(m, m)[i])));
            }
            let factors = F64x4::from_fn(|lane| match first + lane {
                m if m < n => self.recurrence.ratio_of_starts(n, m) * (self.sine * self.cosine),
                _ => 0.0,
            });
            corner = corner.map(|value| value.times_plain(factors));
            for lane in 0..LANES.min(n - first) {
                let signs = signs(first + lane, n);
                (0..2).for_each(|i| starts[n][i].set_lane(lane, corner[i].with_sign(signs[i])));
            }
        }
        for (n, start) in starts.iter_mut().enumerate() {
            let apart = [first.saturating_sub(n).max(n.saturating_sub(last)), first + n];
            for family in 0..2 {
                let small = start[family].exponent.0.iter().all(|exponent| *exponent > 0.0);
                if apart[family] >= self.reach || small && self.stays_small(first, n, family) {
                    start[family] = Scaled::ZERO;
                }
            }
        }
        starts
    }
}

struct Block<'a> {
    rotation: &'a RotationAboutY,
    first: usize,
    input: &'a [[f64; PARTS]],
    output: &'a mut [Row],
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Block { rotation, first, input, output } = self;
        let recurrence = &rotation.recurrence;
        let last = first + LANES - 1;
        let t = 2.0 * rotation.sine * rotation.sine;
        let orders = load(simd, &F64x4::from_fn(|lane| (first + lane) as f64));
        let starts = rotation.starts(first);
        let zero = Pair::new(simd, [Scaled::ZERO; 2]);
        let mut pairs: Vec<Option<Pair<S>>> =
            starts.iter().map(|start| (*start != [Scaled::ZERO; 2]).then_some(zero)).collect();
        for (l, row) in (first..).zip(output) {
            for n in if l <= last { 0 } else { l }..=l {
                if let Some(pair) = &mut pairs[n] {
                    pair.enter(simd, starts[n], |lane| n.max(first + lane) == l);
                }
            }
            let ([a, b, product], steps) = (recurrence.degree(l), recurrence.steps(l));
            let step = |lane: usize| steps.get(first + lane).copied().unwrap_or_default();
            let ahead = load(simd, &F64x4::from_fn(|lane| a * step(lane)[0]));
            let behind = load(simd, &F64x4::from_fn(|lane| b * step(lane)[1]));
            let centre = simd.splat_f64s(product - product * t);
            let mut sums = [simd.splat_f64s(0.0); PARTS];
            let mut product = simd.splat_f64s(0.0);
            for ((pair, [inverse, ratio]), input) in pairs.iter_mut().zip(steps).zip(&input[triangle(l)..]) {
                if let Some(pair) = pair {
                    if let Some([g, h]) = pair.values(simd) {
                        let (even, odd) = (simd.add_f64s(g, h), simd.sub_f64s(g, h));
                        for part in 0..PARTS {
                            let mixed = if part < PARTS / 2 { even } else { odd };
                            sums[part] = simd.mul_add_f64s(mixed, simd.splat_f64s(input[part]), sums[part]);
                        }
                    }
                    let ahead = simd.mul_f64s(ahead, simd.splat_f64s(*inverse));
                    let behind = simd.mul_f64s(behind, simd.splat_f64s(*ratio));
                    pair.climb(simd, [ahead, behind], centre, product);
                }
                product = simd.add_f64s(product, orders);
            }
            (0..PARTS).for_each(|part| store(simd, sums[part], &mut row[part]));
        }
    }
}
