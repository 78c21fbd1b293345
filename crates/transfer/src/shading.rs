//! Shading at vertices: equation 1 and steps 1 to 4 of section 4.
//!
//! Both may move: c_i(v), looked up in the vertex' frame, is turned into the world, where the light is the
//! same for all vertices; of a grey table that is one vector rather than the three of a coloured light. If
//! the light is fixed, it is turned into each frame once ([`FixedLight`]); if the view is, c_i is looked up
//! and turned once ([`FixedView`]). All three agree to rounding.
//!
//! Results are signed: a series rings, and what clamps is the display's choice.

use brdf::BrdfTable;
use glam::Vec3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Degree, Expansion};
use sphere::{DVec3, Direction};

use crate::frames::{Frames, LANES, single};
use crate::rotation::{FrameRotation, Lanes};
use crate::transfer::Transfer;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 0;

/// Where a mesh is seen from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewer {
    /// From far away, in this direction.
    Distant(Direction),
    /// From a place.
    At([f64; 3]),
}

/// Coefficients of eight vertices.
type Rows = Vec<[f32; LANES]>;

impl Viewer {
    /// The direction from a position toward the viewer; the normal if it stands there.
    fn direction_from(self, position: [f32; 3], normal: [f32; 3]) -> Vec3 {
        match self {
            Self::Distant(direction) => single(direction),
            Self::At(place) => {
                let away = DVec3::from_array(place) - DVec3::from_array(position.map(f64::from));
                Direction::new(away).map_or(Vec3::from(normal), single)
            }
        }
    }
}

/// The blocks of eight vertices that a thread takes at a time.
const BLOCKS: usize = 64;

/// The radiance of each vertex, RGB; table and light are cut to the lower of their degrees.
///
/// # Example: a matte sphere under a white sky has its albedo everywhere
/// ```
/// use sh::{Degree, Expansion};
/// use transfer::{Frames, Viewer, shade};
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.5; 3])?);
/// let (table, _) = brdf::tabulate(&chalk, Degree::new(4)?, 16)?;
/// let mut sky = Expansion::zero(Degree::new(4)?);
/// sky.coefficients_mut()[0] = [(4.0 * std::f64::consts::PI).sqrt(); 3];
/// let sphere = Frames::of(&mesh::shape("sphere").unwrap())?;
/// let seen = shade(&sphere, &table, Viewer::Distant(sphere::Direction::X), &sky);
/// assert!(seen.iter().flatten().all(|value| (value - 0.5).abs() < 1e-5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn shade(frames: &Frames, table: &BrdfTable, viewer: Viewer, light: &Expansion) -> Vec<[f32; 3]> {
    let degree = table.degree().min(light.degree());
    let kernel = Turned { frames, table, viewer, rotation: &FrameRotation::new(degree), degree };
    let light = by_channel(light, degree);
    let mut radiance = vec![[0.0; 3]; frames.len()];
    radiance.par_chunks_mut(LANES * BLOCKS).enumerate().for_each(|(chunk, radiance)| {
        SimdLevel::detect().run(BothMove { kernel, light: &light, first: chunk * BLOCKS, radiance });
    });
    radiance
}

/// The looked-up coefficients of eight vertices, turned into the world.
#[derive(Clone, Copy)]
struct Turned<'a> {
    frames: &'a Frames,
    table: &'a BrdfTable,
    viewer: Viewer,
    rotation: &'a FrameRotation,
    degree: Degree,
}

impl Turned<'_> {
    /// Those of a block, [channel][row][lane]; `c` has room for a texel, `work` for the rows.
    #[inline(always)]
    fn block(&self, block: usize, c: &mut [f32], turned: &mut [Vec<[f32; LANES]>], work: &mut Lanes) {
        let channels = self.table.channels();
        for lane in 0..LANES {
            let vertex = (block * LANES + lane).min(self.frames.len() - 1);
            look_up(self.frames, self.table, self.viewer, vertex, c);
            for (channel, turned) in turned.iter_mut().enumerate() {
                for (row, lanes) in turned.iter_mut().enumerate() {
                    lanes[lane] = c[row * channels + channel];
                }
            }
        }
        for turned in turned {
            self.rotation.to_world(&self.frames.angles()[block], turned, work);
        }
    }

    /// Room for [`Turned::block`].
    fn room(&self) -> (Vec<f32>, Vec<Rows>, Rows) {
        let rows = vec![[0.0; LANES]; self.degree.rows()];
        (vec![0.0; self.table.texel()], vec![rows.clone(); self.table.channels()], rows)
    }
}

