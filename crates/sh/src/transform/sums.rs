//! The sums over l and over rows for one order m: three channels, cosine and sine, both hemispheres.
//!
//! Rows theta and pi - theta share lambda, since P_lm is even or odd about the equator as l - m is: the even
//! part E = N + S of a pair of rows meets only even l - m, the odd part O = N - S only odd ones.

use pulp::{Simd, WithSimd};

use crate::f64x4::{F64x4, LANES, load, store};
use crate::legendre::{Argument, Entry, Form, LegendreRecurrence, Sectoral, Step, enter, least_sine};

/// Values that go together at four pairs of rows: 3 channels x (cosine, sine) of the even part E in 0 .. 6,
/// of the odd part O in 6 .. 12.
pub(crate) type Group = [F64x4; PARTS];

/// Values in a group.
pub(crate) const PARTS: usize = 12;

/// Where the odd part starts in a group.
pub(crate) const ODD: usize = 6;

/// Groups whose sums run together: their values stay in the first-level cache.
const BLOCK: usize = 64;

/// Steps of one group that go together in a synthesis.
const CHUNK: usize = 64;

/// The northern rows of a grid (the equator included), from the pole down, in fours; the last is repeated.
pub(crate) struct Rows {
    pub(crate) cosine: Vec<F64x4>,
    pub(crate) sine: Vec<F64x4>,
    /// The argument y of the recurrence's steps; the first `polar` groups use the polar form.
    argument: Vec<F64x4>,
    polar: usize,
    sectoral: Sectoral,
}

impl Rows {
    /// Prepares rows of the given (cosine, sine), for m up to `degree`.
    pub(crate) fn new(rows: &[(f64, f64)], degree: usize) -> Self {
        let at = |group: usize, lane: usize| rows[(group * LANES + lane).min(rows.len() - 1)];
        let groups = rows.len().div_ceil(LANES);
        let form = |group: usize| Form::of(at(group, LANES - 1).1);
        let lanes = |value: &dyn Fn(usize, (f64, f64)) -> f64| -> Vec<F64x4> {
            (0..groups).map(|group| F64x4::from_fn(|lane| value(group, at(group, lane)))).collect()
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

    fn form(&self, group: usize) -> Form {
        if group < self.polar { Form::POLAR } else { Form::EQUATORIAL }
    }

    /// The number of groups of four rows.
    pub(crate) fn groups(&self) -> usize {
        self.sine.len()
    }
}

/// sums[k] = sum over rows of lambda_k times (E, x O), still in four lanes.
///
/// `columns` holds one group per four rows, O already multiplied by x, weights included. `current` and
/// `previous` are scratch of one lane per group.
pub(crate) struct Project<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) recurrence: &'a LegendreRecurrence,
    pub(crate) degree: usize,
    pub(crate) columns: &'a [Group],
    pub(crate) current: &'a mut [F64x4],
    pub(crate) previous: &'a mut [F64x4],
    pub(crate) sums: &'a mut [Group],
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, recurrence, degree, columns, mut current, mut previous, sums } = self;
        let steps = recurrence.steps();
        let least = least_sine(recurrence.order(), degree);
        sums.fill([F64x4::ZERO; PARTS]);
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
                let argument = Argument { form: rows.form(group), y: &rows.argument[group] };
                let mut entry = enter(simd, recurrence, &rows.sectoral, group, argument, |k, lambda| {
                    accumulate(simd, &mut sums[k], lambda, column);
                });
                while entry.step < later.min(steps.len()) {
                    accumulate(simd, &mut sums[entry.step], &entry.current, column);
                    advance(simd, &mut entry, argument, steps);
                }
                later = entry.step;
                joins[group - start] = entry.step;
                // The two states change places with every step.
                let swapped = entry.step % 2 == 1;
                current[group] = if swapped { entry.previous } else { entry.current };
                previous[group] = if swapped { entry.current } else { entry.previous };
            }

            let mut first = end;
            let polar = rows.polar.clamp(start, end);
            for (k, step) in steps.iter().enumerate() {
                while first > start && joins[first - 1 - start] <= k {
                    first -= 1;
                }
                if first < end {
                    let sum = &mut sums[k];
                    let a = load(simd, &step.a);
                    let mut total: [S::f64s; PARTS] = std::array::from_fn(|part| load(simd, &sum[part]));
                    for (range, form) in
                        [(first.min(polar)..polar, Form::POLAR), (first.max(polar)..end, Form::EQUATORIAL)]
                    {
                        let b = load(simd, step.b(form));
                        let states = current[range.clone()].iter().zip(&mut previous[range.clone()]);
                        let inputs = columns[range.clone()].iter().zip(&rows.argument[range]);
                        for ((now, before), (column, y)) in states.zip(inputs) {
                            let lambda = load(simd, now);
                            for part in 0..PARTS {
                                total[part] =
                                    simd.mul_add_f64s(lambda, load(simd, &column[part]), total[part]);
                            }
                            let factor = simd.mul_add_f64s(a, load(simd, y), b);
                            store(simd, simd.mul_add_f64s(factor, lambda, load(simd, before)), before);
                        }
                    }
                    for part in 0..PARTS {
                        store(simd, total[part], &mut sum[part]);
                    }
                }
                std::mem::swap(&mut current, &mut previous);
            }
            if steps.len() % 2 == 1 {
                std::mem::swap(&mut current, &mut previous);
            }
        }
    }
}

