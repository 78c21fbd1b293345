//! Shading at vertices: [KSS02, eq. 1] and steps 1 to 4 of [KSS02, sec. 4].
//!
//! Both may move: c_i(v), looked up in the vertex' frame, is turned into the world, where the light is the
//! same for all vertices; of a grey table that is one vector rather than the three of a coloured light. If
//! the light is fixed, it is turned into each frame once ([`FixedLight`]); if the view is, c_i is looked up
//! and turned once ([`FixedView`]). All three agree to rounding.
//!
//! Results are signed: a series rings, and what clamps is the display's choice.
//!
//! Everything is computed for eight vertices at a time, a lane each, so that no sum runs across a vector.

use brdf::BrdfTable;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::{self, SimdLevel, WithLanes};
use sh::{Degree, Expansion};

use crate::frames::{Block, Frames, LANES, Viewer};
use crate::lanes::by_lane;
use crate::rotation::{FrameRotation, Lanes, Multiples};
use crate::transfer::{Transfer, TransferDegrees};
use crate::vectors::{
    EIGHTS, Entry, Halves, Shifts, by_channel, by_row, dot, first_column, load, product, store, total,
};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The number of blocks of eight vertices that a thread takes at a time.
const BLOCKS: usize = 64;

/// The number of vertices that a thread takes at a time.
const CHUNK: usize = LANES * BLOCKS;

/// The radiance of each vertex, RGB; table and light are cut to the lower of their degrees.
///
/// # Example: a matte sphere under a white sky has its albedo everywhere
/// ```
/// use sh::{Degree, Expansion};
/// use transfer::{Frames, Viewer, shade};
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.5; 3])?);
/// let (table, _) = brdf::tabulate(&chalk, Degree::new(4)?, 16, sh::Stop::NEVER)?;
/// let mut sky = Expansion::zero(Degree::new(4)?);
/// sky.coefficients_mut()[0] = [(4.0 * std::f64::consts::PI).sqrt(); 3];
/// let sphere = Frames::of(&mesh::shape("sphere").unwrap())?;
/// let seen = shade(&sphere, &table, Viewer::Distant(sphere::Direction::X), &sky);
/// assert!(seen.iter().flatten().all(|value| (value - 0.5).abs() < 1e-5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn shade(frames: &Frames, table: &BrdfTable, viewer: Viewer, light: &Expansion) -> Vec<[f32; 3]> {
    let degree = table.degree().min(light.degree());
    let turned = Turned { table, viewer, rotation: &FrameRotation::new(degree), degree };
    let light = by_row(light, degree);
    let mut radiance = vec![[0.0; 3]; frames.len()];
    let chunks = radiance.par_chunks_mut(CHUNK).zip(frames.blocks().par_chunks(BLOCKS));
    chunks.for_each(|(radiance, blocks)| {
        SimdLevel::detect().run_lanes(BothMove { turned, light: &light, blocks, radiance });
    });
    radiance
}

/// Memory for looking coefficients up and turning them.
struct Room {
    /// The texels of eight vertices.
    texels: Vec<f32>,
    /// The multiples of the angles of a turn.
    turns: Multiples,
}

/// The looked-up coefficients of eight vertices, turned into the world.
#[derive(Clone, Copy)]
struct Turned<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    rotation: &'a FrameRotation,
    degree: Degree,
}

impl Turned<'_> {
    fn room(&self) -> Room {
        Room { texels: vec![0.0; LANES * self.table.texel()], turns: self.rotation.room() }
    }

    /// The number of values that [`Turned::block`] has for each vertex.
    fn length(&self) -> usize {
        self.table.channels() * self.degree.rows()
    }

    /// Looks up the coefficients of a block, [channel][row][lane].
    #[inline(always)]
    fn block<L: f64x4::Lanes>(
        &self,
        simd: L,
        block: &Block,
        Room { texels, turns }: &mut Room,
        c: &mut Lanes,
    ) {
        self.table.lookup_eight(simd, &block.blend, &block.views(self.viewer), texels);
        by_lane(simd, texels, self.table.channels(), c);
        self.rotation.to_world(simd, &block.angles, c, turns);
    }
}

/// The sums over rows of c times a light that is the same for all vertices; c has a channel for each of the
/// light's, or one for all.
#[inline(always)]
fn under<S: Simd>(simd: S, light: &[[f32; 3]], c: &Lanes, channels: usize, radiance: &mut [[f32; 3]]) {
    let rows = c.len() / channels;
    let channel = |channel: usize| &c[channel.min(channels - 1) * rows..][..light.len()];
    let [red, green, blue] = [channel(0), channel(1), channel(2)];
    let mut sums = [simd.splat_f32s(0.0); 3];
    for (row, light) in light.iter().enumerate() {
        for (index, c) in [red, green, blue].into_iter().enumerate() {
            let light = simd.splat_f32s(light[index]);
            sums[index] = simd.mul_add_f32s(load(simd, &c[row]), light, sums[index]);
        }
    }
    write(simd, sums, radiance);
}