/// c_i toward the viewer, in the frame of a vertex.
#[inline(always)]
fn look_up(frames: &Frames, table: &BrdfTable, viewer: Viewer, vertex: usize, c: &mut [f32]) {
    let view = viewer.direction_from(frames.positions()[vertex], frames.normal(vertex));
    let local = frames.local(vertex, view).as_dvec3();
    table.lookup_into(0, Direction::normalised(local), c);
}

struct BothMove<'a> {
    kernel: Turned<'a>,
    light: &'a [Vec<f32>; 3],
    /// The first block.
    first: usize,
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for BothMove<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (mut c, mut turned, mut work) = self.kernel.room();
        for (offset, radiance) in self.radiance.chunks_mut(LANES).enumerate() {
            self.kernel.block(self.first + offset, &mut c, &mut turned, &mut work);
            for channel in 0..3 {
                let mut sum = [0.0f32; LANES];
                let turned = &turned[channel.min(turned.len() - 1)];
                for (lanes, light) in turned.iter().zip(&self.light[channel]) {
                    (0..LANES).for_each(|lane| sum[lane] += lanes[lane] * light);
                }
                radiance.iter_mut().zip(sum).for_each(|(rgb, sum)| rgb[channel] = sum);
            }
        }
    }
}

/// Rows of each channel up to a degree, in f32.
fn by_channel(light: &Expansion, degree: Degree) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|c| light.coefficients()[..degree.rows()].iter().map(|rgb| rgb[c] as f32).collect())
}

