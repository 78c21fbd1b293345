//! The maps of T x T views: the full four-dimensional table [RH02, sec. 5.2 and app. C].
//!
//! With Y_pq = f_p|q|(theta) times cos(q phi) or sin(|q| phi), the sums separate:
//!
//! > c_q(theta) = sum over p of B_pq f_pq(theta), s_q likewise of B_p,-q,
//! > B(theta, phi) = sum over q of c_q(theta) cos(q phi) + s_q(theta) sin(q phi),
//!
//! O(P^2) for each texel and theta, O(P) for each texel and view: O(P) for each value if T > P.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Basis, Stop, Stopped};
use sphere::{Direction, LatLong};

use crate::{Shrm, Terms};

/// The maps of a spherical harmonic reflection map for `side` x `side` views of its own frame, shape [side,
/// side, texels], rows of theta, columns of phi. `stop` is asked every few milliseconds.
///
/// # Errors
/// If it was stopped.
pub(crate) fn view_table(map: &Shrm, side: usize, stop: Stop<'_>) -> Result<Vec<[f32; 3]>, Stopped> {
    let (grid, terms) = (map.grid(), Views::new(map, side));
    let mut maps = vec![[0.0; 3]; side * side * grid.len()];
    // Block after block, its run in every map.
    let mut runs: Vec<Vec<&mut [[f32; 3]]>> = Vec::new();
    runs.resize_with(grid.len().div_ceil(BLOCK), || Vec::with_capacity(side * side));
    for map in maps.chunks_exact_mut(grid.len()) {
        runs.iter_mut().zip(map.chunks_mut(BLOCK)).for_each(|(runs, run)| runs.push(run));
    }
    let level = SimdLevel::detect();
    let values = map.values().par_chunks(BLOCK * map.rows());
    runs.into_par_iter().zip(values).try_for_each(|(runs, values)| {
        stop.check()?;
        level.run(TexelBlock { views: &terms, values, runs });
        Ok(())
    })?;
    Ok(maps)
}

/// Texels that are computed at once: their coefficients and sums stay in the nearest caches, and what they
/// write into one map is a run of 1.5 kB.
const BLOCK: usize = 128;

/// The harmonics of all views, in factors.
struct Views {
    side: usize,
    /// For each place c_q or s_q of the sums, the coefficients that it is made of: row of a texel, p, q.
    parts: Vec<Vec<[usize; 3]>>,
    /// f_pq of each theta, rows as in `Basis`.
    thetas: Vec<Vec<f64>>,
    /// cos(q phi) or sin(q phi) of each phi, for each place.
    turns: Vec<Vec<f32>>,
}

impl Views {
    fn new(map: &Shrm, side: usize) -> Self {
        let (views, p) = (LatLong { width: side, height: side }, map.p().get());
        let basis = Basis::new(map.p());
        // At phi = 0 the rows q >= 0 are f_pq.
        let thetas = (0..side).map(|row| {
            let mut f = vec![0.0; map.p().rows()];
            basis.evaluate_into(Direction::from_angles(views.theta(row), 0.0), &mut f);
            f
        });
        let zonal = map.terms() == Terms::Zonal;
        let mut parts = vec![(0..=p).map(|p| [if zonal { p } else { p * p + p }, p, 0]).collect()];
        for q in 1..=if zonal { 0 } else { p } {
            parts.push((q..=p).map(|p| [p * p + p + q, p, q]).collect());
            parts.push((q..=p).map(|p| [p * p + p - q, p, q]).collect());
        }
        let turns = (0..side).map(|column| {
            let turn = |place: usize| {
                let (sine, cosine) = math::sin_cos(place.div_ceil(2) as f64 * views.phi(column));
                if place == 0 || place % 2 == 1 { cosine as f32 } else { sine as f32 }
            };
            (0..parts.len()).map(turn).collect()
        });
        Self { side, thetas: thetas.collect(), turns: turns.collect(), parts }
    }
}

/// A block of texels toward all views.
struct TexelBlock<'a> {
    views: &'a Views,
    /// The texels' coefficients.
    values: &'a [[f32; 3]],
    /// The texels' part of every map.
    runs: Vec<&'a mut [[f32; 3]]>,
}

impl WithSimd for TexelBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        /// Vectors that are summed at once.
        const WIDE: usize = 12;
        let Self { views, values, mut runs } = self;
        let texels = runs[0].len();
        let rows = values.len() / texels;
        // Each row of the coefficients in whole tiles, [rows, texels, 3].
        let len = (3 * texels).next_multiple_of(WIDE * S::F32_LANES);
        let mut planes = vec![0.0; rows * len];
        for (texel, values) in values.chunks_exact(rows).enumerate() {
            for (plane, value) in planes.chunks_exact_mut(len).zip(values) {
                plane[3 * texel..][..3].copy_from_slice(value);
            }
        }
        let (planes, _) = S::as_simd_f32s(&planes);
        let vectors = len / S::F32_LANES;
        let mut sums = vec![simd.splat_f32s(0.0); views.parts.len() * vectors];
        let mut line = vec![0.0; len];
        for (f, runs) in views.thetas.iter().zip(runs.chunks_exact_mut(views.side)) {
            for (sum, parts) in sums.chunks_exact_mut(vectors).zip(&views.parts) {
                let factors = parts.iter().map(|&[row, p, q]| (row, f[p * p + p + q] as f32));
                total::<S, WIDE>(simd, factors, planes, sum);
            }
            for (turns, run) in views.turns.iter().zip(runs) {
                let turns = turns.iter().copied().enumerate();
                let run = run.as_flattened_mut();
                if run.len() == len {
                    let (out, _) = S::as_mut_simd_f32s(run);
                    total::<S, WIDE>(simd, turns, &sums, out);
                } else {
                    let (out, _) = S::as_mut_simd_f32s(&mut line);
                    total::<S, WIDE>(simd, turns, &sums, out);
                    run.copy_from_slice(&line[..run.len()]);
                }
            }
        }
    }
}

/// The sum of rows times factors, in tiles of `WIDE` vectors that stay in registers.
#[inline(always)]
fn total<S: Simd, const WIDE: usize>(
    simd: S,
    factors: impl Iterator<Item = (usize, f32)> + Clone,
    rows: &[S::f32s],
    sums: &mut [S::f32s],
) {
    let vectors = sums.len();
    for (tile, sums) in sums.chunks_exact_mut(WIDE).enumerate() {
        let mut total = [simd.splat_f32s(0.0); WIDE];
        for (row, factor) in factors.clone() {
            let factor = simd.splat_f32s(factor);
            let row = &rows[row * vectors + tile * WIDE..][..WIDE];
            for i in 0..WIDE {
                total[i] = simd.mul_add_f32s(factor, row[i], total[i]);
            }
        }
        sums.copy_from_slice(&total);
    }
}
