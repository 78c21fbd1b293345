//! From coefficients to pixels: columns of equal m, then rows.

use rayon::prelude::*;

use super::fourier::Sample;
use super::grid::Grid;
use super::plan::{TransformError, TransformPlan, Workspace, order_pairs};
use super::sums::{Evaluate, Group, ODD, PARTS};
use crate::f64x4::{LANES, SimdLevel};
use crate::legendre::LegendreRecurrence;
use crate::{Degree, Expansion};

/// A plan for synthesis alone: the values of an expansion at the pixels of any grid, however coarse.
///
/// Unlike [`crate::Transform`] it works with any number of rows and columns: values are those of the function
/// at the pixel centres.
pub struct Synthesis {
    plan: TransformPlan,
    degree: Degree,
}

impl Synthesis {
    /// A plan for `degree` on a [`sphere::LatLong`] or [`crate::GaussGrid`].
    ///
    /// # Errors
    /// If the grid has no pixel.
    pub fn new(grid: impl Into<Grid>, degree: Degree) -> Result<Self, TransformError> {
        Self::at_level(SimdLevel::detect(), grid.into(), degree)
    }

    pub(super) fn at_level(level: SimdLevel, grid: Grid, degree: Degree) -> Result<Self, TransformError> {
        if grid.is_empty() {
            return Err(TransformError::Empty { columns: grid.width(), rows: grid.height() });
        }
        Ok(Self { plan: TransformPlan::new(level, grid, degree.get()), degree })
    }

    /// The grid of the pixels.
    pub fn grid(&self) -> &Grid {
        &self.plan.grid
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    pub(super) fn plan(&self) -> &TransformPlan {
        &self.plan
    }

    /// The image of an expansion; its degree may be lower than that of the plan.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan.
    pub fn synthesise<T: Sample>(&self, expansion: &Expansion) -> Vec<[T; 3]> {
        let mut pixels = vec![[T::ZERO; 3]; self.plan.grid.len()];
        self.synthesise_into(expansion, &mut pixels);
        pixels
    }

    /// [`Synthesis::synthesise`] into memory of the caller.
    ///
    /// # Panics
    /// If the expansion's degree is past that of the plan, or the number of pixels is not that of the grid.
    pub fn synthesise_into<T: Sample>(&self, expansion: &Expansion, pixels: &mut [[T; 3]]) {
        let plan = &self.plan;
        assert!(expansion.degree() <= self.degree, "the expansion's degree is past that of the plan");
        assert_eq!(pixels.len(), plan.grid.len(), "the number of pixels is not that of the grid");
        plan.with_workspace(|Workspace { groups, .. }| {
            let count = plan.rows.groups();
            let pairs = order_pairs(plan.degree);
            groups.par_chunks_mut(2 * count).zip(pairs).for_each_init(
                SynthesisScratch::default,
                |scratch, (columns, pair)| {
                    for (m, column) in pair.zip(columns.chunks_exact_mut(count)) {
                        scratch.evaluate(plan, expansion, m, column);
                    }
                },
            );

            let (width, height) = (plan.grid.width(), plan.grid.height());
            let (mut north, mut south) = pixels.split_at_mut(height.div_ceil(2) * width);
            let tasks: Vec<_> = (0..count)
                .map(|_| {
                    let first = (LANES * width).min(north.len());
                    let (top, rest) = std::mem::take(&mut north).split_at_mut(first);
                    north = rest;
                    let last = south.len() - (LANES * width).min(south.len());
                    let (rest, bottom) = std::mem::take(&mut south).split_at_mut(last);
                    south = rest;
                    (top, bottom)
                })
                .collect();
            let groups: &[Group] = groups;
            tasks.into_par_iter().enumerate().for_each_init(
                || plan.fourier_scratch.take(),
                |scratch, (group, (north, south))| {
                    plan.fourier.synthesise(|m| &groups[m * count + group], scratch, north, south);
                },
            );
        });
    }
}

/// Memory of one task of the Legendre sums.
#[derive(Default)]
struct SynthesisScratch {
    recurrence: LegendreRecurrence,
    /// (cosine, sine) of each channel for l = m .. .
    order: Vec<[f64; ODD]>,
    terms: Vec<[f64; PARTS]>,
}

impl SynthesisScratch {
    /// The Fourier coefficients of one order at every pair of rows.
    fn evaluate(&mut self, plan: &TransformPlan, expansion: &Expansion, m: usize, column: &mut [Group]) {
        self.recurrence.prepare(m, plan.degree);
        let steps = self.recurrence.steps().len();
        self.order.clear();
        self.order.extend((m..=expansion.degree().get()).map(|l| {
            let centre = l * l + l;
            let [r, g, b] = expansion.coefficients()[centre + m];
            let [r_sine, g_sine, b_sine] =
                if m > 0 { expansion.coefficients()[centre - m] } else { [0.0; 3] };
            [r, r_sine, g, g_sine, b, b_sine]
        }));
        self.order.resize(2 * steps + 1, [0.0; ODD]);
        self.terms.clear();
        self.terms.extend(self.order[..2 * steps].chunks_exact(2).enumerate().map(|(k, degrees)| {
            // sum over l of a_l P_l, gathered by lambda_k.
            let (now, after) = (self.recurrence.even(k), self.recurrence.even_after(k));
            let (odd, next) = (self.recurrence.odd(k), &self.order[2 * k + 2]);
            std::array::from_fn(|part| match part.checked_sub(ODD) {
                None => now * degrees[0][part] + after * next[part],
                Some(part) => odd * degrees[1][part],
            })
        }));
        plan.level.run(Evaluate {
            rows: &plan.rows,
            recurrence: &self.recurrence,
            degree: plan.degree,
            terms: &self.terms,
            columns: column,
        });
    }
}