/// The sum of products, in eight sums that fill a vector register.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (blocks_a, rest_a) = a.as_chunks::<LANES>();
    let (blocks_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in blocks_a.iter().zip(blocks_b) {
        (0..LANES).for_each(|lane| sums[lane] += a[lane] * b[lane]);
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

/// A light turned into the frame of each vertex: 300 bytes a vertex for degree 4. Only the view may move.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedLight {
    degree: Degree,
    /// [V, 3, (F+1)^2].
    values: Vec<f32>,
}

impl FixedLight {
    /// Turns the light.
    pub fn new(frames: &Frames, light: &Expansion) -> Self {
        let degree = light.degree();
        let (rotation, light) = (FrameRotation::new(degree), by_channel(light, degree));
        let rows = degree.rows();
        let mut values = vec![0.0; frames.len() * 3 * rows];
        values.par_chunks_mut(LANES * 3 * rows).enumerate().for_each(|(block, values)| {
            let mut work = vec![[0.0; LANES]; rows];
            for (channel, light) in light.iter().enumerate() {
                let mut lanes: Vec<[f32; LANES]> = light.iter().map(|value| [*value; LANES]).collect();
                rotation.to_local(&frames.angles()[block], &mut lanes, &mut work);
                for (lane, vertex) in values.chunks_exact_mut(3 * rows).enumerate() {
                    for (value, lanes) in vertex[channel * rows..].iter_mut().zip(&lanes) {
                        *value = lanes[lane];
                    }
                }
            }
        });
        Self { degree, values }
    }

    /// What arrives of a light past the mesh, (T L)_i: the light turned and shadowed.
    pub fn with_transfer(transfer: &Transfer, light: &Expansion) -> Self {
        let columns = transfer.input().min(light.degree());
        let (degree, light) = (transfer.output(), by_channel(light, columns));
        let (rows, stored) = (degree.rows(), transfer.input().rows());
        let mut values = vec![0.0; transfer.len() * 3 * rows];
        values.par_chunks_exact_mut(3 * rows).enumerate().for_each(|(vertex, values)| {
            for (row, entries) in transfer.matrix(vertex).chunks_exact(stored).enumerate() {
                for (channel, light) in light.iter().enumerate() {
                    values[channel * rows + row] = dot(&entries[..light.len()], light);
                }
            }
        });
        Self { degree, values }
    }

    /// The degree of the light in the frames.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The light in the frames: [V, 3, (F+1)^2].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The radiance of each vertex, RGB, as [`shade`] has it.
    ///
    /// # Panics
    /// If the frames are not as many as those that the light was turned into.
    pub fn shade(&self, frames: &Frames, table: &BrdfTable, viewer: Viewer) -> Vec<[f32; 3]> {
        let rows = self.degree.rows();
        assert_eq!(frames.len() * 3 * rows, self.values.len(), "the frames of this light");
        let mut radiance = vec![[0.0; 3]; frames.len()];
        let vertices =
            radiance.par_chunks_mut(LANES * BLOCKS).zip(self.values.par_chunks(LANES * BLOCKS * 3 * rows));
        vertices.enumerate().for_each(|(chunk, (radiance, light))| {
            let first = chunk * LANES * BLOCKS;
            SimdLevel::detect().run(LightStays { frames, table, viewer, rows, first, light, radiance });
        });
        radiance
    }
}

struct LightStays<'a> {
    frames: &'a Frames,
    table: &'a BrdfTable,
    viewer: Viewer,
    rows: usize,
    first: usize,
    light: &'a [f32],
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for LightStays<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let channels = self.table.channels();
        let kept = self.rows.min(self.table.degree().rows());
        let mut c = vec![0.0; self.table.texel()];
        let mut split = vec![0.0; kept];
        let lights = self.light.chunks_exact(3 * self.rows);
        for (offset, (rgb, light)) in self.radiance.iter_mut().zip(lights).enumerate() {
            look_up(self.frames, self.table, self.viewer, self.first + offset, &mut c);
            for channel in 0..3 {
                let light = &light[channel * self.rows..][..kept];
                rgb[channel] = if channels == 1 {
                    dot(&c[..kept], light)
                } else {
                    split.iter_mut().zip(c[channel..].iter().step_by(3)).for_each(|(to, from)| *to = *from);
                    dot(&split, light)
                };
            }
        }
    }
}

/// The coefficients c_i toward a viewer, turned into the world: 100 bytes a vertex for degree 4 and a grey
/// table. Only the light may move.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedView {
    degree: Degree,
    channels: usize,
    /// [V, channels, (F+1)^2].
    values: Vec<f32>,
}

impl FixedView {
    /// Looks the table up for every vertex.
    pub fn new(frames: &Frames, table: &BrdfTable, viewer: Viewer) -> Self {
        let (degree, channels) = (table.degree(), table.channels());
        let kernel = Turned { frames, table, viewer, rotation: &FrameRotation::new(degree), degree };
        let rows = degree.rows();
        let mut values = vec![0.0; frames.len() * channels * rows];
        values.par_chunks_mut(LANES * channels * rows).enumerate().for_each(|(block, values)| {
            let (mut c, mut turned, mut work) = kernel.room();
            kernel.block(block, &mut c, &mut turned, &mut work);
            for (lane, vertex) in values.chunks_exact_mut(channels * rows).enumerate() {
                for (values, turned) in vertex.chunks_exact_mut(rows).zip(&turned) {
                    values.iter_mut().zip(turned).for_each(|(value, lanes)| *value = lanes[lane]);
                }
            }
        });
        Self { degree, channels, values }
    }

