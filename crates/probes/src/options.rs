//! How much is computed for a probe, and how far it is wrong.

use std::ops::Range;

use rayon::prelude::*;
use sh::{Degree, Stop, Stopped};

use crate::irradiance_cache::STEPS;

/// The independent blocks that the paths of a probe are divided into.
pub(crate) const BLOCKS: usize = 4;

/// The most memory, in bytes, that a bake takes for its result and its caches.
pub const MOST_BYTES: usize = 1 << 34;

/// The bytes of the states of probes whose paths are doubled together, at most.
const OPEN_BYTES: usize = 192 << 20;

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
    /// The result and the caches are larger than [`MOST_BYTES`].
    #[error(
        "the transport of {probes} probes and the light on surfaces take {bytes} bytes, and at most \
         {MOST_BYTES} are baked; a larger spacing or a lower degree of the sky makes them smaller"
    )]
    TooLarge {
        /// The number of probes.
        probes: usize,
        /// The size of the result and of the caches.
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

    /// The paths of a probe in the first round.
    pub(crate) fn first_paths(&self) -> u32 {
        self.paths.clamp(BLOCKS as u32, 1 << 28).next_multiple_of(BLOCKS as u32)
    }

    /// About how often a bake of some probes asks whether to stop, without [`BakeOptions::error`].
    pub fn steps(&self, probes: usize) -> usize {
        probes + if self.bounces == Some(0) { 0 } else { BLOCKS * STEPS }
    }

    /// Bakes `count` probes in rounds, each of which doubles the paths of those whose error is not yet small
    /// enough. `prepare` makes what a round with so many paths has in common, for each block, `start` the
    /// state of a probe, `finish` makes its result with the number of paths and the error, and `keep` stores
    /// the result of a probe. `stop` is asked before each probe.
    ///
    /// As many probes go on to further rounds together as have states of [`OPEN_BYTES`].
    pub(crate) fn in_rounds<C: Sync, S: Send, B: Send>(
        &self,
        count: usize,
        stop: Stop<'_>,
        mut prepare: impl FnMut(u32) -> Result<C, BakeError>,
        bake: &(impl BakeProbe<C, S, B> + Sync),
        mut keep: impl FnMut(usize, B),
    ) -> Result<(), BakeError> {
        enum Progress<S, B> {
            Open(S),
            Done(B),
        }
        let blocks = BLOCKS as u32;
        // Traces paths with these indices of each block, and returns the probes that are open after them.
        let mut round = |common: &C, indices: Range<u32>, probes: Vec<(usize, Option<S>)>| {
            let (each, paths) = (indices.end, indices.end * blocks);
            let is_last = 2 * u64::from(paths) > u64::from(self.most_paths);
            let one = |(probe, state): (usize, Option<S>)| {
                stop.check()?;
                let mut state = state.unwrap_or_else(|| bake.start(probe));
                (0..BLOCKS).for_each(|block| bake.run(common, probe, &mut state, block, indices.clone()));
                let error = bake.error(&state, each);
                let is_enough = is_last || self.error.is_none_or(|wanted| error <= wanted);
                let progress = match is_enough {
                    true => Progress::Done(bake.finish(state, paths, error)),
                    false => Progress::Open(state),
                };
                Ok::<_, BakeError>((probe, progress))
            };
            let found = probes.into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
            let mut open = Vec::new();
            for (probe, progress) in found {
                match progress {
                    Progress::Open(state) => open.push((probe, Some(state))),
                    Progress::Done(result) => keep(probe, result),
                }
            }
            Ok::<_, BakeError>(open)
        };
        let first = self.first_paths() / blocks;
        let at_once = (OPEN_BYTES / bake.state_bytes().max(1) / 2).max(1);
        let mut next = 0;
        let mut of_first = Some(prepare(first * blocks)?);
        while let Some(common) = &of_first {
            let mut open = Vec::new();
            while next < count && open.len() < at_once {
                let end = (next + at_once).min(count);
                open.extend(round(common, 0..first, (next..end).map(|probe| (probe, None)).collect())?);
                next = end;
            }
            if next == count {
                of_first = None;
            }
            let mut done = first;
            while !open.is_empty() {
                let common = prepare(2 * done * blocks)?;
                open = round(&common, done..2 * done, open)?;
                done *= 2;
            }
        }
        Ok(())
    }

    /// The bytes of the caches with so many numbers a point that are there at once, about, while they are
    /// made for the most paths.
    pub(crate) fn cache_bytes(&self, triangles: usize, numbers: usize) -> usize {
        let most = if self.error.is_some() { self.paths.max(self.most_paths) } else { self.paths };
        let (points, rays) = Self::cache_size(most, triangles);
        let kept = BLOCKS * if self.bounces.is_some() { 2 } else { 1 };
        // The light of a point, its sum and the next one are kept while a cache is made.
        let numbers = numbers.saturating_mul(kept + 3).saturating_add(rays as usize);
        (2 * points * size_of::<f32>()).saturating_mul(numbers)
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
    /// The bytes of the state of a probe, about.
    fn state_bytes(&self) -> usize;
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

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    use super::*;

    /// How many states there are, and the most that there were at once.
    #[derive(Default)]
    struct States {
        now: AtomicUsize,
        most: AtomicUsize,
    }

    /// A probe, and how many paths each of its blocks has traced.
    struct Traced<'a> {
        states: &'a States,
        probe: usize,
        paths: [u32; BLOCKS],
    }

    impl Drop for Traced<'_> {
        fn drop(&mut self) {
            self.states.now.fetch_sub(1, SeqCst);
        }
    }

    /// The paths of a probe from which on its error is at most 1, by number.
    const PATHS_TO_ONE: [u32; 5] = [1, 70, 128, 1000, 5000];

    impl<'a> BakeProbe<u32, Traced<'a>, (u32, f32)> for &'a States {
        fn state_bytes(&self) -> usize {
            OPEN_BYTES / 8
        }

        fn start(&self, probe: usize) -> Traced<'a> {
            self.most.fetch_max(self.now.fetch_add(1, SeqCst) + 1, SeqCst);
            Traced { states: self, probe, paths: [0; BLOCKS] }
        }

        fn run(&self, all: &u32, _: usize, state: &mut Traced<'a>, block: usize, indices: Range<u32>) {
            assert_eq!((*all, state.paths[block]), (4 * indices.end, indices.start));
            state.paths[block] = indices.end;
        }

        fn error(&self, state: &Traced<'a>, count: u32) -> f32 {
            assert_eq!(state.paths, [count; BLOCKS]);
            PATHS_TO_ONE[state.probe % PATHS_TO_ONE.len()] as f32 / (4 * count) as f32
        }

        fn finish(&self, _: Traced<'a>, paths: u32, error: f32) -> (u32, f32) {
            (paths, error)
        }
    }

    /// Every probe gets the paths that it needs, and few are open at a time.
    #[test]
    fn paths_are_doubled_for_as_many_probes_as_memory_holds() {
        let states = States::default();
        let options = BakeOptions { paths: 64, error: Some(1.0), most_paths: 2048, ..BakeOptions::default() };
        let mut found = BTreeMap::new();
        let keep = |probe, result| assert_eq!(found.insert(probe, result), None);
        options.in_rounds(103, Stop::NEVER, Ok, &&states, keep).unwrap();
        assert_eq!(found.keys().copied().collect::<Vec<_>>(), (0..103).collect::<Vec<_>>());
        for (probe, (paths, error)) in found {
            let expected = [64, 128, 128, 1024, 2048][probe % 5];
            assert_eq!((paths, error), (expected, PATHS_TO_ONE[probe % 5] as f32 / expected as f32));
        }
        let most = states.most.into_inner();
        assert!((4..=8).contains(&most), "{most}");
        assert_eq!(states.now.into_inner(), 0);
    }
}
