//! Normalised associated Legendre functions of one order m, by a recurrence in x^2 = cos^2(theta).
//!
//! P_lm is the theta part of the real orthonormal harmonics: Y_lm = P_lm cos(m phi) and Y_l,-m = P_lm sin(m
//! phi), positive near x = 1, the factor sqrt(2) of m > 0 included. With eps_l = sqrt((l^2 - m^2) / (4 l^2 -
//! 1)),
//!
//! ```text
//! x P_l = eps_(l+1) P_(l+1) + eps_l P_(l-1),   P_mm = c_m sin^m(theta).
//! ```
//!
//! Two degrees per step (Ishioka 2018, J. Meteor. Soc. Japan 96): with l = m + 2 k, the polynomials
//! R_k = P_(l+1) / x = alpha_k lambda_k give both parities, and scaled by alpha their recurrence is two
//! multiply-adds:
//!
//! ```text
//! P_l       = eps_(l+1) R_k + eps_l R_(k-1)
//! P_(l+1)   = x R_k
//! lambda_(k+1) = (a_k x^2 + b_k) lambda_k + lambda_(k-1),   lambda_0 = P_mm
//! alpha_0 = 1 / eps_(m+1),   alpha_(k+1) = (-1)^k / (alpha_k eps_(l+2) eps_(l+3))
//! a_k = (-1)^k alpha_k^2,    b_k = -a_k (eps_(l+1)^2 + eps_(l+2)^2)
//! ```
//!
//! sin^m(theta) leaves the range of a double: values start as [`Scaled`] and take part in sums when they are
//! in range.

use std::f64::consts::PI;

use pulp::Simd;

use crate::f64x4::{F64x4, LANES, load, store};
use crate::scaled::{HIGH, INVERSE_UNIT, Scaled};

/// P_mm = c_m sin^m(theta) of rows in fours, for every m up to a degree.
pub(crate) struct Sectoral {
    /// c_m for each m.
    factors: Vec<f64>,
    /// sin^j, j = 0 .. FINE, group by group.
    fine: Vec<Scaled>,
    /// sin^(FINE j), j = 0 ..= degree / FINE, group by group.
    coarse: Vec<Scaled>,
    groups: usize,
}

/// Powers that one table steps over.
const FINE: usize = 16;

impl Sectoral {
    /// The sectoral functions of rows of the given sines.
    pub(crate) fn new(sines: &[F64x4], degree: usize) -> Self {
        let groups = sines.len();
        let mut fine = vec![Scaled::ONE; groups];
        for j in 0..FINE {
            for (group, &sine) in sines.iter().enumerate() {
                fine.push(fine[j * groups + group].times_plain(sine));
            }
        }
        let step = fine.split_off(FINE * groups);
        let mut coarse = vec![Scaled::ONE; groups];
        for j in 0..degree / FINE {
            for group in 0..groups {
                coarse.push(coarse[j * groups + group].times(step[group]));
            }
        }
        // c_m^2 = (2 m + 1)!! / (4 pi (2 m)!!), twice that for m > 0; the product 1/2 3/4 5/6 ... falls as
        // m^(-1/2).
        let mut product = 1.0;
        let factors = (0..=degree)
            .map(|m| {
                if m > 0 {
                    product *= (2 * m - 1) as f64 / (2 * m) as f64;
                }
                let signs = if m == 0 { 1.0 } else { 2.0 };
                (signs * product * (2 * m + 1) as f64 / (4.0 * PI)).sqrt()
            })
            .collect();
        Self { factors, fine, coarse, groups }
    }

    #[inline(always)]
    fn start(&self, m: usize, group: usize) -> Scaled {
        let coarse = self.coarse[m / FINE * self.groups + group];
        let mut start = coarse.times(self.fine[m % FINE * self.groups + group]);
        start.value.0.iter_mut().for_each(|value| *value *= self.factors[m]);
        start
    }
}

/// One step of the recurrence: lambda_(k+1) = (a y + b) lambda_k + lambda_(k-1).
///
/// In mid-latitudes and at the equator y is x^2 and b is b_k. Near the poles, where rounding x^2 moves theta
/// by eps / theta, y is -sin^2(theta) and b is b_k + a_k.
///
/// Each lane has its own copy, because loads need fewer registers than broadcasts.
#[derive(Clone, Copy)]
pub(crate) struct Step {
    pub(crate) a: F64x4,
    pub(crate) b: [F64x4; 2],
}

/// Which of the two forms of a [`Step`] four rows use: 0 for x^2, 1 for -sin^2(theta).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Form(usize);

impl Form {
    pub(crate) const EQUATORIAL: Self = Self(0);
    pub(crate) const POLAR: Self = Self(1);

    /// The better form for rows whose largest sine is this.
    pub(crate) fn of(sine: f64) -> Self {
        if sine * sine < 0.5 { Self::POLAR } else { Self::EQUATORIAL }
    }

    /// The argument y of the recurrence for a row of this cosine and sine.
    pub(crate) fn argument(self, cosine: f64, sine: f64) -> f64 {
        if self == Self::POLAR { -sine * sine } else { cosine * cosine }
    }
}

impl Step {
    #[inline(always)]
    pub(crate) fn b(&self, form: Form) -> &F64x4 {
        &self.b[form.0]
    }
}

/// The coefficients of the recurrence for one m.
#[derive(Default)]
pub(crate) struct LegendreRecurrence {
    m: usize,
    /// eps_(m + i), i = 0 ..= degree - m + 4.
    eps: Vec<f64>,
    alpha: Vec<f64>,
    steps: Vec<Step>,
}

