//! Transfer matrices in clusters, each with a basis of its own.
//!
//! Sloan, Hall, Hart and Snyder, "Clustered Principal Components for Precomputed Radiance Transfer" (2003):
//! the matrices, as points of (O+1)^2 (F+1)^2 numbers, fall into clusters; within one, a matrix is the mean
//! plus a few of its principal components, of which each vertex stores the weights. A vertex belongs to the
//! cluster that represents it with the least error. When shading, the means and components are applied to the
//! light once, not the matrices of all vertices.

use brdf::BrdfTable;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Degree, Expansion, Stop, Stopped};

use crate::frames::{Block, Frames, LANES, Viewer};
use crate::transfer::Transfer;
use crate::vectors::{EIGHTS, by_channel, dot, load, product, total};

/// Clustered matrices of V vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusteredTransfer {
    output: Degree,
    input: Degree,
    components: usize,
    /// The bases [K, n + 1, (O+1)^2, (F+1)^2]: the mean, then the components, orthonormal; zero if there are
    /// fewer.
    bases: Vec<f32>,
    /// The cluster of each vertex.
    clusters: Vec<u32>,
    /// The weights of the components, [V, n].
    weights: Vec<f32>,
}

/// The rounds in which means move, and those in which bases do.
const MEAN_ROUNDS: usize = 6;
const BASIS_ROUNDS: usize = 3;
/// The rounds of the subspace iteration that finds components.
const POWER_ROUNDS: usize = 6;
/// The number of clusters that a vertex tries in each round: those with the nearest means.
const CANDIDATES: usize = 4;
/// The number of blocks of eight vertices that a thread takes at a time.
const BLOCKS: usize = 64;
/// The number of columns that [`product`] sums at once.
const GROUP: usize = EIGHTS * LANES;

impl ClusteredTransfer {
    /// Clusters from their parts; `None` if the lengths do not fit or a vertex has no cluster.
    pub fn new(
        (output, input): (Degree, Degree),
        components: usize,
        bases: Vec<f32>,
        clusters: Vec<u32>,
        weights: Vec<f32>,
    ) -> Option<Self> {
        let one = (components + 1).checked_mul(output.rows() * input.rows())?;
        let fits = bases.len().is_multiple_of(one) && weights.len() == clusters.len() * components;
        let count = bases.len() / one;
        let known = clusters.iter().all(|cluster| (*cluster as usize) < count);
        (fits && known).then_some(Self { output, input, components, bases, clusters, weights })
    }

