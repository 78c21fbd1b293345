//! The discrete Fourier transform of many sequences at once: one in each lane of vectors, and several of
//! those interleaved.
//!
//! X_k = sum over j of x_j e^(-2 pi i j k / n), by Stockham's method, which sorts as it goes and needs no
//! shuffle within a vector: one pass for each factor r of n = r m writes
//!
//! ```text
//! y[s (r p + k) + q] = e^(-2 pi i p k / n) sum over j of x[s (p + m j) + q] e^(-2 pi i j k / r),
//! p < m, k < r, q < s,
//! ```
//!
//! and leaves r s sequences of length m, interleaved; with c sequences interleaved from the start, the first
//! s is c. A length with a prime factor past [`LARGEST_FACTOR`]
//! becomes a convolution of a length that is a power of two (Bluestein 1970).

use std::f64::consts::PI;

use pulp::{Simd, WithSimd};

use crate::f64x4::{F64x4, LANES, SimdLevel};
use crate::vector::{Real, Vector};

/// Complex numbers: real parts, imaginary parts.
pub(crate) type Complex<V> = [V; 2];

/// Four complex numbers.
pub(crate) type Complex4 = Complex<F64x4>;

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
pub(crate) struct Fft<V: Vector = F64x4> {
    level: SimdLevel,
    len: usize,
    /// The radices of the passes; none if Bluestein's method is used.
    factors: Vec<usize>,
    /// e^(-2 pi i k / n).
    roots: Vec<[V::Scalar; 2]>,
    bluestein: Option<Box<Bluestein<V>>>,
}

/// With j k = (j^2 + k^2 - (k - j)^2) / 2 the transform is a convolution: X_k = c_k sum over j of x_j c_j /
/// c_(k-j).
struct Bluestein<V: Vector> {
    /// c_j = e^(-pi i j^2 / n).
    chirp: Vec<[V::Scalar; 2]>,
    /// The transform of 1 / c, which has period n or 2 n, divided by its length.
    spectrum: Vec<[V::Scalar; 2]>,
    fft: Fft<V>,
}

impl<V: Vector> Fft<V> {
    /// The transform of sequences of `len` numbers.
    pub(crate) fn new(level: SimdLevel, len: usize) -> Self {
        let (mut factors, mut rest) = (Vec::new(), len.max(1));
        for factor in [4, 2].into_iter().chain((3..=LARGEST_FACTOR).step_by(2)) {
            while rest.is_multiple_of(factor) {
                factors.push(factor);
                rest /= factor;
            }
        }
        let scalars =
            |values: Vec<[f64; 2]>| values.iter().map(|value| value.map(V::Scalar::from_f64)).collect();
        if rest == 1 {
            let roots = (0..len).map(|k| cis(-2.0 * PI * k as f64 / len as f64)).collect();
            return Self { level, len, factors, roots: scalars(roots), bluestein: None };
        }
        let chirp: Vec<[f64; 2]> =
            (0..len).map(|j| cis(-PI * (j * j % (2 * len)) as f64 / len as f64)).collect();
        let wide = (2 * len - 1).next_power_of_two();
        let mut inverse = vec![ZERO; wide];
        for (j, value) in chirp.iter().enumerate() {
            let value = [value[0], -value[1]].map(|part| F64x4([part; LANES]));
            inverse[j] = value;
            inverse[(wide - j) % wide] = value;
        }
        Fft::<F64x4>::new(level, wide).run(&mut inverse, &mut Vec::new());
        let spectrum = inverse.iter().map(|value| value.map(|part| part.0[0] / wide as f64)).collect();
        let bluestein =
            Bluestein { chirp: scalars(chirp), spectrum: scalars(spectrum), fft: Self::new(level, wide) };
        Self { level, len, factors: Vec::new(), roots: Vec::new(), bluestein: Some(Box::new(bluestein)) }
    }

