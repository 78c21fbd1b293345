//! From pixels to coefficients: rows, then columns of equal m, then the order of [`Expansion`].

use std::f64::consts::TAU;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::fourier::{FourierScratch, ImageRows, Sample};
use super::grid::Grid;
use super::plan::{TransformPlan, Workspace, order_pairs, split};
use super::resample::{Resample, ResampleScratch};
use super::spare::InUse;
use super::sums::{Group, ODD, PARTS, Project};
use crate::f64x4::{F64x4, LANES, load, store};
use crate::legendre::LegendreRecurrence;
use crate::{Expansion, Stop, Stopped, quadrature};

/// The rule by which a grid integrates along theta.
pub(super) enum Colatitude {
    /// A weight w for each northern row, in fours, zeros past the last: w for even parts, w x for odd ones.
    Weights(Vec<[F64x4; 2]>),
    /// Pixel-centred rows past half of their degree.
    Resample(Resample),
}

/// Degrees in one task of the last step.
const DEGREES: usize = 8;

impl Colatitude {
    pub(super) fn new(plan: &TransformPlan) -> Self {
        let TransformPlan { grid, rows, degree, level, .. } = plan;
        let (height, width) = (grid.height(), grid.width());
        let scale = TAU / width as f64;
        let weights = match grid {
            Grid::LatLong(_) if 2 * *degree > height - 1 => {
                return Self::Resample(Resample::new(*level, height, scale));
            }
            Grid::LatLong(_) => quadrature::fejer(height),
            Grid::Gauss(grid) => grid.weights().to_vec(),
        };
        let northern = &weights[..height.div_ceil(2)];
        let lanes = northern.chunks(LANES).zip(&rows.cosine).map(|(weights, cosine)| {
            let even = std::array::from_fn(|lane| weights.get(lane).map_or(0.0, |weight| scale * weight));
            [F64x4(even), F64x4::from_fn(|lane| even[lane] * cosine.0[lane])]
        });
        Self::Weights(lanes.collect())
    }
}

/// Memory of one task of the Legendre sums.
struct AnalysisScratch {
    recurrence: LegendreRecurrence,
    columns: [Vec<Group>; 2],
    current: Vec<F64x4>,
    previous: Vec<F64x4>,
    sums: Vec<Group>,
    resample: ResampleScratch,
}

