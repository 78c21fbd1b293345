//! Spherical harmonic reflection maps from explicit ones: coefficients fitted for each texel [RH02, app. C].
//!
//! Maps b_k of one grid, each for a view w_k, are samples of B(C, w) = sum over rows n of x_n(C) Y_n(w). For
//! each texel the coefficients minimise the sum over k of (sum over n of A_kn x_n - b_k)^2 with A_kn =
//! Y_n(w_k). A is the same for every texel: its pseudo-inverse is computed once, from A = Q R as R^-1 Q^T
//! (Gram and Schmidt's method, done twice, which keeps Q orthogonal to rounding), and each texel is a product
//! of it. There is no regularisation: a degree that the views do not determine is an error.
//!
//! *Conditioning.* |A| |A^+| / N with Frobenius norms and N coefficients: 1 for views on which the harmonics
//! are orthogonal. Errors of the maps' values that are independent become errors of the coefficients, larger
//! by this factor than from orthogonal views of the same number.

use brdf::Centre;
use rayon::prelude::*;
use sh::{Basis, Degree, zonal_into};
use sphere::Direction;

use crate::{MapGrid, Shrm, Terms, View};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The largest conditioning that is accepted if P is not given.
pub const GOOD_CONDITION: f64 = 2.0;

/// The largest conditioning that is accepted at all.
pub const WORST_CONDITION: f64 = 1e4;

/// A fitted map and how well it fits.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The fitted map.
    pub map: Shrm,
    /// The part of the values that the map leaves: root mean square over maps, texels (by solid angle) and
    /// channels, divided by that of the values. 0 for black maps, and if there are as many coefficients as
    /// views.
    pub residual: f64,
    /// The factor |A| |A^+| / N by which errors grow, 1 at best.
    pub condition: f64,
}

/// Why maps cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The values are not views x texels.
    #[error("{found} values are not those of {views} maps of {texels} texels")]
    Count {
        /// The number of values.
        found: usize,
        /// The number of views.
        views: usize,
        /// The number of texels of a map.
        texels: usize,
    },
    /// A value is NaN or infinite.
    #[error("map {map} holds {value} at texel {texel}")]
    NotFinite {
        /// The index of the map, from 0.
        map: usize,
        /// The index of the texel, along rows, rows along faces.
        texel: usize,
        /// The value that is NaN or infinite.
        value: f32,
    },
    /// The degree has more coefficients than there are views.
    #[error("degree P = {p} has {rows} coefficients, more than {views} views determine")]
    TooFewViews {
        /// The degree P.
        p: usize,
        /// The number of coefficients of the degree.
        rows: usize,
        /// The number of views.
        views: usize,
    },
    /// The views leave coefficients undetermined, or nearly.
    #[error(
        "the {views} views do not determine degree P = {p}: errors would grow {condition:.1e} times (at most 1e4)"
    )]
    Undetermined {
        /// The degree P.
        p: usize,
        /// The number of views.
        views: usize,
        /// The conditioning; infinite if a coefficient is not determined at all.
        condition: f64,
    },
}

/// A map with all terms, fitted to maps for single views.
///
/// `views` are V in the world for [`View::Global`], or w_o in the frame of each texel for [`View::Local`];
/// `maps` has shape [views, texels]. Without `p` the highest degree is taken that the views determine with a
/// conditioning of [`GOOD_CONDITION`] or better. Work is O(views P^4) once and O(views P^2) for each texel;
/// values are fitted in f64 and rounded once.
///
/// # Errors
/// If the number of values is not views x texels, a value is not finite, or the views do not determine `p`.
pub fn fit_views(
    grid: MapGrid,
    centre: Centre,
    view: View,
    views: &[Direction],
    maps: &[[f32; 3]],
    p: Option<Degree>,
) -> Result<Fit, FitError> {
    let rows = |p: usize| (p + 1) * (p + 1);
    let solver = solver(views.len(), p, rows, |p, k, row| Basis::new(p).evaluate_into(views[k], row))?;
    solver.run(grid, maps, |p, values| Shrm::new(grid, view, centre, p, Terms::All, values))
}

/// A local map of zonal terms, fitted to maps for angles theta_o, in radians, between central direction and
/// view.
///
/// `maps` has shape [angles, texels]; everything else as for [`fit_views`], with P + 1 coefficients.
///
/// # Errors
/// The errors of [`fit_views`].
pub fn fit_angles(
    grid: MapGrid,
    centre: Centre,
    angles: &[f64],
    maps: &[[f32; 3]],
    p: Option<Degree>,
) -> Result<Fit, FitError> {
    let solver = solver(angles.len(), p, |p| p + 1, |_, k, row| zonal_into(math::cos(angles[k]), row))?;
    solver.run(grid, maps, |p, values| Shrm::new(grid, View::Local, centre, p, Terms::Zonal, values))
}

/// Makes the solver of the requested degree, or of the highest that is well determined.
fn solver(
    views: usize,
    p: Option<Degree>,
    rows: impl Fn(usize) -> usize,
    fill: impl Fn(Degree, usize, &mut [f64]),
) -> Result<Solver, FitError> {
    let at = |p: Degree| {
        let columns = rows(p.get());
        if columns > views {
            return Err(FitError::TooFewViews { p: p.get(), rows: columns, views });
        }
        let mut matrix = vec![0.0; views * columns];
        for (k, row) in matrix.chunks_exact_mut(columns).enumerate() {
            fill(p, k, row);
        }
        Ok(Solver::new(p, views, matrix))
    };
    let undetermined =
        |solver: &Solver| FitError::Undetermined { p: solver.p.get(), views, condition: solver.condition };
    if let Some(p) = p {
        let solver = at(p)?;
        return if solver.condition <= WORST_CONDITION { Ok(solver) } else { Err(undetermined(&solver)) };
    }
    let mut best = at(Degree::ZERO)?;
    while let Ok(next) = Degree::new(best.p.get() + 1) {
        match at(next) {
            Ok(solver) if solver.condition <= GOOD_CONDITION => best = solver,
            _ => break,
        }
    }
    Ok(best)
}