impl LegendreRecurrence {
    /// Fills the coefficients for l = m ..= degree.
    pub(crate) fn prepare(&mut self, m: usize, degree: usize) {
        debug_assert!(m <= degree);
        self.m = m;
        let count = (degree - m) / 2 + 1;
        self.eps.clear();
        self.eps.extend((0..2 * count + 3).map(|i| {
            let l = (m + i) as f64;
            // l^2 - m^2 = i (i + 2 m)
            ((i * (i + 2 * m)) as f64 / (4.0 * l * l - 1.0)).sqrt()
        }));
        if m == 0 {
            self.eps[0] = 0.0;
        }
        let eps = &self.eps;
        self.alpha.clear();
        self.steps.clear();
        let mut alpha = 1.0 / eps[1];
        let mut sign = 1.0;
        for k in 0..count {
            let (e1, e2, e3) = (eps[2 * k + 1], eps[2 * k + 2], eps[2 * k + 3]);
            let a = sign * alpha * alpha;
            self.alpha.push(alpha);
            let squares = e1 * e1 + e2 * e2;
            self.steps.push(Step {
                a: F64x4([a; LANES]),
                b: [-a * squares, a * (1.0 - squares)].map(|b| F64x4([b; LANES])),
            });
            alpha = sign / (alpha * e2 * e3);
            sign = -sign;
        }
    }

    pub(crate) fn order(&self) -> usize {
        self.m
    }

    /// The steps k; step k serves the degrees m + 2 k and m + 2 k + 1.
    pub(crate) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// The factor of lambda_k in P_l of l = m + 2 k.
    pub(crate) fn even(&self, k: usize) -> f64 {
        self.alpha[k] * self.eps[2 * k + 1]
    }

    /// The factor of lambda_k in P_l of l = m + 2 k + 2.
    pub(crate) fn even_after(&self, k: usize) -> f64 {
        self.alpha[k] * self.eps[2 * k + 2]
    }

    /// The factor of x lambda_k in P_l of l = m + 2 k + 1.
    pub(crate) fn odd(&self, k: usize) -> f64 {
        self.alpha[k]
    }
}

/// The argument of the recurrence in four rows.
#[derive(Clone, Copy)]
pub(crate) struct Argument<'a> {
    /// The form of the steps that the rows use.
    pub(crate) form: Form,
    /// The argument of this form in each row ([`Form::argument`]).
    pub(crate) y: &'a F64x4,
}

/// The state in which four rows enter the sums: from `step` on, all four are in the range of a double.
pub(crate) struct Entry {
    /// The first step k at which every row is in range; the number of steps if this never happens.
    pub(crate) step: usize,
    /// lambda at `step`.
    pub(crate) current: F64x4,
    /// lambda at the step before `step`.
    pub(crate) previous: F64x4,
}

/// Runs the recurrence of four rows until all are in range.
///
/// `partial` is called for each step at which some rows are in range, with lambda_k and zeros for the others.
#[inline(always)]
pub(crate) fn enter<S: Simd>(
    simd: S,
    recurrence: &LegendreRecurrence,
    sectoral: &Sectoral,
    group: usize,
    Argument { form, y }: Argument<'_>,
    mut partial: impl FnMut(usize, &F64x4),
) -> Entry {
    let start = sectoral.start(recurrence.m, group);
    let mut exponent = start.exponent.0;
    let mut state = Entry { step: 0, current: start.value, previous: F64x4::ZERO };
    let (steps, y) = (&recurrence.steps[..], load(simd, y));
    let advance = |current, previous, step: &Step| {
        let factor = simd.mul_add_f64s(load(simd, &step.a), y, load(simd, step.b(form)));
        simd.mul_add_f64s(factor, current, previous)
    };
    while exponent != [0.0; LANES] && state.step < steps.len() {
        if exponent.contains(&0.0) {
            let mut masked = state.current;
            (0..LANES).filter(|&i| exponent[i] > 0.0).for_each(|i| masked.0[i] = 0.0);
            partial(state.step, &masked);
        }
        // One step if some rows are in range; otherwise as many as it takes.
        let (mut current, mut previous) = (load(simd, &state.current), load(simd, &state.previous));
        for step in &steps[state.step..] {
            (current, previous) = (advance(current, previous, step), current);
            state.step += 1;
            if any_beyond(simd, current, HIGH) || exponent.contains(&0.0) {
                break;
            }
        }
        store(simd, current, &mut state.current);
        store(simd, previous, &mut state.previous);
        for i in 0..LANES {
            if state.current.0[i].abs() > HIGH && exponent[i] > 0.0 {
                state.current.0[i] *= INVERSE_UNIT;
                state.previous.0[i] *= INVERSE_UNIT;
                exponent[i] -= 1.0;
            }
        }
    }
    state
}

/// Whether the size of any lane is above a limit.
#[inline(always)]
fn any_beyond<S: Simd>(simd: S, vector: S::f64s, limit: f64) -> bool {
    simd.reduce_max_f64s(simd.abs_f64s(vector)) > limit
}

/// The sine of the colatitude below which P_lm of every l <= degree is negligible.
///
/// Below the turning point sin(theta) = m / l, P_lm falls as exp(-0.94 d^1.5 / (sqrt(m) cos(theta))) with
/// d = m - l sin(theta) (WKB); d = 15 m^(1/3) is below 2^-78.
pub(crate) fn least_sine(m: usize, degree: usize) -> f64 {
    let m = m as f64;
    if m == 0.0 { 0.0 } else { (m - 15.0 * math::cbrt(m)) / degree as f64 }
}