/// Writes red, green and blue of up to eight vertices.
#[inline(always)]
pub(crate) fn write<S: Simd>(simd: S, sums: [S::f32s; 3], radiance: &mut [[f32; 3]]) {
    let mut lanes = [[0.0; LANES]; 3];
    lanes.iter_mut().zip(sums).for_each(|(lanes, sum)| store(simd, sum, lanes));
    for (lane, rgb) in radiance.iter_mut().take(LANES).enumerate() {
        *rgb = lanes.map(|lanes| lanes[lane]);
    }
}

struct BothMove<'a> {
    turned: Turned<'a>,
    light: &'a [[f32; 3]],
    blocks: &'a [Block],
    radiance: &'a mut [[f32; 3]],
}

impl WithLanes for BothMove<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: f64x4::Lanes>(self, simd: L) {
        let mut room = self.turned.room();
        let mut c = vec![[0.0; LANES]; self.turned.length()];
        for (block, radiance) in self.blocks.iter().zip(self.radiance.chunks_mut(LANES)) {
            self.turned.block(simd, block, &mut room, &mut c);
            under(simd, self.light, &c, self.turned.table.channels(), radiance);
        }
    }
}

/// A light turned into the frame of each vertex: 300 bytes a vertex for degree 4. Only the view may move.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedLight {
    degree: Degree,
    /// The number of vertices.
    count: usize,
    /// The turned light, [block of eight vertices][3][(F+1)^2][lane].
    values: Vec<[f32; LANES]>,
}

impl FixedLight {
    /// Turns the light.
    pub fn new(frames: &Frames, light: &Expansion) -> Self {
        let degree = light.degree();
        let (rotation, light) = (FrameRotation::new(degree), by_row(light, degree));
        let mut values = vec![[0.0; LANES]; frames.blocks().len() * 3 * degree.rows()];
        let chunks =
            values.par_chunks_mut(BLOCKS * 3 * degree.rows()).zip(frames.blocks().par_chunks(BLOCKS));
        chunks.for_each(|(values, blocks)| {
            SimdLevel::detect().run(TurnLight { rotation: &rotation, light: &light, blocks, values });
        });
        Self { degree, count: frames.len(), values }
    }

    /// Returns the light (T L)_i that arrives past the mesh: the light turned and shadowed. The transfer is
    /// one for all channels, or one for each of red, green and blue.
    ///
    /// # Panics
    /// If there is no transfer.
    pub fn with_transfer(transfer: &[Transfer], light: &Expansion) -> Self {
        let first = &transfer[0];
        let (degree, stored) = (first.output(), first.input().rows());
        let light = by_channel(light, first.input().min(light.degree()));
        let (rows, length) = (degree.rows(), degree.rows() * stored);
        let mut values = vec![[0.0; LANES]; first.len().div_ceil(LANES) * 3 * rows];
        for (channel, light) in light.iter().enumerate() {
            let matrices = transfer[channel.min(transfer.len() - 1)].values().par_chunks(LANES * length);
            values.par_chunks_exact_mut(3 * rows).zip(matrices).for_each(|(values, matrices)| {
                let values = &mut values[channel * rows..][..rows];
                for (lane, matrix) in matrices.chunks_exact(length).enumerate() {
                    for (value, entries) in values.iter_mut().zip(matrix.chunks_exact(stored)) {
                        value[lane] = dot(&entries[..light.len()], light);
                    }
                }
            });
        }
        Self { degree, count: first.len(), values }
    }

    /// The degree of the light in the frames.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The light in the frames: [V, 3, (F+1)^2].
    pub fn values(&self) -> Vec<f32> {
        by_vertex(&self.values, self.count, 3 * self.degree.rows())
    }

    /// The radiance of each vertex, RGB, as [`shade`] has it.
    ///
    /// # Panics
    /// If the frames are not as many as those that the light was turned into.
    pub fn shade(&self, frames: &Frames, table: &BrdfTable, viewer: Viewer) -> Vec<[f32; 3]> {
        assert_eq!(frames.len(), self.count, "the frames of this light");
        let length = 3 * self.degree.rows();
        let rows = self.degree.min(table.degree()).rows();
        let mut radiance = vec![[0.0; 3]; frames.len()];
        let chunks = radiance.par_chunks_mut(CHUNK).zip(frames.blocks().par_chunks(BLOCKS));
        chunks.zip(self.values.par_chunks(BLOCKS * length)).for_each(|((radiance, blocks), light)| {
            SimdLevel::detect().run_lanes(LightStays { table, viewer, rows, blocks, light, radiance });
        });
        radiance
    }
}

