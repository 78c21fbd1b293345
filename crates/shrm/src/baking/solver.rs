//! Relative least squares over the views of eight texels at once: conjugate gradients on the normal
//! equations, preconditioned by the factor of their matrix if P is small ([`NormalMatrix`]).

use pulp::{Simd, WithSimd};

use super::normal_matrix::NormalMatrix;
use super::view_grid::ViewGrid;
use super::view_sums::{F32x8, LANES, adjoin, load, store, synthesise};

/// The most steps of the method of conjugate gradients.
const STEPS: usize = 32;

/// Steps after which the error is compared with the one before them; with a factor it is after each step.
const CHECKED: usize = 4;

/// The part of the squared error that is left if these steps gained too little to go on.
const GAINED: f32 = 0.95;

/// One channel of eight texels.
pub(super) struct Solve<'a> {
    pub(super) views: &'a ViewGrid,
    pub(super) matrix: Option<&'a NormalMatrix>,
    /// The radiance e below which a value counts as black.
    pub(super) dark: f32,
    /// The soft field's harmonics at the same views, and its coefficients, in pairs as
    /// [`ViewGrid::rows_of_pairs`] has them.
    pub(super) field: (&'a ViewGrid, &'a [[F32x8; 2]]),
    /// The soft field's coefficients that the map has too; becomes the solution.
    pub(super) coefficients: &'a mut [[F32x8; 2]],
    /// The lamps' radiance at each view; becomes what the map lacks of all light.
    pub(super) lit: &'a mut [F32x8],
}

impl WithSimd for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { views, matrix, dark, field, coefficients: x, lit } = self;
        let (mut seen, mut weight) = (vec![F32x8::ZERO; lit.len()], vec![F32x8::ZERO; lit.len()]);
        let mut direction = vec![[F32x8::ZERO; 2]; x.len()];
        let mut gradient = direction.clone();

        // x begins at the projection: the soft field and that of the lamps.
        let scale = simd.splat_f32s(views.solid_angle);
        for (value, lit) in weight.iter_mut().zip(lit.iter()) {
            store(simd, simd.mul_f32s(scale, load(simd, lit)), value);
        }
        adjoin(simd, views, &weight, &mut gradient);
        synthesise(simd, field.0, field.1, &mut seen);
        for (lit, seen) in lit.iter_mut().zip(&seen) {
            store(simd, simd.add_f32s(load(simd, lit), load(simd, seen)), lit);
        }
        for (x, lamps) in x.as_flattened_mut().iter_mut().zip(gradient.as_flattened()) {
            store(simd, simd.add_f32s(load(simd, x), load(simd, lamps)), x);
        }
        weigh(simd, views, lit, dark, &mut weight);
        let factored = matrix.map(|matrix| (matrix, matrix.factor(simd, &weight)));
        let mut scaled = factored.as_ref().map(|_| gradient.clone()).unwrap_or_default();
        let checked = if factored.is_some() { 1 } else { CHECKED };

        // What is missing, lit - Y x, and its relative square.
        synthesise(simd, views, x, &mut seen);
        for (lit, seen) in lit.iter_mut().zip(&seen) {
            store(simd, simd.sub_f32s(load(simd, lit), load(simd, seen)), lit);
        }
        let missing = lit;
        let (mut square, mut error) = (F32x8::ZERO, F32x8([f32::INFINITY; LANES]));
        // 0 for a texel that has ended, so that none depends on those beside it.
        let mut goes_on = F32x8([1.0; LANES]);
        for step in 0..=STEPS {
            let mut relative = simd.splat_f32s(0.0);
            for ((seen, missing), weight) in seen.iter_mut().zip(&*missing).zip(&weight) {
                let weighted = simd.mul_f32s(load(simd, weight), load(simd, missing));
                relative = simd.mul_add_f32s(weighted, load(simd, missing), relative);
                store(simd, weighted, seen);
            }
            if step % checked == 0 {
                let before = std::mem::replace(&mut error, F32x8::ZERO);
                store(simd, relative, &mut error);
                for lane in (0..LANES).filter(|lane| error.0[*lane] >= GAINED * before.0[*lane]) {
                    goes_on.0[lane] = 0.0;
                }
                if step == STEPS || goes_on == F32x8::ZERO {
                    break;
                }
            }
            adjoin(simd, views, &seen, &mut gradient);
            let downhill = match &factored {
                Some((matrix, factor)) => {
                    matrix.solve(simd, factor, &gradient, &mut scaled);
                    &scaled
                }
                None => &gradient,
            };
            let next = dot(simd, &gradient, downhill);
            if factored.is_some() {
                // The most that the squared error can become less.
                for lane in (0..LANES).filter(|lane| next.0[*lane] <= (1.0 - GAINED) * error.0[*lane]) {
                    goes_on.0[lane] = 0.0;
                }
                if goes_on == F32x8::ZERO {
                    break;
                }
            }
            let share = load(simd, &ratio(next, square));
            square = next;
            for (direction, downhill) in direction.as_flattened_mut().iter_mut().zip(downhill.as_flattened())
            {
                store(simd, simd.mul_add_f32s(share, load(simd, direction), load(simd, downhill)), direction);
            }
            synthesise(simd, views, &direction, &mut seen);
            let mut length = simd.splat_f32s(0.0);
            for (seen, weight) in seen.iter().zip(&weight) {
                let weighted = simd.mul_f32s(load(simd, weight), load(simd, seen));
                length = simd.mul_add_f32s(weighted, load(simd, seen), length);
            }
            let mut step_length = F32x8::ZERO;
            store(simd, length, &mut step_length);
            let step_v = simd.mul_f32s(load(simd, &goes_on), load(simd, &ratio(square, step_length)));
            for (x, direction) in x.as_flattened_mut().iter_mut().zip(direction.as_flattened()) {
                store(simd, simd.mul_add_f32s(step_v, load(simd, direction), load(simd, x)), x);
            }
            for (missing, seen) in missing.iter_mut().zip(&seen) {
                let less = simd.negate_mul_add_f32s(step_v, load(simd, seen), load(simd, missing));
                store(simd, less, missing);
            }
        }
    }
}

