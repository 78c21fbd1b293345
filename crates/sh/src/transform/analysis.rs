//! From pixels to coefficients: rows, then columns of equal m, then the order of [`Expansion`].

use std::f64::consts::TAU;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::fourier::{FourierScratch, ImageRows};
use super::grid::Grid;
use super::plan::{TransformPlan, Workspace, blocks_of_orders, split};
use super::precision::{ForEachPrecision, PerPrecision, Precision};
use super::resample::{ORDERS, Resample, ResampleScratch};
use super::spare::InUse;
use super::sums::{Group, ODD, PARTS, Project};
use crate::legendre::LegendreRecurrence;
use crate::vector::{F64x8, LANES};
use crate::{Expansion, Stop, Stopped, quadrature};

/// The rule by which a grid integrates along theta.
pub struct Colatitude {
    /// A weight w for each northern row, in eights, zeros past the last: w for even parts, w x for odd ones.
    weights: Vec<[F64x8; 2]>,
    /// For pixel-centred rows past half of their degree; the weights of these are 1.
    resample: Option<ForEachPrecision<ResampleOf>>,
}

struct ResampleOf;

impl PerPrecision for ResampleOf {
    type Of<T: Precision> = Resample<T>;
}

/// Degrees in one task of the last step.
const DEGREES: usize = 8;

impl Colatitude {
    pub(super) fn new(plan: &TransformPlan) -> Self {
        let TransformPlan { grid, rows, degree, .. } = plan;
        let height = grid.height();
        let resampled = matches!(grid, Grid::LatLong(_)) && 2 * *degree > height - 1;
        let weights = match grid {
            _ if resampled => vec![1.0; height],
            Grid::LatLong(_) => quadrature::fejer(height).iter().map(|w| scale(grid) * w).collect(),
            Grid::Gauss(gauss) => gauss.weights().iter().map(|w| scale(grid) * w).collect(),
        };
        let northern = &weights[..height.div_ceil(2)];
        let lanes = northern.chunks(LANES).zip(&rows.cosine).map(|(weights, cosine)| {
            let even = F64x8::from_fn(|lane| weights.get(lane).copied().unwrap_or(0.0));
            [even, F64x8::from_fn(|lane| even.0[lane] * cosine.0[lane])]
        });
        Self { weights: lanes.collect(), resample: resampled.then(ForEachPrecision::new) }
    }
}

/// The factor of sums over columns that makes them integrals over phi.
fn scale(grid: &Grid) -> f64 {
    TAU / grid.width() as f64
}

/// Memory of one task of the Legendre sums.
struct AnalysisScratch<T: Precision> {
    recurrence: LegendreRecurrence,
    column: Vec<Group<f64>>,
    current: Vec<F64x8>,
    previous: Vec<F64x8>,
    sums: Vec<Group<f64>>,
    resampled: Vec<Group<T>>,
    resample: ResampleScratch<T>,
}

