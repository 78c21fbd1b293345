//! The transfer of shadows as the visibility itself: its (O + F + 1)^2 coefficients, in the world.
//!
//! > T = R sum over k of V_k G_k, G_ijk = integral of Y_i Y_j Y_k
//!
//! holds the matrix exactly, in 81 numbers rather than 625 (O = F = 4). When shading, few of the products are
//! not zero, and those of (i, j) and (j, i) are the same.

use brdf::BrdfTable;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Degree, Expansion};

use crate::directions::Directions;
use crate::frames::{Block, Frames, LANES, Viewer};
use crate::occluders::Occluders;
use crate::rotation::FrameRotation;
use crate::shading::by_lane;
use crate::transfer::{MOST_BYTES, Shadows, Transfer, TransferError, turn_rows};
use crate::triple_products::TripleProducts;
use crate::vectors::by_row;

/// The coefficients of V of each vertex, [V, (O + F + 1)^2], in the world; V = 1 below the horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    output: Degree,
    input: Degree,
    sum: Degree,
    values: Vec<f32>,
}

/// Coefficients of eight vertices fit into arrays of this length: O and F are at most 8.
const ROOM: usize = 512;

/// The blocks of eight vertices that a thread takes at a time.
const BLOCKS: usize = 64;

impl Visibility {
    /// Coefficients from their values; `None` if O or F is above 8, or the length is not a multiple of
    /// (O + F + 1)^2.
    pub fn new(output: Degree, input: Degree, values: Vec<f32>) -> Option<Self> {
        let sum = Degree::new(output.get() + input.get()).ok()?;
        let fits = output.get() <= 8 && input.get() <= 8 && values.len().is_multiple_of(sum.rows());
        fits.then_some(Self { output, input, sum, values })
    }