/// A quotient for each texel; 0 where nothing is left to solve.
fn ratio(over: F32x8, under: F32x8) -> F32x8 {
    let quotient = |lane: usize| if under.0[lane] > 0.0 { over.0[lane] / under.0[lane] } else { 0.0 };
    F32x8(std::array::from_fn(quotient).map(|q: f32| if q.is_finite() { q } else { 0.0 }))
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[[F32x8; 2]], b: &[[F32x8; 2]]) -> F32x8 {
    let mut sum = simd.splat_f32s(0.0);
    for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
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

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use sh::f64x4::SimdLevel;

    use super::*;
    use crate::Terms;

    /// The coefficients of a fit to some light, and the relative square of what it misses in each lane.
    fn fitted(views: &ViewGrid, factored: bool, dark: f32, lit: &[F32x8]) -> (Vec<[F32x8; 2]>, [f64; LANES]) {
        let matrix = factored.then(|| NormalMatrix::new(views, Centre::Reflection).unwrap());
        let mut coefficients = vec![[F32x8::ZERO; 2]; views.counts().sum()];
        let (field, mut missing) = (coefficients.clone(), lit.to_vec());
        SimdLevel::detect().run(Solve {
            views,
            matrix: matrix.as_ref(),
            dark,
            field: (views, &field),
            coefficients: &mut coefficients,
            lit: &mut missing,
        });
        let mut squares = [0.0; LANES];
        for (missing, lit) in missing.iter().zip(lit) {
            for (lane, square) in squares.iter_mut().enumerate() {
                *square += f64::from(missing.0[lane] / (lit.0[lane] + dark)).powi(2);
            }
        }
        (coefficients, squares)
    }

    /// With a factor the square is as near to the least as the rule for the end allows, also beside a
    /// highlight that is ten thousand times as bright.
    #[test]
    fn a_factor_leaves_no_more_than_steps_without_it() {
        for (p, terms) in [(2, Terms::All), (4, Terms::All), (6, Terms::Zonal)] {
            let views = ViewGrid::new(p, p, terms, Centre::Reflection);
            let value = |i: usize, lane: usize| {
                let grain = (((i * 2_654_435_761) >> 7) % 1000) as f32 / 1000.0;
                0.2 + grain * if i.is_multiple_of(53) { 10_f32.powi(lane as i32 - 3) } else { 0.1 }
            };
            let lit: Vec<F32x8> =
                (0..views.len()).map(|i| F32x8(std::array::from_fn(|lane| value(i, lane)))).collect();
            let [with, without] = [true, false].map(|factored| fitted(&views, factored, 0.01, &lit).1);
            for (with, without) in with.iter().zip(&without) {
                assert!(f64::from(GAINED) * with <= *without, "P = {p}: {with} {without}");
            }
        }
    }

    /// Without any light nothing is fitted.
    #[test]
    fn black_texels_stay_black() {
        let views = ViewGrid::new(4, 4, Terms::All, Centre::Reflection);
        for dark in [0.0, 0.01] {
            let (coefficients, _) = fitted(&views, true, dark, &vec![F32x8::ZERO; views.len()]);
            assert!(coefficients.as_flattened().iter().all(|value| *value == F32x8::ZERO));
        }
    }
}
