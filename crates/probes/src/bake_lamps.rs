//! Transport from a lamp to probes.

use std::ops::Range;

use glam::Vec3;
use sh::{Basis, Stop};

use crate::bake::{double, probe_seed};
use crate::irradiance_cache::{Cache, CacheOptions, PointLight};
use crate::lamp::Lamp;
use crate::options::{BLOCKS, BakeError, BakeOptions, BakeProbe, relative_error};
use crate::paths::{Numbers, Paths, PointOfCache, Visitor};
use crate::random::hash;
use crate::surfaces::{Place, Surfaces};

/// What arrives at probes from a lamp whose colour times intensity is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct LampColumns {
    /// What the lamp sends straight to the probes: [probe, (F + 1)^2, RGB].
    pub direct: Vec<f32>,
    /// What surfaces reflected: [probe, (F + 1)^2, RGB].
    pub indirect: Vec<f32>,
    /// The paths that were traced for each probe.
    pub paths: Vec<u32>,
    /// The standard error of each probe's irradiance relative to it, RMS over all directions.
    pub errors: Vec<f32>,
}

/// Bakes the light of a lamp that arrives at probes, positions in metres; the degree of the sky is not used.
///
/// Direct light is exact, and so is the lamp's light on the surface that a path meets; what surfaces
/// reflect more than once comes from a cache of it at points on surfaces, as in [`bake()`](crate::bake()).
/// Errors are 0.3 percent RMS at 4096 paths in the scenes of `tests/reference.rs`. Uses all threads; the
/// result does not depend on their number. `stop` is asked before each probe, and while the caches are made.
///
/// # Errors
/// If there is no probe, a position is not finite, a degree is out of its range, or it was stopped.
pub fn bake_lamp(
    surfaces: &Surfaces<'_>,
    lamp: &Lamp,
    positions: &[[f32; 3]],
    options: &BakeOptions,
    stop: Stop<'_>,
) -> Result<LampColumns, BakeError> {
    options.check(positions)?;
    let basis = Basis::new(options.degree);
    let paths = Paths { surfaces, emitters: None, bounces: options.bounces };
    let caches = |count: u32| {
        // The first reflection is exact; the cache has the others.
        if options.bounces.is_some_and(|most| most < 2) {
            return Ok(None);
        }
        let (points, rays) = BakeOptions::cache_size(count, surfaces.parts.triangles.len());
        let cache = |block: usize| {
            let seed = hash(options.seed) ^ block as u64;
            let options =
                CacheOptions { points, rays, seed, with_direct: false, channels: &[0, 1, 2], cells: None };
            Cache::new(&paths, &options, || LampAtPoint { lamp, numbers: [0.0; 3] }, stop)
        };
        Ok(Some((0..BLOCKS).map(cache).collect::<Result<Vec<_>, _>>()?))
    };
    let bake = BakeLamp { paths: &paths, positions, options, lamp, basis: &basis };
    let (count, length) = (positions.len(), 3 * options.degree.rows());
    let mut columns = LampColumns {
        direct: vec![0.0; count * length],
        indirect: vec![0.0; count * length],
        paths: vec![0; count],
        errors: vec![0.0; count],
    };
    options.in_rounds(count, stop, caches, &bake, |probe, (direct, indirect, paths, error)| {
        columns.direct[probe * length..][..length].copy_from_slice(direct.as_flattened());
        columns.indirect[probe * length..][..length].copy_from_slice(indirect.as_flattened());
        columns.paths[probe] = paths;
        columns.errors[probe] = error;
    })?;
    Ok(columns)
}

/// How the light of a lamp at a probe is baked.
struct BakeLamp<'a> {
    paths: &'a Paths<'a>,
    positions: &'a [[f32; 3]],
    options: &'a BakeOptions,
    lamp: &'a Lamp,
    basis: &'a Basis,
}

/// What a probe gets: straight from the lamp and reflected, the number of paths and the error.
type Baked = (Vec<[f32; 3]>, Vec<[f32; 3]>, u32, f32);

/// What the lamp sends straight to a probe, and each block of its paths.
struct ProbeState<'a> {
    direct: Vec<[f64; 3]>,
    blocks: Vec<(Numbers, Sums<'a>)>,
}

