//! What a fit minimises: residuals in stops, under spots of light and under a uniform light.

use std::f64::consts::{LN_2, PI};

use super::least_squares::Normal;

/// The ambient light of every test, in shares of the spot's flux.
pub(super) const AMBIENT: f64 = 0.03 / (4.0 * PI);

/// How much more the uniform light weighs than one spot.
const UNIFORM: f64 = 4.0;

/// The residuals so far.
pub(super) struct Residuals<'a> {
    /// The sum of their squares.
    pub(super) cost: f64,
    /// What they are added to with their derivatives, if that is asked for.
    normal: Option<&'a mut Normal>,
}

impl<'a> Residuals<'a> {
    pub(super) fn new(normal: Option<&'a mut Normal>) -> Self {
        Self { cost: 0.0, normal }
    }

    /// Adds the residual of a spot, of which taps make `sum`, the ambient light included, and the lobe
    /// `truth` without it; `row` has the derivatives of the sum, and is changed.
    #[inline]
    pub(super) fn add_spot(&mut self, sum: f64, truth: f64, row: &mut [f64]) {
        let residual = math::log2(sum / (truth + AMBIENT));
        self.cost += residual * residual;
        if let Some(normal) = self.normal.as_deref_mut() {
            let scale = 1.0 / (LN_2 * sum);
            row.iter_mut().for_each(|value| *value *= scale);
            normal.add(row, residual);
        }
    }

    /// Adds the residual of the uniform light, under which the sum of the weights is 1. Each has the index of
    /// its logarithm among the parameters; `row` has a place for each parameter, and is changed.
    pub(super) fn add_uniform(
        &mut self,
        weights: impl Iterator<Item = (usize, f64)> + Clone,
        row: &mut [f64],
    ) {
        let whole: f64 = weights.clone().map(|(_, weight)| weight).sum();
        let residual = UNIFORM * math::log2(whole);
        self.cost += residual * residual;
        if let Some(normal) = self.normal.as_deref_mut() {
            row.fill(0.0);
            for (index, weight) in weights {
                row[index] = UNIFORM * weight / (LN_2 * whole);
            }
            normal.add(row, residual);
        }
    }
}
