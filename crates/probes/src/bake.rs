//! Transport from the sky and from emissive materials to probes.
//!
//! > T_ij = integral over w of Y_i(w) B_j(w) dw
//!
//! where B_j(w) is the radiance that arrives from w under the sky Y_j. A path with the first direction w that
//! leaves the scene in the direction d with the throughput b adds Y_i(w) b Y_j(d); the mean over all paths is
//! T_ij, without a bias.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Basis, Stop};
use sphere::{DVec3, Direction};

use crate::emitters::Emitters;
use crate::options::{BLOCKS, BakeError, BakeOptions, MOST_BYTES, relative_error};
use crate::paths::{Numbers, Paths, Visitor};
use crate::random::hash;
use crate::surfaces::{Place, Surfaces};
use crate::transport::Transport;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Paths whose sums are kept in single precision.
const PATHS_IN_SINGLE: u32 = 256;

/// The bytes of the transport of some probes with some emissive materials.
pub fn transport_bytes(probes: usize, options: &BakeOptions, channels: usize, emitters: usize) -> usize {
    let rows = options.degree.rows();
    let one = rows * (options.sky.rows() * channels + 6 * emitters) * size_of::<f32>();
    probes.saturating_mul(one)
}

/// Bakes the transport to probes at positions in metres.
///
/// Errors of T are 2 percent RMS at 4096 paths and 0.5 at 65,536 in the scenes of `tests/reference.rs`. Uses
/// all threads; the result does not depend on their number, nor a probe's on the other probes. `stop` is
/// asked before each probe.
///
/// # Errors
/// If there is no probe, a position is not finite, a degree is out of its range, the result is larger than
/// [`MOST_BYTES`], or it was stopped.
pub fn bake(
    surfaces: &Surfaces<'_>,
    positions: &[[f32; 3]],
    options: &BakeOptions,
    stop: Stop<'_>,
) -> Result<Transport, BakeError> {
    options.check(positions)?;
    let channels = surfaces.channels();
    let bytes = transport_bytes(positions.len(), options, channels, surfaces.columns);
    if bytes > MOST_BYTES {
        return Err(BakeError::TooLarge { probes: positions.len(), bytes });
    }
    let emitters = Emitters::of(surfaces);
    let bases = [Basis::new(options.degree), Basis::new(options.sky)];
    let paths = Paths { surfaces, emitters: Some(&emitters), bounces: options.bounces };
    let shape = Shape { rows: options.degree.rows(), columns: options.sky.rows(), channels };
    let probe = |position: &[f32; 3]| {
        stop.check()?;
        let blocks = |block: usize| {
            let seed = probe_seed(position, options.seed) ^ block as u64;
            (Numbers::new(hash(seed)), Sums::new(shape, surfaces.columns, &bases))
        };
        let mut blocks: Vec<(Numbers, Sums<'_>)> = (0..BLOCKS).map(blocks).collect();
        let (count, error) = options.until_exact(
            &mut blocks,
            |blocks, block, indices| {
                let (numbers, sums) = &mut blocks[block];
                for index in indices {
                    paths.trace(Vec3::from(*position), numbers, index, sums);
                    if index % PATHS_IN_SINGLE == PATHS_IN_SINGLE - 1 {
                        sums.flush();
                    }
                }
                sums.flush();
            },
            |blocks, _| {
                relative_error(&blocks.iter().map(|(_, sums)| sums.of_all_light()).collect::<Vec<_>>())
            },
        );
        let scale = 1.0 / f64::from(count);
        let total = |parts: Vec<&[f64]>| {
            let sum = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
            (0..parts[0].len()).map(|k| (sum(k) * scale) as f32).collect::<Vec<f32>>()
        };
        let emission = [0, 1].map(|k| total(blocks.iter().map(|(_, sums)| &*sums.emission[k]).collect()));
        let sky = total(blocks.iter().map(|(_, sums)| &*sums.sky).collect());
        Ok(Baked { sky, emission, count, error })
    };
    let baked: Vec<Baked> = positions.par_iter().map(probe).collect::<Result<_, BakeError>>()?;
    let Shape { rows, columns, channels } = shape;
    let mut transport = Transport::empty(options.degree, options.sky, channels, surfaces.columns);
    for Baked { sky, emission: [direct, indirect], count, error } in baked {
        for i in 0..rows {
            for j in 0..columns {
                let places = (0..channels).map(|channel| (channel * rows + i) * padded(columns) + j);
                transport.sky.extend(places.map(|place| sky[place]));
            }
        }
        transport.direct.extend(direct);
        transport.indirect.extend(indirect);
        transport.paths.push(count);
        transport.errors.push(error);
    }
    Ok(transport)
}

/// The seed of a probe: that of its place alone.
pub(crate) fn probe_seed(position: &[f32; 3], seed: u64) -> u64 {
    position.iter().fold(hash(seed), |seed, x| hash(seed ^ u64::from((x + 0.0).to_bits()))) << 4
}

/// What a probe gets.
struct Baked {
    sky: Vec<f32>,
    emission: [Vec<f32>; 2],
    count: u32,
    error: f32,
}

#[derive(Clone, Copy)]
struct Shape {
    rows: usize,
    columns: usize,
    channels: usize,
}

/// The length of a row of columns in memory: whole registers.
fn padded(columns: usize) -> usize {
    columns.next_multiple_of(4)
}

/// The sums of a block of paths.
struct Sums<'a> {
    shape: Shape,
    bases: &'a [Basis; 2],
    /// The harmonics of the first direction.
    first: Vec<f32>,
    /// The harmonics of the sky's direction, padded with zeros.
    last: Vec<f32>,
    scratch: Vec<f64>,
    /// [channel, row, column], of a few paths and of all.
    sky_of_few: Vec<f32>,
    sky: Vec<f64>,
    /// Direct and reflected light of emitters: [emitter, row, RGB].
    emission: [Vec<f64>; 2],
}

