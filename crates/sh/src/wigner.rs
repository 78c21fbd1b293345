//! Wigner's d functions: what a rotation about +Y does to the harmonics of one degree.
//!
//! d^l_mn(beta) is the matrix of R_y(beta) between complex harmonics with the Condon-Shortley phase (Varshalovich,
//! Moskalev and Khersonskii 1988, chapter 4: d^1_10 = -sin(beta) / sqrt(2)). For R = R_z(b) R_y(a) those harmonics obey
//! Y_lm(R w) = sum over n of D^l_mn(R) Y_ln(w), D^l_mn = e^(i m b) d^l_mn(a).
//!
//! Between real harmonics the matrix splits: for m, n >= 0, and up to factors sqrt(2) where m or n is 0,
//! cosines mix by g + h and sines by g - h, with g^l_mn = (-1)^(m+n) d^l_mn and h^l_mn = (-1)^m d^l_m,-n.
//! For fixed (m, n) both climb in l by a three-term recurrence (ibid. 4.8, eq. 14), with w_ln = sqrt(l^2 - n^2),
//! t = 1 - cos(beta) = 2 sin^2(beta / 2) and the upper sign for g:
//!
//! w_l+1,m w_l+1,n f^(l+1) = ((2l+1) / l) (l (l+1) (1 - t) -+ m n) f^l - ((l+1) / l) w_lm w_ln f^(l-1)
//!
//! from f^l at l = max(m, n), where d^l_ln = T_ln times a sign: T_lk = sqrt(binomial(2l, l+k)) c^(l+k) s^(l-k),
//! c = cos(beta / 2), s = sin(beta / 2). Upward is the stable direction: f grows until l (l+1) sin^2(beta) passes
//! m^2 + n^2 - 2 m n cos(beta) and oscillates from there. Starts may lie far below what f64 holds and
//! grow to matter later, so they carry their own exponent until they are large enough.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use pulp::{Arch, Simd, WithSimd};

/// Values per (l, m): cosine and sine parts of three channels.
pub(crate) const PARTS: usize = 6;

/// Where row l of a triangle of rows 0 ..= l starts.
pub(crate) const fn triangle(l: usize) -> usize {
    l * (l + 1) / 2
}

/// The matrices of one angle beta in [0, pi / 2], ready to be applied up to a degree.
pub(crate) struct Wigner {
    arch: Arch,
    degree: usize,
    sine: f64,
    cosine: f64,
    /// 1 / w_l+1,n and w_ln / w_l+1,n, in row l, place n.
    steps: Vec<[f64; 2]>,
    /// sqrt(k) and 1 / sqrt(k), k = 0 ..= 2 degree.
    roots: Vec<[f64; 2]>,
    /// T_ll = c^(2l), l = 0 ..= degree.
    peaks: Vec<Scaled>,
    /// Terms with |m - n| (for g) or m + n (for h) from here on are below 1e-36 and left out.
    reach: usize,
}

impl Wigner {
    /// The matrices of degree 0 to `degree` for the angle beta whose half has this sine and cosine.
    pub(crate) fn new(degree: usize, sine: f64, cosine: f64) -> Self {
        let mut steps = Vec::with_capacity(triangle(degree + 1));
        for l in 0..=degree {
            for n in 0..=l {
                let above = ((l + 1 - n) * (l + 1 + n)) as f64;
                let here = ((l - n) * (l + n)) as f64;
                steps.push([1.0 / above.sqrt(), (here / above).sqrt()]);
            }
        }
        // |d^l_mn| <= (l beta)^a / a! with a = |m - n|: J_y has norm l and reaches from m to n only in a steps,
        // so that the first a terms of exp(-i beta J_y) vanish there. beta <= pi s / sqrt(2) on [0, pi / 2].
        let widest = degree as f64 * sine * 2.2215;
        let (mut reach, mut bound) = (0, 1.0);
        while bound > 1e-36 && reach <= 2 * degree {
            reach += 1;
            bound *= widest / reach as f64;
        }
        let roots = (0..=2 * degree).map(|k| (k as f64).sqrt()).map(|root| [root, 1.0 / root]).collect();
        let peaks = std::iter::successors(Some(Scaled::ONE), |value| Some(value.times(cosine * cosine)));
        let peaks = peaks.take(degree + 1).collect();
        Self { arch: Arch::new(), degree, sine, cosine, steps, roots, peaks, reach }
    }

    /// The columns that one block handles together: the vector width of this CPU.
    pub(crate) fn lanes(&self) -> usize {
        struct Lanes;
        impl WithSimd for Lanes {
            type Output = usize;
            fn with_simd<S: Simd>(self, _: S) -> usize {
                S::F64_LANES
            }
        }
        self.arch.dispatch(Lanes)
    }