/// The coefficients of an image.
pub(super) fn analyse<T: Precision>(
    plan: &TransformPlan,
    colatitude: &Colatitude,
    image: &dyn ImageRows<T>,
    stop: Stop<'_>,
    expansion: &mut Expansion,
) -> Result<(), Stopped> {
    assert_eq!(image.pixel_count(), plan.grid.len(), "the number of pixels is not that of the grid");
    plan.with_workspace(|workspace| {
        let Workspace { groups, orders } = workspace;
        let (count, width) = (plan.degree + 1, plan.grid.width());
        let along_rows = plan.along_rows::<T>();
        let fourier = &along_rows.fourier;
        let at_once = image.rows_at_once().div_ceil(LANES);
        let band = |(scratch, bands): &mut (InUse<'_, FourierScratch<T>>, [Vec<_>; 2]),
                    (band, output): (usize, &mut [Group<T>])| {
            stop.check()?;
            let first = band * at_once;
            let [at_north, at_south] = fourier.rows(first..(first + at_once).min(fourier.groups()));
            let [north, south] = bands;
            let bands = [
                (at_north.start, image.read_rows(width, at_north, north)),
                (at_south.start, image.read_rows(width, at_south, south)),
            ];
            for (group, output) in (first..).zip(output.chunks_mut(count)) {
                fourier.analyse(group, bands, scratch, output);
            }
            Ok(())
        };
        groups
            .par_chunks_mut(count * at_once)
            .enumerate()
            .map_init(|| (along_rows.fourier_scratch.take(), Default::default()), band)
            .collect::<Result<(), Stopped>>()?;

        let resample = colatitude.resample.as_ref().map(|resample| {
            resample.get(|| Resample::<T>::new(plan.level, plan.grid.height(), scale(&plan.grid)))
        });
        let blocks = blocks_of_orders(plan.degree, if resample.is_some() { ORDERS } else { 2 });
        let lengths = blocks.iter().map(|block| block.clone().map(|m| count - m).sum());
        let parts = split(orders, lengths);
        blocks.into_par_iter().zip(parts).for_each_init(
            || AnalysisScratch::new(plan),
            |scratch, (block, output)| {
                scratch.integrate(plan, &colatitude.weights, resample, groups, block, output);
            },
        );

        reorder(plan.degree, orders, expansion.coefficients_mut());
        Ok(())
    })
}

impl<T: Precision> AnalysisScratch<T> {
    fn new(plan: &TransformPlan) -> Self {
        let groups = plan.rows.groups();
        Self {
            recurrence: LegendreRecurrence::default(),
            column: vec![[F64x8::ZERO; PARTS]; groups],
            current: vec![F64x8::ZERO; groups],
            previous: vec![F64x8::ZERO; groups],
            sums: Vec::new(),
            resampled: Vec::new(),
            resample: ResampleScratch::default(),
        }
    }

    /// The coefficients of a block of orders, by m, then l.
    fn integrate(
        &mut self,
        plan: &TransformPlan,
        weights: &[[F64x8; 2]],
        resample: Option<&Resample<T>>,
        groups: &[Group<T>],
        block: std::ops::Range<usize>,
        mut output: &mut [[f64; 6]],
    ) {
        let count = plan.degree + 1;
        // The groups of the first order, and how far apart groups of one order and those of one row are.
        let (mut input, mut stride, mut ahead) = (&groups[block.start..], count, 1);
        if let Some(resample) = resample {
            resample.apply(input, block.len(), count, &mut self.resampled, &mut self.resample);
            (input, stride, ahead) = (&self.resampled, 1, plan.rows.groups());
        }
        for (i, m) in block.enumerate() {
            let input = &input[i * ahead..];
            plan.level.run(Gather { input, stride, weights, column: &mut self.column });
            self.recurrence.prepare(m, plan.degree);
            self.sums.resize(self.recurrence.steps().len(), [F64x8::ZERO; PARTS]);
            plan.level.run_wide(Project {
                rows: &plan.rows,
                recurrence: &self.recurrence,
                degree: plan.degree,
                columns: &self.column,
                current: &mut self.current,
                previous: &mut self.previous,
                sums: &mut self.sums,
            });
            let (order, rest) = output.split_at_mut(count - m);
            plan.level.run(Finish { recurrence: &self.recurrence, sums: &self.sums, order });
            output = rest;
        }
    }
}

/// column = weights times every `stride`-th group of the input.
struct Gather<'a, T> {
    input: &'a [Group<T>],
    stride: usize,
    weights: &'a [[F64x8; 2]],
    column: &'a mut [Group<f64>],
}

impl<T: Precision> WithSimd for Gather<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let inputs = self.input.iter().step_by(self.stride);
        for ((to, from), weights) in self.column.iter_mut().zip(inputs).zip(self.weights) {
            for part in 0..PARTS {
                let weight = &weights[usize::from(part >= ODD)];
                for lane in 0..LANES {
                    to[part].0[lane] = weight.0[lane] * from[part].0[lane].to_f64();
                }
            }
        }
    }
}

/// Turns sums with lambda_k into sums with P_lm, l = m ..= degree.
struct Finish<'a> {
    recurrence: &'a LegendreRecurrence,
    sums: &'a [Group<f64>],
    order: &'a mut [[f64; 6]],
}

impl WithSimd for Finish<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { recurrence, sums, order } = self;
        let mut earlier = [0.0; ODD];
        for (k, (sum, degrees)) in sums.iter().zip(order.chunks_mut(2)).enumerate() {
            let mut total = [0.0; PARTS];
            for part in 0..PARTS {
                let mut lanes = [0.0; LANES / 2];
                for i in 0..LANES / 2 {
                    lanes[i] = sum[part].0[i] + sum[part].0[LANES / 2 + i];
                }
                total[part] = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
            }
            let now = recurrence.even(k);
            let before = if k > 0 { recurrence.even_after(k - 1) } else { 0.0 };
            for part in 0..ODD {
                degrees[0][part] = now * total[part] + before * earlier[part];
                earlier[part] = total[part];
            }
            if let Some(odd) = degrees.get_mut(1) {
                let factor = recurrence.odd(k);
                for part in 0..ODD {
                    odd[part] = factor * total[ODD + part];
                }
            }
        }
    }
}

/// Takes coefficients ordered by rising m, then l, to rows l * l + l + m.
fn reorder(degree: usize, orders: &[[f64; 6]], rows: &mut [[f64; 3]]) {
    let blocks: Vec<_> = (0..=degree).step_by(DEGREES).map(|l| l..(l + DEGREES).min(degree + 1)).collect();
    let lengths = blocks.iter().map(|block| block.end * block.end - block.start * block.start);
    let parts = split(rows, lengths);
    blocks.into_par_iter().zip(parts).for_each(|(block, part)| {
        let mut start = 0;
        for m in 0..block.end {
            for l in block.start.max(m)..block.end {
                let [r, r_sine, g, g_sine, b, b_sine] = orders[start + l - m];
                let centre = l * l + l - block.start * block.start;
                part[centre + m] = [r, g, b];
                if m > 0 {
                    part[centre - m] = [r_sine, g_sine, b_sine];
                }
            }
            start += degree + 1 - m;
        }
    });
}