#[inline(always)]
fn accumulate<S: Simd>(simd: S, sum: &mut Group, lambda: &F64x4, column: &Group) {
    let lambda = load(simd, lambda);
    for part in 0..PARTS {
        let total = simd.mul_add_f64s(lambda, load(simd, &column[part]), load(simd, &sum[part]));
        store(simd, total, &mut sum[part]);
    }
}

#[inline(always)]
fn advance<S: Simd>(simd: S, entry: &mut Entry, Argument { form, y }: Argument<'_>, steps: &[Step]) {
    let step = steps[entry.step];
    let factor = simd.mul_add_f64s(load(simd, &step.a), load(simd, y), load(simd, step.b(form)));
    let next = simd.mul_add_f64s(factor, load(simd, &entry.current), load(simd, &entry.previous));
    entry.previous = entry.current;
    store(simd, next, &mut entry.current);
    entry.step += 1;
}

/// columns = sum over k of lambda_k times terms[k]; O comes out multiplied by x.
pub(crate) struct Evaluate<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) recurrence: &'a LegendreRecurrence,
    pub(crate) degree: usize,
    pub(crate) terms: &'a [[f64; PARTS]],
    pub(crate) columns: &'a mut [Group],
}

impl WithSimd for Evaluate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, recurrence, degree, terms, columns } = self;
        let steps = recurrence.steps();
        let least = least_sine(recurrence.order(), degree);
        let mut lambda = [F64x4::ZERO; CHUNK];
        for (group, column) in columns.iter_mut().enumerate() {
            *column = [F64x4::ZERO; PARTS];
            let sine = &rows.sine[group];
            if sine.0[LANES - 1] < least {
                continue;
            }
            let argument = Argument { form: rows.form(group), y: &rows.argument[group] };
            let entry = enter(simd, recurrence, &rows.sectoral, group, argument, |k, lambda| {
                let lambda = load(simd, lambda);
                for part in 0..PARTS {
                    let total = load(simd, &column[part]);
                    store(
                        simd,
                        simd.mul_add_f64s(lambda, simd.splat_f64s(terms[k][part]), total),
                        &mut column[part],
                    );
                }
            });
            // Even parts with the recurrence, odd parts after: twelve sums at once would not fit in
            // registers.
            let (mut current, mut previous) = (load(simd, &entry.current), load(simd, &entry.previous));
            let (y, cosine) = (load(simd, argument.y), load(simd, &rows.cosine[group]));
            let (even_column, odd_column) = column.split_at_mut(ODD);
            let mut even: [S::f64s; ODD] = std::array::from_fn(|part| load(simd, &even_column[part]));
            let mut odd: [S::f64s; ODD] = std::array::from_fn(|part| load(simd, &odd_column[part]));
            for (terms, steps) in terms[entry.step..].chunks(CHUNK).zip(steps[entry.step..].chunks(CHUNK)) {
                for ((term, step), lambda) in terms.iter().zip(steps).zip(&mut lambda) {
                    store(simd, current, lambda);
                    for part in 0..ODD {
                        even[part] = simd.mul_add_f64s(current, simd.splat_f64s(term[part]), even[part]);
                    }
                    let factor = simd.mul_add_f64s(load(simd, &step.a), y, load(simd, step.b(argument.form)));
                    (current, previous) = (simd.mul_add_f64s(factor, current, previous), current);
                }
                for (term, lambda) in terms.iter().zip(&lambda) {
                    let lambda = load(simd, lambda);
                    for part in 0..ODD {
                        odd[part] = simd.mul_add_f64s(lambda, simd.splat_f64s(term[ODD + part]), odd[part]);
                    }
                }
            }
            for part in 0..ODD {
                store(simd, even[part], &mut even_column[part]);
                store(simd, simd.mul_f64s(odd[part], cosine), &mut odd_column[part]);
            }
        }
    }
}