    /// Clusters matrices, and measures the error: the root of the mean square of what is lost, relative to
    /// that of the matrices. Uses all threads; the result does not depend on their number. `stop` is asked
    /// for every matrix and for every cluster, on every thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn of(
        transfer: &Transfer,
        clusters: usize,
        components: usize,
        stop: Stop<'_>,
    ) -> Result<(Self, f64), Stopped> {
        let length = transfer.output().rows() * transfer.input().rows();
        let points = Points { length, values: transfer.values(), components, stop };
        let count = clusters.clamp(1, transfer.len().max(1));
        let mut means: Vec<f32> = (0..count)
            .flat_map(|k| points.point(k * transfer.len() / count).unwrap_or(&[]).iter().copied())
            .collect();
        means.resize(count * length, 0.0);
        let mut own: Vec<u32> = Vec::new();
        for _ in 0..MEAN_ROUNDS {
            own = points.each(|point, _| points.nearest(point, &means)[0])?;
            means = points.means(&own, &means);
        }
        let mut bases = points.bases(&own, &means)?;
        for _ in 0..BASIS_ROUNDS {
            let best = |point: &[f32], _| {
                let near = points.nearest(point, &means);
                let error = |cluster: &u32| points.represent(point, &bases, *cluster).1;
                let errors: Vec<f32> = near.iter().map(error).collect();
                let least = (0..near.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]));
                near[least.unwrap_or(0)]
            };
            own = points.each(best)?;
            means = points.means(&own, &means);
            bases = points.bases(&own, &means)?;
        }
        let found: Vec<(Vec<f32>, f32)> =
            points.each(|point, index| points.represent(point, &bases, own[index]))?;
        let lost: f64 = found.iter().map(|(_, error)| f64::from(error.max(0.0))).sum();
        let size: f64 = transfer.values().iter().map(|value| math::powi(f64::from(*value), 2)).sum();
        let weights = found.into_iter().flat_map(|(weights, _)| weights).collect();
        let (output, input) = (transfer.output(), transfer.input());
        let value = Self { output, input, components, bases, clusters: own, weights };
        Ok((value, if size > 0.0 { (lost / size).sqrt() } else { 0.0 }))
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
        self.clusters.len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.clusters.is_empty()
    }

    /// The number of components n.
    pub fn components(&self) -> usize {
        self.components
    }

    /// The means and components: [K, n + 1, (O+1)^2, (F+1)^2].
    pub fn bases(&self) -> &[f32] {
        &self.bases
    }

    /// The cluster of each vertex.
    pub fn clusters(&self) -> &[u32] {
        &self.clusters
    }

    /// The weights of the components: [V, n].
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The numbers of a cluster's basis.
    fn one(&self) -> usize {
        (self.components + 1) * self.output.rows() * self.input.rows()
    }

    /// The matrices that the clusters stand for.
    pub fn matrices(&self) -> Option<Transfer> {
        let length = self.output.rows() * self.input.rows();
        let mut values = vec![0.0; self.len() * length];
        values.par_chunks_mut(length).enumerate().for_each(|(vertex, values)| {
            let basis = &self.bases[self.clusters[vertex] as usize * self.one()..][..self.one()];
            let (mean, components) = basis.split_at(length);
            values.copy_from_slice(mean);
            let weights = &self.weights[vertex * self.components..];
            for (component, weight) in components.chunks_exact(length).zip(weights) {
                values.iter_mut().zip(component).for_each(|(sum, value)| *sum += weight * value);
            }
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
        assert_eq!(frames.len(), self.len(), "the frames of these clusters");
        let rows = self.output.min(table.degree()).rows();
        let padded = rows.next_multiple_of(GROUP);
        let light = by_channel(light, self.input.min(light.degree()));
        let (whole, columns) = (self.output.rows(), self.input.rows());
        let mut lit = vec![0.0; self.bases.len() / (whole * columns) * 3 * padded];
        let matrices = self.bases.par_chunks_exact(whole * columns);
        lit.par_chunks_exact_mut(3 * padded).zip(matrices).for_each(|(lit, matrix)| {
            for (lit, light) in lit.chunks_exact_mut(padded).zip(&light) {
                for (value, row) in lit.iter_mut().zip(matrix.chunks_exact(columns).take(rows)) {
                    *value = dot(&row[..light.len()], light);
                }
            }
        });
        let mut radiance = vec![[0.0; 3]; frames.len()];
        let chunks = radiance.par_chunks_mut(BLOCKS * LANES).zip(frames.blocks().par_chunks(BLOCKS));
        chunks.enumerate().for_each(|(chunk, (radiance, blocks))| {
            let first = chunk * BLOCKS * LANES;
            let (transfer, lit) = (self, lit.as_slice());
            SimdLevel::detect().run(Shade { table, viewer, transfer, padded, lit, first, blocks, radiance });
        });
        radiance
    }
}

struct Shade<'a> {
    table: &'a BrdfTable,
    viewer: Viewer,
    transfer: &'a ClusteredTransfer,
    /// The rows of a channel of `lit`, a multiple of [`GROUP`]; the last ones are zero.
    padded: usize,
    /// The bases, applied to the light: [K, n + 1, 3, padded].
    lit: &'a [f32],
    /// The first vertex.
    first: usize,
    blocks: &'a [Block],
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for Shade<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (channels, texel, n) = (self.table.channels(), self.table.texel(), self.transfer.components);
        let kept = (texel / channels).min(self.padded);
        let (row, mut vertex) = (3 * self.padded, self.first);
        let mut texels = vec![0.0; LANES * texel];
        let mut c = vec![0.0; channels * self.padded];
        let mut shares = vec![1.0; n + 1];
        for (block, radiance) in self.blocks.iter().zip(self.radiance.chunks_mut(LANES)) {
            self.table.lookup_eight(simd, &block.blend, &block.views(self.viewer), &mut texels);
            for (found, rgb) in texels.chunks_exact(texel).zip(radiance) {
                for (channel, c) in c.chunks_exact_mut(self.padded).enumerate() {
                    for (row, c) in c[..kept].iter_mut().enumerate() {
                        *c = found[row * channels + channel];
                    }
                }
                let cluster = self.transfer.clusters[vertex] as usize;
                shares[1..].copy_from_slice(&self.transfer.weights[vertex * n..][..n]);
                let lit = &self.lit[cluster * (n + 1) * row..][..(n + 1) * row];
                let mut sums = [simd.splat_f32s(0.0); 3];
                for first in (0..self.padded).step_by(GROUP) {
                    // Of red, then green, then blue: independent sums, so that none waits for another.
                    let start = |k: usize| k / EIGHTS * self.padded + first + k % EIGHTS * LANES;
                    let starts: [usize; 3 * EIGHTS] = std::array::from_fn(start);
                    let arrives = product(simd, &shares, 1, lit, row, starts);
                    for (channel, sum) in sums.iter_mut().enumerate() {
                        let c = &c[channel.min(channels - 1) * self.padded + first..][..GROUP];
                        let arrives = &arrives[channel * EIGHTS..][..EIGHTS];
                        for (arrives, c) in arrives.iter().zip(c.as_chunks::<LANES>().0) {
                            *sum = simd.mul_add_f32s(*arrives, load(simd, c), *sum);
                        }
                    }
                }
                *rgb = sums.map(|sum| total(simd, sum));
                vertex += 1;
            }
        }
    }
}

