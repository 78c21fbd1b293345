//! The sums over l and over rows for one order m: three channels, cosine and sine, both hemispheres.
//!
//! Rows theta and pi - theta share lambda, since P_lm is even or odd about the equator as l - m is: the even
//! part E = N + S of a pair of rows meets only even l - m, the odd part O = N - S only odd ones.

use pulp::{Simd, WithSimd};

use super::precision::Precision;
use crate::legendre::{Argument, Form, LegendreRecurrence, Sectoral, Step, enter, least_sine};
use crate::vector::{F64x8, LANES, Vector8, registers};

/// Values that go together at eight pairs of rows: 3 channels x (cosine, sine) of the even part E in 0 .. 6,
/// of the odd part O in 6 .. 12.
pub(crate) type Group<T> = [Vector8<T>; PARTS];

/// Values in a group.
pub(crate) const PARTS: usize = 12;

/// Where the odd part starts in a group.
pub(crate) const ODD: usize = 6;

/// Groups whose sums run together: their values stay in the first-level cache.
const BLOCK: usize = 32;

/// Steps of one group that go together in a synthesis.
const CHUNK: usize = 64;

/// The northern rows of a grid (the equator included), from the pole down, in eights; the last is repeated.
pub(crate) struct Rows {
    pub(crate) cosine: Vec<F64x8>,
    pub(crate) sine: Vec<F64x8>,
    /// The argument y of the recurrence's steps; the first `polar` groups use the polar form.
    argument: Vec<F64x8>,
    polar: usize,
    sectoral: Sectoral,
}

impl Rows {
    /// Prepares rows of the given (cosine, sine), for m up to `degree`.
    pub(crate) fn new(rows: &[(f64, f64)], degree: usize) -> Self {
        let at = |group: usize, lane: usize| rows[(group * LANES + lane).min(rows.len() - 1)];
        let groups = rows.len().div_ceil(LANES);
        let form = |group: usize| Form::of(at(group, LANES - 1).1);
        let lanes = |value: &dyn Fn(usize, (f64, f64)) -> f64| -> Vec<F64x8> {
            (0..groups).map(|group| F64x8::from_fn(|lane| value(group, at(group, lane)))).collect()
        };
        let sine = lanes(&|_, (_, sine)| sine);
        Self {
            cosine: lanes(&|_, (cosine, _)| cosine),
            argument: lanes(&|group, (cosine, sine)| form(group).argument(cosine, sine)),
            polar: (0..groups).take_while(|&group| form(group) == Form::POLAR).count(),
            sectoral: Sectoral::new(&sine, degree),
            sine,
        }
    }

    fn argument(&self, group: usize) -> Argument<'_> {
        let form = if group < self.polar { Form::POLAR } else { Form::EQUATORIAL };
        Argument { form, y: &self.argument[group] }
    }

    /// The number of groups of eight rows.
    pub(crate) fn groups(&self) -> usize {
        self.sine.len()
    }
}

