//! How much is computed for a probe, and how far it is wrong.

use std::ops::Range;

use rayon::prelude::*;
use sh::{Degree, Stop, Stopped};

use crate::irradiance_cache::STEPS;

/// The independent blocks that the paths of a probe are divided into.
pub(crate) const BLOCKS: usize = 4;

/// The bytes of the largest result.
pub const MOST_BYTES: usize = 1 << 34;

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeOptions {
    /// The degree F of what arrives: 2 to 4.
    pub degree: Degree,
    /// The degree O of the sky: 2 to 8.
    pub sky: Degree,
    /// The most reflections; `None` for all.
    pub bounces: Option<u32>,
    /// The paths of a probe.
    pub paths: u32,
    /// The standard error of irradiance, relative to it, at which paths are no longer doubled; `None` to
    /// trace `paths` for every probe.
    pub error: Option<f32>,
    /// The most paths of a probe, when they are doubled.
    pub most_paths: u32,
    /// Another seed makes other errors.
    pub seed: u64,
}

impl Default for BakeOptions {
    /// Degrees 2 and 4, all bounces, 4096 paths.
    fn default() -> Self {
        let degree = |degree| Degree::new(degree).unwrap_or(Degree::ZERO);
        Self {
            degree: degree(2),
            sky: degree(4),
            bounces: None,
            paths: 4096,
            error: None,
            most_paths: 1 << 20,
            seed: 0,
        }
    }
}

/// The reason why nothing was baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// The degree of what arrives is not 2 to 4, or that of the sky not 2 to 8.
    #[error("the degrees are {arriving} and {sky}; expected 2 to 4 of what arrives and 2 to 8 of the sky")]
    Degrees {
        /// The degree of what arrives.
        arriving: usize,
        /// The degree of the sky.
        sky: usize,
    },
    /// There is no probe.
    #[error("there are no probes")]
    NoProbes,
    /// A probe is nowhere.
    #[error("the position of probe {0} is not finite")]
    NotFinite(usize),
    /// The result is larger than [`MOST_BYTES`].
    #[error(
        "the transport of {probes} probes has {bytes} bytes, and at most {MOST_BYTES} are baked; a larger \
         spacing or a lower degree of the sky makes it smaller"
    )]
    TooLarge {
        /// The number of probes.
        probes: usize,
        /// The size of the result.
        bytes: usize,
    },
    /// Its caller stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl BakeOptions {
    pub(crate) fn check(&self, positions: &[[f32; 3]]) -> Result<(), BakeError> {
        let (arriving, sky) = (self.degree.get(), self.sky.get());
        if !((2..=4).contains(&arriving) && (2..=8).contains(&sky)) {
            return Err(BakeError::Degrees { arriving, sky });
        }
        if positions.is_empty() {
            return Err(BakeError::NoProbes);
        }
        match positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
            Some(at) => Err(BakeError::NotFinite(at)),
            None => Ok(()),
        }
    }

    /// About how often a bake of some probes asks whether to stop, without [`BakeOptions::error`].
    pub fn steps(&self, probes: usize) -> usize {
        probes + if self.bounces == Some(0) { 0 } else { BLOCKS * STEPS }
    }

    /// Bakes `count` probes in rounds, each of which doubles the paths of those whose error is not yet small
    /// enough. `prepare` makes what a round with so many paths has in common, for each block, `start` the
    /// state of a probe, and `finish` makes its result with the number of paths and the error. `stop` is
    /// asked before each probe.
    pub(crate) fn in_rounds<C: Sync, S: Send, B: Send>(
        &self,
        count: usize,
        stop: Stop<'_>,
        prepare: impl Fn(u32) -> Result<C, BakeError>,
        bake: &(impl BakeProbe<C, S, B> + Sync),
    ) -> Result<Vec<B>, BakeError> {
        enum Progress<S, B> {
            Open(S),
            Done(B),
        }
        let blocks = BLOCKS as u32;
        let mut each = self.paths.clamp(blocks, 1 << 28).div_ceil(blocks);
        let mut done = 0;
        let mut results: Vec<Option<B>> = (0..count).map(|_| None).collect();
        let mut open: Vec<(usize, Option<S>)> = (0..count).map(|probe| (probe, None)).collect();
        while !open.is_empty() {
            let common = prepare(each * blocks)?;
            let is_last = 2 * u64::from(each * blocks) > u64::from(self.most_paths);
            let round = |(probe, state): (usize, Option<S>)| {
                stop.check()?;
                let mut state = state.unwrap_or_else(|| bake.start(probe));
                (0..BLOCKS).for_each(|block| bake.run(&common, probe, &mut state, block, done..each));
                let error = bake.error(&state, each);
                let is_enough = is_last || self.error.is_none_or(|wanted| error <= wanted);
                let progress = match is_enough {
                    true => Progress::Done(bake.finish(state, each * blocks, error)),
                    false => Progress::Open(state),
                };
                Ok::<_, BakeError>((probe, progress))
            };
            let found = open.into_par_iter().map(round).collect::<Result<Vec<_>, _>>()?;
            open = Vec::new();
            for (probe, progress) in found {
                match progress {
                    Progress::Open(state) => open.push((probe, Some(state))),
                    Progress::Done(result) => results[probe] = Some(result),
                }
            }
            done = each;
            each *= 2;
        }
        Ok(results.into_iter().flatten().collect())
    }

    /// The points of the cache of a block, at least, and the rays of each of them, for a number of paths in a
    /// scene of some triangles: four times the paths bring twice as many of both, up to the memory and the
    /// time of some 10 million rays, and details bring points.
    pub(crate) fn cache_size(paths: u32, triangles: usize) -> (usize, u32) {
        let root = (paths as f32).sqrt();
        let points = (128.0 * root).min(65536.0) as usize + triangles.min(1 << 18) / 64;
        (points, ((0.5 * root) as u32).clamp(4, 64).next_power_of_two())
    }
}

