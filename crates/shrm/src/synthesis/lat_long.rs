//! Lat-long maps: a series in beta for each row, evaluated at the columns four at a time.
//!
//! Columns mirror each other at -beta, and if their number is even, also at pi - beta and beta + pi.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::Stopped;
use sh::f64x4::LANES;
use sphere::LatLong;

use super::parity_split_fourier::{StridedTerms, mirror};
use super::plan::SynthesisPlan;
use super::spin::Rows;

/// The values of all texels, [texels, rows].
pub(super) fn synthesise(plan: &SynthesisPlan<'_>, grid: LatLong) -> Result<Vec<[f32; 3]>, Stopped> {
    let count = if grid.width.is_multiple_of(2) { grid.width.div_ceil(4) } else { grid.width.div_ceil(2) };
    let mut angles = vec![0.0_f32; count * plan.fourier.len()];
    for (column, angle) in angles.chunks_exact_mut(plan.fourier.len()).enumerate() {
        plan.fourier.angle(math::sin_cos(grid.phi(column)), angle);
    }
    let line = grid.width * plan.rows();
    let mut values = vec![[0.0_f32; 3]; grid.height * line];
    // Each task has some northern rows and their mirrors; the equator of an odd height has none.
    let (north, south) = values.split_at_mut(grid.height.div_ceil(2) * line);
    let norths: Vec<_> = north.chunks_mut(LANES * line).collect();
    let mut souths: Vec<_> = south.rchunks_mut(LANES * line).collect();
    souths.resize_with(norths.len(), Default::default);
    norths.into_par_iter().zip(souths).enumerate().try_for_each(|(task, (north, south))| {
        plan.stop.check()?;
        let alphas: Vec<f64> = (0..north.len() / line).map(|row| grid.theta(task * LANES + row)).collect();
        let mut series = vec![0.0_f32; 2 * alphas.len() * plan.series()];
        let (above, below) = series.split_at_mut(alphas.len() * plan.series());
        plan.level.run(Rows {
            plan,
            lighting: plan.reflection.lighting(),
            alphas: &alphas,
            north: above,
            south: below,
        });
        for (values, series) in north.chunks_exact_mut(line).zip(above.chunks_exact(plan.series())) {
            plan.level.run(Line { plan, grid, angles: &angles, series, values });
        }
        for (values, series) in south.rchunks_exact_mut(line).zip(below.chunks_exact(plan.series())) {
            plan.level.run(Line { plan, grid, angles: &angles, series, values });
        }
        Ok(())
    })?;
    Ok(values)
}

/// One row of a map from its series.
struct Line<'a> {
    plan: &'a SynthesisPlan<'a>,
    grid: LatLong,
    /// The terms in beta, [columns, orders], for the columns that are not mirrors.
    angles: &'a [f32],
    series: &'a [f32],
    values: &'a mut [[f32; 3]],
}

impl WithSimd for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        /// Columns whose sums stay in the nearest cache.
        const BLOCK: usize = 8;
        let Self { plan, grid, angles, series, values } = self;
        let (columns, width) = (plan.columns, grid.width);
        let values = values.as_flattened_mut();
        let most = plan.groups.iter().map(|group| group.padded).max().unwrap_or(0);
        let (mut sums, mut four) = (vec![0.0; BLOCK * 4 * most], vec![0.0; 4 * most]);
        for group in &plan.groups {
            let padded = group.padded;
            let terms = StridedTerms { values: &series[group.start..], step: padded };
            let (sums, four) = (&mut sums[..BLOCK * 4 * padded], &mut four[..4 * padded]);
            for (block, angles) in angles.chunks(BLOCK * plan.fourier.len()).enumerate() {
                let count = angles.len() / plan.fourier.len();
                let sums = &mut sums[..count * 4 * padded];
                plan.fourier.sum(simd, angles, terms, padded, sums);
                for (column, sums) in (block * BLOCK..).zip(sums.chunks_exact(4 * padded)) {
                    mirror(sums, four);
                    let texels = if width.is_multiple_of(2) {
                        [
                            Some(column),
                            Some(width / 2 - 1 - column),
                            Some(width - 1 - column),
                            Some(width / 2 + column),
                        ]
                    } else {
                        [Some(column), None, Some(width - 1 - column), None]
                    };
                    for (texel, four) in texels.into_iter().zip(four.chunks_exact(padded)) {
                        let Some(texel) = texel else { continue };
                        let out = &mut values[texel * columns..][group.columns.clone()];
                        out.iter_mut().zip(&group.places).for_each(|(out, place)| *out = four[*place]);
                    }
                }
            }
        }
    }
}