    /// Transforms the sequences that are interleaved in `data`, as many as its length has room for; what
    /// `scratch` holds before and after is arbitrary.
    pub(crate) fn run(&self, data: &mut Vec<Complex<V>>, scratch: &mut Vec<Complex<V>>) {
        let zero = [V::ZERO; 2];
        let count = data.len() / self.len.max(1);
        debug_assert_eq!(data.len(), count * self.len);
        let Some(bluestein) = &self.bluestein else {
            scratch.resize(data.len(), zero);
            self.level.run(Passes { fft: self, count, data, scratch });
            if self.factors.len() % 2 == 1 {
                std::mem::swap(data, scratch);
            }
            return;
        };
        let Bluestein { chirp, spectrum, fft } = &**bluestein;
        let mut wide = vec![zero; count * fft.len];
        wide[..data.len()].copy_from_slice(data);
        self.level.run(Multiply { data: &mut wide, factors: chirp, count });
        fft.run(&mut wide, scratch);
        self.level.run(Multiply { data: &mut wide, factors: spectrum, count });
        // The transform of a transform is the sequence in reverse.
        fft.run(&mut wide, scratch);
        data[..count].copy_from_slice(&wide[..count]);
        for (to, from) in data.chunks_exact_mut(count).skip(1).zip(wide.chunks_exact(count).rev()) {
            to.copy_from_slice(from);
        }
        self.level.run(Multiply { data, factors: chirp, count });
    }
}

/// The product with one complex number.
pub(crate) fn times([re, im]: &Complex4, [x, y]: [f64; 2]) -> Complex4 {
    [F64x4::from_fn(|i| re.0[i] * x - im.0[i] * y), F64x4::from_fn(|i| re.0[i] * y + im.0[i] * x)]
}

/// Multiplies element j of each of `count` interleaved sequences by the j-th factor.
pub(crate) struct Multiply<'a, V: Vector> {
    pub(crate) data: &'a mut [Complex<V>],
    pub(crate) factors: &'a [[V::Scalar; 2]],
    pub(crate) count: usize,
}

impl<V: Vector> WithSimd for Multiply<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (values, factor) in self.data.chunks_exact_mut(self.count).zip(self.factors) {
            let factor = splat::<V, S>(simd, *factor);
            for value in values {
                for r in 0..V::REGISTERS {
                    let [re, im] = read::<V, S>(simd, r, value);
                    let mul = V::Scalar::mul::<S>;
                    let re_part = V::Scalar::sub(simd, mul(simd, re, factor[0]), mul(simd, im, factor[1]));
                    let im_part = V::Scalar::add(simd, mul(simd, re, factor[1]), mul(simd, im, factor[0]));
                    write(simd, r, [re_part, im_part], value);
                }
            }
        }
    }
}

/// All passes, to and fro between two buffers of the same length.
struct Passes<'a, V: Vector> {
    fft: &'a Fft<V>,
    count: usize,
    data: &'a mut [Complex<V>],
    scratch: &'a mut [Complex<V>],
}

/// Complex numbers in registers.
type Complexes<V, S> = [<<V as Vector>::Scalar as Real>::Register<S>; 2];

/// What a pass has to know: m, s and the number of sequences at the start.
#[derive(Clone, Copy)]
struct Pass<'a, T> {
    roots: &'a [[T; 2]],
    m: usize,
    s: usize,
    count: usize,
}

impl<T: Copy> Pass<'_, T> {
    /// e^(-2 pi i p k / (r m)).
    #[inline(always)]
    fn root(&self, pk: usize) -> [T; 2] {
        self.roots[pk * (self.s / self.count)]
    }
}

impl<V: Vector> WithSimd for Passes<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fft, count, data: mut from, scratch: mut to } = self;
        let mut pass = Pass { roots: &fft.roots[..], m: fft.len, s: count, count };
        for &radix in &fft.factors {
            pass.m /= radix;
            match radix {
                4 => pass4(simd, pass, from, to),
                2 => pass2(simd, pass, from, to),
                _ => pass_odd(simd, pass, radix, from, to),
            }
            pass.s *= radix;
            std::mem::swap(&mut from, &mut to);
        }
    }
}