/// A = Y_n(w_k), shape [views, rows], and its pseudo-inverse, shape [rows, views].
struct Solver {
    p: Degree,
    views: usize,
    matrix: Vec<f64>,
    inverse: Vec<f64>,
    condition: f64,
}

impl Solver {
    fn new(p: Degree, views: usize, matrix: Vec<f64>) -> Self {
        let rows = matrix.len() / views;
        // Columns of Q, one after the other, and R by columns.
        let mut q: Vec<f64> = Vec::with_capacity(matrix.len());
        let mut r = vec![0.0; rows * rows];
        let mut full_rank = true;
        for n in 0..rows {
            let mut column: Vec<f64> = (0..views).map(|k| matrix[k * rows + n]).collect();
            let size = norm(&column);
            for _ in 0..2 {
                for (m, q) in q.chunks_exact(views).enumerate() {
                    let part: f64 = q.iter().zip(&column).map(|(a, b)| a * b).sum();
                    column.iter_mut().zip(q).for_each(|(value, q)| *value -= part * q);
                    r[n * rows + m] += part;
                }
            }
            let left = norm(&column);
            full_rank &= left > 1e-10 * size;
            r[n * rows + n] = left;
            q.extend(column.iter().map(|value| value / left));
        }
        if !full_rank {
            return Self { p, views, matrix, inverse: Vec::new(), condition: f64::INFINITY };
        }
        // R X = Q^T from the last row up; Q^T's rows are Q's columns.
        let mut inverse = q;
        for n in (0..rows).rev() {
            let (upper, lower) = inverse.split_at_mut((n + 1) * views);
            let row = &mut upper[n * views..];
            for (m, below) in (n + 1..rows).zip(lower.chunks_exact(views)) {
                let factor = r[m * rows + n];
                row.iter_mut().zip(below).for_each(|(value, x)| *value -= factor * x);
            }
            row.iter_mut().for_each(|value| *value /= r[n * rows + n]);
        }
        let condition = norm(&matrix) * norm(&inverse) / rows as f64;
        Self { p, views, matrix, inverse, condition }
    }

    /// Fits every texel.
    fn run(
        self,
        grid: MapGrid,
        maps: &[[f32; 3]],
        shrm: impl Fn(Degree, Vec<[f32; 3]>) -> Option<Shrm>,
    ) -> Result<Fit, FitError> {
        const BLOCK: usize = 64;
        let (views, texels) = (self.views, grid.len());
        let wrong_count = FitError::Count { found: maps.len(), views, texels };
        if maps.len() != views * texels || texels == 0 {
            return Err(wrong_count);
        }
        if let Some(bad) = maps.as_flattened().iter().position(|value| !value.is_finite()) {
            let (map, texel) = (bad / 3 / texels, bad / 3 % texels);
            return Err(FitError::NotFinite { map, texel, value: maps.as_flattened()[bad] });
        }
        let rows = self.matrix.len() / views;
        let mut values = vec![[0.0_f32; 3]; texels * rows];
        let blocks = values.par_chunks_mut(BLOCK * rows).enumerate().map(|(block, values)| {
            let (mut samples, mut sums) = (vec![[0.0; 3]; views], [0.0; 2]);
            for (texel, out) in (block * BLOCK..).zip(values.chunks_exact_mut(rows)) {
                for (k, sample) in samples.iter_mut().enumerate() {
                    *sample = maps[k * texels + texel].map(f64::from);
                }
                for (out, inverse) in out.iter_mut().zip(self.inverse.chunks_exact(views)) {
                    *out = dot(inverse, &samples).map(|value| value as f32);
                }
                let [left, all] = self.left(&samples, out);
                let solid_angle = grid.solid_angle(texel);
                sums = [sums[0] + solid_angle * left, sums[1] + solid_angle * all];
            }
            sums
        });
        let blocks: Vec<[f64; 2]> = blocks.collect();
        let [left, all] = blocks.iter().fold([0.0; 2], |sum, block| [sum[0] + block[0], sum[1] + block[1]]);
        let residual = if all > 0.0 { (left / all).sqrt() } else { 0.0 };
        let map = shrm(self.p, values).ok_or(wrong_count)?;
        Ok(Fit { map, residual, condition: self.condition })
    }

    /// The sums of squares of the part of a texel's samples that coefficients leave, and of the samples.
    fn left(&self, samples: &[[f64; 3]], rows: &[[f32; 3]]) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (sample, harmonics) in samples.iter().zip(self.matrix.chunks_exact(rows.len())) {
            for channel in 0..3 {
                let terms = harmonics.iter().zip(rows);
                let fitted: f64 = terms.map(|(y, row)| y * f64::from(row[channel])).sum();
                sums[0] += math::powi(sample[channel] - fitted, 2);
                sums[1] += math::powi(sample[channel], 2);
            }
        }
        sums
    }
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

fn dot(weights: &[f64], samples: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (weight, sample) in weights.iter().zip(samples) {
        for channel in 0..3 {
            sum[channel] += weight * sample[channel];
        }
    }
    sum
}
