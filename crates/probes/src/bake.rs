//! Transport from the sky and from emissive materials to probes.
//!
//! > T_ij = integral over w of Y_i(w) B_j(w) dw
//!
//! where B_j(w) is the radiance that arrives from w under the sky Y_j. A path with the first direction w that
//! leaves the scene in the direction d with the throughput b adds Y_i(w) b Y_j(d); the mean over all paths is
//! T_ij, but for the blur of the cache at which they end (irradiance_cache.rs).

use std::ops::Range;

use glam::Vec3;
use sh::{Basis, Stop};
use sphere::{DVec3, Direction};

use crate::bricks::{BakeRecord, BrickCounts, Bricks, Dependencies, EarlierBake, Fate, PointGroups};
use crate::cells::{CellGrid, WORDS};
use crate::emitters::Emitters;
use crate::irradiance_cache::{Cache, CacheOptions, PointLight, SKY_RAYS};
use crate::options::{BLOCKS, BakeError, BakeOptions, BakeProbe, MOST_BYTES, relative_error};
use crate::paths::{Numbers, Paths, PointOfCache, Visitor};
use crate::random::{hash, hash_of, hash_words};
use crate::surfaces::{Place, Surfaces};
use crate::transport::Transport;

/// Raised when the results of bakes or of [`crate::ProbePlaces`], [`crate::rooms`] or [`crate::scatter`]
/// change: every kind of stage that calls them adds this to its own revision.
pub const REVISION: u32 = 4;

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
/// Paths end at a cache of the light at points on surfaces, with one cache for each of four blocks of
/// paths, so that estimates of errors know of it. Errors of T are 0.8 to 1.3 percent RMS at 4096 paths and
/// 0.2 at 65,536 in the scenes of `tests/reference.rs`; plain paths have 1.1 to 2.7 at 4096. Uses all
/// threads; the result does not depend on their number, nor a probe's on the other probes. `stop` is asked
/// before each probe, and while the caches are made.
///
/// # Errors
/// If there is no probe, a position is not finite, a degree is out of its range, the result and the caches
/// are larger than [`MOST_BYTES`], or it was stopped.
pub fn bake(
    surfaces: &Surfaces<'_>,
    positions: &[[f32; 3]],
    options: &BakeOptions,
    stop: Stop<'_>,
) -> Result<Transport, BakeError> {
    bake_recorded(surfaces, positions, None, options, None, stop).map(|baked| baked.transport)
}

/// A transport in bricks.
#[derive(Clone, Debug)]
pub struct BakedBricks {
    /// The transport of all probes, of those that were kept, too.
    pub transport: Transport,
    /// What the bricks were made from; `None` if an error was asked for, since how many paths a probe has,
    /// and with them its caches, is then only known once it is baked.
    pub record: Option<BakeRecord>,
    /// How many bricks are those of the earlier bake, if there was one.
    pub counts: Option<BrickCounts>,
}

/// Bakes the transport to probes as [`bake()`] does, to the bit, and takes over those bricks of an earlier
/// bake that cannot be different now.
///
/// The light of points on surfaces is computed anew, and paths are traced for the other bricks alone.
///
/// # Errors
/// The errors of [`bake()`].
pub fn bake_bricks(
    surfaces: &Surfaces<'_>,
    positions: &[[f32; 3]],
    bricks: &Bricks,
    options: &BakeOptions,
    earlier: Option<EarlierBake<'_>>,
    stop: Stop<'_>,
) -> Result<BakedBricks, BakeError> {
    let recorded = options.error.is_none().then_some(bricks);
    bake_recorded(surfaces, positions, recorded, options, earlier, stop)
}