#[inline(always)]
fn read<V: Vector, S: Simd>(simd: S, r: usize, value: &Complex<V>) -> Complexes<V, S> {
    [Real::load(simd, value[0].lanes(), r), Real::load(simd, value[1].lanes(), r)]
}

#[inline(always)]
fn write<V: Vector, S: Simd>(simd: S, r: usize, vector: Complexes<V, S>, value: &mut Complex<V>) {
    for (part, vector) in value.iter_mut().zip(vector) {
        Real::store(simd, vector, part.lanes_mut(), r);
    }
}

#[inline(always)]
fn add<V: Vector, S: Simd>(simd: S, a: Complexes<V, S>, b: Complexes<V, S>) -> Complexes<V, S> {
    [V::Scalar::add(simd, a[0], b[0]), V::Scalar::add(simd, a[1], b[1])]
}

#[inline(always)]
fn sub<V: Vector, S: Simd>(simd: S, a: Complexes<V, S>, b: Complexes<V, S>) -> Complexes<V, S> {
    [V::Scalar::sub(simd, a[0], b[0]), V::Scalar::sub(simd, a[1], b[1])]
}

#[inline(always)]
fn mul<V: Vector, S: Simd>(simd: S, a: Complexes<V, S>, b: Complexes<V, S>) -> Complexes<V, S> {
    [
        V::Scalar::negate_mul_add(simd, a[1], b[1], V::Scalar::mul(simd, a[0], b[0])),
        V::Scalar::mul_add(simd, a[0], b[1], V::Scalar::mul(simd, a[1], b[0])),
    ]
}

#[inline(always)]
fn splat<V: Vector, S: Simd>(simd: S, value: [V::Scalar; 2]) -> Complexes<V, S> {
    value.map(|part| V::Scalar::splat(simd, part))
}

#[inline(always)]
fn pass2<V: Vector, S: Simd>(simd: S, pass: Pass<'_, V::Scalar>, x: &[Complex<V>], y: &mut [Complex<V>]) {
    let s = pass.s;
    let (x0, x1) = x.split_at(s * pass.m);
    for (p, y) in y.chunks_exact_mut(2 * s).enumerate() {
        let w = splat::<V, S>(simd, pass.root(p));
        let (y0, y1) = y.split_at_mut(s);
        let (x0, x1) = (&x0[s * p..][..s], &x1[s * p..][..s]);
        for q in 0..s {
            for r in 0..V::REGISTERS {
                let (a, b) = (read(simd, r, &x0[q]), read(simd, r, &x1[q]));
                write(simd, r, add::<V, S>(simd, a, b), &mut y0[q]);
                write(simd, r, mul::<V, S>(simd, sub::<V, S>(simd, a, b), w), &mut y1[q]);
            }
        }
    }
}

#[inline(always)]
fn pass4<V: Vector, S: Simd>(simd: S, pass: Pass<'_, V::Scalar>, x: &[Complex<V>], y: &mut [Complex<V>]) {
    let s = pass.s;
    let (x0, x) = x.split_at(s * pass.m);
    let (x1, x) = x.split_at(s * pass.m);
    let (x2, x3) = x.split_at(s * pass.m);
    for (p, y) in y.chunks_exact_mut(4 * s).enumerate() {
        let [x0, x1, x2, x3] = [x0, x1, x2, x3].map(|x| &x[s * p..][..s]);
        let (y0, y) = y.split_at_mut(s);
        let (y1, y) = y.split_at_mut(s);
        let (y2, y3) = y.split_at_mut(s);
        let y3 = &mut y3[..s];
        if p == 0 {
            for q in 0..s {
                for r in 0..V::REGISTERS {
                    let values = butterfly4(simd, r, [&x0[q], &x1[q], &x2[q], &x3[q]]);
                    write(simd, r, values[0], &mut y0[q]);
                    write(simd, r, values[1], &mut y1[q]);
                    write(simd, r, values[2], &mut y2[q]);
                    write(simd, r, values[3], &mut y3[q]);
                }
            }
            continue;
        }
        let [w1, w2, w3] = [1, 2, 3].map(|k| splat::<V, S>(simd, pass.root(p * k)));
        for q in 0..s {
            for r in 0..V::REGISTERS {
                let values = butterfly4(simd, r, [&x0[q], &x1[q], &x2[q], &x3[q]]);
                write(simd, r, values[0], &mut y0[q]);
                write(simd, r, mul::<V, S>(simd, values[1], w1), &mut y1[q]);
                write(simd, r, mul::<V, S>(simd, values[2], w2), &mut y2[q]);
                write(simd, r, mul::<V, S>(simd, values[3], w3), &mut y3[q]);
            }
        }
    }
}