/// sums[k] = sum over rows of lambda_k times (E, x O), still in eight lanes.
///
/// `columns` holds one group per eight rows, O already multiplied by x, weights included. `current` and
/// `previous` are scratch of one vector per group.
pub(crate) struct Project<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) recurrence: &'a LegendreRecurrence,
    pub(crate) degree: usize,
    pub(crate) columns: &'a [Group<f64>],
    pub(crate) current: &'a mut [F64x8],
    pub(crate) previous: &'a mut [F64x8],
    pub(crate) sums: &'a mut [Group<f64>],
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, recurrence, degree, columns, current, previous, sums } = self;
        let steps = recurrence.steps();
        let least = least_sine(recurrence.order(), degree);
        sums.fill([F64x8::ZERO; PARTS]);
        // The groups nearest the equator come first into range: of a block, those from `first` on take part.
        let mut joins = [0usize; BLOCK];
        for start in (0..rows.groups()).step_by(BLOCK) {
            let end = (start + BLOCK).min(rows.groups());
            let mut later = 0;
            for group in (start..end).rev() {
                let sine = &rows.sine[group];
                let column = &columns[group];
                if sine.0[LANES - 1] < least {
                    joins[group - start] = steps.len();
                    continue;
                }
                let argument = rows.argument(group);
                let mut entry = enter(simd, recurrence, &rows.sectoral, group, argument, |k, lambda| {
                    accumulate(simd, &mut sums[k], lambda, column);
                });
                // All join at an even step, since two steps may be taken at once.
                while entry.step < later.max(entry.step.next_multiple_of(2)).min(steps.len()) {
                    accumulate(simd, &mut sums[entry.step], &entry.current, column);
                    entry.advance(simd, argument, steps, f64::INFINITY);
                }
                later = entry.step;
                joins[group - start] = entry.step;
                (current[group], previous[group]) = (entry.current, entry.previous);
            }

            let mut sweep = Sweep {
                rows,
                columns,
                current: &mut *current,
                previous: &mut *previous,
                joins: &joins,
                start,
                end,
            };
            for r in 0..registers::<S>() {
                if registers::<S>() == 1 {
                    for (k, (steps, sums)) in steps.chunks(2).zip(sums.chunks_mut(2)).enumerate() {
                        match (steps, sums) {
                            ([first, second], [first_sum, second_sum]) => {
                                sweep.run(simd, r, 2 * k, [first, second], [first_sum, second_sum]);
                            }
                            ([step], [sum]) => sweep.run(simd, r, 2 * k, [step], [sum]),
                            _ => {}
                        }
                    }
                } else {
                    for (k, (step, sum)) in steps.iter().zip(&mut *sums).enumerate() {
                        sweep.run(simd, r, k, [step], [sum]);
                    }
                }
            }
        }
    }
}

/// The rows of one block, whose states go from step to step.
struct Sweep<'a> {
    rows: &'a Rows,
    columns: &'a [Group<f64>],
    current: &'a mut [F64x8],
    previous: &'a mut [F64x8],
    joins: &'a [usize; BLOCK],
    start: usize,
    end: usize,
}

impl Sweep<'_> {
    /// Adds the terms of the steps from k on to their sums.
    #[inline(always)]
    fn run<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        r: usize,
        k: usize,
        steps: [&Step; N],
        sums: [&mut Group<f64>; N],
    ) {
        let Self { rows, columns, current, previous, joins, start, end } = self;
        let first = *end - joins[..*end - *start].iter().rev().take_while(|&&join| join <= k).count();
        if first == *end {
            return;
        }
        let zero = simd.splat_f64s(0.0);
        let mut totals = [[zero; PARTS]; N];
        let mut a = [zero; N];
        for i in 0..N {
            a[i] = steps[i].a.load(simd, r);
            for part in 0..PARTS {
                totals[i][part] = sums[i][part].load(simd, r);
            }
        }
        let polar = rows.polar.clamp(first, *end);
        for (range, form) in [(first..polar, Form::POLAR), (polar..*end, Form::EQUATORIAL)] {
            let mut b = [zero; N];
            for i in 0..N {
                b[i] = steps[i].b(form).load(simd, r);
            }
            let states = current[range.clone()].iter_mut().zip(&mut previous[range.clone()]);
            let inputs = columns[range.clone()].iter().zip(&rows.argument[range]);
            for ((now, before), (column, y)) in states.zip(inputs) {
                let y = y.load(simd, r);
                let (mut lambda, mut earlier) = (now.load(simd, r), before.load(simd, r));
                let mut lambdas = [zero; N];
                for i in 0..N {
                    lambdas[i] = lambda;
                    let next = simd.mul_add_f64s(simd.mul_add_f64s(a[i], y, b[i]), lambda, earlier);
                    (lambda, earlier) = (next, lambda);
                }
                for part in 0..PARTS {
                    let value = column[part].load(simd, r);
                    for i in 0..N {
                        totals[i][part] = simd.mul_add_f64s(lambdas[i], value, totals[i][part]);
                    }
                }
                now.store(simd, lambda, r);
                before.store(simd, earlier, r);
            }
        }
        for i in 0..N {
            for part in 0..PARTS {
                sums[i][part].store(simd, totals[i][part], r);
            }
        }
    }
}