/// Bakes the transport to probes. With bricks, what they are made from is recorded.
fn bake_recorded(
    surfaces: &Surfaces<'_>,
    positions: &[[f32; 3]],
    bricks: Option<&Bricks>,
    options: &BakeOptions,
    earlier: Option<EarlierBake<'_>>,
    stop: Stop<'_>,
) -> Result<BakedBricks, BakeError> {
    options.check(positions)?;
    let channels = surfaces.channels();
    let emitters = Emitters::of(surfaces);
    let grid = bricks.map(|bricks| CellGrid::new(bricks.bounds));
    let bases = [Basis::new(options.degree), Basis::new(options.sky)];
    let paths = Paths { surfaces, emitters: Some(&emitters), bounces: options.bounces };
    let (rows, columns) = (options.degree.rows(), options.sky.rows());
    let shape = Shape { rows, columns, channels, emitters: surfaces.columns };
    let numbers_of_point = shape.channels_of_point();
    let triangles = surfaces.parts.triangles.len();
    let bytes = transport_bytes(positions.len(), options, channels, surfaces.columns)
        .saturating_add(options.cache_bytes(triangles, numbers_of_point.len()));
    if bytes > MOST_BYTES {
        return Err(BakeError::TooLarge { probes: positions.len(), bytes });
    }
    let caches = |count: u32| {
        if options.bounces == Some(0) {
            return Ok(None);
        }
        let (points, rays) = BakeOptions::cache_size(count, triangles);
        let cache = |block: usize| {
            let seed = hash(options.seed) ^ block as u64;
            let channels = &numbers_of_point;
            let options =
                CacheOptions { points, rays, seed, with_direct: true, channels, cells: grid.as_ref() };
            Cache::new(&paths, &options, || SkyAtPoint::new(shape, &bases[1]), stop)
        };
        Ok(Some((0..BLOCKS).map(cache).collect::<Result<Vec<_>, _>>()?))
    };
    let mut first_caches = caches(options.first_paths())?;
    let record = bricks.zip(grid.as_ref()).map(|(bricks, grid)| {
        let digests: Vec<u64> = surfaces.digests().collect();
        let of_all = digest_of_all(&paths, grid, &digests, first_caches.as_deref(), options);
        let groups = first_caches.iter_mut().flatten().filter_map(|cache| cache.groups.as_mut());
        let groups = PointGroups::number(groups.collect());
        let contents = grid.contents(surfaces, &digests, stop)?;
        Ok::<_, BakeError>(BakeRecord::begin(of_all, contents, groups, positions, bricks))
    });
    let record = record.transpose()?;
    let mut transport = Transport::empty(options.degree, options.sky, channels, surfaces.columns);
    let bricks = bricks.map_or(&[][..], |bricks| &bricks.probes);
    let fates = record.as_ref().zip(earlier).map(|(record, earlier)| {
        let is_alike = earlier.transport.shape() == transport.shape();
        record.fates(bricks, &earlier, is_alike)
    });
    let groups = record.as_ref().map_or(0, |record| record.groups.len());
    let recorded = grid.as_ref().map(|grid| (grid, groups));
    let (of_sky, of_emitters) = (rows * columns * channels, rows * 3 * surfaces.columns);
    transport.sky = vec![0.0; positions.len() * of_sky];
    transport.direct = vec![0.0; positions.len() * of_emitters];
    transport.indirect = vec![0.0; positions.len() * of_emitters];
    transport.paths = vec![0; positions.len()];
    transport.errors = vec![0.0; positions.len()];
    let mut depends: Vec<Dependencies> = bricks.iter().map(|_| Dependencies::new(groups)).collect();
    let mut is_kept = vec![false; positions.len()];
    if let (Some(record), Some(earlier)) = (&record, &earlier) {
        for (brick, fate) in fates.iter().flatten().enumerate() {
            let Fate::Kept(before) = fate else { continue };
            depends[brick] = record.dependencies_of_kept(earlier.record, *before);
            for (own, from) in bricks[brick].iter().zip(&earlier.bricks.probes[*before]) {
                transport.take_probe(*own as usize, earlier.transport, *from as usize);
                is_kept[*own as usize] = true;
            }
        }
    }
    let mut brick_of = vec![0; positions.len()];
    for (brick, probes) in bricks.iter().enumerate() {
        probes.iter().for_each(|probe| brick_of[*probe as usize] = brick);
    }
    let open: Vec<usize> = (0..positions.len()).filter(|probe| !is_kept[*probe]).collect();
    let places: Vec<[f32; 3]> = open.iter().map(|probe| positions[*probe]).collect();
    let bake = BakeTransport { paths: &paths, positions: &places, options, shape, bases: &bases, recorded };
    let mut first_caches = Some(first_caches);
    let prepare = |count| first_caches.take().map_or_else(|| caches(count), Ok);
    options.in_rounds(open.len(), stop, prepare, &bake, |index, baked: Baked| {
        let probe = open[index];
        let Baked { sky, emission: [direct, indirect], count, error, depends: own } = baked;
        if let Some(own) = own {
            depends[brick_of[probe]].join(&own);
        }
        for (k, number) in transport.sky[probe * of_sky..][..of_sky].iter_mut().enumerate() {
            let (row, column, channel) = (k / channels / columns, k / channels % columns, k % channels);
            *number = sky[(channel * rows + row) * padded(columns) + column];
        }
        transport.direct[probe * of_emitters..][..of_emitters].copy_from_slice(&direct);
        transport.indirect[probe * of_emitters..][..of_emitters].copy_from_slice(&indirect);
        transport.paths[probe] = count;
        transport.errors[probe] = error;
    })?;
    let record = record.map(|record| record.finish(&depends));
    Ok(BakedBricks { transport, record, counts: fates.as_deref().map(BrickCounts::of) })
}

