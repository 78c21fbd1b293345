//! The transfer of a white matte surface: what it sends out under each coefficient of the light.
//!
//! > t_j = 1/pi times the integral of V(s) max(0, N.s) Y_j(s) ds
//!
//! (Sloan, Kautz and Snyder 2002): one vector a vertex rather than a matrix, and one product with the light,
//! times the albedo, is the radiance, the same toward every view.

use std::f64::consts::PI;

use brdf::{BrdfTable, Lambert, Material, Views};
use rayon::prelude::*;
use sh::{Basis, Degree, Expansion, Stop};
use sphere::{DVec3, Direction};

use crate::directions::Directions;
use crate::frames::{Frames, LANES};
use crate::occluders::Occluders;
use crate::packet::{Blocked, rays};
use crate::transfer::{MOST_BYTES, Transfer, TransferError};
use crate::vectors::{by_channel, dot};

/// A vector for each vertex, [V, (F+1)^2].
#[derive(Clone, Debug, PartialEq)]
pub struct MatteTransfer {
    input: Degree,
    values: Vec<f32>,
}

/// The table is not that of a matte material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the table is not that of `lambert`, and a matte transfer is of no other material")]
pub struct NotMatte;

/// The coefficients c_i of a white matte surface.
pub(crate) fn white(degree: Degree) -> Vec<f32> {
    let white = Lambert::new([1.0; 3]).map(Material::Lambert);
    let c = white.ok().and_then(|white| Views::new(&white, degree).coefficients(Direction::Z).ok());
    c.map_or_else(Vec::new, |found| found.c.iter().map(|rgb| rgb[0] as f32).collect())
}

impl MatteTransfer {
    /// Vectors from their values; `None` if the length is not a multiple of (F+1)^2.
    pub fn new(input: Degree, values: Vec<f32>) -> Option<Self> {
        values.len().is_multiple_of(input.rows()).then_some(Self { input, values })
    }

    /// Bakes shadows; also the number of vertices that see nothing. Unlike that of matrices, the cosine is
    /// not cut at a degree: next to a sphere, 16,384 directions are within 1e-3 (`tests/forms.rs`).
    ///
    /// # Errors
    /// The errors of [`crate::precompute`] for O = 0.
    pub fn precompute(
        frames: &Frames,
        occluders: &Occluders,
        directions: &Directions,
        input: Degree,
        stop: Stop<'_>,
    ) -> Result<(Self, usize), TransferError> {
        let columns = input.rows();
        let bytes = frames.len().saturating_mul(columns * size_of::<f32>());
        if bytes > MOST_BYTES {
            return Err(TransferError::TooLarge { vertices: frames.len(), bytes });
        }
        let (found, expected) = (directions.degree().get(), input.get());
        if found < expected {
            return Err(TransferError::Directions { found, expected });
        }
        let (basis, shares) = (Basis::new(input), shares(input));
        let rays = rays(directions);
        let mut values = vec![0.0; frames.len() * columns];
        let blocks = values.par_chunks_mut(LANES * columns).enumerate().map(|(block, values)| {
            stop.check()?;
            let (first, count) = (block * LANES, values.len() / columns);
            let normals: Vec<DVec3> = (first..first + count)
                .map(|vertex| DVec3::from_array(frames.normal(vertex).map(f64::from)))
                .collect();
            let mut sums: Vec<Vec<f64>> = normals
                .iter()
                .map(|normal| {
                    let mut open = vec![0.0; columns];
                    basis.evaluate_into(Direction::normalised(*normal), &mut open);
                    open.iter_mut().enumerate().for_each(|(row, y)| *y *= shares[row.isqrt()]);
                    open
                })
                .collect();
            let mut blocked = [0; LANES];
            let found = |lane: usize, index: usize| {
                let cosine = normals[lane].dot(directions.directions()[index].vector());
                let weighted = directions.weighted(index).iter().take(columns);
                sums[lane].iter_mut().zip(weighted).for_each(|(sum, y)| *sum -= cosine / PI * y);
                blocked[lane] += 1;
            };
            let cast = Blocked { occluders, frames, rays: &rays, first, count, found }.run();
            for (values, sums) in values.chunks_exact_mut(columns).zip(&sums) {
                values.iter_mut().zip(sums).for_each(|(value, sum)| *value = *sum as f32);
            }
            Ok((0..count).filter(|lane| blocked[*lane] == cast[*lane]).count())
        });
        let blind = blocks.collect::<Result<Vec<usize>, TransferError>>()?.into_iter().sum();
        Ok((Self { input, values }, blind))
    }

    /// The vectors of matrices, whose degree O cuts the cosine.
    pub fn of(transfer: &Transfer) -> Self {
        let (input, c) = (transfer.input(), white(transfer.output()));
        let columns = input.rows();
        let mut values = vec![0.0; transfer.len() * columns];
        values.par_chunks_mut(columns).enumerate().for_each(|(vertex, values)| {
            for (c, row) in c.iter().zip(transfer.matrix(vertex).chunks_exact(columns)) {
                values.iter_mut().zip(row).for_each(|(sum, entry)| *sum += c * entry);
            }
        });
        Self { input, values }
    }

    /// The degree F of the light of the world.
    pub fn input(&self) -> Degree {
        self.input
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.values.len() / self.input.rows()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// All vectors: [V, (F+1)^2].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The radiance of each vertex: the albedo of the table's material there times t L.
    ///
    /// # Errors
    /// If the table is not that of matte materials.
    ///
    /// # Panics
    /// If there are not as many vertices as frames.
    pub fn shade(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        light: &Expansion,
    ) -> Result<Vec<[f32; 3]>, NotMatte> {
        assert_eq!(frames.len(), self.len(), "the frames of this transfer");
        let albedos = albedos(frames, table).ok_or(NotMatte)?;
        let light = by_channel(light, self.input.min(light.degree()));
        let one = |(t, albedo): (&[f32], [f32; 3])| {
            [0, 1, 2].map(|k| albedo[k] * dot(&t[..light[k].len()], &light[k]))
        };
        Ok(self.values.par_chunks_exact(self.input.rows()).zip(albedos).with_min_len(1024).map(one).collect())
    }
}

/// The share of each degree that a white matte surface reflects: t_j of an open vertex over Y_j of its
/// normal.
fn shares(degree: Degree) -> Vec<f64> {
    let c = white(degree);
    let share = |l: usize| f64::from(c[l * l + l]) / ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
    (0..=degree.get()).map(share).collect()
}

/// The albedo of each vertex, if all materials of a table are multiples of the white matte one at every view.
pub(crate) fn albedos(frames: &Frames, table: &BrdfTable) -> Option<Vec<[f32; 3]>> {
    let (white, channels) = (white(table.degree()), table.channels());
    let albedo = |c: &[f32]| [0, 1, 2].map(|k| c[k.min(channels - 1)] / white[0]);
    let is_matte = |map: &[f32]| {
        let albedo = albedo(map);
        map.chunks_exact(table.texel())
            .flat_map(|texel| texel.iter().enumerate())
            .all(|(index, value)| (value - albedo[index % channels] * white[index / channels]).abs() < 1e-5)
    };
    if !table.values().chunks_exact(table.size() * table.size() * table.texel()).all(is_matte) {
        return None;
    }
    let mut c = vec![0.0; table.texel()];
    let of = |vertex: usize| {
        table.blend_into(frames.blend(vertex), Direction::Z, &mut c);
        albedo(&c)
    };
    Some((0..frames.len()).map(of).collect())
}
