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
    /// the sine of theta_v: head on, a tap looks along R. Then those of the weights of further lobes, whose
    /// taps have the same places.
    coefficients: Vec<f64>,
}

/// For each parameter of a lobe the index of its polynomial. All lobes have the places of the taps in common,
/// and each has weights of its own.
fn polynomials(shape: Shape, lobe: usize) -> Vec<usize> {
    let mut further = shape.len() + lobe.saturating_sub(1) * shape.weights().count()..;
    let index = |(index, meaning): (usize, Meaning)| match meaning {
        Meaning::Weight if lobe > 0 => further.next().unwrap_or(index),
        _ => index,
    };
    shape.meanings().enumerate().map(index).collect()
}

/// The coefficients of one lobe, those of its weights in the place of the first's.
fn of_lobe(shape: Shape, coefficients: &[f64], lobe: usize) -> Vec<f64> {
    let terms = |index: usize| &coefficients[index * TERMS..][..TERMS];
    polynomials(shape, lobe).into_iter().flat_map(terms).copied().collect()
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
        Self { shape, coefficients: fitted(shape, &[fits], start, |_| true, Pull::NONE) }
    }

    /// The polynomials that fit all views of all lobes best, near these: each coefficient is pulled. A lobe
    /// without weights starts from those of the first.
    pub(super) fn refined(&self, lobes: &[Vec<ViewFit<'_>>], pull: Pull<'_>) -> Self {
        let mut start = self.coefficients.clone();
        let whole = TERMS * (self.shape.len() + (lobes.len() - 1) * self.shape.weights().count());
        while start.len() < whole {
            for index in self.shape.weights() {
                start.extend_from_within(index * TERMS..(index + 1) * TERMS);
            }
        }
        let lobes: Vec<&[ViewFit<'_>]> = lobes.iter().map(Vec::as_slice).collect();
        Self { shape: self.shape, coefficients: fitted(self.shape, &lobes, start, |_| true, pull) }
    }

    /// The polynomials of one of the lobes.
    pub(super) fn lobe(&self, lobe: usize) -> Self {
        Self { shape: self.shape, coefficients: of_lobe(self.shape, &self.coefficients, lobe) }
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
        let coefficients = fitted(self.shape, &[fits], start, |meaning| meaning == Meaning::Weight, pull);
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
        // Polynomials after those of the first lobe are of weights.
        let meanings = shape.meanings().chain(std::iter::repeat(Meaning::Weight));
        let polynomials = meanings.take(coefficients.len() / TERMS).enumerate();
        for (parameter, meaning) in polynomials.filter(|(_, meaning)| free(*meaning)) {
            let strength = if meaning == Meaning::Delta { self.strength / self.width } else { self.strength };
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

/// The coefficients near a start that fit all views of each lobe best; those of parameters that are not
/// `free` stay.
fn fitted(
    shape: Shape,
    lobes: &[&[ViewFit<'_>]],
    start: Vec<f64>,
    free: impl Fn(Meaning) -> bool + Copy,
    pull: Pull<'_>,
) -> Vec<f64> {
    let evaluate = |coefficients: &[f64], mut normal: Option<&mut Normal>| {
        let pulled = pull.evaluate(shape, coefficients, free, normal.as_deref_mut());
        let of_lobe = |(lobe, fits): (usize, &&[ViewFit<'_>])| -> f64 {
            let coefficients = of_lobe(shape, coefficients, lobe);
            let Some(normal) = normal.as_deref_mut() else {
                let cost = |fit: &ViewFit<'_>| {
                    fit.importance * fit.evaluate(&values(shape, &coefficients, fit.theta), None)
                };
                return fits.iter().map(cost).sum();
            };
            let places = polynomials(shape, lobe);
            fits.iter().map(|fit| add_view(shape, &coefficients, fit, free, &places, normal)).sum()
        };
        lobes.iter().enumerate().map(of_lobe).sum::<f64>() + pulled
    };
    minimise(start, evaluate, |_| ())
}

/// Adds what one view of a lobe says of the free coefficients of its polynomials, whose places among all are
/// given; returns its cost.
fn add_view(
    shape: Shape,
    coefficients: &[f64],
    fit: &ViewFit<'_>,
    free: impl Fn(Meaning) -> bool,
    places: &[usize],
    whole: &mut Normal,
) -> f64 {
    let mut normal = Normal::new(shape.len());
    let cost = fit.evaluate(&values(shape, coefficients, fit.theta), Some(&mut normal));
    // Factors of 0 leave a parameter out.
    let factors: Vec<_> = (shape.meanings())
        .map(|meaning| if free(meaning) { factors(fit.theta, meaning) } else { [0.0; TERMS] })
        .collect();
    for i in 0..factors.len() {
        for (a, f) in factors[i].iter().enumerate() {
            whole.vector[places[i] * TERMS + a] += fit.importance * f * normal.vector[i];
        }
        for j in 0..=i {
            // The lower triangle is kept, also where a weight stands behind a place.
            let (row, column) = if places[i] >= places[j] { (i, j) } else { (j, i) };
            for (a, f) in factors[row].iter().enumerate() {
                let scale = fit.importance * f * normal.matrix[i * normal.size + j];
                let line = &mut whole.matrix[(places[row] * TERMS + a) * whole.size..][..whole.size];
                let sums = &mut line[places[column] * TERMS..][..TERMS];
                sums.iter_mut().zip(&factors[column]).for_each(|(sum, g)| *sum += scale * g);
            }
        }
    }
    fit.importance * cost
}