/// Matrices as points.
struct Points<'a> {
    length: usize,
    values: &'a [f32],
    components: usize,
    stop: Stop<'a>,
}

impl Points<'_> {
    /// Computes something of each point and its index.
    fn each<T: Send>(&self, of: impl Fn(&[f32], usize) -> T + Sync) -> Result<Vec<T>, Stopped> {
        let points = self.values.par_chunks_exact(self.length).enumerate();
        points.map(|(index, point)| self.stop.check().map(|()| of(point, index))).collect()
    }

    fn point(&self, index: usize) -> Option<&[f32]> {
        self.values.get(index * self.length..(index + 1) * self.length)
    }

    /// The clusters with the nearest means, the nearest first.
    fn nearest(&self, point: &[f32], means: &[f32]) -> Vec<u32> {
        let mut near: Vec<(f32, u32)> = Vec::with_capacity(CANDIDATES + 1);
        for (cluster, mean) in means.chunks_exact(self.length).enumerate() {
            let distance = SimdLevel::detect().run(Distance(point, mean));
            let place = near.partition_point(|(other, _)| *other <= distance);
            if place < CANDIDATES {
                near.insert(place, (distance, cluster as u32));
                near.truncate(CANDIDATES);
            }
        }
        near.into_iter().map(|(_, cluster)| cluster).collect()
    }

    /// The mean of each cluster; one without points keeps the mean it had before.
    fn means(&self, own: &[u32], before: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0f64; before.len()];
        let mut counts = vec![0usize; before.len() / self.length];
        for (point, cluster) in self.values.chunks_exact(self.length).zip(own) {
            let cluster = *cluster as usize;
            counts[cluster] += 1;
            let sums = &mut sums[cluster * self.length..][..self.length];
            sums.iter_mut().zip(point).for_each(|(sum, value)| *sum += f64::from(*value));
        }
        let mean = |(index, sum): (usize, f64)| match counts[index / self.length] {
            0 => before[index],
            count => (sum / count as f64) as f32,
        };
        sums.into_iter().enumerate().map(mean).collect()
    }

    /// The mean and the principal components of each cluster, by subspace iteration.
    fn bases(&self, own: &[u32], means: &[f32]) -> Result<Vec<f32>, Stopped> {
        let count = means.len() / self.length;
        let mut members = vec![Vec::new(); count];
        for (index, cluster) in own.iter().enumerate() {
            members[*cluster as usize].push(index);
        }
        let basis = |(members, mean): (&Vec<usize>, &[f32])| {
            let centred = |index: usize| {
                let point = self.point(index).unwrap_or(mean);
                point.iter().zip(mean).map(|(a, b)| a - b).collect::<Vec<f32>>()
            };
            let start =
                |k: usize| members.get(k * members.len() / self.components).map(|index| centred(*index));
            let mut axes: Vec<Vec<f32>> = (0..self.components).filter_map(start).collect();
            orthonormalise(&mut axes);
            for _ in 0..POWER_ROUNDS {
                self.stop.check()?;
                let mut next = vec![vec![0.0; self.length]; axes.len()];
                for index in members {
                    let point = centred(*index);
                    for (next, axis) in next.iter_mut().zip(&axes) {
                        let share = dot(&point, axis);
                        next.iter_mut().zip(&point).for_each(|(sum, value)| *sum += share * value);
                    }
                }
                orthonormalise(&mut next);
                axes = next;
            }
            let mut basis = [mean.to_vec(), axes.concat()].concat();
            basis.resize((self.components + 1) * self.length, 0.0);
            Ok(basis)
        };
        let clusters = members.par_iter().zip(means.par_chunks_exact(self.length));
        let found: Vec<Vec<f32>> = clusters.map(basis).collect::<Result<_, Stopped>>()?;
        Ok(found.concat())
    }

    /// The weights of a point in a cluster's basis, and the square of the part that they lose.
    fn represent(&self, point: &[f32], bases: &[f32], cluster: u32) -> (Vec<f32>, f32) {
        let one = (self.components + 1) * self.length;
        let (mean, axes) = bases[cluster as usize * one..][..one].split_at(self.length);
        let mut rest: Vec<f32> = point.iter().zip(mean).map(|(a, b)| a - b).collect();
        let mut weights = Vec::with_capacity(self.components);
        for axis in axes.chunks_exact(self.length) {
            let share = dot(&rest, axis);
            rest.iter_mut().zip(axis).for_each(|(rest, axis)| *rest -= share * axis);
            weights.push(share);
        }
        (weights, dot(&rest, &rest))
    }
}

