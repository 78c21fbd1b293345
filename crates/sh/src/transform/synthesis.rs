//! From coefficients to pixels: columns of equal m, then rows.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::plan::{TransformPlan, Workspace, blocks_of_orders};
use super::precision::Precision;
use super::sums::{Evaluate, Group, ODD, PARTS};
use crate::Expansion;
use crate::legendre::LegendreRecurrence;
use crate::vector::LANES;

/// The pixels of an expansion whose degree is at most that of the plan.
pub(super) fn synthesise<T: Precision>(plan: &TransformPlan, expansion: &Expansion, pixels: &mut [[T; 3]]) {
    assert_eq!(pixels.len(), plan.grid.len(), "the number of pixels is not that of the grid");
    plan.with_workspace(|Workspace::<T> { groups, .. }| {
        let count = plan.rows.groups();
        let blocks = blocks_of_orders(plan.degree, ORDERS);
        groups.par_chunks_mut(ORDERS * count).zip(blocks).for_each_init(
            SynthesisScratch::default,
            |scratch, (columns, block)| {
                scratch.gather(expansion, block.clone(), plan.degree);
                for (m, column) in block.zip(columns.chunks_exact_mut(count)) {
                    scratch.evaluate(plan, m, column);
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
        let groups: &[Group<T>] = groups;
        let along_rows = plan.along_rows::<T>();
        tasks.into_par_iter().enumerate().for_each_init(
            || along_rows.fourier_scratch.take(),
            |scratch, (group, (north, south))| {
                along_rows.fourier.synthesise(|m| &groups[m * count + group], scratch, north, south);
            },
        );
    });
}

/// Orders in one task of the Legendre sums: their coefficients of one degree are adjacent.
const ORDERS: usize = 8;

/// Memory of one task of the Legendre sums.
#[derive(Default)]
struct SynthesisScratch {
    recurrence: LegendreRecurrence,
    /// (cosine, sine) of each channel, for each order of the task and, from the first of these on, each l.
    degrees: Vec<[[f64; ODD]; ORDERS]>,
    terms: Vec<[f64; PARTS]>,
}

impl SynthesisScratch {
    /// Takes the coefficients of some orders, with zeros for two degrees past the plan's.
    fn gather(&mut self, expansion: &Expansion, block: Range<usize>, degree: usize) {
        self.degrees.clear();
        self.degrees.resize(degree + 3 - block.start, [[0.0; ODD]; ORDERS]);
        for (l, orders) in (block.start..=expansion.degree().get()).zip(&mut self.degrees) {
            let centre = l * l + l;
            let last = block.end.min(l + 1);
            let cosines = &expansion.coefficients()[centre + block.start..centre + last];
            let sines = &expansion.coefficients()[centre + 1 - last..centre + 1 - block.start];
            for ((order, [r, g, b]), sine) in orders.iter_mut().zip(cosines).zip(sines.iter().rev()) {
                *order = [*r, sine[0], *g, sine[1], *b, sine[2]];
            }
            if block.start == 0 {
                let [r, _, g, _, b, _] = orders[0];
                orders[0] = [r, 0.0, g, 0.0, b, 0.0];
            }
        }
    }

    /// The Fourier coefficients of one order at every pair of rows.
    fn evaluate<T: Precision>(&mut self, plan: &TransformPlan, m: usize, column: &mut [Group<T>]) {
        self.recurrence.prepare(m, plan.degree);
        self.terms.resize(self.recurrence.steps().len(), [0.0; PARTS]);
        let order = m % ORDERS;
        let degrees = &self.degrees[order..];
        plan.level.run(Terms { recurrence: &self.recurrence, degrees, order, terms: &mut self.terms });
        plan.level.run_wide(Evaluate {
            rows: &plan.rows,
            recurrence: &self.recurrence,
            degree: plan.degree,
            terms: &self.terms,
            columns: column,
        });
    }
}

/// sum over l of a_l P_l, gathered by lambda_k.
struct Terms<'a> {
    recurrence: &'a LegendreRecurrence,
    /// From l = m on.
    degrees: &'a [[[f64; ODD]; ORDERS]],
    order: usize,
    terms: &'a mut [[f64; PARTS]],
}

impl WithSimd for Terms<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { recurrence, degrees, order, terms } = self;
        for (k, (terms, degrees)) in terms.iter_mut().zip(degrees.windows(3).step_by(2)).enumerate() {
            let (now, after, odd) = (recurrence.even(k), recurrence.even_after(k), recurrence.odd(k));
            for part in 0..ODD {
                terms[part] = now * degrees[0][order][part] + after * degrees[2][order][part];
                terms[ODD + part] = odd * degrees[1][order][part];
            }
        }
    }
}