    /// The length of what [`Wigner::apply`] writes for the block that starts at m = `first`.
    pub(crate) fn block_len(&self, first: usize) -> usize {
        (self.degree + 1 - first) * PARTS * self.lanes()
    }

    /// Rotates coefficients about +Y, for m from `first` on, as many as there are lanes.
    ///
    /// `input` holds [`PARTS`] values at `triangle(l) + n` for l = 0 ..= degree and n = 0 ..= l. `output` has shape
    /// [degree + 1 - first, PARTS, lanes], indexed l - first, part, m - first; entries with m > l are zero.
    pub(crate) fn apply(&self, first: usize, input: &[[f64; PARTS]], output: &mut [f64]) {
        self.arch.dispatch(Block { wigner: self, first, input, output });
    }

    /// T_lk for k = l, l-1, ..., -l.
    fn edge(&self, l: usize) -> impl Iterator<Item = Scaled> {
        let mut value = self.peaks[l];
        let tangent = self.sine / self.cosine;
        (0..=2 * l).map(move |i| {
            // T_l,k-1 / T_lk = sqrt((l+k) / (l-k+1)) s / c with k = l - i + 1.
            if i > 0 {
                value = value.times(self.roots[2 * l + 1 - i][0] * self.roots[i][1] * tangent);
            }
            value
        })
    }
}

/// Which of the two families of functions.
#[derive(Clone, Copy, PartialEq)]
enum Family {
    G,
    H,
}

/// A start that was too small for f64 when its column began, and enters at `l`.
struct Late {
    l: usize,
    place: usize,
    family: Family,
    below: f64,
    value: f64,
}

/// The one that enters first is the greatest. No two with the same l share a place, so their order is free.
impl Ord for Late {
    fn cmp(&self, other: &Self) -> Ordering {
        other.l.cmp(&self.l)
    }
}

impl PartialOrd for Late {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Late {
    fn eq(&self, other: &Self) -> bool {
        self.l == other.l
    }
}

impl Eq for Late {}

struct Block<'a> {
    wigner: &'a Wigner,
    first: usize,
    input: &'a [[f64; PARTS]],
    output: &'a mut [f64],
}

/// f^l and f^(l-1) of both families, at place n * lanes + lane.
struct State {
    g: Vec<f64>,
    g_below: Vec<f64>,
    h: Vec<f64>,
    h_below: Vec<f64>,
    late: BinaryHeap<Late>,
}

impl State {
    fn new(len: usize) -> Self {
        let zero = || vec![0.0; len];
        Self { g: zero(), g_below: zero(), h: zero(), h_below: zero(), late: BinaryHeap::new() }
    }

    fn set(&mut self, family: Family, place: usize, below: f64, value: f64) {
        let (here, before) = match family {
            Family::G => (&mut self.g, &mut self.g_below),
            Family::H => (&mut self.h, &mut self.h_below),
        };
        (here[place], before[place]) = (value, below);
    }

    /// Lets those late starts in that enter at `l`.
    fn admit(&mut self, l: usize) {
        while self.late.peek().is_some_and(|late| late.l <= l) {
            if let Some(Late { place, family, below, value, .. }) = self.late.pop() {
                self.set(family, place, below, value);
            }
        }
    }
}

impl WithSimd for Block<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Block { wigner, first, input, output } = self;
        let (lanes, top) = (S::F64_LANES, wigner.degree);
        let mut state = State::new((top + 1) * lanes);
        let mut corners = vec![[Scaled::ONE; 2]; lanes];
        let (output, _) = S::as_mut_simd_f64s(output);
        let mut orders = [0.0; MOST_LANES];
        for (lane, order) in orders.iter_mut().enumerate() {
            *order = (first + lane) as f64;
        }
        let orders = S::as_simd_f64s(&orders).0[0];
        for l in first..=top {
            if l > first {
                let climb = Climb::new(simd, wigner, first, l - 1);
                climb.run(simd, orders, &mut state);
                state.admit(l);
            }
            for lane in 0..lanes.min(l + 1 - first) {
                wigner.start(l, first + lane, lane, lanes, &mut corners[lane], &mut state);
            }
            let row = &mut output[(l - first) * PARTS..][..PARTS];
            let input = &input[triangle(l)..][..=l];
            row.copy_from_slice(&mix(simd, S::as_simd_f64s(&state.g).0, S::as_simd_f64s(&state.h).0, input));
        }
    }
}

/// More lanes than any vector of f64 has here.
const MOST_LANES: usize = 16;

/// The factors of the step from l to l + 1.
struct Climb<'a, S: Simd> {
    l: usize,
    /// l (l+1) (1 - t).
    centre: f64,
    /// (2l+1) / (l w_l+1,m).
    ahead: S::f64s,
    /// (l+1) w_lm / (l w_l+1,m).
    behind: S::f64s,
    steps: &'a [[f64; 2]],
}