    /// Casts the rays of [`crate::precompute_unless`], and keeps what they found; also the number of vertices
    /// that see nothing.
    ///
    /// # Errors
    /// As that; also if O or F is above 8.
    pub fn precompute(
        frames: &Frames,
        occluders: &Occluders,
        directions: &Directions,
        (output, input): (Degree, Degree),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(Self, usize), TransferError> {
        let (found, expected) = (directions.degree().get(), output.get() + input.get());
        if found < expected || output.get() > 8 || input.get() > 8 {
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
            if stop() {
                return Err(TransferError::Stopped);
            }
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

    /// O, the degree of the light that arrives.
    pub fn output(&self) -> Degree {
        self.output
    }

    /// F, the degree of the light of the world.
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
            turn_rows((&rotation, rows), &frames.blocks()[block].angles, &worlds, values);
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
        let products = Products::new(output, input);
        let rotation = FrameRotation::new(output);
        let light = by_row(light, input);
        let mut radiance = vec![[0.0; 3]; frames.len()];
        let chunks = radiance.par_chunks_mut(LANES * BLOCKS).zip(frames.blocks().par_chunks(BLOCKS));
        let columns = self.sum.rows();
        let chunks = chunks.zip(self.values.par_chunks(LANES * BLOCKS * columns));
        chunks.for_each(|((radiance, blocks), values)| {
            SimdLevel::detect().run(Shade {
                table,
                viewer,
                output,
                columns,
                values,
                products: &products,
                rotation: &rotation,
                light: &light,
                blocks,
                radiance,
            });
        });
        radiance
    }
}

/// The products of a row i and a column j.
struct Pair {
    i: u16,
    j: u16,
    /// Whether those of (j, i) are the same.
    mirrored: bool,
    /// The end of its terms.
    end: u32,
}

/// The products, grouped by (i, j) with i <= j where both (i, j) and (j, i) are wanted.
struct Products {
    pairs: Vec<Pair>,
    /// k and the integral.
    terms: Vec<(u16, f32)>,
}

impl Products {
    fn new(output: Degree, input: Degree) -> Self {
        let products = TripleProducts::new(output, input);
        let (columns, both) = (input.rows(), output.min(input).rows());
        let (mut pairs, mut terms) = (Vec::<Pair>::new(), Vec::new());
        for &(entry, k, integral) in &products.terms {
            let (i, j) = (entry as usize / columns, entry as usize % columns);
            let mirrored = i != j && i < both && j < both;
            if mirrored && i > j {
                continue;
            }
            terms.push((k as u16, integral as f32));
            let end = terms.len() as u32;
            match pairs.last_mut() {
                Some(last) if (last.i, last.j) == (i as u16, j as u16) => last.end = end,
                _ => pairs.push(Pair { i: i as u16, j: j as u16, mirrored, end }),
            }
        }
        Self { pairs, terms }
    }
}

struct Shade<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    output: Degree,
    /// (O + F + 1)^2.
    columns: usize,
    /// The coefficients of these vertices.
    values: &'a [f32],
    products: &'a Products,
    rotation: &'a FrameRotation,
    light: &'a [[f32; 3]],
    blocks: &'a [Block],
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for Shade<'_> {
    type Output = ();

    /// c is turned into the world, where (c T)_j = sum over i and k of c_i G_ijk V_k.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (channels, rows) = (self.table.channels(), self.output.rows());
        let mut texels = vec![0.0; LANES * self.table.texel()];
        let mut found = vec![[0.0f32; LANES]; channels * rows];
        let mut work = vec![[0.0f32; LANES]; rows];
        let (mut c, mut v, mut seen) = ([[0.0; LANES]; ROOM], [[0.0; LANES]; ROOM], [[0.0f32; LANES]; ROOM]);
        let values = self.values.chunks(LANES * self.columns);
        for ((block, radiance), values) in self.blocks.iter().zip(self.radiance.chunks_mut(LANES)).zip(values)
        {
            self.table.lookup_eight(&block.blend, &block.views(self.viewer), &mut texels);
            by_lane(&texels, channels, &mut found);
            for (lane, values) in values.chunks_exact(self.columns).enumerate() {
                for (v, value) in v.iter_mut().zip(values) {
                    v[lane] = *value;
                }
            }
            for channel in 0..3 {
                if channel < channels {
                    let found = &mut found[channel * rows..][..rows];
                    self.rotation.to_world(&block.angles, found, &mut work);
                    c[..rows].copy_from_slice(found);
                    seen[..self.light.len()].fill([0.0; LANES]);
                    self.products.apply(&c, &v, &mut seen);
                }
                let mut sums = [0.0f32; LANES];
                for (seen, light) in seen.iter().zip(self.light) {
                    for lane in 0..LANES {
                        sums[lane] += seen[lane] * light[channel];
                    }
                }
                for (rgb, sum) in radiance.iter_mut().zip(sums) {
                    rgb[channel] = sum;
                }
            }
        }
    }
}

impl Products {
    /// Adds c_i G_ijk V_k to each j.
    #[inline(always)]
    fn apply(&self, c: &[[f32; LANES]; ROOM], v: &[[f32; LANES]; ROOM], seen: &mut [[f32; LANES]; ROOM]) {
        let mut terms = self.terms.as_slice();
        let mut begin = 0;
        for &Pair { i, j, mirrored, end } in &self.pairs {
            let (own, rest) = terms.split_at((end - begin) as usize);
            (terms, begin) = (rest, end);
            let mut sums = [0.0f32; LANES];
            for &(k, integral) in own {
                // The remainder spares a check of the bound.
                let v = &v[k as usize % ROOM];
                for lane in 0..LANES {
                    sums[lane] += integral * v[lane];
                }
            }
            let (i, j) = (i as usize % ROOM, j as usize % ROOM);
            for lane in 0..LANES {
                seen[j][lane] += c[i][lane] * sums[lane];
            }
            if mirrored {
                for lane in 0..LANES {
                    seen[i][lane] += c[j][lane] * sums[lane];
                }
            }
        }
    }
}
