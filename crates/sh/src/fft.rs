//! The discrete Fourier transform of four sequences at once, one in each lane.
//!
//! X_k = sum over j of x_j e^(-2 pi i j k / n), by Stockham's method, which sorts as it goes and needs no
//! shuffle within a vector: one pass for each factor r of n = r m writes
//!
//! ```text
//! y[s (r p + k) + q] = e^(-2 pi i p k / n) sum over j of x[s (p + m j) + q] e^(-2 pi i j k / r),
//! p < m, k < r, q < s,
//! ```
//!
//! and leaves r s sequences of length m, interleaved. A length with a prime factor past [`LARGEST_FACTOR`]
//! becomes a convolution of a length that is a power of two (Bluestein 1970).

use std::f64::consts::PI;

use pulp::{Simd, WithSimd};

use crate::f64x4::{F64x4, LANES, SimdLevel, load, store};

/// Four complex numbers: real parts, imaginary parts.
pub(crate) type Complex4 = [F64x4; 2];

/// Four complex zeros.
pub(crate) const ZERO: Complex4 = [F64x4::ZERO; 2];

/// e^(i angle), [cosine, sine].
pub(crate) fn cis(angle: f64) -> [f64; 2] {
    let (sine, cosine) = math::sin_cos(angle);
    [cosine, sine]
}

/// Sums over a factor take time proportional to its square; past this one Bluestein's method is faster.
const LARGEST_FACTOR: usize = 61;

/// The transform of one length.
pub(crate) struct Fft {
    level: SimdLevel,
    len: usize,
    /// The radices of the passes; none if Bluestein's method is used.
    factors: Vec<usize>,
    /// e^(-2 pi i k / n).
    roots: Vec<[f64; 2]>,
    bluestein: Option<Box<Bluestein>>,
}

/// With j k = (j^2 + k^2 - (k - j)^2) / 2 the transform is a convolution: X_k = c_k sum over j of x_j c_j /
/// c_(k-j).
struct Bluestein {
    /// c_j = e^(-pi i j^2 / n).
    chirp: Vec<[f64; 2]>,
    /// The transform of 1 / c, which has period n or 2 n, divided by its length.
    spectrum: Vec<[f64; 2]>,
    fft: Fft,
}

impl Fft {
    /// The transform of sequences of `len` numbers.
    pub(crate) fn new(level: SimdLevel, len: usize) -> Self {
        let (mut factors, mut rest) = (Vec::new(), len.max(1));
        for factor in [4, 2].into_iter().chain((3..=LARGEST_FACTOR).step_by(2)) {
            while rest.is_multiple_of(factor) {
                factors.push(factor);
                rest /= factor;
            }
        }
        if rest == 1 {
            let roots = (0..len).map(|k| cis(-2.0 * PI * k as f64 / len as f64)).collect();
            return Self { level, len, factors, roots, bluestein: None };
        }
        let chirp: Vec<[f64; 2]> =
            (0..len).map(|j| cis(-PI * (j * j % (2 * len)) as f64 / len as f64)).collect();
        let fft = Self::new(level, (2 * len - 1).next_power_of_two());
        let mut inverse = vec![ZERO; fft.len];
        for (j, [cosine, sine]) in chirp.iter().enumerate() {
            let value = [F64x4([*cosine; LANES]), F64x4([-sine; LANES])];
            inverse[j] = value;
            inverse[(fft.len - j) % fft.len] = value;
        }
        fft.run(&mut inverse, &mut Vec::new());
        let spectrum = inverse.iter().map(|value| value.map(|part| part.0[0] / fft.len as f64)).collect();
        let bluestein = Some(Box::new(Bluestein { chirp, spectrum, fft }));
        Self { level, len, factors: Vec::new(), roots: Vec::new(), bluestein }
    }

    /// Transforms `data`; what `scratch` holds before and after is arbitrary.
    pub(crate) fn run(&self, data: &mut Vec<Complex4>, scratch: &mut Vec<Complex4>) {
        debug_assert_eq!(data.len(), self.len);
        let Some(bluestein) = &self.bluestein else {
            scratch.resize(self.len, ZERO);
            self.level.run(Passes { fft: self, data, scratch });
            if self.factors.len() % 2 == 1 {
                std::mem::swap(data, scratch);
            }
            return;
        };
        let Bluestein { chirp, spectrum, fft } = &**bluestein;
        let mut wide = vec![ZERO; fft.len];
        for ((to, from), chirp) in wide.iter_mut().zip(&*data).zip(chirp) {
            *to = times(from, *chirp);
        }
        fft.run(&mut wide, scratch);
        wide.iter_mut().zip(spectrum).for_each(|(value, factor)| *value = times(value, *factor));
        // The transform of a transform is the sequence in reverse.
        fft.run(&mut wide, scratch);
        for (k, (to, chirp)) in data.iter_mut().zip(chirp).enumerate() {
            *to = times(&wide[(fft.len - k) % fft.len], *chirp);
        }
    }
}

