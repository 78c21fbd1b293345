//! The transfer of shadows as the visibility itself: its (O + F + 1)^2 coefficients, in the world.
//!
//! > T = R sum over k of V_k G_k, G_ijk = integral of Y_i Y_j Y_k
//!
//! holds the matrix exactly, in 81 numbers rather than 625 (O = F = 4). When shading, few of the products are
//! not zero, and those of (i, j) and (j, i) are the same.

use std::sync::OnceLock;

use brdf::BrdfTable;
use pulp::Simd;
use rayon::prelude::*;
use sh::f64x4::{self, SimdLevel, WithLanes};
use sh::{Degree, Expansion, Stop};

use crate::directions::Directions;
use crate::frames::{Block, Frames, LANES, Viewer};
use crate::lanes::by_lane;
use crate::occluders::Occluders;
use crate::rotation::FrameRotation;
use crate::shading::write;
use crate::transfer::{MOST_BYTES, Shadows, Transfer, TransferDegrees, TransferError, turn_rows};
use crate::triple_products::TripleProducts;
use crate::vectors::{by_row, load};

/// The coefficients of V of each vertex, [V, (O + F + 1)^2], in the world; V = 1 below the horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    output: Degree,
    input: Degree,
    sum: Degree,
    values: Vec<f32>,
}

/// The highest O and F.
const HIGHEST: usize = 8;

/// The number of blocks of eight vertices that share the reading of a product.
const AT_ONCE: usize = 4;

/// The number of blocks of eight vertices that a thread takes at a time.
const BLOCKS: usize = 64;

impl Visibility {
    /// Coefficients from their values; `None` if O or F is above 8, or the length is not a multiple of
    /// (O + F + 1)^2.
    pub fn new(output: Degree, input: Degree, values: Vec<f32>) -> Option<Self> {
        let sum = Degree::new(output.get() + input.get()).ok()?;
        let fits = output.get().max(input.get()) <= HIGHEST && values.len().is_multiple_of(sum.rows());
        fits.then_some(Self { output, input, sum, values })
    }

    /// Casts the rays of [`crate::precompute`], and keeps what they found; also the number of vertices
    /// that see nothing.
    ///
    /// # Errors
    /// The errors of [`crate::precompute`]; also if O or F is above 8.
    pub fn precompute(
        frames: &Frames,
        occluders: &Occluders,
        directions: &Directions,
        TransferDegrees { output, input }: TransferDegrees,
        stop: Stop<'_>,
    ) -> Result<(Self, usize), TransferError> {
        let (found, expected) = (directions.degree().get(), output.get() + input.get());
        if found < expected || output.get().max(input.get()) > HIGHEST {
            return Err(TransferError::Directions { found, expected });
        }
        let columns = (expected + 1) * (expected + 1);
        let bytes = frames.len().saturating_mul(columns * size_of::<f32>());
        if bytes > MOST_BYTES {
            return Err(TransferError::TooLarge { vertices: frames.len(), bytes });
        }
        let shadows = Shadows::new(frames, occluders, directions, expected);
        let mut values = vec![0.0; frames.len() * columns];
        let blocks = values.par_chunks_mut(LANES * columns).enumerate().map(|(block, values)| {
            stop.check()?;
            let (hidden, blind) = shadows.block(block);
            for (values, hidden) in values.chunks_exact_mut(columns).zip(&hidden) {
                values.iter_mut().zip(hidden).for_each(|(value, hidden)| *value = -*hidden as f32);
                values[0] = ((4.0 * std::f64::consts::PI).sqrt() - hidden[0]) as f32;
            }
            Ok(blind)
        });
        let blind = blocks.collect::<Result<Vec<usize>, TransferError>>()?.into_iter().sum();
        let sum = Degree::new(expected).unwrap_or(directions.degree());
        Ok((Self { output, input, sum, values }, blind))
    }

    /// The degree O of the light that arrives.
    pub fn output(&self) -> Degree {
        self.output
    }