impl<'a, S: Simd> Climb<'a, S> {
    #[inline(always)]
    fn new(_: S, wigner: &'a Wigner, first: usize, l: usize) -> Self {
        let steps = &wigner.steps[triangle(l)..][..=l];
        let (mut ahead, mut behind) = ([0.0; MOST_LANES], [0.0; MOST_LANES]);
        let degree = l as f64;
        let turn = 1.0 - 2.0 * wigner.sine * wigner.sine;
        // At l = 0 only m = n = 0 exist: d^1_00 = cos(beta).
        let (centre, a, b) = if l == 0 {
            (turn, 1.0, 0.0)
        } else {
            let product = (l * (l + 1)) as f64;
            let centre = product - product * (2.0 * wigner.sine * wigner.sine);
            (centre, (2.0 * degree + 1.0) / degree, (degree + 1.0) / degree)
        };
        for lane in 0..S::F64_LANES.min((l + 1).saturating_sub(first)) {
            let [inverse, ratio] = steps[first + lane];
            (ahead[lane], behind[lane]) = (a * inverse, b * ratio);
        }
        Self { l, centre, ahead: S::as_simd_f64s(&ahead).0[0], behind: S::as_simd_f64s(&behind).0[0], steps }
    }

    /// Takes f^l to f^(l+1) for n = 0 ..= l.
    #[inline(always)]
    fn run(&self, simd: S, orders: S::f64s, state: &mut State) {
        let count = self.l + 1;
        let g = &S::as_simd_f64s(&state.g).0[..count];
        let h = &S::as_simd_f64s(&state.h).0[..count];
        let g_below = &mut S::as_mut_simd_f64s(&mut state.g_below).0[..count];
        let h_below = &mut S::as_mut_simd_f64s(&mut state.h_below).0[..count];
        let centre = simd.splat_f64s(self.centre);
        let one = simd.splat_f64s(1.0);
        let mut n = simd.splat_f64s(0.0);
        for (i, &[inverse, ratio]) in self.steps.iter().enumerate() {
            let ahead = simd.mul_f64s(self.ahead, simd.splat_f64s(inverse));
            let behind = simd.mul_f64s(self.behind, simd.splat_f64s(ratio));
            let to_g = simd.mul_f64s(ahead, simd.negate_mul_add_e_f64s(n, orders, centre));
            let to_h = simd.mul_f64s(ahead, simd.mul_add_e_f64s(n, orders, centre));
            let past_g = simd.mul_f64s(behind, g_below[i]);
            let past_h = simd.mul_f64s(behind, h_below[i]);
            g_below[i] = simd.sub_f64s(simd.mul_f64s(to_g, g[i]), past_g);
            h_below[i] = simd.sub_f64s(simd.mul_f64s(to_h, h[i]), past_h);
            n = simd.add_f64s(n, one);
        }
        std::mem::swap(&mut state.g, &mut state.g_below);
        std::mem::swap(&mut state.h, &mut state.h_below);
    }
}

/// Sum over n of (g + h) times the cosine parts and (g - h) times the sine parts.
#[inline(always)]
fn mix<S: Simd>(simd: S, g: &[S::f64s], h: &[S::f64s], input: &[[f64; PARTS]]) -> [S::f64s; PARTS] {
    let mut sum = [simd.splat_f64s(0.0); PARTS];
    for ((&g, &h), parts) in g.iter().zip(h).zip(input) {
        let (even, odd) = (simd.add_f64s(g, h), simd.sub_f64s(g, h));
        for channel in 0..PARTS / 2 {
            sum[channel] = simd.mul_add_e_f64s(even, simd.splat_f64s(parts[channel]), sum[channel]);
        }
        for channel in PARTS / 2..PARTS {
            sum[channel] = simd.mul_add_e_f64s(odd, simd.splat_f64s(parts[channel]), sum[channel]);
        }
    }
    sum
}

impl Wigner {
    /// Starts the functions of (l, m) whose recurrence begins at l: all n where l = m, n = l where l > m.
    ///
    /// `corner` carries T_lm and T_l,-m from one l to the next.
    fn start(
        &self,
        l: usize,
        m: usize,
        lane: usize,
        lanes: usize,
        corner: &mut [Scaled; 2],
        state: &mut State,
    ) {
        let sign = |odd: usize| if odd.is_multiple_of(2) { 1.0 } else { -1.0 };
        if l == m {
            for (i, value) in self.edge(l).enumerate() {
                if i <= l {
                    self.enter(l, m, l - i, lane, lanes, Family::G, value, state);
                }
                if i >= l {
                    self.enter(l, m, i - l, lane, lanes, Family::H, value.times(sign(i - l)), state);
                }
                if i == 0 {
                    corner[0] = value;
                }
                if i == 2 * l {
                    corner[1] = value;
                }
            }
        } else {
            // T_l+1,k / T_lk = sqrt((2l+2)(2l+1) / ((l+1+k)(l+1-k))) s c
            let [inverse, _] = self.steps[triangle(l - 1) + m];
            let factor =
                self.roots[2 * l][0] * self.roots[2 * l - 1][0] * inverse * (self.sine * self.cosine);
            *corner = corner.map(|value| value.times(factor));
            self.enter(l, m, l, lane, lanes, Family::G, corner[0].times(sign(l - m)), state);
            self.enter(l, m, l, lane, lanes, Family::H, corner[1].times(sign(l)), state);
        }
    }