/// A hash of what all probes depend on.
fn digest_of_all(
    paths: &Paths<'_>,
    grid: &CellGrid,
    triangles: &[u64],
    caches: Option<&[Cache]>,
    options: &BakeOptions,
) -> u64 {
    let emitters = paths.emitters.map_or(0, |emitters| emitters.digest(triangles));
    let channels = paths.surfaces.channels() as u64;
    let numbers = [emitters, grid.digest(), channels, paths.surfaces.columns as u64];
    let sizes = caches.unwrap_or_default().iter().map(Cache::digest);
    let text = format!("{REVISION} {options:?}").into_bytes();
    let all = numbers.into_iter().chain(sizes).chain(text.into_iter().map(u64::from));
    hash_words(0, all)
}

/// The seed of a probe: that of its place alone.
pub(crate) fn probe_seed(position: &[f32; 3], seed: u64) -> u64 {
    hash_of(hash(seed), position.map(|x| x + 0.0)) << 4
}

/// How the transport to a probe is baked.
struct BakeTransport<'a> {
    paths: &'a Paths<'a>,
    positions: &'a [[f32; 3]],
    options: &'a BakeOptions,
    shape: Shape,
    bases: &'a [Basis; 2],
    /// The cells of space and the number of groups of points, if dependencies are to be known.
    recorded: Option<(&'a CellGrid, usize)>,
}

/// The numbers and the sums of each block of a probe.
type Blocks<'a> = Vec<(Numbers, Sums<'a>)>;

impl<'a> BakeProbe<Option<Vec<Cache>>, Blocks<'a>, Baked> for BakeTransport<'a> {
    fn state_bytes(&self) -> usize {
        let Shape { rows, columns, channels, emitters } = self.shape;
        let sky = channels * rows * padded(columns) * (size_of::<f32>() + size_of::<f64>());
        let emission = 2 * emitters * rows * 3 * size_of::<f64>();
        let depends = self.recorded.map_or(0, |(_, groups)| groups / 8 + WORDS * size_of::<u64>());
        BLOCKS * (size_of::<(Numbers, Sums<'_>)>() + sky + emission + depends)
    }

    fn start(&self, probe: usize) -> Blocks<'a> {
        let seed = probe_seed(&self.positions[probe], self.options.seed);
        let block = |block: usize| {
            let depends = self.recorded.map(|(grid, groups)| (grid, Dependencies::new(groups)));
            (Numbers::new(hash(seed ^ block as u64)), Sums { depends, ..Sums::new(self.shape, self.bases) })
        };
        (0..BLOCKS).map(block).collect()
    }

    fn run(
        &self,
        caches: &Option<Vec<Cache>>,
        probe: usize,
        blocks: &mut Blocks<'a>,
        block: usize,
        indices: Range<u32>,
    ) {
        let cache = caches.as_ref().map(|caches| (&caches[block], indices.end));
        let (numbers, sums) = &mut blocks[block];
        for index in indices {
            self.paths.trace(Vec3::from(self.positions[probe]), numbers, index, cache, sums);
            if index % PATHS_IN_SINGLE == PATHS_IN_SINGLE - 1 {
                sums.flush();
            }
        }
        sums.flush();
    }

    fn error(&self, blocks: &Blocks<'a>, _: u32) -> f32 {
        relative_error(&blocks.iter().map(|(_, sums)| sums.of_all_light()).collect::<Vec<_>>())
    }

    fn finish(&self, blocks: Blocks<'a>, count: u32, error: f32) -> Baked {
        let scale = 1.0 / f64::from(count);
        let total = |parts: Vec<&[f64]>| {
            let sum = |k: usize| parts.iter().map(|part| part[k]).sum::<f64>();
            (0..parts[0].len()).map(|k| (sum(k) * scale) as f32).collect::<Vec<f32>>()
        };
        let emission = [0, 1].map(|k| total(blocks.iter().map(|(_, sums)| &*sums.emission[k]).collect()));
        let sky = total(blocks.iter().map(|(_, sums)| &*sums.sky).collect());
        let own = blocks.into_iter().filter_map(|(_, sums)| sums.depends);
        let depends = own.map(|(_, depends)| depends).reduce(|mut one, other| {
            one.join(&other);
            one
        });
        Baked { sky, emission, count, error, depends }
    }
}

/// What a probe gets.
struct Baked {
    sky: Vec<f32>,
    emission: [Vec<f32>; 2],
    count: u32,
    error: f32,
    depends: Option<Dependencies>,
}

#[derive(Clone, Copy)]
struct Shape {
    rows: usize,
    columns: usize,
    channels: usize,
    emitters: usize,
}

impl Shape {
    /// The channels of the numbers of a point of the cache: [channel, column] of the sky, padded, and
    /// [emitter, RGB].
    fn channels_of_point(self) -> Vec<u8> {
        let sky = (0..self.channels as u8).flat_map(|channel| vec![channel; padded(self.columns)]);
        sky.chain([0, 1, 2].repeat(self.emitters)).collect()
    }
}