#[inline(always)]
fn accumulate<S: Simd>(simd: S, sum: &mut Group<f64>, lambda: &F64x8, column: &Group<f64>) {
    for r in 0..registers::<S>() {
        let lambda = lambda.load(simd, r);
        for part in 0..PARTS {
            let total = simd.mul_add_f64s(lambda, column[part].load(simd, r), sum[part].load(simd, r));
            sum[part].store(simd, total, r);
        }
    }
}

/// columns = sum over k of lambda_k times terms[k]; O comes out multiplied by x.
pub(crate) struct Evaluate<'a, T> {
    pub(crate) rows: &'a Rows,
    pub(crate) recurrence: &'a LegendreRecurrence,
    pub(crate) degree: usize,
    pub(crate) terms: &'a [[f64; PARTS]],
    pub(crate) columns: &'a mut [Group<T>],
}

impl<T: Precision> WithSimd for Evaluate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, recurrence, degree, terms, columns } = self;
        let steps = recurrence.steps();
        let least = least_sine(recurrence.order(), degree);
        let mut lambda = [F64x8::ZERO; CHUNK];
        for (group, values) in columns.iter_mut().enumerate() {
            *values = [Vector8::ZERO; PARTS];
            let sine = &rows.sine[group];
            if sine.0[LANES - 1] < least {
                continue;
            }
            let mut column = [F64x8::ZERO; PARTS];
            let argument = rows.argument(group);
            let entry = enter(simd, recurrence, &rows.sectoral, group, argument, |k, lambda| {
                for r in 0..registers::<S>() {
                    let lambda = lambda.load(simd, r);
                    for part in 0..PARTS {
                        let total = column[part].load(simd, r);
                        let total = simd.mul_add_f64s(lambda, simd.splat_f64s(terms[k][part]), total);
                        column[part].store(simd, total, r);
                    }
                }
            });
            for r in 0..registers::<S>() {
                // Even parts with the recurrence, odd parts after: twelve sums at once would not fit in
                // registers.
                let (mut current, mut previous) = (entry.current.load(simd, r), entry.previous.load(simd, r));
                let (y, cosine) = (argument.y.load(simd, r), rows.cosine[group].load(simd, r));
                let mut even = [simd.splat_f64s(0.0); ODD];
                let mut odd = even;
                for part in 0..ODD {
                    even[part] = column[part].load(simd, r);
                    odd[part] = column[ODD + part].load(simd, r);
                }
                let chunks = terms[entry.step..].chunks(CHUNK).zip(steps[entry.step..].chunks(CHUNK));
                for (terms, steps) in chunks {
                    for ((term, step), lambda) in terms.iter().zip(steps).zip(&mut lambda) {
                        lambda.store(simd, current, r);
                        for part in 0..ODD {
                            even[part] = simd.mul_add_f64s(current, simd.splat_f64s(term[part]), even[part]);
                        }
                        let factor =
                            simd.mul_add_f64s(step.a.load(simd, r), y, step.b(argument.form).load(simd, r));
                        (current, previous) = (simd.mul_add_f64s(factor, current, previous), current);
                    }
                    for (term, lambda) in terms.iter().zip(&lambda) {
                        let lambda = lambda.load(simd, r);
                        for part in 0..ODD {
                            let term = simd.splat_f64s(term[ODD + part]);
                            odd[part] = simd.mul_add_f64s(lambda, term, odd[part]);
                        }
                    }
                }
                for part in 0..ODD {
                    column[part].store(simd, even[part], r);
                    column[ODD + part].store(simd, simd.mul_f64s(odd[part], cosine), r);
                }
            }
            for (to, from) in values.iter_mut().zip(&column) {
                for lane in 0..LANES {
                    to.0[lane] = T::from_f64(from.0[lane]);
                }
            }
        }
    }
}