    /// Enters one start into the state: at once, later, or never if it cannot matter.
    #[allow(clippy::too_many_arguments)]
    #[inline]
    fn enter(
        &self,
        l: usize,
        m: usize,
        n: usize,
        lane: usize,
        lanes: usize,
        family: Family,
        start: Scaled,
        state: &mut State,
    ) {
        let steps_apart = if family == Family::G { m.abs_diff(n) } else { m + n };
        if steps_apart >= self.reach {
            return;
        }
        let place = n * lanes + lane;
        if let Some(value) = start.to_f64() {
            state.set(family, place, 0.0, value);
        } else if let Some((l, below, value)) = self.grow(l, m, n, family, start) {
            state.late.push(Late { l, place, family, below, value });
        }
    }

    /// Climbs from a start that f64 cannot hold until it can: that l, f^(l-1) and f^l.
    ///
    /// None where it stays small up to the last degree F. Below its turning point l_t = sqrt(m^2 + n^2 -+ 2 m n
    /// cos(beta)) / sin(beta) a function falls by kappa each step, sinh(kappa) >= sin(beta) sqrt(l_t^2 - l^2) / l (the
    /// recurrence with slowly varying factors), so that it is below e^-84 = 1e-36 at F where
    /// l_t sin(beta) > F sin(beta) + 20 (F sin(beta))^(1/3).
    #[cold]
    fn grow(&self, l: usize, m: usize, n: usize, family: Family, start: Scaled) -> Option<(usize, f64, f64)> {
        let t = 2.0 * self.sine * self.sine;
        let mn = (m * n) as f64 * if family == Family::G { 1.0 } else { -1.0 };
        let horizon = self.degree as f64 * 2.0 * self.sine * self.cosine;
        if ((m * m + n * n) as f64 - 2.0 * mn * (1.0 - t)).sqrt() > horizon + 20.0 * horizon.cbrt() {
            return None;
        }
        let (mut below, mut value, mut exponent) = (0.0, start.mantissa, start.exponent);
        for l in l..self.degree {
            let degree = l as f64;
            let product = degree * (degree + 1.0);
            let [inverse_m, ratio_m] = self.steps[triangle(l) + m];
            let [inverse_n, ratio_n] = self.steps[triangle(l) + n];
            let ahead = (2.0 * degree + 1.0) / degree * inverse_m * inverse_n * (product - product * t - mn);
            let behind = (degree + 1.0) / degree * ratio_m * ratio_n;
            (below, value) = (value, ahead * value - behind * below);
            if value.abs() > Scaled::STEP {
                (below, value) = (below / Scaled::STEP, value / Scaled::STEP);
                exponent += 1;
            }
            if let Some(number) = (Scaled { mantissa: value, exponent }).to_f64() {
                return Some((l + 1, below * (number / value), number));
            }
        }
        None
    }
}

/// mantissa * 2^(256 exponent): numbers far below what f64 holds.
#[derive(Clone, Copy)]
struct Scaled {
    mantissa: f64,
    exponent: i32,
}

impl Scaled {
    const ONE: Self = Self { mantissa: 1.0, exponent: 0 };
    const STEP: f64 = f64::from_bits((1023 + 256) << 52);

    #[inline]
    fn times(self, factor: f64) -> Self {
        let mantissa = self.mantissa * factor;
        if mantissa.abs() < 1.0 / Self::STEP {
            Self { mantissa: mantissa * Self::STEP, exponent: self.exponent - 1 }
        } else if mantissa.abs() > Self::STEP {
            Self { mantissa: mantissa / Self::STEP, exponent: self.exponent + 1 }
        } else {
            Self { mantissa, exponent: self.exponent }
        }
    }

    /// The number, where it is zero or at least 2^-768.
    fn to_f64(self) -> Option<f64> {
        match self.exponent {
            0 => Some(self.mantissa),
            -1 => Some(self.mantissa / Self::STEP),
            -2 => Some(self.mantissa / Self::STEP / Self::STEP),
            _ if self.mantissa == 0.0 => Some(0.0),
            _ => None,
        }
    }
}