    /// Looks the table up for every vertex and takes what the mesh hides away from it: sum over i of c_i
    /// T_ij.
    ///
    /// # Panics
    /// If the transfer has not as many vertices.
    pub fn with_transfer(frames: &Frames, table: &BrdfTable, viewer: Viewer, transfer: &Transfer) -> Self {
        assert_eq!(frames.len(), transfer.len(), "the frames of this transfer");
        let (degree, channels) = (transfer.input(), table.channels());
        let (rows, kept) = (degree.rows(), transfer.output().min(table.degree()).rows());
        let mut values = vec![0.0; frames.len() * channels * rows];
        values.par_chunks_mut(LANES * channels * rows).enumerate().for_each(|(block, values)| {
            let mut c = vec![0.0; table.texel()];
            for (lane, values) in values.chunks_exact_mut(channels * rows).enumerate() {
                let vertex = block * LANES + lane;
                look_up(frames, table, viewer, vertex, &mut c);
                for (row, entries) in transfer.matrix(vertex).chunks_exact(rows).take(kept).enumerate() {
                    for (channel, values) in values.chunks_exact_mut(rows).enumerate() {
                        let c = c[row * channels + channel];
                        values.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += c * entry);
                    }
                }
            }
        });
        Self { degree, channels, values }
    }

    /// The radiance of each vertex, RGB, as [`shade`] has it.
    pub fn shade(&self, light: &Expansion) -> Vec<[f32; 3]> {
        let (rows, channels) = (self.degree.rows(), self.channels);
        let degree = self.degree.min(light.degree());
        let light = by_channel(light, degree);
        let count = self.values.len() / (channels * rows);
        let mut radiance = vec![[0.0; 3]; count];
        let chunk = LANES * BLOCKS;
        radiance.par_chunks_mut(chunk).zip(self.values.par_chunks(chunk * channels * rows)).for_each(
            |(radiance, values)| {
                SimdLevel::detect().run(ViewStays { rows, channels, light: &light, values, radiance });
            },
        );
        radiance
    }
}

struct ViewStays<'a> {
    rows: usize,
    channels: usize,
    light: &'a [Vec<f32>; 3],
    values: &'a [f32],
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for ViewStays<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let vertices = self.values.chunks_exact(self.channels * self.rows);
        for (rgb, vertex) in self.radiance.iter_mut().zip(vertices) {
            for channel in 0..3 {
                let first = channel.min(self.channels - 1) * self.rows;
                let light = &self.light[channel];
                rgb[channel] = dot(&vertex[first..first + light.len()], light);
            }
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
    assert_eq!(frames.len(), transfer.len(), "the frames of this transfer");
    let columns = transfer.input().min(light.degree());
    let light = by_channel(light, columns);
    let mut radiance = vec![[0.0; 3]; frames.len()];
    radiance.par_chunks_mut(LANES * BLOCKS).enumerate().for_each(|(chunk, radiance)| {
        let first = chunk * LANES * BLOCKS;
        SimdLevel::detect().run(Transferred {
            frames,
            table,
            viewer,
            transfer,
            light: &light,
            first,
            radiance,
        });
    });
    radiance
}

struct Transferred<'a> {
    frames: &'a Frames,
    table: &'a BrdfTable,
    viewer: Viewer,
    transfer: &'a Transfer,
    light: &'a [Vec<f32>; 3],
    first: usize,
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for Transferred<'_> {
    type Output = ();

    /// c T first, which is one product of matrix and vector for a grey table, then its dots with the light.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let channels = self.table.channels();
        let rows = self.transfer.output().min(self.table.degree()).rows();
        let (columns, kept) = (self.transfer.input().rows(), self.light[0].len());
        let mut c = vec![0.0; self.table.texel()];
        let mut seen = vec![0.0; kept];
        for (offset, rgb) in self.radiance.iter_mut().enumerate() {
            let vertex = self.first + offset;
            look_up(self.frames, self.table, self.viewer, vertex, &mut c);
            let matrix = self.transfer.matrix(vertex);
            for channel in 0..3 {
                if channel < channels {
                    seen.fill(0.0);
                    for (row, entries) in matrix.chunks_exact(columns).take(rows).enumerate() {
                        let c = c[row * channels + channel];
                        seen.iter_mut().zip(&entries[..kept]).for_each(|(sum, entry)| *sum += c * entry);
                    }
                }
                rgb[channel] = dot(&seen, &self.light[channel]);
            }
        }
    }
}
