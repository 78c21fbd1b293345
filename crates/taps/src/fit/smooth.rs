//! Taps that change smoothly with the view: polynomials in 1 - cos(theta_v), fitted to all views at once.

use sh::{Stop, Stopped};

use super::least_squares::Normal;
use super::view::{Parameters, ViewFit};

/// The number of coefficients of each polynomial.
const TERMS: usize = 8;

/// The polynomials of all taps.
#[derive(Clone, Debug)]
pub(crate) struct Smooth {
    /// For each tap and parameter the coefficients of Chebyshev's polynomials; those of delta are multiplied by
    /// the sine of theta_v.
    coefficients: Vec<[[f64; TERMS]; 3]>,
}

/// Chebyshev's polynomials at 1 - cos(theta).
fn basis(theta: f64) -> [f64; TERMS] {
    let x = 2.0 * (1.0 - math::cos(theta)) - 1.0;
    let mut basis = [1.0; TERMS];
    basis[1] = x;
    for i in 2..TERMS {
        basis[i] = 2.0 * x * basis[i - 1] - basis[i - 2];
    }
    basis
}

/// The factors of a view for the three parameters.
fn factors(theta: f64) -> [[f64; TERMS]; 3] {
    let basis = basis(theta);
    [basis.map(|value| value * math::sin(theta)), basis, basis]
}

impl Smooth {
    /// The taps at a view.
    pub(crate) fn at(&self, theta: f64) -> Vec<[f64; 3]> {
        let factors = factors(theta);
        let value = |tap: &[[f64; TERMS]; 3]| {
            std::array::from_fn(|p| tap[p].iter().zip(&factors[p]).map(|(a, b)| a * b).sum())
        };
        self.coefficients.iter().map(value).collect()
    }

    /// The root of the mean squared residual of all views.
    pub(crate) fn cost(&self, problems: &[ViewFit<'_>]) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for problem in problems {
            let mut taps = self.at(problem.theta);
            problem.bound(&mut taps);
            sum += problem.evaluate(&taps, None);
            count += problem.len();
        }
        (sum / count as f64).sqrt()
    }

    /// The polynomials nearest to taps at some views.
    fn through(thetas: &[f64], views: &[Parameters]) -> Self {
        let taps = views[0].0.len();
        let mut coefficients = vec![[[0.0; TERMS]; 3]; taps];
        for tap in 0..taps {
            for p in 0..3 {
                let mut normal = Normal::new(TERMS);
                for (theta, view) in thetas.iter().zip(views) {
                    normal.add(&factors(*theta)[p], -view.0[tap][p]);
                }
                if let Some(found) = normal.step(1e-6) {
                    coefficients[tap][p].copy_from_slice(&found);
                }
            }
        }
        Self { coefficients }
    }

    fn normal(&self, problems: &[ViewFit<'_>]) -> (Normal, f64) {
        let taps = self.coefficients.len();
        let size = 3 * TERMS * taps;
        let mut whole = Normal::new(size);
        let mut cost = 0.0;
        for problem in problems {
            let at = self.at(problem.theta);
            let mut bounded = at.clone();
            problem.bound(&mut bounded);
            let mut normal = Normal::new(3 * taps);
            cost += problem.evaluate(&bounded, Some(&mut normal));
            let factors = factors(problem.theta);
            for i in 0..3 * taps {
                let f = &factors[i % 3];
                for a in 0..TERMS {
                    whole.vector[i * TERMS + a] += f[a] * normal.vector[i];
                }
                for j in 0..=i {
                    let (value, g) = (normal.matrix[i * normal.size + j], &factors[j % 3]);
                    for a in 0..TERMS {
                        let row = &mut whole.matrix[(i * TERMS + a) * size + j * TERMS..][..TERMS];
                        let scale = value * f[a];
                        row.iter_mut().zip(g).for_each(|(sum, g)| *sum += scale * g);
                    }
                }
            }
        }
        (whole, cost)
    }

    fn stepped(&self, step: &[f64]) -> Self {
        let mut coefficients = self.coefficients.clone();
        let flat = coefficients.as_flattened_mut().as_flattened_mut();
        flat.iter_mut().zip(step).for_each(|(value, step)| *value += step);
        Self { coefficients }
    }
}

/// The polynomials that fit all views best, from taps at each.
pub(crate) fn refine(
    problems: &[ViewFit<'_>],
    thetas: &[f64],
    views: &[Parameters],
    stop: Stop<'_>,
) -> Result<Smooth, Stopped> {
    let mut smooth = Smooth::through(thetas, views);
    let mut damping = 1e-2;
    let whole = |smooth: &Smooth| {
        let mut sum = 0.0;
        for problem in problems {
            let mut taps = smooth.at(problem.theta);
            problem.bound(&mut taps);
            sum += problem.evaluate(&taps, None);
        }
        sum
    };
    for _ in 0..ITERATIONS {
        stop.check()?;
        let (normal, cost) = smooth.normal(problems);
        let mut better = None;
        while damping < 1e6 {
            if let Some(step) = normal.step(damping) {
                let trial = smooth.stepped(&step);
                let trial_cost = whole(&trial);
                if trial_cost < cost {
                    better = Some((trial, trial_cost));
                    break;
                }
            }
            damping *= 4.0;
        }
        let Some((trial, trial_cost)) = better else { break };
        smooth = trial;
        damping = (damping * 0.25).max(1e-7);
        if cost - trial_cost < 1e-4 * cost {
            break;
        }
    }
    Ok(smooth)
}

const ITERATIONS: usize = 40;