/// The product with one complex number.
pub(crate) fn times([re, im]: &Complex4, [x, y]: [f64; 2]) -> Complex4 {
    [F64x4::from_fn(|i| re.0[i] * x - im.0[i] * y), F64x4::from_fn(|i| re.0[i] * y + im.0[i] * x)]
}

/// All passes, to and fro between two buffers of the same length.
struct Passes<'a> {
    fft: &'a Fft,
    data: &'a mut [Complex4],
    scratch: &'a mut [Complex4],
}

/// Four complex numbers in registers.
type Vector<S> = [<S as Simd>::f64s; 2];

impl WithSimd for Passes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fft, data: mut from, scratch: mut to } = self;
        let (mut m, mut s) = (fft.len, 1);
        for &radix in &fft.factors {
            m /= radix;
            match radix {
                4 => pass4(simd, &fft.roots, (m, s), from, to),
                2 => pass2(simd, &fft.roots, (m, s), from, to),
                _ => pass_odd(simd, &fft.roots, (m, s, radix), from, to),
            }
            s *= radix;
            std::mem::swap(&mut from, &mut to);
        }
    }
}

#[inline(always)]
fn read<S: Simd>(simd: S, value: &Complex4) -> Vector<S> {
    [load(simd, &value[0]), load(simd, &value[1])]
}

#[inline(always)]
fn write<S: Simd>(simd: S, vector: Vector<S>, value: &mut Complex4) {
    store(simd, vector[0], &mut value[0]);
    store(simd, vector[1], &mut value[1]);
}

#[inline(always)]
fn add<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [simd.add_f64s(a[0], b[0]), simd.add_f64s(a[1], b[1])]
}

#[inline(always)]
fn sub<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [simd.sub_f64s(a[0], b[0]), simd.sub_f64s(a[1], b[1])]
}

#[inline(always)]
fn mul<S: Simd>(simd: S, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [
        simd.negate_mul_add_f64s(a[1], b[1], simd.mul_f64s(a[0], b[0])),
        simd.mul_add_f64s(a[0], b[1], simd.mul_f64s(a[1], b[0])),
    ]
}

#[inline(always)]
fn splat<S: Simd>(simd: S, value: [f64; 2]) -> Vector<S> {
    value.map(|part| simd.splat_f64s(part))
}

#[inline(always)]
fn pass2<S: Simd>(simd: S, roots: &[[f64; 2]], (m, s): (usize, usize), x: &[Complex4], y: &mut [Complex4]) {
    let (x0, x1) = x.split_at(s * m);
    for (p, y) in y.chunks_exact_mut(2 * s).enumerate() {
        let w = splat(simd, roots[p * s]);
        let (y0, y1) = y.split_at_mut(s);
        let (x0, x1) = (&x0[s * p..][..s], &x1[s * p..][..s]);
        for q in 0..s {
            let (a, b) = (read(simd, &x0[q]), read(simd, &x1[q]));
            write(simd, add(simd, a, b), &mut y0[q]);
            write(simd, mul(simd, sub(simd, a, b), w), &mut y1[q]);
        }
    }
}

#[inline(always)]
fn pass4<S: Simd>(simd: S, roots: &[[f64; 2]], (m, s): (usize, usize), x: &[Complex4], y: &mut [Complex4]) {
    let (x0, x) = x.split_at(s * m);
    let (x1, x) = x.split_at(s * m);
    let (x2, x3) = x.split_at(s * m);
    if s == 1 {
        let (lower, upper) = (x0.iter().zip(x1), x2.iter().zip(x3));
        let w = roots.iter().zip(roots.iter().step_by(2)).zip(roots.iter().step_by(3));
        for ((((x0, x1), (x2, x3)), y), ((w1, w2), w3)) in lower.zip(upper).zip(y.chunks_exact_mut(4)).zip(w)
        {
            let x = [x0, x1, x2, x3].map(|x| read(simd, x));
            let [y0, y1, y2, y3] = butterfly4(simd, x);
            write(simd, y0, &mut y[0]);
            write(simd, mul(simd, y1, splat(simd, *w1)), &mut y[1]);
            write(simd, mul(simd, y2, splat(simd, *w2)), &mut y[2]);
            write(simd, mul(simd, y3, splat(simd, *w3)), &mut y[3]);
        }
        return;
    }
    for (p, y) in y.chunks_exact_mut(4 * s).enumerate() {
        let [x0, x1, x2, x3] = [x0, x1, x2, x3].map(|x| &x[s * p..][..s]);
        let (y0, y) = y.split_at_mut(s);
        let (y1, y) = y.split_at_mut(s);
        let (y2, y3) = y.split_at_mut(s);
        let y3 = &mut y3[..s];
        if p == 0 {
            for q in 0..s {
                let values = butterfly4(simd, [&x0[q], &x1[q], &x2[q], &x3[q]].map(|x| read(simd, x)));
                write(simd, values[0], &mut y0[q]);
                write(simd, values[1], &mut y1[q]);
                write(simd, values[2], &mut y2[q]);
                write(simd, values[3], &mut y3[q]);
            }
            continue;
        }
        let [w1, w2, w3] = [1, 2, 3].map(|k| splat(simd, roots[p * k * s]));
        for q in 0..s {
            let values = butterfly4(simd, [&x0[q], &x1[q], &x2[q], &x3[q]].map(|x| read(simd, x)));
            write(simd, values[0], &mut y0[q]);
            write(simd, mul(simd, values[1], w1), &mut y1[q]);
            write(simd, mul(simd, values[2], w2), &mut y2[q]);
            write(simd, mul(simd, values[3], w3), &mut y3[q]);
        }
    }
}

