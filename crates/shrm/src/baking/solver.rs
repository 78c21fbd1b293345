//! Relative least squares over the views of eight texels at once: conjugate gradients on the normal
//! equations.

use pulp::{Simd, WithSimd};

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

/// One channel of eight texels.
pub(super) struct Solve<'a> {
    /// The views with the harmonics of the map.
    pub(super) views: &'a ViewGrid,
    /// The same views with the harmonics of the soft field.
    pub(super) soft_views: &'a ViewGrid,
    pub(super) steps: usize,
    /// The radiance e below which black is black.
    pub(super) dark: f32,
    /// Coefficients of the soft field.
    pub(super) soft: &'a [F32x8],
    /// Whether the map holds the lamps too.
    pub(super) baked: bool,
    /// Becomes the solution.
    pub(super) coefficients: &'a mut [F32x8],
    /// The lamps' radiance at each view; becomes what the map is to show.
    pub(super) lit: &'a mut [F32x8],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { views, soft_views, steps, dark, soft, baked, coefficients: x, lit } = self;
        let zeros = |count: usize| vec![F32x8::ZERO; count];
        let (mut seen, mut weight, mut direction) = (zeros(lit.len()), zeros(lit.len()), zeros(x.len()));
        let (mut residual, mut image) = (zeros(x.len()), zeros(x.len()));

        // Rows up to the smaller P are the same in both.
        x.fill(F32x8::ZERO);
        x.iter_mut().zip(soft).for_each(|(x, soft)| *x = *soft);
        if baked {
            // x begins at the projection of the lamps too.
            let scale = simd.splat_f32s(views.solid_angle);
            for (value, lit) in weight.iter_mut().zip(lit.iter()) {
                store(simd, simd.mul_f32s(scale, load(simd, lit)), value);
            }
            adjoin(simd, views, &weight, &mut image);
            for (x, image) in x.iter_mut().zip(&image) {
                store(simd, simd.add_f32s(load(simd, x), load(simd, image)), x);
            }
        }
        // The weights are those of all light; b is what the map is to show of it.
        synthesise(simd, soft_views, soft, &mut seen);
        for (lit, seen) in lit.iter_mut().zip(&mut seen) {
            store(simd, simd.add_f32s(load(simd, lit), load(simd, seen)), lit);
        }
        weigh(simd, views, lit, dark, &mut weight);
        if !baked {
            lit.copy_from_slice(&seen);
        }

        synthesise(simd, views, x, &mut seen);
        for ((seen, lit), weight) in seen.iter_mut().zip(lit.iter()).zip(&weight) {
            let missing = simd.sub_f32s(load(simd, lit), load(simd, seen));
            store(simd, simd.mul_f32s(load(simd, weight), missing), seen);
        }
        adjoin(simd, views, &seen, &mut residual);
        direction.copy_from_slice(&residual);
        let mut square = dot(simd, &residual, &residual);
        for _ in 0..steps {
            synthesise(simd, views, &direction, &mut seen);
            for (seen, weight) in seen.iter_mut().zip(&weight) {
                store(simd, simd.mul_f32s(load(simd, weight), load(simd, seen)), seen);
            }
            adjoin(simd, views, &seen, &mut image);
            let step = ratio(square, dot(simd, &direction, &image));
            let step_v = load(simd, &step);
            for (i, x) in x.iter_mut().enumerate() {
                store(simd, simd.mul_add_f32s(step_v, load(simd, &direction[i]), load(simd, x)), x);
                let less = simd.mul_f32s(step_v, load(simd, &image[i]));
                store(simd, simd.sub_f32s(load(simd, &residual[i]), less), &mut residual[i]);
            }
            let next = dot(simd, &residual, &residual);
            let share = ratio(next, square);
            let share = load(simd, &share);
            square = next;
            for (direction, residual) in direction.iter_mut().zip(&residual) {
                store(simd, simd.mul_add_f32s(share, load(simd, direction), load(simd, residual)), direction);
            }
        }
    }
}

#[inline(always)]
fn load<S: Simd>(_: S, value: &F32x8) -> S::f32s {
    pulp::cast(value.0)
}

#[inline(always)]
fn store<S: Simd>(_: S, vector: S::f32s, value: &mut F32x8) {
    value.0 = pulp::cast(vector);
}