/// The length of a row of columns in memory: whole registers.
fn padded(columns: usize) -> usize {
    columns.next_multiple_of(4)
}

/// Adds the product of a column and a row to a matrix.
fn add_product(matrix: &mut [f32], column: &[f32], factor: f32, row: &[f32]) {
    for (line, value) in matrix.chunks_exact_mut(row.len()).zip(column) {
        let factor = factor * value;
        line.iter_mut().zip(row).for_each(|(sum, number)| *sum += factor * number);
    }
}

/// The light of the sky and of emitters at a point of the cache.
struct SkyAtPoint<'a> {
    shape: Shape,
    basis: &'a Basis,
    harmonics: Vec<f64>,
    numbers: Vec<f32>,
}

impl<'a> SkyAtPoint<'a> {
    fn new(shape: Shape, basis: &'a Basis) -> Self {
        let length = shape.channels * padded(shape.columns) + 3 * shape.emitters;
        Self { shape, basis, harmonics: vec![0.0; shape.columns], numbers: vec![0.0; length] }
    }
}

impl PointLight for SkyAtPoint<'_> {
    const HAS_SKY: bool = true;

    fn numbers(self) -> Vec<f32> {
        self.numbers
    }
}

impl Visitor for SkyAtPoint<'_> {
    fn begin(&mut self, _: Vec3) {}

    fn sky(&mut self, direction: Vec3, share: [f32; 3]) {
        self.basis.evaluate_into(double(direction), &mut self.harmonics);
        for (line, share) in self.numbers.chunks_exact_mut(padded(self.shape.columns)).zip(share) {
            let share = share / SKY_RAYS as f32;
            line.iter_mut().zip(&self.harmonics).for_each(|(sum, y)| *sum += share * *y as f32);
        }
    }

    fn emission(&mut self, column: usize, share: [f32; 3], _: u32) {
        let first = self.shape.channels * padded(self.shape.columns) + 3 * column;
        self.numbers[first..].iter_mut().zip(share).for_each(|(sum, share)| *sum += share);
    }

    fn emission_from(&mut self, _: Vec3, _: usize, _: [f32; 3]) {}

    fn reflects(&mut self, _: &Surfaces<'_>, _: &Place, _: [f32; 3]) {}

    fn cached(&mut self, _: &PointOfCache<'_>, _: [f32; 3]) {}
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
    /// What the sums depend on, if that is to be known.
    depends: Option<(&'a CellGrid, Dependencies)>,
}

impl<'a> Sums<'a> {
    fn new(shape: Shape, bases: &'a [Basis; 2]) -> Self {
        let Shape { rows, columns, channels, emitters } = shape;
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
            depends: None,
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
        let Shape { rows, columns, channels, .. } = self.shape;
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

pub(crate) fn double(direction: Vec3) -> Direction {
    Direction::normalised(DVec3::new(direction.x.into(), direction.y.into(), direction.z.into()))
}

impl Visitor for Sums<'_> {
    fn begin(&mut self, direction: Vec3) {
        let rows = self.shape.rows;
        self.bases[0].evaluate_into(double(direction), &mut self.scratch[..rows]);
        self.first.iter_mut().zip(&self.scratch).for_each(|(first, y)| *first = *y as f32);
    }

    fn sky(&mut self, direction: Vec3, share: [f32; 3]) {
        let Shape { rows, columns, channels, .. } = self.shape;
        self.bases[1].evaluate_into(double(direction), &mut self.scratch[..columns]);
        self.last.iter_mut().zip(&self.scratch[..columns]).for_each(|(last, y)| *last = *y as f32);
        for (matrix, share) in
            self.sky_of_few.chunks_exact_mut(rows * padded(columns)).zip(share).take(channels)
        {
            add_product(matrix, &self.first, share, &self.last);
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

    fn depends(&mut self) -> Option<(&CellGrid, &mut Dependencies)> {
        self.depends.as_mut().map(|(grid, depends)| (*grid, depends))
    }

    fn cached(&mut self, point: &PointOfCache<'_>, share: [f32; 3]) {
        let Shape { rows, columns, channels, .. } = self.shape;
        if let Some((_, depends)) = &mut self.depends {
            depends.add_group(point.group);
        }
        let (sky, emission) = point.light.split_at(channels * padded(columns));
        let matrices = self.sky_of_few.chunks_exact_mut(rows * padded(columns));
        for ((matrix, row), share) in matrices.zip(sky.chunks_exact(padded(columns))).zip(share) {
            add_product(matrix, &self.first, share, row);
        }
        for (column, emission) in emission.as_chunks::<3>().0.iter().enumerate() {
            self.emission(column, [0, 1, 2].map(|channel| share[channel] * emission[channel]), 1);
        }
    }
}

#[cfg(test)]
mod tests;