/// How a probe is baked: [`BakeOptions::in_rounds`].
pub(crate) trait BakeProbe<C, S, B> {
    fn start(&self, probe: usize) -> S;
    /// Traces the paths of a block with these indices.
    fn run(&self, common: &C, probe: usize, state: &mut S, block: usize, indices: Range<u32>);
    /// The error after so many paths of each block.
    fn error(&self, state: &S, count: u32) -> f32;
    fn finish(&self, state: S, paths: u32, error: f32) -> B;
}

/// The factors that make irradiance of the rows of radiance, by degree: pi, 2 pi / 3, pi / 4, 0, -pi / 24.
pub(crate) fn cosine_factor(l: usize) -> f64 {
    use std::f64::consts::PI;
    [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0].get(l).copied().unwrap_or(0.0)
}

/// The standard error of irradiance relative to it, both RMS over all directions, from the rows that each
/// independent block of paths finds: [block][row][channel], l by l.
///
/// The variance of the mean of four blocks is estimated by theirs around it, 3 degrees of freedom for each
/// row and channel; all rows together make the estimate right to some 15 percent.
pub(crate) fn relative_error(blocks: &[Vec<[f64; 3]>]) -> f32 {
    let count = blocks.len() as f64;
    let (mut mean_squares, mut variances) = (0.0, 0.0);
    let rows = blocks.first().map_or(0, Vec::len);
    let mut l = 0;
    for row in 0..rows {
        if row >= (l + 1) * (l + 1) {
            l += 1;
        }
        let factor = cosine_factor(l) * cosine_factor(l);
        for channel in 0..3 {
            let mean = blocks.iter().map(|block| block[row][channel]).sum::<f64>() / count;
            let squares =
                blocks.iter().map(|block| (block[row][channel] - mean) * (block[row][channel] - mean));
            variances += factor * squares.sum::<f64>() / (count * (count - 1.0));
            mean_squares += factor * mean * mean;
        }
    }
    if mean_squares > 0.0 { (variances / mean_squares).sqrt() as f32 } else { 0.0 }
}
