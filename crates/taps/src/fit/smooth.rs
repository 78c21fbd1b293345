//! Taps that change smoothly with the view: each parameter is a polynomial in 1 - cos(theta_v), fitted to all
//! views at once.

use super::least_squares::{Normal, minimise};
use super::view::{Meaning, Shape, ViewFit};

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
        Self { shape, coefficients: fitted(shape, fits, start, |_| true) }
    }

    /// Keeps the places and widths of the taps, and fits their weights to other lobes: those of one channel.
    pub(super) fn with_weights_of(&self, fits: &[ViewFit<'_>]) -> Self {
        let start = self.coefficients.clone();
        let coefficients = fitted(self.shape, fits, start, |meaning| meaning == Meaning::Weight);
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

/// The coefficients near a start that fit all views best; those of parameters that are not `free` stay.
fn fitted(
    shape: Shape,
    fits: &[ViewFit<'_>],
    start: Vec<f64>,
    free: impl Fn(Meaning) -> bool + Copy,
) -> Vec<f64> {
    let evaluate = |coefficients: &[f64], normal: Option<&mut Normal>| {
        let Some(normal) = normal else {
            return fits.iter().map(|fit| fit.evaluate(&values(shape, coefficients, fit.theta), None)).sum();
        };
        fits.iter().map(|fit| add_view(shape, coefficients, fit, free, normal)).sum()
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
