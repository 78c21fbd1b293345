//! Interreflection: light that arrives at a vertex by way of the mesh itself [KSS02, sec. 5].
//!
//! > T_ij += integral over blocked s of Y_i(R_p s) B_j(x_s, -s) ds
//!
//! where x_s is what the vertex sees along s, and B_j its radiance toward the vertex under Y_j: the sum of
//! c_i T_ij at the corners of the triangle that was hit, each with the c_i of its own material and in its
//! own frame, blended over the triangle. So the matrix of a bounce is made from those of the bounce before,
//! and that of the first from shadows alone. Back faces are black. The materials are part of the result.
//!
//! Where all materials are matte, one vector a vertex is enough for all bounces but the last, and the cosine
//! needs no degree.

use brdf::BrdfTable;
use glam::Vec3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Degree, Stop, Stopped};
use sphere::Direction;

use crate::directions::Directions;
use crate::frames::{Frames, LANES};
use crate::matte::{MatteTransfer, albedos};
use crate::occluders::Occluders;
use crate::packet::{Hit, Packet, Towards, above};
use crate::rotation::FrameRotation;
use crate::transfer::{MOST_BYTES, Transfer, TransferDegrees, TransferError, turn_rows};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The bytes that [`interreflect`] has in memory: those of the shadows and of two bounces.
pub fn reflection_bytes(vertices: usize, degrees: TransferDegrees, channels: usize) -> usize {
    let one = vertices.saturating_mul(degrees.output.rows() * degrees.input.rows() * size_of::<f32>());
    one.saturating_mul(1 + 2 * channels)
}

/// A mesh that reflects light on itself, and the rays that its vertices cast.
#[derive(Clone, Copy)]
pub struct ReflectingMesh<'a> {
    /// The vertices, each with its place between the materials of the table.
    pub frames: &'a Frames,
    /// The triangles of the same mesh.
    pub occluders: &'a Occluders,
    /// The directions of the rays.
    pub directions: &'a Directions,
    /// The materials.
    pub table: &'a BrdfTable,
}

/// The transfer with `bounces` reflections of the mesh's light by itself: one for a grey table, else one for
/// each of red, green and blue. `shadows` is what [`crate::precompute`] made of the same mesh and directions.
///
/// Next to brute force, matte corners, screens and bowls are right to 1 percent; glossy corners to what the
/// degree O cuts, 7 percent at 4 and 1 percent at 6 (`tests/interreflection.rs`). Uses all threads; the
/// result does not depend on their number. `stop` is asked for every eight vertices, on every thread.
///
/// # Errors
/// If the matrices of two bounces are larger than [`MOST_BYTES`], or it was stopped.
///
/// # Panics
/// If the occluders are not of the mesh of the frames.
pub fn interreflect(
    mesh: ReflectingMesh<'_>,
    shadows: &Transfer,
    bounces: usize,
    stop: Stop<'_>,
) -> Result<Vec<Transfer>, TransferError> {
    let ReflectingMesh { frames, occluders, directions, table } = mesh;
    let (output, input) = (shadows.output(), shadows.input());
    let (columns, channels) = (input.rows(), table.channels());
    let bytes = reflection_bytes(frames.len(), TransferDegrees { output, input }, channels);
    if bytes > MOST_BYTES {
        return Err(TransferError::TooLarge { vertices: frames.len(), bytes });
    }
    let scene = Scene { mesh, input, channels, stop };
    if bounces == 0 {
        return Ok(vec![shadows.clone()]);
    }
    if let Some(albedos) = albedos(frames, table) {
        let (white, _) = MatteTransfer::precompute(frames, occluders, directions, input, stop)?;
        let before = scene.matte_bounces(&white, &albedos, bounces - 1)?;
        let exit = Exit::Matte(scene.leaving(&before, &albedos));
        return Ok(scene.matrices(&exit, shadows)?);
    }
    let mut before = vec![shadows.clone()];
    for _ in 0..bounces {
        let exit = Exit::Glossy { frames, table, before: &before, columns };
        before = scene.matrices(&exit, shadows)?;
    }
    Ok(before)
}

