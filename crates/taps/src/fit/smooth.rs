//! Taps that change smoothly with the view: each parameter is a polynomial in 1 - cos(theta_v), fitted to all
//! views at once.

use super::least_squares::{Normal, minimise};
use super::view::{Meaning, Shape, ViewFit};
use crate::Widths;

/// The coefficients of each polynomial.
const TERMS: usize = 8;

/// The polynomials of all parameters.
#[derive(Clone, Debug)]
pub(super) struct Smooth {
    shape: Shape,
    /// [`TERMS`] coefficients of Chebyshev's polynomials for each parameter. Those of delta are multiplied by
    /// the sine of theta_v: head on, a tap looks along R.
    coefficients: Vec<f64>,
}

/// What each coefficient of a parameter adds to it at a view.
fn factors(theta: f64, meaning: Meaning) -> [f64; TERMS] {
    let (sine, cosine) = math::sin_cos(theta);
    let x = 1.0 - 2.0 * cosine;
    let mut factors = [1.0; TERMS];
    factors[1] = x;
    for i in 2..TERMS {
        factors[i] = 2.0 * x * factors[i - 1] - factors[i - 2];
    }
    if meaning == Meaning::Delta { factors.map(|value| sine * value) } else { factors }
}

/// The values of polynomials at a view.
fn values(shape: Shape, coefficients: &[f64], theta: f64) -> Vec<f64> {
    let value = |(coefficients, meaning): (&[f64; TERMS], Meaning)| {
        coefficients.iter().zip(factors(theta, meaning)).map(|(a, b)| a * b).sum()
    };
    let mut values: Vec<f64> = coefficients.as_chunks().0.iter().zip(shape.meanings()).map(value).collect();
    shape.bound(&mut values);
    values
}

