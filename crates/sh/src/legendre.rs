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

use crate::f64x4::{self, F64x4};
use crate::scaled::{HIGH, INVERSE_UNIT, Scaled};
use crate::vector::{F64x8, LANES, registers};

/// P_mm = c_m sin^m(theta) of rows in eights, for every m up to a degree.
pub(crate) struct Sectoral {
    /// c_m for each m.
    factors: Vec<f64>,
    /// sin^j, j = 0 .. FINE, four rows by four.
    fine: Vec<Scaled>,
    /// sin^(FINE j), j = 0 ..= degree / FINE, four rows by four.
    coarse: Vec<Scaled>,
    groups: usize,
}

/// Powers that one table steps over.
const FINE: usize = 16;

impl Sectoral {
    /// The sectoral functions of rows of the given sines.
    pub(crate) fn new(sines: &[F64x8], degree: usize) -> Self {
        let half = |sines: &F64x8, half| F64x4::from_fn(|lane| sines.0[f64x4::LANES * half + lane]);
        let sines: Vec<F64x4> = sines.iter().flat_map(|sines| [half(sines, 0), half(sines, 1)]).collect();
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

    /// The values of eight rows and their exponents.
    #[inline(always)]
    fn start(&self, m: usize, group: usize) -> [F64x8; 2] {
        let halves = [0, 1].map(|half| {
            let at = 2 * group + half;
            self.coarse[m / FINE * self.groups + at].times(self.fine[m % FINE * self.groups + at])
        });
        let lane = |i: usize| (&halves[i / f64x4::LANES], i % f64x4::LANES);
        [
            F64x8::from_fn(|i| lane(i).0.value.0[lane(i).1] * self.factors[m]),
            F64x8::from_fn(|i| lane(i).0.exponent.0[lane(i).1]),
        ]
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
    pub(crate) a: F64x8,
    pub(crate) b: [F64x8; 2],
}

/// Which of the two forms of a [`Step`] eight rows use: 0 for x^2, 1 for -sin^2(theta).
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
    pub(crate) fn b(&self, form: Form) -> &F64x8 {
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
                a: F64x8::from_fn(|_| a),
                b: [-a * squares, a * (1.0 - squares)].map(|b| F64x8::from_fn(|_| b)),
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

/// The argument of the recurrence in eight rows.
#[derive(Clone, Copy)]
pub(crate) struct Argument<'a> {
    /// The form of the steps that the rows use.
    pub(crate) form: Form,
    /// The argument of this form in each row ([`Form::argument`]).
    pub(crate) y: &'a F64x8,
}

/// The state in which eight rows enter the sums: from `step` on, all are in the range of a double.
pub(crate) struct Entry {
    /// The first step k at which every row is in range; the number of steps if this never happens.
    pub(crate) step: usize,
    /// lambda at `step`.
    pub(crate) current: F64x8,
    /// lambda at the step before `step`.
    pub(crate) previous: F64x8,
}

impl Entry {
    /// Goes on by one step. Whether the size of any lane is above `limit` then.
    #[inline(always)]
    pub(crate) fn advance<S: Simd>(
        &mut self,
        simd: S,
        Argument { form, y }: Argument<'_>,
        steps: &[Step],
        limit: f64,
    ) -> bool {
        let step = &steps[self.step];
        self.step += 1;
        let mut beyond = false;
        for r in 0..registers::<S>() {
            let factor = simd.mul_add_f64s(step.a.load(simd, r), y.load(simd, r), step.b(form).load(simd, r));
            let next = simd.mul_add_f64s(factor, self.current.load(simd, r), self.previous.load(simd, r));
            self.previous.store(simd, self.current.load(simd, r), r);
            self.current.store(simd, next, r);
            beyond |= simd.reduce_max_f64s(simd.abs_f64s(next)) > limit;
        }
        beyond
    }
}

/// Runs the recurrence of eight rows until all are in range.
///
/// `partial` is called for each step at which some rows are in range, with lambda_k and zeros for the others.
#[inline(always)]
pub(crate) fn enter<S: Simd>(
    simd: S,
    recurrence: &LegendreRecurrence,
    sectoral: &Sectoral,
    group: usize,
    argument: Argument<'_>,
    mut partial: impl FnMut(usize, &F64x8),
) -> Entry {
    let [current, mut exponent] = sectoral.start(recurrence.m, group);
    let mut state = Entry { step: 0, current, previous: F64x8::ZERO };
    let steps = &recurrence.steps[..];
    while exponent != F64x8::ZERO && state.step < steps.len() {
        let some = exponent.0.contains(&0.0);
        if some {
            let current = &state.current;
            let masked = F64x8::from_fn(|i| if exponent.0[i] > 0.0 { 0.0 } else { current.0[i] });
            partial(state.step, &masked);
        }
        // One step if some rows are in range; otherwise as many as it takes.
        while !state.advance(simd, argument, steps, HIGH) && !some && state.step < steps.len() {}
        for i in 0..LANES {
            if state.current.0[i].abs() > HIGH && exponent.0[i] > 0.0 {
                state.current.0[i] *= INVERSE_UNIT;
                state.previous.0[i] *= INVERSE_UNIT;
                exponent.0[i] -= 1.0;
            }
        }
    }
    state
}

/// The sine of the colatitude below which P_lm of every l <= degree is negligible.
///
/// Below the turning point sin(theta) = m / l, P_lm falls as exp(-0.94 d^1.5 / (sqrt(m) cos(theta))) with
/// d = m - l sin(theta) (WKB); d = 15 m^(1/3) is below 2^-78.
pub(crate) fn least_sine(m: usize, degree: usize) -> f64 {
    let m = m as f64;
    if m == 0.0 { 0.0 } else { (m - 15.0 * math::cbrt(m)) / degree as f64 }
}
