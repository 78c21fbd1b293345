//! A grid of views, on which real harmonics are evaluated by rows and columns.
//!
//! Columns lie symmetrically about both axes: phi, pi - phi, pi + phi and -phi for each phi of a quarter
//! turn. So a sum over q is four sums over a quarter: cosines and sines of even and of odd q.

use std::f64::consts::{PI, TAU};

use brdf::Centre;
use sh::{Basis, Degree};
use sphere::Direction;

use crate::Terms;
use crate::plain::mean_views;

/// Views and the harmonics at them.
pub(super) struct ViewGrid {
    pub(super) p: usize,
    pub(super) terms: Terms,
    /// theta_o and the weight of each row.
    pub(super) rows: Vec<(f64, f64)>,
    /// The azimuths of a quarter turn.
    pub(super) quarter: Vec<f64>,
    /// f_pq(theta_o) times sqrt(2) for q > 0: [row, q, p - q], the rows of q one after the other.
    pub(super) functions: Vec<f32>,
    /// cos(q phi) and sin(q phi), and zeros up to [`ViewGrid::padded`]: [azimuth, q].
    pub(super) waves: Vec<[f32; 2]>,
    /// The number of orders q, rounded up to an even one.
    pub(super) padded: usize,
    /// 4 pi over the number of views.
    pub(super) solid_angle: f32,
}

/// The fewest rows of views, so that fits of few degrees share one table of the lamps.
const FEWEST: usize = 16;

/// The number of azimuths that one of a quarter turn stands for: phi, pi - phi, pi + phi, -phi.
pub(super) const MIRRORED: usize = 4;

impl ViewGrid {
    /// The harmonics up to degree P about this centre, at about (2 F + 8)^2 views, but 16^2 at least, F being
    /// the degree that is fitted.
    pub(super) fn new(p: usize, fitted: usize, terms: Terms, centre: Centre) -> Self {
        Self::with_rows((2 * fitted + 8).max(FEWEST).next_multiple_of(MIRRORED), p, terms, centre)
    }

    /// The harmonics up to another degree at the same views.
    pub(super) fn to_degree(&self, p: usize, centre: Centre) -> Self {
        Self::with_rows(self.rows.len(), p, self.terms, centre)
    }

    fn with_rows(count: usize, p: usize, terms: Terms, centre: Centre) -> Self {
        let rows: Vec<(f64, f64)> = mean_views(centre, count).collect();
        let columns = if terms == Terms::Zonal { MIRRORED } else { count };
        let quarter: Vec<f64> =
            (0..columns / MIRRORED).map(|j| TAU * (j as f64 + 0.5) / columns as f64).collect();
        let degree = Degree::new(p).unwrap_or(Degree::ZERO);
        let basis = Basis::new(degree);
        let mut y = vec![0.0; degree.rows()];
        let orders = if terms == Terms::Zonal { 0 } else { p };
        let mut functions = Vec::new();
        for (theta, _) in &rows {
            // At phi = 0 the harmonics of q > 0 are f_pq times sqrt(2).
            basis.evaluate_into(Direction::from_angles(*theta, 0.0), &mut y);
            for q in 0..=orders {
                functions.extend((q..=p).map(|p| y[p * p + p + q] as f32));
            }
        }
        let padded = (orders + 1).next_multiple_of(2);
        let wave = |phi: f64| {
            (0..padded).map(move |q| match q as f64 * phi {
                angle if q <= orders => [math::cos(angle) as f32, math::sin(angle) as f32],
                _ => [0.0; 2],
            })
        };
        let waves = quarter.iter().flat_map(|phi| wave(*phi)).collect();
        let solid_angle = (4.0 * PI / (rows.len() * columns) as f64) as f32;
        Self { p, terms, rows, quarter, functions, waves, padded, solid_angle }
    }

    /// The highest q.
    pub(super) fn orders(&self) -> usize {
        if self.terms == Terms::Zonal { 0 } else { self.p }
    }

    /// The number of views.
    pub(super) fn len(&self) -> usize {
        self.rows.len() * self.quarter.len() * MIRRORED
    }

    pub(super) fn functions_of(&self, row: usize) -> &[f32] {
        let count = self.functions.len() / self.rows.len();
        &self.functions[row * count..][..count]
    }

    /// The four azimuths that the j-th of a quarter stands for.
    pub(super) fn azimuths(&self, j: usize) -> [f64; MIRRORED] {
        let phi = self.quarter[j];
        [phi, PI - phi, PI + phi, -phi]
    }

    /// The number of coefficients p = q ..= P of each order q.
    pub(super) fn counts(&self) -> impl Iterator<Item = usize> + use<> {
        let p = self.p;
        (0..=self.orders()).map(move |q| p + 1 - q)
    }

    /// The rows of a map's coefficients as cosine and sine of each (q, p), q before p: what the sums over p
    /// then q need. Order 0 has no sine.
    pub(super) fn rows_of_pairs(&self) -> Vec<[Option<usize>; 2]> {
        let row = |p: usize, q: usize| match self.terms {
            Terms::Zonal => [Some(p), None],
            Terms::All if q == 0 => [Some(p * p + p), None],
            Terms::All => [Some(p * p + p + q), Some(p * p + p - q)],
        };
        (0..=self.orders()).flat_map(|q| (q..=self.p).map(move |p| row(p, q))).collect()
    }
}