    /// The degree F of the light of the world.
    pub fn input(&self) -> Degree {
        self.input
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.values.len() / self.sum.rows()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// All coefficients: [V, (O + F + 1)^2].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The matrices, turned into the frames of the vertices; `None` if these are not as many.
    pub fn matrices(&self, frames: &Frames) -> Option<Transfer> {
        if frames.len() != self.len() {
            return None;
        }
        let (rows, columns) = (self.output.rows(), self.input.rows());
        let (products, rotation) =
            (TripleProducts::new(self.output, self.input), FrameRotation::new(self.output));
        let mut values = vec![0.0; self.len() * rows * columns];
        values.par_chunks_mut(LANES * rows * columns).enumerate().for_each(|(block, values)| {
            let own = self.values[block * LANES * self.sum.rows()..].chunks_exact(self.sum.rows());
            let world = |v: &[f32]| {
                let mut world = vec![0.0; rows * columns];
                for &(entry, k, integral) in &products.terms {
                    world[entry as usize] += integral * f64::from(v[k as usize]);
                }
                world
            };
            let worlds: Vec<Vec<f64>> = own.take(LANES).map(world).collect();
            turn_rows(&rotation, rows, &frames.blocks()[block].angles, &worlds, values);
        });
        Transfer::new(self.output, self.input, values)
    }

    /// The radiance of each vertex, as [`crate::shade_with_transfer`] has it.
    ///
    /// # Panics
    /// If there are not as many vertices as frames.
    pub fn shade(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        viewer: Viewer,
        light: &Expansion,
    ) -> Vec<[f32; 3]> {
        assert_eq!(frames.len(), self.len(), "the frames of this visibility");
        let output = self.output.min(table.degree());
        let input = self.input.min(light.degree());
        let products = Products::up_to(output, input);
        let rotation = FrameRotation::new(output);
        let light = by_row(light, input);
        let mut radiance = vec![[0.0; 3]; frames.len()];
        let chunks = radiance.par_chunks_mut(LANES * BLOCKS).zip(frames.blocks().par_chunks(BLOCKS));
        let columns = self.sum.rows();
        let chunks = chunks.zip(self.values.par_chunks(LANES * BLOCKS * columns));
        chunks.for_each(|((radiance, blocks), values)| {
            let shade = Shade {
                table,
                viewer,
                output,
                columns,
                values,
                products,
                rotation: &rotation,
                light: &light,
                blocks,
                radiance,
            };
            SimdLevel::detect().run_lanes(shade);
        });
        radiance
    }
}

/// The products, grouped by i and by j, with i <= j where both (i, j) and (j, i) are wanted.
struct Products {
    /// The number of columns that each row has products with.
    rows: Vec<u16>,
    columns: Vec<Column>,
    /// Pairs of the index k and the integral.
    terms: Vec<[(u16, f32); 2]>,
}

/// The products of a row i and a column j.
struct Column {
    j: u16,
    /// Whether the products of (j, i) are the same.
    mirrored: bool,
    /// The number of the column's pairs of terms, of which the last one may hold a zero.
    pairs: u16,
}

impl Products {
    /// The products up to these degrees, which are at most 8: computed once, since integrals take as long as
    /// a frame.
    fn up_to(output: Degree, input: Degree) -> &'static Self {
        const SIDE: usize = HIGHEST + 1;
        static ALL: [[OnceLock<Products>; SIDE]; SIDE] = [const { [const { OnceLock::new() }; SIDE] }; SIDE];
        ALL[output.get()][input.get()].get_or_init(|| Self::new(output, input))
    }

    fn new(output: Degree, input: Degree) -> Self {
        let products = TripleProducts::new(output, input);
        let (width, both) = (input.rows(), output.min(input).rows());
        let (mut rows, mut columns, mut terms) = (Vec::new(), Vec::new(), Vec::new());
        let is_mirrored = |i: usize, j: usize| i != j && i < both && j < both;
        for own in products.terms.chunk_by(|a, b| a.0 == b.0) {
            let (i, j) = (own[0].0 as usize / width, own[0].0 as usize % width);
            if is_mirrored(i, j) && i > j {
                continue;
            }
            rows.resize(i + 1, 0);
            rows[i] += 1;
            let own: Vec<_> = own.iter().map(|(_, k, integral)| (*k as u16, *integral as f32)).collect();
            terms.extend(own.chunks(2).map(|pair| [pair[0], pair.get(1).copied().unwrap_or_default()]));
            columns.push(Column {
                j: j as u16,
                mirrored: is_mirrored(i, j),
                pairs: own.len().div_ceil(2) as u16,
            });
        }
        Self { rows, columns, terms }
    }
}

struct Shade<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    output: Degree,
    /// The number of coefficients of a vertex, (O + F + 1)^2.
    columns: usize,
    /// The coefficients of these vertices.
    values: &'a [f32],
    products: &'a Products,
    rotation: &'a FrameRotation,
    light: &'a [[f32; 3]],
    blocks: &'a [Block],
    radiance: &'a mut [[f32; 3]],
}

impl WithLanes for Shade<'_> {
    type Output = ();

    /// Turns c into the world, where (c T)_j = sum over i and k of c_i G_ijk V_k.
    #[inline(always)]
    fn with_lanes<L: f64x4::Lanes>(self, simd: L) {
        // With a known number of channels their sums stay in registers.
        match self.table.channels() {
            1 => self.shade::<L, 1>(simd),
            _ => self.shade::<L, 3>(simd),
        }
    }
}