pub(super) fn analyse_into<T: Sample>(
    plan: &TransformPlan,
    colatitude: &Colatitude,
    pixels: &(impl ImageRows<T> + ?Sized),
    stop: Stop<'_>,
    expansion: &mut Expansion,
) -> Result<(), Stopped> {
    assert_eq!(pixels.pixel_count(), plan.grid.len(), "the number of pixels is not that of the grid");
    plan.with_workspace(|workspace| {
        let Workspace { groups, orders } = workspace;
        let (count, width) = (plan.degree + 1, plan.grid.width());
        let at_once = pixels.rows_at_once().div_ceil(LANES);
        let band = |(scratch, bands): &mut (InUse<'_, FourierScratch>, [Vec<_>; 2]),
                    (band, output): (usize, &mut [Group])| {
            stop.check()?;
            let first = band * at_once;
            let rows = plan.fourier.rows(first..(first + at_once).min(plan.fourier.groups()));
            let [north, south] = bands;
            let [at_north, at_south] = rows;
            let bands = [
                (at_north.start, pixels.read_rows(width, at_north, north)),
                (at_south.start, pixels.read_rows(width, at_south, south)),
            ];
            for (group, output) in (first..).zip(output.chunks_mut(count)) {
                plan.fourier.analyse(group, bands, scratch, output);
            }
            Ok(())
        };
        groups
            .par_chunks_mut(count * at_once)
            .enumerate()
            .map_init(|| (plan.fourier_scratch.take(), Default::default()), band)
            .collect::<Result<(), Stopped>>()?;

        let pairs = order_pairs(plan.degree);
        let lengths = pairs.iter().map(|pair| pair.clone().map(|m| count - m).sum());
        let parts = split(orders, lengths);
        pairs.into_par_iter().zip(parts).for_each_init(
            || AnalysisScratch::new(plan),
            |scratch, (pair, output)| scratch.integrate(plan, colatitude, groups, pair, output),
        );

        reorder(plan.degree, orders, expansion.coefficients_mut());
        Ok(())
    })
}

impl AnalysisScratch {
    fn new(plan: &TransformPlan) -> Self {
        let column = || vec![[F64x4::ZERO; PARTS]; plan.rows.groups()];
        let lanes = || vec![F64x4::ZERO; plan.rows.groups()];
        Self {
            recurrence: LegendreRecurrence::default(),
            columns: [column(), column()],
            current: lanes(),
            previous: lanes(),
            sums: Vec::new(),
            resample: ResampleScratch::default(),
        }
    }

    /// The coefficients of one or two orders, by m, then l.
    fn integrate(
        &mut self,
        plan: &TransformPlan,
        colatitude: &Colatitude,
        groups: &[Group],
        pair: std::ops::Range<usize>,
        output: &mut [[f64; 6]],
    ) {
        let count = plan.degree + 1;
        for (m, column) in pair.clone().zip(&mut self.columns) {
            let input = &groups[m..];
            match colatitude {
                Colatitude::Weights(weights) => plan.level.run(Gather { input, count, weights, column }),
                Colatitude::Resample(_) => {
                    column.iter_mut().zip(input.iter().step_by(count)).for_each(|(to, from)| *to = *from);
                }
            }
        }
        if let Colatitude::Resample(resample) = colatitude {
            let [first, second] = &mut self.columns;
            if pair.len() == 1 {
                second.fill([F64x4::ZERO; PARTS]);
            }
            resample.apply(first, second, &mut self.resample);
            for column in [first, second] {
                for (values, cosine) in column.iter_mut().zip(&plan.rows.cosine) {
                    values[ODD..].iter_mut().for_each(|value| multiply(value, cosine));
                }
            }
        }
        let mut output = output;
        for (m, column) in pair.zip(&mut self.columns) {
            self.recurrence.prepare(m, plan.degree);
            self.sums.resize(self.recurrence.steps().len(), [F64x4::ZERO; PARTS]);
            plan.level.run(Project {
                rows: &plan.rows,
                recurrence: &self.recurrence,
                degree: plan.degree,
                columns: column,
                current: &mut self.current,
                previous: &mut self.previous,
                sums: &mut self.sums,
            });
            let (order, rest) = output.split_at_mut(count - m);
            finish(&self.recurrence, &self.sums, order);
            output = rest;
        }
    }
}

/// column = weights times every `count`-th group of the input.
struct Gather<'a> {
    input: &'a [Group],
    count: usize,
    weights: &'a [[F64x4; 2]],
    column: &'a mut [Group],
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let inputs = self.input.iter().step_by(self.count);
        for ((to, from), weights) in self.column.iter_mut().zip(inputs).zip(self.weights) {
            let [even, odd] = [load(simd, &weights[0]), load(simd, &weights[1])];
            for part in 0..PARTS {
                let weight = if part < ODD { even } else { odd };
                store(simd, simd.mul_f64s(load(simd, &from[part]), weight), &mut to[part]);
            }
        }
    }
}

fn multiply(value: &mut F64x4, factor: &F64x4) {
    value.0.iter_mut().zip(factor.0).for_each(|(value, factor)| *value *= factor);
}

/// Turns sums with lambda_k into sums with P_lm, l = m ..= degree.
fn finish(recurrence: &LegendreRecurrence, sums: &[Group], order: &mut [[f64; 6]]) {
    let mut earlier = [0.0; ODD];
    for (k, (sum, degrees)) in sums.iter().zip(order.chunks_mut(2)).enumerate() {
        let total = sum.map(|lane| (lane.0[0] + lane.0[1]) + (lane.0[2] + lane.0[3]));
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