impl<'a> Sums<'a> {
    fn new(shape: Shape, emitters: usize, bases: &'a [Basis; 2]) -> Self {
        let Shape { rows, columns, channels } = shape;
        let length = channels * rows * padded(columns);
        Self {
            shape,
            bases,
            first: vec![0.0; rows],
            last: vec![0.0; padded(columns)],
            scratch: vec![0.0; rows.max(columns)],
            sky_of_few: vec![0.0; length],
            sky: vec![0.0; length],
            emission: [0, 1].map(|_| vec![0.0; emitters * rows * 3]),
        }
    }

    fn flush(&mut self) {
        for (sum, few) in self.sky.iter_mut().zip(&mut self.sky_of_few) {
            *sum += f64::from(*few);
            *few = 0.0;
        }
    }

    /// The rows of what arrives if the sky and all emitters have the radiance 1, times the paths.
    fn of_all_light(&self) -> Vec<[f64; 3]> {
        let Shape { rows, columns, channels } = self.shape;
        let white = 2.0 * std::f64::consts::PI.sqrt();
        let row = |row: usize| {
            [0, 1, 2].map(|channel| {
                let sky = self.sky[((channel % channels) * rows + row) * padded(columns)] * white;
                let emitters = self
                    .emission
                    .iter()
                    .flat_map(|sums| sums.iter().skip(3 * row + channel).step_by(3 * rows));
                sky + emitters.sum::<f64>()
            })
        };
        (0..rows).map(row).collect()
    }
}

fn double(direction: Vec3) -> Direction {
    Direction::normalised(DVec3::new(direction.x.into(), direction.y.into(), direction.z.into()))
}

impl Visitor for Sums<'_> {
    fn begin(&mut self, direction: Vec3) {
        let rows = self.shape.rows;
        self.bases[0].evaluate_into(double(direction), &mut self.scratch[..rows]);
        self.first.iter_mut().zip(&self.scratch).for_each(|(first, y)| *first = *y as f32);
    }

    fn sky(&mut self, direction: Vec3, share: [f32; 3]) {
        let Shape { rows, columns, channels } = self.shape;
        self.bases[1].evaluate_into(double(direction), &mut self.scratch[..columns]);
        self.last.iter_mut().zip(&self.scratch[..columns]).for_each(|(last, y)| *last = *y as f32);
        let lines = self.sky_of_few.chunks_exact_mut(padded(columns));
        let factors = (0..channels).flat_map(|channel| (0..rows).map(move |row| (channel, row)));
        for (line, (channel, row)) in lines.zip(factors) {
            let factor = self.first[row] * share[channel];
            line.iter_mut().zip(&self.last).for_each(|(sum, y)| *sum += factor * y);
        }
    }

    fn emission(&mut self, column: usize, share: [f32; 3], reflections: u32) {
        let rows = self.shape.rows;
        let sums = &mut self.emission[usize::from(reflections > 0)][column * rows * 3..][..rows * 3];
        for (sums, y) in sums.as_chunks_mut::<3>().0.iter_mut().zip(&self.first) {
            sums.iter_mut().zip(share).for_each(|(sum, share)| *sum += f64::from(share * y));
        }
    }

    fn emission_from(&mut self, direction: Vec3, column: usize, share: [f32; 3]) {
        let rows = self.shape.rows;
        self.bases[0].evaluate_into(double(direction), &mut self.scratch[..rows]);
        let sums = &mut self.emission[0][column * rows * 3..][..rows * 3];
        for (sums, y) in sums.as_chunks_mut::<3>().0.iter_mut().zip(&self.scratch) {
            sums.iter_mut().zip(share).for_each(|(sum, share)| *sum += f64::from(share) * y);
        }
    }

    fn reflects(&mut self, _: &Surfaces<'_>, _: &Place, _: [f32; 3]) {}
}