/// The `length` numbers of each vertex, one vertex after the other, from blocks of eight.
fn by_vertex(blocks: &[[f32; LANES]], count: usize, length: usize) -> Vec<f32> {
    let mut values = vec![0.0; count * length];
    values.par_chunks_mut(length).enumerate().for_each(|(vertex, values)| {
        let block = &blocks[vertex / LANES * length..][..length];
        values.iter_mut().zip(block).for_each(|(value, lanes)| *value = lanes[vertex % LANES]);
    });
    values
}

struct TurnLight<'a> {
    rotation: &'a FrameRotation,
    light: &'a [[f32; 3]],
    blocks: &'a [Block],
    values: &'a mut [[f32; LANES]],
}

impl WithSimd for TurnLight<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rows = self.light.len();
        let mut room = self.rotation.room();
        for (block, values) in self.blocks.iter().zip(self.values.chunks_exact_mut(3 * rows)) {
            for (channel, values) in values.chunks_exact_mut(rows).enumerate() {
                for (to, from) in values.iter_mut().zip(self.light) {
                    *to = [from[channel]; LANES];
                }
            }
            self.rotation.to_local(simd, &block.angles, values, &mut room);
        }
    }
}

struct LightStays<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    /// The rows that light and table both have.
    rows: usize,
    blocks: &'a [Block],
    light: &'a [[f32; LANES]],
    radiance: &'a mut [[f32; 3]],
}

impl WithLanes for LightStays<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: f64x4::Lanes>(self, simd: L) {
        let channels = self.table.channels();
        let mut texels = vec![0.0; LANES * self.table.texel()];
        let mut c = vec![[0.0; LANES]; channels * self.rows];
        let lights = self.light.chunks_exact(self.light.len() / self.blocks.len());
        for ((block, light), radiance) in self.blocks.iter().zip(lights).zip(self.radiance.chunks_mut(LANES))
        {
            self.table.lookup_eight(simd, &block.blend, &block.views(self.viewer), &mut texels);
            by_lane(simd, &texels, channels, &mut c);
            let sums = [0, 1, 2].map(|channel| {
                let c = &c[channel.min(channels - 1) * self.rows..][..self.rows];
                let light = &light[channel * (light.len() / 3)..];
                c.iter().zip(light).fold(simd.splat_f32s(0.0), |sum, (c, light)| {
                    simd.mul_add_f32s(load(simd, c), load(simd, light), sum)
                })
            });
            write(simd, sums, radiance);
        }
    }
}

/// The coefficients c_i toward a viewer, turned into the world: 100 bytes a vertex for degree 4 and a grey
/// table. Only the light may move.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedView {
    degree: Degree,
    channels: usize,
    /// The number of vertices.
    count: usize,
    /// The coefficients, [block of eight vertices][channels][(F+1)^2][lane].
    values: Vec<[f32; LANES]>,
}

impl FixedView {
    /// Looks the table up for every vertex.
    pub fn new(frames: &Frames, table: &BrdfTable, viewer: Viewer) -> Self {
        let (degree, channels) = (table.degree(), table.channels());
        let turned = Turned { table, viewer, rotation: &FrameRotation::new(degree), degree };
        let mut values = vec![[0.0; LANES]; frames.blocks().len() * turned.length()];
        let chunks = values.par_chunks_mut(BLOCKS * turned.length()).zip(frames.blocks().par_chunks(BLOCKS));
        chunks
            .for_each(|(values, blocks)| SimdLevel::detect().run_lanes(TurnTable { turned, blocks, values }));
        Self { degree, channels, count: frames.len(), values }
    }