impl Shade<'_> {
    #[inline(always)]
    fn shade<L: f64x4::Lanes, const CHANNELS: usize>(self, simd: L) {
        let (rows, columns) = (self.output.rows(), self.columns);
        let mut texels = vec![0.0; LANES * self.table.texel()];
        let mut found = vec![[0.0; LANES]; CHANNELS * rows];
        let mut open = vec![[0.0; LANES]; columns];
        let mut filled = vec![0.0; LANES * columns];
        let mut room = self.rotation.room();
        let zero = [simd.splat_f32s(0.0); AT_ONCE];
        let (mut c, mut v) = (vec![[zero; CHANNELS]; rows], vec![zero; columns]);
        let mut seen = vec![[zero; CHANNELS]; self.light.len()];
        let chunks = self.blocks.chunks(AT_ONCE).zip(self.values.chunks(AT_ONCE * LANES * columns));
        for ((blocks, values), radiance) in chunks.zip(self.radiance.chunks_mut(AT_ONCE * LANES)) {
            for (index, (block, values)) in blocks.iter().zip(values.chunks(LANES * columns)).enumerate() {
                self.table.lookup_eight(simd, &block.blend, &block.views(self.viewer), &mut texels);
                by_lane(simd, &texels, CHANNELS, &mut found);
                self.rotation.to_world(simd, &block.angles, &mut found, &mut room);
                for (channel, found) in found.chunks_exact(rows).enumerate() {
                    c.iter_mut().zip(found).for_each(|(c, found)| c[channel][index] = load(simd, found));
                }
                filled[..values.len()].copy_from_slice(values);
                by_lane(simd, &filled, 1, &mut open);
                v.iter_mut().zip(&open).for_each(|(v, open)| v[index] = load(simd, open));
            }
            seen.fill([zero; CHANNELS]);
            self.products.apply(simd, &c, &v, &mut seen);
            let mut sums = [[simd.splat_f32s(0.0); 3]; AT_ONCE];
            for (seen, light) in seen.iter().zip(self.light) {
                for channel in 0..3 {
                    let (seen, light) = (&seen[channel.min(CHANNELS - 1)], simd.splat_f32s(light[channel]));
                    for (sums, seen) in sums.iter_mut().zip(seen) {
                        sums[channel] = simd.mul_add_f32s(*seen, light, sums[channel]);
                    }
                }
            }
            radiance.chunks_mut(LANES).zip(sums).for_each(|(radiance, sums)| write(simd, sums, radiance));
        }
    }
}

impl Products {
    /// Adds c_i G_ijk V_k to each j.
    #[inline(always)]
    fn apply<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        c: &[[[S::f32s; AT_ONCE]; CHANNELS]],
        v: &[[S::f32s; AT_ONCE]],
        seen: &mut [[[S::f32s; AT_ONCE]; CHANNELS]],
    ) {
        let zero = [simd.splat_f32s(0.0); AT_ONCE];
        let (mut columns, mut terms) = (self.columns.as_slice(), self.terms.as_slice());
        for (i, (count, c_i)) in self.rows.iter().zip(c).enumerate() {
            let (own, rest) = columns.split_at(usize::from(*count));
            columns = rest;
            // What (j, i) add.
            let mut mirrored = [zero; CHANNELS];
            for column in own {
                let (own, rest) = terms.split_at(usize::from(column.pairs));
                terms = rest;
                let mut sums = zero;
                for (k, integral) in own.as_flattened() {
                    let (v, integral) = (&v[usize::from(*k)], simd.splat_f32s(*integral));
                    for block in 0..AT_ONCE {
                        sums[block] = simd.mul_add_f32s(integral, v[block], sums[block]);
                    }
                }
                let j = usize::from(column.j);
                for channel in 0..CHANNELS {
                    let seen = &mut seen[j][channel];
                    for block in 0..AT_ONCE {
                        seen[block] = simd.mul_add_f32s(c_i[channel][block], sums[block], seen[block]);
                    }
                    if column.mirrored {
                        let mirrored = &mut mirrored[channel];
                        for block in 0..AT_ONCE {
                            mirrored[block] =
                                simd.mul_add_f32s(c[j][channel][block], sums[block], mirrored[block]);
                        }
                    }
                }
            }
            let Some(seen) = seen.get_mut(i) else { continue };
            for (seen, mirrored) in seen.as_flattened_mut().iter_mut().zip(mirrored.as_flattened()) {
                *seen = simd.add_f32s(*seen, *mirrored);
            }
        }
    }
}