impl Smooth {
    /// The polynomials that fit all views best, from parameters at each.
    pub(super) fn new(shape: Shape, fits: &[ViewFit<'_>], parameters: &[Vec<f64>]) -> Self {
        let mut start = vec![0.0; TERMS * shape.len()];
        for (index, (meaning, coefficients)) in shape.meanings().zip(start.chunks_mut(TERMS)).enumerate() {
            let mut normal = Normal::new(TERMS);
            for (fit, parameters) in fits.iter().zip(parameters) {
                normal.add(&factors(fit.theta, meaning), -parameters[index]);
            }
            if let Some(nearest) = normal.step(1e-6) {
                coefficients.copy_from_slice(&nearest);
            }
        }
        Self { shape, coefficients: fitted(shape, fits, start, |_| true, Pull::NONE) }
    }

    /// The polynomials that fit all views best, near these: each coefficient is pulled.
    pub(super) fn refined(&self, fits: &[ViewFit<'_>], pull: Pull<'_>) -> Self {
        let coefficients = fitted(self.shape, fits, self.coefficients.clone(), |_| true, pull);
        Self { shape: self.shape, coefficients }
    }

    /// The polynomials of a lobe that is wider by a factor, and else alike.
    pub(super) fn widened(&self, factor: f64) -> Self {
        let mut coefficients = self.coefficients.clone();
        for (meaning, values) in self.shape.meanings().zip(coefficients.as_chunks_mut::<TERMS>().0) {
            match meaning {
                Meaning::Delta => values.iter_mut().for_each(|value| *value *= factor),
                Meaning::Level => values[0] += Widths::PER_OCTAVE as f64 * math::log2(factor),
                Meaning::Kernel | Meaning::Weight => {}
            }
        }
        Self { shape: self.shape, coefficients }
    }

    /// The mean of these polynomials and others.
    pub(super) fn mean(&self, other: &Self) -> Self {
        let pairs = self.coefficients.iter().zip(&other.coefficients);
        Self { shape: self.shape, coefficients: pairs.map(|(a, b)| 0.5 * (a + b)).collect() }
    }

    /// The sum of squared residuals over all views, in stops.
    pub(super) fn cost(&self, fits: &[ViewFit<'_>]) -> f64 {
        fits.iter().map(|fit| fit.evaluate(&self.at(fit.theta), None)).sum()
    }

    /// Keeps the places and widths of the taps, and fits their weights to other lobes: those of one channel.
    pub(super) fn with_weights_of(&self, fits: &[ViewFit<'_>], pull: Pull<'_>) -> Self {
        let start = self.coefficients.clone();
        let coefficients = fitted(self.shape, fits, start, |meaning| meaning == Meaning::Weight, pull);
        Self { shape: self.shape, coefficients }
    }

    /// What the parameters are.
    pub(super) fn shape(&self) -> Shape {
        self.shape
    }

    /// The parameters at a view.
    pub(super) fn at(&self, theta: f64) -> Vec<f64> {
        values(self.shape, &self.coefficients, theta)
    }
}

/// The pull of each coefficient to that of other polynomials.
#[derive(Clone, Copy)]
pub(super) struct Pull<'a> {
    /// Where to; `None` if nothing pulls.
    pub(super) to: Option<&'a Smooth>,
    /// How strongly: the residual of a fourth of an octave, of a factor e of a weight, and of an angle of
    /// `width`.
    pub(super) strength: f64,
    /// The width of the lobe, in radians.
    pub(super) width: f64,
}

impl Pull<'_> {
    /// No pull.
    pub(super) const NONE: Self = Self { to: None, strength: 0.0, width: 1.0 };

    /// The cost of coefficients; adds to the normal equations, if they are given.
    fn evaluate(
        self,
        shape: Shape,
        coefficients: &[f64],
        free: impl Fn(Meaning) -> bool,
        mut normal: Option<&mut Normal>,
    ) -> f64 {
        let Some(to) = self.to else { return 0.0 };
        let mut cost = 0.0;
        for (parameter, meaning) in shape.meanings().enumerate().filter(|(_, meaning)| free(*meaning)) {
            let strength =
                if meaning == Meaning::Delta { self.strength / self.width } else { self.strength };
            for index in parameter * TERMS..(parameter + 1) * TERMS {
                let residual = strength * (coefficients[index] - to.coefficients[index]);
                cost += residual * residual;
                if let Some(normal) = normal.as_deref_mut() {
                    normal.add_one(index, strength, residual);
                }
            }
        }
        cost
    }
}

/// The coefficients near a start that fit all views best; those of parameters that are not `free` stay.
fn fitted(
    shape: Shape,
    fits: &[ViewFit<'_>],
    start: Vec<f64>,
    free: impl Fn(Meaning) -> bool + Copy,
    pull: Pull<'_>,
) -> Vec<f64> {
    let evaluate = |coefficients: &[f64], normal: Option<&mut Normal>| {
        let Some(normal) = normal else {
            let of_view = |fit: &ViewFit<'_>| fit.evaluate(&values(shape, coefficients, fit.theta), None);
            return fits.iter().map(of_view).sum::<f64>() + pull.evaluate(shape, coefficients, free, None);
        };
        let cost: f64 = fits.iter().map(|fit| add_view(shape, coefficients, fit, free, normal)).sum();
        cost + pull.evaluate(shape, coefficients, free, Some(normal))
    };
    minimise(start, evaluate, |_| ())
}

/// Adds what one view says of the free coefficients; returns its cost.
fn add_view(
    shape: Shape,
    coefficients: &[f64],
    fit: &ViewFit<'_>,
    free: impl Fn(Meaning) -> bool,
    whole: &mut Normal,
) -> f64 {
    let mut normal = Normal::new(shape.len());
    let cost = fit.evaluate(&values(shape, coefficients, fit.theta), Some(&mut normal));
    // Factors of 0 leave a parameter out.
    let factors: Vec<_> = (shape.meanings())
        .map(|meaning| if free(meaning) { factors(fit.theta, meaning) } else { [0.0; TERMS] })
        .collect();
    for (i, f) in factors.iter().enumerate() {
        for (a, f) in f.iter().enumerate() {
            let row = i * TERMS + a;
            whole.vector[row] += f * normal.vector[i];
            let line = &mut whole.matrix[row * whole.size..][..whole.size];
            for (j, g) in factors[..=i].iter().enumerate() {
                let scale = f * normal.matrix[i * normal.size + j];
                line[j * TERMS..][..TERMS].iter_mut().zip(g).for_each(|(sum, g)| *sum += scale * g);
            }
        }
    }
    cost
}