    /// Looks the table up for every vertex and takes what the mesh hides away from it: sum over i of c_i
    /// T_ij. The transfer is one for all channels, or one for each of red, green and blue.
    ///
    /// # Panics
    /// If there is no transfer, or it has not as many vertices.
    pub fn with_transfer(frames: &Frames, table: &BrdfTable, viewer: Viewer, transfer: &[Transfer]) -> Self {
        let first = &transfer[0];
        assert_eq!(frames.len(), first.len(), "the frames of this transfer");
        let (degree, texel) = (first.input(), table.texel());
        let (rows, kept) = (degree.rows(), first.output().min(table.degree()).rows());
        let channels = table.channels().max(transfer.len());
        let mut values = vec![[0.0; LANES]; frames.blocks().len() * channels * rows];
        let blocks = values.par_chunks_exact_mut(channels * rows).zip(frames.blocks()).enumerate();
        blocks.for_each(|(index, (values, block))| {
            let mut texels = vec![0.0; LANES * texel];
            SimdLevel::detect().run(Lookup { table, viewer, block, texels: &mut texels });
            for (channel, values) in values.chunks_exact_mut(rows).enumerate() {
                let transfer = &transfer[channel.min(transfer.len() - 1)];
                let vertices = (index * LANES..frames.len()).zip(texels.chunks_exact(texel));
                for (lane, (vertex, c)) in vertices.enumerate() {
                    let c = c[channel.min(table.channels() - 1)..].iter().step_by(table.channels());
                    for (c, entries) in c.zip(transfer.matrix(vertex).chunks_exact(rows)).take(kept) {
                        values.iter_mut().zip(entries).for_each(|(sum, entry)| sum[lane] += c * entry);
                    }
                }
            }
        });
        Self { degree, channels, count: frames.len(), values }
    }

    /// The degree of the coefficients.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The coefficients in the world: [V, channels, (F+1)^2], with one channel or three.
    pub fn values(&self) -> Vec<f32> {
        by_vertex(&self.values, self.count, self.channels * self.degree.rows())
    }

    /// The radiance of each vertex, RGB, as [`shade`] has it.
    pub fn shade(&self, light: &Expansion) -> Vec<[f32; 3]> {
        let light = by_row(light, self.degree.min(light.degree()));
        let length = self.channels * self.degree.rows();
        let mut radiance = vec![[0.0; 3]; self.count];
        radiance.par_chunks_mut(CHUNK).zip(self.values.par_chunks(BLOCKS * length)).for_each(
            |(radiance, values)| {
                let channels = self.channels;
                SimdLevel::detect().run(ViewStays { channels, length, light: &light, values, radiance });
            },
        );
        radiance
    }
}

struct Lookup<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    block: &'a Block,
    texels: &'a mut [f32],
}

impl WithSimd for Lookup<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, viewer, block, texels } = self;
        table.lookup_eight(simd, &block.blend, &block.views(viewer), texels);
    }
}

struct TurnTable<'a> {
    turned: Turned<'a>,
    blocks: &'a [Block],
    values: &'a mut [[f32; LANES]],
}

impl WithLanes for TurnTable<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: f64x4::Lanes>(self, simd: L) {
        let mut room = self.turned.room();
        let values = self.values.chunks_exact_mut(self.turned.length());
        for (block, values) in self.blocks.iter().zip(values) {
            self.turned.block(simd, block, &mut room, values);
        }
    }
}

struct ViewStays<'a> {
    channels: usize,
    length: usize,
    light: &'a [[f32; 3]],
    values: &'a [[f32; LANES]],
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for ViewStays<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let blocks = self.values.chunks_exact(self.length);
        for (c, radiance) in blocks.zip(self.radiance.chunks_mut(LANES)) {
            under(simd, self.light, c, self.channels, radiance);
        }
    }
}

/// The radiance of each vertex with what the mesh hides: sum over i of c_i (T L)_i. The table is cut to the
/// transfer's degree O if it has more, the light to F.
///
/// # Panics
/// If the transfer has not as many vertices.
pub fn shade_with_transfer(
    frames: &Frames,
    table: &BrdfTable,
    viewer: Viewer,
    transfer: &Transfer,
    light: &Expansion,
) -> Vec<[f32; 3]> {
    let degrees = TransferDegrees { output: transfer.output(), input: transfer.input() };
    shade_with_matrices(frames, table, viewer, degrees, transfer.values(), light)
}

/// [`shade_with_transfer`], for matrices in either precision.
pub(crate) fn shade_with_matrices<E: Entry>(
    frames: &Frames,
    table: &BrdfTable,
    viewer: Viewer,
    TransferDegrees { output, input }: TransferDegrees,
    entries: &[E],
    light: &Expansion,
) -> Vec<[f32; 3]> {
    let columns = input.rows();
    let length = output.rows() * columns;
    assert_eq!(frames.len() * length, entries.len(), "the frames of this transfer");
    let mut padded = by_row(light, input.min(light.degree()));
    padded.resize(columns, [0.0; 3]);
    let (light, rows) = (&Vectors::new(&padded), output.min(table.degree()).rows());
    let mut radiance = vec![[0.0; 3]; frames.len()];
    let chunks = radiance.par_chunks_mut(CHUNK).zip(frames.blocks().par_chunks(BLOCKS)).enumerate();
    chunks.for_each(|(chunk, (radiance, blocks))| {
        let entries = &entries[chunk * CHUNK * length..];
        Transferred { table, viewer, rows, length, entries, light, blocks, radiance }
            .run(SimdLevel::detect());
    });
    radiance
}