/// The matte transfer of a mesh of matte materials with `bounces` reflections: one for a grey table, else one
/// for each channel; `None` if a material is not matte. Also the number of vertices that see nothing.
///
/// # Errors
/// The errors of [`interreflect`].
///
/// # Panics
/// The errors of [`interreflect`].
pub fn interreflect_matte(
    mesh: ReflectingMesh<'_>,
    input: Degree,
    bounces: usize,
    stop: Stop<'_>,
) -> Result<Option<(Vec<MatteTransfer>, usize)>, TransferError> {
    let ReflectingMesh { frames, occluders, directions, table } = mesh;
    let channels = table.channels();
    let Some(albedos) = albedos(frames, table) else { return Ok(None) };
    let (white, blind) = MatteTransfer::precompute(frames, occluders, directions, input, stop)?;
    let scene = Scene { mesh, input, channels, stop };
    let found = scene.matte_bounces(&white, &albedos, bounces)?;
    let channel = |channel: usize| {
        let rows = found.chunks_exact(input.rows()).skip(channel).step_by(channels);
        MatteTransfer::new(input, rows.flatten().copied().collect())
    };
    Ok(Some(((0..channels).filter_map(channel).collect(), blind)))
}

/// The mesh and the degree that a bake is of.
struct Scene<'a> {
    mesh: ReflectingMesh<'a>,
    input: Degree,
    channels: usize,
    stop: Stop<'a>,
}

impl Scene<'_> {
    /// The matrices of shadows and of light that left the vertices, for each channel.
    fn matrices(&self, exit: &Exit<'_>, shadows: &Transfer) -> Result<Vec<Transfer>, Stopped> {
        let output = shadows.output();
        let (rows, length) = (output.rows(), output.rows() * self.input.rows());
        let rotation = FrameRotation::new(output);
        let mut after = vec![shadows.values().to_vec(); self.channels];
        let mut blocks: Vec<Vec<&mut [f32]>> = Vec::new();
        for channel in &mut after {
            for (block, values) in channel.chunks_mut(LANES * length).enumerate() {
                if blocks.len() == block {
                    blocks.push(Vec::new());
                }
                blocks[block].push(values);
            }
        }
        blocks.into_par_iter().enumerate().try_for_each(|(block, values)| {
            let count = values[0].len() / length;
            let gathered = self.gather(exit, block * LANES, count, Receiver::Harmonics(rows))?;
            let mut turned = vec![0.0; count * length];
            for (worlds, values) in gathered.into_iter().zip(values) {
                let worlds: Vec<Vec<f64>> =
                    worlds.into_iter().map(|world| world.into_iter().map(f64::from).collect()).collect();
                turn_rows(&rotation, rows, &self.mesh.frames.blocks()[block].angles, &worlds, &mut turned);
                values.iter_mut().zip(&turned).for_each(|(value, turned)| *value += turned);
            }
            Ok(())
        })?;
        Ok(after.into_iter().filter_map(|values| Transfer::new(output, self.input, values)).collect())
    }

    /// The matte vectors after some bounces, [V, channels, (F+1)^2].
    fn matte_bounces(
        &self,
        white: &MatteTransfer,
        albedos: &[[f32; 3]],
        bounces: usize,
    ) -> Result<Vec<f32>, Stopped> {
        let (columns, length) = (self.input.rows(), self.channels * self.input.rows());
        let direct: Vec<f32> =
            white.values().chunks_exact(columns).flat_map(|t| t.repeat(self.channels)).collect();
        let mut vectors = direct.clone();
        for _ in 0..bounces {
            let exit = Exit::Matte(self.leaving(&vectors, albedos));
            vectors.copy_from_slice(&direct);
            vectors.par_chunks_mut(LANES * length).enumerate().try_for_each(|(block, values)| {
                let count = values.len() / length;
                let gathered = self.gather(&exit, block * LANES, count, Receiver::Cosine)?;
                for (channel, vertices) in gathered.iter().enumerate() {
                    for (values, own) in values.chunks_exact_mut(length).zip(vertices) {
                        let values = &mut values[channel * columns..][..columns];
                        values.iter_mut().zip(own).for_each(|(value, own)| *value += own);
                    }
                }
                Ok(())
            })?;
        }
        Ok(vectors)
    }

    /// The light that leaves the vertices: the albedo times the vectors.
    fn leaving(&self, vectors: &[f32], albedos: &[[f32; 3]]) -> Vec<f32> {
        let rows = vectors.chunks_exact(self.input.rows()).enumerate();
        let rows = rows.map(|(row, t)| (t, albedos[row / self.channels][row % self.channels]));
        rows.flat_map(|(t, albedo)| t.iter().map(move |t| albedo * t)).collect()
    }

    /// The light that up to eight vertices receive, [channel][vertex][rows * (F+1)^2].
    fn gather(
        &self,
        exit: &Exit<'_>,
        first: usize,
        count: usize,
        receiver: Receiver,
    ) -> Result<Vec<Vec<Vec<f32>>>, Stopped> {
        self.stop.check()?;
        let rows = if let Receiver::Harmonics(rows) = receiver { rows } else { 1 };
        let mut sums = vec![vec![vec![0.0; rows * self.input.rows()]; count]; self.channels];
        SimdLevel::detect().run(Gather { scene: self, exit, first, receiver, sums: &mut sums });
        Ok(sums)
    }
}