/// The square of the distance of two points.
struct Distance<'a>(&'a [f32], &'a [f32]);

impl WithSimd for Distance<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        let mut sums = [0.0f32; 16];
        let ((a, rest_a), (b, rest_b)) = (self.0.as_chunks::<16>(), self.1.as_chunks::<16>());
        for (a, b) in a.iter().zip(b) {
            (0..16).for_each(|lane| sums[lane] += (a[lane] - b[lane]) * (a[lane] - b[lane]));
        }
        let rest: f32 = rest_a.iter().zip(rest_b).map(|(a, b)| (a - b) * (a - b)).sum();
        sums.iter().sum::<f32>() + rest
    }
}

/// Gram and Schmidt, twice for accuracy; axes that depend on those before become zero.
fn orthonormalise(axes: &mut [Vec<f32>]) {
    for k in 0..axes.len() {
        let (before, rest) = axes.split_at_mut(k);
        let Some(axis) = rest.first_mut() else { return };
        let size = dot(axis, axis).sqrt();
        for _ in 0..2 {
            for other in before.iter() {
                let share = dot(axis, other);
                axis.iter_mut().zip(other).for_each(|(value, other)| *value -= share * other);
            }
        }
        let left = dot(axis, axis).sqrt();
        let scale = if left > 1e-5 * size && left > f32::MIN_POSITIVE { 1.0 / left } else { 0.0 };
        axis.iter_mut().for_each(|value| *value *= scale);
    }
}