/// The transform of four numbers.
#[inline(always)]
fn butterfly4<V: Vector, S: Simd>(simd: S, r: usize, [a, b, c, d]: [&Complex<V>; 4]) -> [Complexes<V, S>; 4] {
    let (a, b, c, d) = (read(simd, r, a), read(simd, r, b), read(simd, r, c), read(simd, r, d));
    let (e, f) = (add::<V, S>(simd, a, c), sub::<V, S>(simd, a, c));
    let (g, h) = (add::<V, S>(simd, b, d), sub::<V, S>(simd, b, d));
    // f - i h and f + i h
    let lower = [V::Scalar::add(simd, f[0], h[1]), V::Scalar::sub(simd, f[1], h[0])];
    let upper = [V::Scalar::sub(simd, f[0], h[1]), V::Scalar::add(simd, f[1], h[0])];
    [add::<V, S>(simd, e, g), lower, sub::<V, S>(simd, e, g), upper]
}

/// An odd radix r: x_j and x_(r-j) have the same cosine and opposite sines, and so have the sums k and r - k.
#[inline(always)]
fn pass_odd<V: Vector, S: Simd>(
    simd: S,
    pass: Pass<'_, V::Scalar>,
    radix: usize,
    x: &[Complex<V>],
    y: &mut [Complex<V>],
) {
    const HALF: usize = LARGEST_FACTOR / 2;
    let Pass { m, s, .. } = pass;
    let zero = [V::Scalar::splat(simd, V::Scalar::from_f64(0.0)); 2];
    let (mut plus, mut minus) = ([zero; HALF], [zero; HALF]);
    let half = radix / 2;
    for (p, y) in y.chunks_exact_mut(radix * s).enumerate() {
        for (q, r) in (0..s).flat_map(|q| (0..V::REGISTERS).map(move |r| (q, r))) {
            let at = |j: usize| read::<V, S>(simd, r, &x[s * (p + m * j) + q]);
            let first = at(0);
            let mut sum = first;
            for j in 1..=half {
                let (a, b) = (at(j), at(radix - j));
                (plus[j - 1], minus[j - 1]) = (add::<V, S>(simd, a, b), sub::<V, S>(simd, a, b));
                sum = add::<V, S>(simd, sum, plus[j - 1]);
            }
            write(simd, r, sum, &mut y[q]);
            for k in 1..=half {
                let (mut even, mut odd, mut angle) = (first, zero, 0);
                for (plus, minus) in plus[..half].iter().zip(&minus[..half]) {
                    angle += k;
                    angle -= if angle >= radix { radix } else { 0 };
                    let [cosine, sine] = splat::<V, S>(simd, pass.root(angle * m));
                    even = [0, 1].map(|i| V::Scalar::mul_add(simd, plus[i], cosine, even[i]));
                    odd = [0, 1].map(|i| V::Scalar::mul_add(simd, minus[i], sine, odd[i]));
                }
                // even + i odd, and even - i odd for r - k
                let lower = [V::Scalar::sub(simd, even[0], odd[1]), V::Scalar::add(simd, even[1], odd[0])];
                let upper = [V::Scalar::add(simd, even[0], odd[1]), V::Scalar::sub(simd, even[1], odd[0])];
                for (k, value) in [(k, lower), (radix - k, upper)] {
                    let w = splat::<V, S>(simd, pass.root(p * k));
                    write(simd, r, mul::<V, S>(simd, value, w), &mut y[s * k + q]);
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
                Fft::<F64x4>::new(level, len).run(&mut data, &mut Vec::new());
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