/// The light that leaves the vertices.
enum Exit<'a> {
    /// The light is the same toward every view: [V, channels, (F+1)^2].
    Matte(Vec<f32>),
    /// The light c T, by the transfer before.
    Glossy { frames: &'a Frames, table: &'a BrdfTable, before: &'a [Transfer], columns: usize },
}

impl Exit<'_> {
    /// Adds the radiance of a hit toward where the ray came from, under each Y_j: [channels, (F+1)^2].
    #[inline(always)]
    fn add(&self, hit: &Hit, back: Vec3, radiance: &mut [f32], c: &mut [f32]) {
        for (corner, weight) in hit.corners.iter().zip(hit.weights) {
            let corner = *corner as usize;
            match self {
                Self::Matte(leaving) => {
                    let values = &leaving[corner * radiance.len()..][..radiance.len()];
                    radiance.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
                }
                Self::Glossy { frames, table, before, columns } if weight > 0.0 => {
                    let local = Vec3::from(frames.axes(corner).map(|axis| Vec3::from(axis).dot(back)));
                    table.blend_into(frames.blend(corner), Direction::normalised(local.as_dvec3()), c);
                    let channels = table.channels();
                    for (channel, sums) in radiance.chunks_exact_mut(*columns).enumerate() {
                        let matrix = before[channel.min(before.len() - 1)].matrix(corner);
                        let c = c[channel..].iter().step_by(channels);
                        for (c, row) in c.zip(matrix.chunks_exact(*columns)) {
                            let c = weight * c;
                            sums.iter_mut().zip(row).for_each(|(sum, entry)| *sum += c * entry);
                        }
                    }
                }
                Self::Glossy { .. } => {}
            }
        }
    }
}

/// The form in which a vertex takes the light that arrives.
#[derive(Clone, Copy)]
enum Receiver {
    /// The light's coefficients in the world, so many rows.
    Harmonics(usize),
    /// The light that a white matte surface sends out.
    Cosine,
}

/// Adds the light that up to eight vertices receive from the mesh.
struct Gather<'a> {
    scene: &'a Scene<'a>,
    exit: &'a Exit<'a>,
    first: usize,
    receiver: Receiver,
    sums: &'a mut [Vec<Vec<f32>>],
}

impl WithSimd for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Scene { mesh, input, .. } = self.scene;
        let ReflectingMesh { frames, occluders, directions, table } = *mesh;
        let (columns, count) = (input.rows(), self.sums[0].len());
        let mut radiance = vec![0.0; self.sums.len() * columns];
        let mut room = vec![0.0; table.texel()];
        let mut packet = Packet::new(occluders, frames, self.first, count);
        let mut open = Vec::new();
        for (index, direction) in directions.directions().iter().enumerate() {
            let towards = Towards::new(*direction);
            let above = above(frames, self.first, count, &towards);
            if !packet.aim(f32::INFINITY, |lane| above[lane]) {
                continue;
            }
            packet.trace::<S, false>(simd, occluders, &towards, &mut open);
            for lane in 0..count {
                let hit = packet.hit(occluders, &towards, lane);
                let Some(hit) = hit.filter(|hit| hit.front) else { continue };
                radiance.fill(0.0);
                self.exit.add(&hit, -towards.direction, &mut radiance, &mut room);
                let normal = Vec3::from(frames.normal(self.first + lane));
                let cosine = normal.dot(towards.direction) * std::f32::consts::FRAC_1_PI;
                let cosine = [f64::from(cosine) * directions.weights()[index]];
                let weights = match self.receiver {
                    Receiver::Harmonics(rows) => &directions.weighted(index)[..rows],
                    Receiver::Cosine => &cosine,
                };
                for (sums, radiance) in self.sums.iter_mut().zip(radiance.chunks_exact(columns)) {
                    for (row, weight) in sums[lane].chunks_exact_mut(columns).zip(weights) {
                        let weight = *weight as f32;
                        row.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += weight * value);
                    }
                }
            }
        }
    }
}