/// A quotient for each texel; 0 where nothing is left to solve.
fn ratio(over: F32x8, under: F32x8) -> F32x8 {
    let quotient = |lane: usize| if under.0[lane] > 0.0 { over.0[lane] / under.0[lane] } else { 0.0 };
    F32x8(std::array::from_fn(quotient).map(|q: f32| if q.is_finite() { q } else { 0.0 }))
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[F32x8], b: &[F32x8]) -> F32x8 {
    let mut sum = simd.splat_f32s(0.0);
    for (a, b) in a.iter().zip(b) {
        sum = simd.mul_add_f32s(load(simd, a), load(simd, b), sum);
    }
    let mut out = F32x8::ZERO;
    store(simd, sum, &mut out);
    out
}

/// 1 / (b + e)^2 times the views' own weights, over the largest of a texel.
#[inline(always)]
fn weigh<S: Simd>(simd: S, views: &ViewGrid, lit: &[F32x8], dark: f32, weight: &mut [F32x8]) {
    let per_row = lit.len() / views.rows.len();
    let mut largest = F32x8::ZERO;
    for (index, (weight, lit)) in weight.iter_mut().zip(lit).enumerate() {
        let own = views.rows[index / per_row].1 as f32;
        for lane in 0..LANES {
            let seen = lit.0[lane].max(0.0) + dark.max(f32::MIN_POSITIVE);
            weight.0[lane] = own * (dark / seen) * (dark / seen);
            largest.0[lane] = largest.0[lane].max(weight.0[lane]);
        }
    }
    let scale = F32x8(largest.0.map(|most| if most > 0.0 { views.solid_angle / most } else { 0.0 }));
    let scale = load(simd, &scale);
    for weight in weight {
        store(simd, simd.mul_f32s(scale, load(simd, weight)), weight);
    }
}

/// The most orders of a map: P = 16 and what a manifest may ask for beyond.
const MOST_ORDERS: usize = 64;

/// The sum over all rows at each view.
#[inline(always)]
fn synthesise<S: Simd>(simd: S, views: &ViewGrid, x: &[F32x8], out: &mut [F32x8]) {
    let (orders, quarters) = (views.orders().min(MOST_ORDERS), views.quarter.len());
    let mut cosine = [F32x8::ZERO; MOST_ORDERS + 1];
    let mut sine = [F32x8::ZERO; MOST_ORDERS + 1];
    for (row, out) in out.chunks_exact_mut(quarters * MIRRORED).enumerate() {
        let mut functions = views.functions_of(row).iter();
        for q in 0..=orders {
            let mut sums = [simd.splat_f32s(0.0); 2];
            for (p, function) in (q..=views.p).zip(&mut functions) {
                let (function, q) = (simd.splat_f32s(*function), q as isize);
                sums[0] = simd.mul_add_f32s(function, load(simd, &x[views.coefficient(p, q)]), sums[0]);
                if q > 0 {
                    let sine = load(simd, &x[views.coefficient(p, -q)]);
                    sums[1] = simd.mul_add_f32s(function, sine, sums[1]);
                }
            }
            store(simd, sums[0], &mut cosine[q]);
            store(simd, sums[1], &mut sine[q]);
        }
        for (waves, out) in views.waves.chunks_exact(orders + 1).zip(out.chunks_exact_mut(MIRRORED)) {
            // Cosines and sines of even and of odd q.
            let mut c = [simd.splat_f32s(0.0); 2];
            let mut s = [simd.splat_f32s(0.0); 2];
            for (q, [cos, sin]) in waves.iter().enumerate() {
                c[q % 2] = simd.mul_add_f32s(simd.splat_f32s(*cos), load(simd, &cosine[q]), c[q % 2]);
                s[q % 2] = simd.mul_add_f32s(simd.splat_f32s(*sin), load(simd, &sine[q]), s[q % 2]);
            }
            let (even, odd) = (simd.add_f32s(c[0], s[1]), simd.add_f32s(c[1], s[0]));
            let (even_less, odd_less) = (simd.sub_f32s(c[0], s[1]), simd.sub_f32s(c[1], s[0]));
            // phi: all; pi - phi: odd cosines and even sines change sign; pi + phi: all odd; -phi: all sines.
            store(simd, simd.add_f32s(even, odd), &mut out[0]);
            store(simd, simd.sub_f32s(even, odd), &mut out[1]);
            store(simd, simd.sub_f32s(even_less, odd_less), &mut out[2]);
            store(simd, simd.add_f32s(even_less, odd_less), &mut out[3]);
        }
    }
}