/// The transform of four numbers.
#[inline(always)]
fn butterfly4<S: Simd>(simd: S, [a, b, c, d]: [Vector<S>; 4]) -> [Vector<S>; 4] {
    let (e, f) = (add(simd, a, c), sub(simd, a, c));
    let (g, h) = (add(simd, b, d), sub(simd, b, d));
    // f - i h and f + i h
    let lower = [simd.add_f64s(f[0], h[1]), simd.sub_f64s(f[1], h[0])];
    let upper = [simd.sub_f64s(f[0], h[1]), simd.add_f64s(f[1], h[0])];
    [add(simd, e, g), lower, sub(simd, e, g), upper]
}

/// An odd radix r: x_j and x_(r-j) have the same cosine and opposite sines, and so have the sums k and r - k.
#[inline(always)]
fn pass_odd<S: Simd>(
    simd: S,
    roots: &[[f64; 2]],
    (m, s, r): (usize, usize, usize),
    x: &[Complex4],
    y: &mut [Complex4],
) {
    const HALF: usize = LARGEST_FACTOR / 2;
    let zero = [simd.splat_f64s(0.0); 2];
    let (mut plus, mut minus) = ([zero; HALF], [zero; HALF]);
    let half = r / 2;
    for (p, y) in y.chunks_exact_mut(r * s).enumerate() {
        for q in 0..s {
            let at = |j: usize| read(simd, &x[s * (p + m * j) + q]);
            let first = at(0);
            let mut sum = first;
            for j in 1..=half {
                let (a, b) = (at(j), at(r - j));
                (plus[j - 1], minus[j - 1]) = (add(simd, a, b), sub(simd, a, b));
                sum = add(simd, sum, plus[j - 1]);
            }
            write(simd, sum, &mut y[q]);
            for k in 1..=half {
                let (mut even, mut odd, mut angle) = (first, zero, 0);
                for (plus, minus) in plus[..half].iter().zip(&minus[..half]) {
                    angle += k;
                    angle -= if angle >= r { r } else { 0 };
                    let [cosine, sine] = splat(simd, roots[angle * m * s]);
                    even = [0, 1].map(|i| simd.mul_add_f64s(plus[i], cosine, even[i]));
                    odd = [0, 1].map(|i| simd.mul_add_f64s(minus[i], sine, odd[i]));
                }
                // even + i odd, and even - i odd for r - k
                let lower = [simd.sub_f64s(even[0], odd[1]), simd.add_f64s(even[1], odd[0])];
                let upper = [simd.add_f64s(even[0], odd[1]), simd.sub_f64s(even[1], odd[0])];
                for (k, value) in [(k, lower), (r - k, upper)] {
                    let w = splat(simd, roots[p * k * s]);
                    write(simd, mul(simd, value, w), &mut y[s * k + q]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares transforms with the sum itself. Both err by some roundings of values of size sqrt(n), times
    /// log n or n.
    #[test]
    fn transforms_of_every_kind_of_length_are_the_sum() {
        for len in [1, 2, 3, 4, 5, 8, 12, 31, 62, 63, 64, 67, 75, 96, 122, 130, 134, 211, 512, 1018] {
            let wave = |k: usize| F64x4::from_fn(|lane| (((k + 3) * (lane + 5) * 7919 % 997) as f64).sin());
            let input: Vec<Complex4> = (0..len).map(|j| [wave(j), wave(j + len)]).collect();
            let mut results = [SimdLevel::detect(), SimdLevel::Portable].map(|level| {
                let mut data = input.clone();
                Fft::new(level, len).run(&mut data, &mut Vec::new());
                data
            });
            assert!(results[0] == results[1], "{len}: every level has the same arithmetic");
            for (k, found) in results[0].iter_mut().enumerate() {
                let mut expected = ZERO;
                for (j, value) in input.iter().enumerate() {
                    let term = times(value, cis(-2.0 * PI * (j * k % len) as f64 / len as f64));
                    (0..2).for_each(|i| (0..LANES).for_each(|l| expected[i].0[l] += term[i].0[l]));
                }
                for (found, expected) in found.iter().flat_map(|v| v.0).zip(expected.iter().flat_map(|v| v.0))
                {
                    assert!((found - expected).abs() < 4e-15 * len as f64, "{len}: {k}: {found} {expected}");
                }
            }
        }
    }
}