impl<'a> BakeProbe<Option<Vec<Cache>>, ProbeState<'a>, Baked> for BakeLamp<'a> {
    fn state_bytes(&self) -> usize {
        let numbers = self.options.degree.rows() * (3 + BLOCKS * 4) * size_of::<f64>();
        numbers + BLOCKS * size_of::<(Numbers, Sums<'_>)>()
    }

    fn start(&self, probe: usize) -> ProbeState<'a> {
        let Self { lamp, basis, options, .. } = *self;
        let place = Vec3::from(self.positions[probe]);
        let rows = options.degree.rows();
        let mut direct = vec![[0.0; 3]; rows];
        if let Some(arriving) = lamp.at(place)
            && let Some(left) = self.paths.surfaces.between(place, arriving.direction, arriving.distance)
        {
            let mut harmonics = vec![0.0; rows];
            basis.evaluate_into(double(arriving.direction), &mut harmonics);
            let light = left.map(|left| f64::from(left * arriving.irradiance));
            direct.iter_mut().zip(harmonics).for_each(|(row, y)| *row = light.map(|light| light * y));
        }
        let block = |block: usize| {
            let seed = probe_seed(&self.positions[probe], options.seed) ^ block as u64;
            let (first, sums) = (vec![0.0; rows], vec![[0.0; 3]; rows]);
            (Numbers::new(hash(seed)), Sums { lamp, basis, first, sums })
        };
        ProbeState { direct, blocks: (0..BLOCKS).map(block).collect() }
    }

    fn run(
        &self,
        caches: &Option<Vec<Cache>>,
        probe: usize,
        state: &mut ProbeState<'a>,
        block: usize,
        indices: Range<u32>,
    ) {
        let place = Vec3::from(self.positions[probe]);
        let cache = caches.as_ref().map(|caches| (&caches[block], indices.end));
        let (numbers, sums) = &mut state.blocks[block];
        indices.for_each(|index| self.paths.trace(place, numbers, index, cache, sums));
    }

    fn error(&self, state: &ProbeState<'a>, count: u32) -> f32 {
        let all = |(_, sums): &(Numbers, Sums<'_>)| {
            let exact = |value: f64| value * f64::from(count);
            let row = |(sum, direct): (&[f64; 3], &[f64; 3])| {
                [0, 1, 2].map(|channel| sum[channel] + exact(direct[channel]))
            };
            sums.sums.iter().zip(&state.direct).map(row).collect()
        };
        relative_error(&state.blocks.iter().map(all).collect::<Vec<_>>())
    }

    fn finish(&self, state: ProbeState<'a>, count: u32, error: f32) -> Baked {
        let mean = |row: usize| {
            [0, 1, 2].map(|channel| {
                let sum: f64 = state.blocks.iter().map(|(_, sums)| sums.sums[row][channel]).sum();
                (sum / f64::from(count)) as f32
            })
        };
        let direct = state.direct.iter().map(|row| row.map(|value| value as f32)).collect();
        (direct, (0..state.direct.len()).map(mean).collect(), count, error)
    }
}

/// The light of a lamp whose way to a place is free, on a surface there: RGB, for a share of its irradiance.
fn reflected(lamp: &Lamp, surfaces: &Surfaces<'_>, place: &Place, share: [f32; 3]) -> Option<[f32; 3]> {
    let start = place.start();
    let arriving = lamp.at(start)?;
    let irradiance = arriving.irradiance * place.normal.dot(arriving.direction);
    if irradiance <= 0.0 {
        return None;
    }
    let left = surfaces.between(start, arriving.direction, arriving.distance)?;
    Some([0, 1, 2].map(|channel| share[channel] * left[channel] * irradiance))
}

/// The light of a lamp at a point of the cache.
struct LampAtPoint<'a> {
    lamp: &'a Lamp,
    numbers: [f32; 3],
}

impl PointLight for LampAtPoint<'_> {
    const HAS_SKY: bool = false;

    fn numbers(self) -> Vec<f32> {
        self.numbers.to_vec()
    }
}

impl Visitor for LampAtPoint<'_> {
    fn begin(&mut self, _: Vec3) {}

    fn sky(&mut self, _: Vec3, _: [f32; 3]) {}

    fn emission(&mut self, _: usize, _: [f32; 3], _: u32) {}

    fn emission_from(&mut self, _: Vec3, _: usize, _: [f32; 3]) {}

    fn reflects(&mut self, surfaces: &Surfaces<'_>, place: &Place, share: [f32; 3]) {
        if let Some(light) = reflected(self.lamp, surfaces, place, share) {
            self.numbers.iter_mut().zip(light).for_each(|(sum, light)| *sum += light);
        }
    }

    fn cached(&mut self, _: &PointOfCache<'_>, _: [f32; 3]) {}
}

/// The sums of a block of paths.
struct Sums<'a> {
    lamp: &'a Lamp,
    basis: &'a Basis,
    /// The harmonics of the first direction.
    first: Vec<f64>,
    sums: Vec<[f64; 3]>,
}

impl Visitor for Sums<'_> {
    fn begin(&mut self, direction: Vec3) {
        self.basis.evaluate_into(double(direction), &mut self.first);
    }

    fn sky(&mut self, _: Vec3, _: [f32; 3]) {}

    fn emission(&mut self, _: usize, _: [f32; 3], _: u32) {}

    fn emission_from(&mut self, _: Vec3, _: usize, _: [f32; 3]) {}

    fn reflects(&mut self, surfaces: &Surfaces<'_>, place: &Place, share: [f32; 3]) {
        if let Some(light) = reflected(self.lamp, surfaces, place, share) {
            self.add(light);
        }
    }

    fn cached(&mut self, point: &PointOfCache<'_>, share: [f32; 3]) {
        self.add([0, 1, 2].map(|channel| share[channel] * point.light[channel]));
    }
}

impl Sums<'_> {
    fn add(&mut self, light: [f32; 3]) {
        for (sum, y) in self.sums.iter_mut().zip(&self.first) {
            (0..3).for_each(|channel| sum[channel] += f64::from(light[channel]) * y);
        }
    }
}