/// The adjoint: for each row the sum over all views.
#[inline(always)]
fn adjoin<S: Simd>(simd: S, views: &ViewGrid, seen: &[F32x8], out: &mut [F32x8]) {
    let (orders, quarters) = (views.orders().min(MOST_ORDERS), views.quarter.len());
    out.fill(F32x8::ZERO);
    for (row, seen) in seen.chunks_exact(quarters * MIRRORED).enumerate() {
        let mut cosine = [F32x8::ZERO; MOST_ORDERS + 1];
        let mut sine = [F32x8::ZERO; MOST_ORDERS + 1];
        for (waves, seen) in views.waves.chunks_exact(orders + 1).zip(seen.chunks_exact(MIRRORED)) {
            let (a, b) = (load(simd, &seen[0]), load(simd, &seen[1]));
            let (c, d) = (load(simd, &seen[2]), load(simd, &seen[3]));
            let (ab, cd) = (simd.add_f32s(a, b), simd.add_f32s(c, d));
            let (ab_less, dc_less) = (simd.sub_f32s(a, b), simd.sub_f32s(d, c));
            let cosines = [simd.add_f32s(ab, cd), simd.add_f32s(ab_less, dc_less)];
            let sines = [simd.sub_f32s(ab_less, dc_less), simd.sub_f32s(ab, cd)];
            for (q, [cos, sin]) in waves.iter().enumerate() {
                let sum = simd.mul_add_f32s(simd.splat_f32s(*cos), cosines[q % 2], load(simd, &cosine[q]));
                store(simd, sum, &mut cosine[q]);
                let sum = simd.mul_add_f32s(simd.splat_f32s(*sin), sines[q % 2], load(simd, &sine[q]));
                store(simd, sum, &mut sine[q]);
            }
        }
        let mut functions = views.functions_of(row).iter();
        for q in 0..=orders {
            let (cosine, sine) = (load(simd, &cosine[q]), load(simd, &sine[q]));
            for (p, function) in (q..=views.p).zip(&mut functions) {
                let (function, q) = (simd.splat_f32s(*function), q as isize);
                let right = &mut out[views.coefficient(p, q)];
                store(simd, simd.mul_add_f32s(function, cosine, load(simd, right)), right);
                if q > 0 {
                    let left = &mut out[views.coefficient(p, -q)];
                    store(simd, simd.mul_add_f32s(function, sine, load(simd, left)), left);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use sh::f64x4::SimdLevel;
    use sh::{Basis, Degree};
    use sphere::Direction;

    use super::*;
    use crate::Terms;

    struct Both<'a>(&'a ViewGrid, &'a [F32x8], &'a [F32x8], &'a mut [F32x8], &'a mut [F32x8]);

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
            let rows = if terms == Terms::Zonal { p + 1 } else { (p + 1) * (p + 1) };
            let (x, v) = (noise(rows, 3), noise(views.len(), 11));
            let (mut seen, mut sums) = (vec![F32x8::ZERO; views.len()], vec![F32x8::ZERO; rows]);
            SimdLevel::detect().run(Both(&views, &x, &v, &mut seen, &mut sums));
            let inner = |a: &[F32x8], b: &[F32x8]| -> f64 {
                a.iter().zip(b).map(|(a, b)| f64::from(a.0[2]) * f64::from(b.0[2])).sum()
            };
            let (left, right) = (inner(&seen, &v), inner(&x, &sums));
            assert!((left - right).abs() < 1e-4 * (rows * views.len()) as f64, "{left} {right}");

            let degree = Degree::new(p).unwrap();
            let mut y = vec![0.0; degree.rows()];
            for (row, (theta, _)) in views.rows.iter().enumerate().step_by(7) {
                for (k, phi) in views.azimuths(0).into_iter().enumerate() {
                    Basis::new(degree).evaluate_into(Direction::from_angles(*theta, phi), &mut y);
                    let expected: f64 = (0..=p)
                        .flat_map(|p| (-(p as isize)..=p as isize).map(move |q| (p, q)))
                        .filter(|(_, q)| terms == Terms::All || *q == 0)
                        .map(|(p, q)| {
                            f64::from(x[views.coefficient(p, q)].0[5]) * y[(p * p + p).wrapping_add_signed(q)]
                        })
                        .sum();
                    let found = f64::from(seen[row * views.quarter.len() * MIRRORED + k].0[5]);
                    assert!((found - expected).abs() < 1e-4 * rows as f64, "{found} {expected}");
                }
            }
        }
    }
}
