//! Transport from a lamp to probes.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Basis, Stop};
use sphere::{DVec3, Direction};

use crate::bake::probe_seed;
use crate::lamp::Lamp;
use crate::options::{BLOCKS, BakeError, BakeOptions, relative_error};
use crate::paths::{Numbers, Paths, Visitor};
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
/// Direct light is exact. Errors are below 1 percent RMS at 4096 paths in the scenes of `tests/reference.rs`.
/// Uses all threads; the result does not depend on their number. `stop` is asked before each probe.
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
    let rows = options.degree.rows();
    let paths = Paths { surfaces, emitters: None, bounces: options.bounces };
    let probe = |position: &[f32; 3]| {
        stop.check()?;
        let place = Vec3::from(*position);
        let mut direct = vec![[0.0; 3]; rows];
        if let Some(arriving) = lamp.at(place)
            && let Some(left) = surfaces.between(place, arriving.direction, arriving.distance)
        {
            let mut harmonics = vec![0.0; rows];
            basis.evaluate_into(double(arriving.direction), &mut harmonics);
            let light = left.map(|left| f64::from(left * arriving.irradiance));
            direct.iter_mut().zip(harmonics).for_each(|(row, y)| *row = light.map(|light| light * y));
        }
        let blocks = |block: usize| {
            let seed = probe_seed(position, options.seed) ^ block as u64;
            let (first, sums) = (vec![0.0; rows], vec![[0.0; 3]; rows]);
            (Numbers::new(hash(seed)), Sums { lamp, basis: &basis, first, sums })
        };
        let mut blocks: Vec<(Numbers, Sums<'_>)> = (0..BLOCKS).map(blocks).collect();
        let (count, error) = options.until_exact(
            &mut blocks,
            |blocks, block, indices| {
                let (numbers, sums) = &mut blocks[block];
                indices.for_each(|index| paths.trace(place, numbers, index, sums));
            },
            |blocks, count| {
                let all = |(_, sums): &(Numbers, Sums<'_>)| {
                    let exact = |value: f64| value * f64::from(count);
                    let row = |(sum, direct): (&[f64; 3], &[f64; 3])| {
                        [0, 1, 2].map(|channel| sum[channel] + exact(direct[channel]))
                    };
                    sums.sums.iter().zip(&direct).map(row).collect()
                };
                relative_error(&blocks.iter().map(all).collect::<Vec<_>>())
            },
        );
        let mean = |row: usize| {
            [0, 1, 2].map(|channel| {
                let sum: f64 = blocks.iter().map(|(_, sums)| sums.sums[row][channel]).sum();
                (sum / f64::from(count)) as f32
            })
        };
        let direct: Vec<[f32; 3]> = direct.iter().map(|row| row.map(|value| value as f32)).collect();
        Ok((direct, (0..rows).map(mean).collect::<Vec<_>>(), count, error))
    };
    let baked: Vec<_> = positions.par_iter().map(probe).collect::<Result<_, BakeError>>()?;
    let mut columns =
        LampColumns { direct: Vec::new(), indirect: Vec::new(), paths: Vec::new(), errors: Vec::new() };
    for (direct, indirect, count, error) in baked {
        columns.direct.extend(direct.as_flattened());
        columns.indirect.extend(indirect.as_flattened());
        columns.paths.push(count);
        columns.errors.push(error);
    }
    Ok(columns)
}

fn double(direction: Vec3) -> Direction {
    Direction::normalised(DVec3::new(direction.x.into(), direction.y.into(), direction.z.into()))
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
        let start = place.start();
        let Some(arriving) = self.lamp.at(start) else { return };
        let irradiance = arriving.irradiance * place.normal.dot(arriving.direction);
        if irradiance <= 0.0 {
            return;
        }
        let Some(left) = surfaces.between(start, arriving.direction, arriving.distance) else { return };
        let light = [0, 1, 2].map(|channel| f64::from(share[channel] * left[channel] * irradiance));
        for (sum, y) in self.sums.iter_mut().zip(&self.first) {
            (0..3).for_each(|channel| sum[channel] += light[channel] * y);
        }
    }
}