/// A light of which eight rows are taken at a time; the last eight go back over what those before them have,
/// where it is zero here.
struct Vectors {
    rows: usize,
    /// The values of each eight, RGB.
    groups: Vec<[[[f32; LANES]; 3]; EIGHTS]>,
}

impl Vectors {
    fn new(light: &[[f32; 3]]) -> Self {
        let rows = light.len();
        let eight = |eight: usize| {
            let of = |channel: usize| {
                std::array::from_fn(|k| {
                    let row = first_column(eight, rows) + k;
                    light.get(row).filter(|_| row >= eight * LANES).map_or(0.0, |rgb| rgb[channel])
                })
            };
            [0, 1, 2].map(of)
        };
        let groups = 0..rows.div_ceil(EIGHTS * LANES);
        let groups = groups.map(|group| std::array::from_fn(|k| eight(group * EIGHTS + k)));
        Self { rows, groups: groups.collect() }
    }
}

struct Transferred<'a, E> {
    table: &'a BrdfTable,
    viewer: Viewer,
    /// The rows that the matrices and the table both have.
    rows: usize,
    /// The entries of a matrix.
    length: usize,
    /// The matrices, from that of the first vertex on.
    entries: &'a [E],
    light: &'a Vectors,
    blocks: &'a [Block],
    radiance: &'a mut [[f32; 3]],
}

/// A kernel and how it converts halves.
struct With<H, K>(H, K);

impl<E: Entry> WithSimd for With<Shifts, Transferred<'_, E>> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.1.shade(simd, self.0);
    }
}

#[cfg(target_arch = "x86_64")]
impl<E: Entry> WithSimd for With<pulp::x86::V4, Transferred<'_, E>> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.1.shade(*self.0, self.0);
    }
}

impl<E: Entry> Transferred<'_, E> {
    fn run(self, level: SimdLevel) {
        match level {
            #[cfg(target_arch = "x86_64")]
            SimdLevel::V4(v4) => Simd::vectorize(v4, With(v4, self)),
            level => level.run(With(Shifts, self)),
        }
    }

    #[inline(always)]
    fn shade<S: Simd, H: Halves>(self, simd: S, halves: H) {
        // A known number of columns saves half of the instructions, and with fewer of them more reads of
        // memory are under way at a time.
        match self.light.rows {
            25 => self.shade_columns::<S, H, 25>(simd, halves),
            _ => self.shade_columns::<S, H, 0>(simd, halves),
        }
    }

    /// Computes c T first, which is one product of vector and matrix for a grey table, then its dots with the
    /// light.
    #[inline(always)]
    fn shade_columns<S: Simd, H: Halves, const COLUMNS: usize>(self, simd: S, halves: H) {
        let (channels, texel, columns) = (self.table.channels(), self.table.texel(), self.light.rows);
        let mut texels = vec![0.0; LANES * texel];
        let mut matrices = self.entries.chunks_exact(self.length);
        for (block, radiance) in self.blocks.iter().zip(self.radiance.chunks_mut(LANES)) {
            self.table.lookup_eight(simd, &block.blend, &block.views(self.viewer), &mut texels);
            let vertices = texels.chunks_exact(texel).zip(radiance);
            for ((c, rgb), matrix) in vertices.zip(&mut matrices) {
                let matrix = &matrix[..self.rows * columns];
                let mut sums = [simd.splat_f32s(0.0); 3];
                for (index, group) in self.light.groups.iter().enumerate() {
                    let index = if COLUMNS > 0 && COLUMNS <= EIGHTS * LANES { 0 } else { index };
                    let mut seen = [simd.splat_f32s(0.0); EIGHTS];
                    for (channel, sum) in sums.iter_mut().enumerate() {
                        if channel < channels {
                            let c = &c[channel..];
                            seen = product::<S, H, E, COLUMNS>(
                                simd, halves, c, channels, matrix, columns, index,
                            );
                        }
                        for (seen, light) in seen.iter().zip(group) {
                            *sum = simd.mul_add_f32s(*seen, load(simd, &light[channel]), *sum);
                        }
                    }
                }
                *rgb = sums.map(|sum| total(simd, sum));
            }
        }
    }
}
