//! Clustered principal components: most of what long vectors hold, in a few numbers for each.
//!
//! Vectors are divided into clusters, each with a mean and a few orthonormal components (Sloan, Hall, Hart
//! and Snyder 2003, section 4), so that a vector is the number of its cluster and a weight for each
//! component. It belongs to the cluster that is nearest once the components are used, which is found in turn
//! with these.

use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::random::hash;

/// Raised when the components of the same vectors change.
pub const REVISION: u32 = 0;

/// The numbers of clusters that are tried.
const CLUSTERS: [usize; 4] = [1, 4, 16, 64];

/// The most components of a cluster.
const MOST_COMPONENTS: usize = 64;

/// The dimensions in which clusters are looked for: the greatest principal components of all vectors.
const DIMENSIONS: usize = 96;

/// How often vectors change to the nearest mean, how often to the nearest cluster, and how often a product
/// with the covariance turns components toward the greatest.
const MEAN_ROUNDS: usize = 5;
const CLUSTER_ROUNDS: usize = 4;
const PRODUCTS: usize = 16;

/// The rows of a covariance that are summed at once.
const BLOCK: usize = 16;

/// Vectors as sums of the components of their clusters.
#[derive(Clone, Debug, PartialEq)]
pub struct ClusteredComponents {
    /// The components of a cluster.
    pub components: usize,
    /// The mean of each cluster and then its components: [cluster, 1 + components, length].
    pub vectors: Vec<f32>,
    /// The cluster of each vector.
    pub clusters: Vec<u8>,
    /// The factors of the components of each vector: [vector, components].
    pub weights: Vec<f32>,
}

/// The clusters of points with some coordinates.
struct Fit {
    /// [cluster, 1 + components, dimension]
    vectors: Vec<f64>,
    clusters: Vec<u8>,
    /// The sum of the squares of what is missing.
    error: f64,
}

impl ClusteredComponents {
    /// Vectors with as many numbers as there are `factors`, in at most `most_bytes` each, as 16-bit numbers
    /// and with their share of the clusters. The squares of the errors are least after each number is
    /// multiplied by its factor, which is above 0. `None` if that is too little for a component. Uses all
    /// threads; the result does not depend on their number.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn new(
        vectors: &[f32],
        factors: &[f32],
        most_bytes: usize,
        stop: Stop<'_>,
    ) -> Result<Option<Self>, Stopped> {
        let length = factors.len();
        let count = vectors.len().checked_div(length).unwrap_or(0);
        let choices: Vec<(usize, usize)> = CLUSTERS
            .into_iter()
            .filter_map(|clusters| Some((clusters, components(count, length, clusters, most_bytes)?)))
            .collect();
        if choices.is_empty() {
            return Ok(None);
        }
        let scaled: Vec<f64> = vectors
            .par_chunks_exact(length)
            .flat_map_iter(|own| {
                own.iter().zip(factors).map(|(x, factor)| f64::from(*x) * f64::from(*factor))
            })
            .collect();
        let origin = mean(scaled.chunks_exact(length), length);
        let members: Vec<&[f64]> = scaled.chunks_exact(length).collect();
        let axes = principal(&members, &origin, DIMENSIONS.min(length), stop)?;
        let dimensions = axes.len() / length.max(1);
        let place = |own: &&[f64]| {
            let way: Vec<f64> = own.iter().zip(&origin).map(|(x, origin)| x - origin).collect();
            axes.chunks_exact(length).map(|axis| dot(axis, &way)).collect::<Vec<f64>>()
        };
        let points: Vec<f64> = members.par_iter().flat_map_iter(place).collect();
        let mut best: Option<(usize, Fit)> = None;
        for (clusters, components) in choices {
            let components = components.min(dimensions);
            let fit = Fit::new(&points, dimensions, clusters, components, stop)?;
            if best.as_ref().is_none_or(|(_, before)| fit.error < before.error) {
                best = Some((components, fit));
            }
        }
        let Some((components, fit)) = best else { return Ok(None) };
        let back = |(at, own): (usize, &[f64])| {
            let mut sum = if at % (1 + components) == 0 { origin.clone() } else { vec![0.0; length] };
            own.iter().zip(axes.chunks_exact(length)).for_each(|(x, axis)| add(&mut sum, *x, axis));
            sum.into_iter().zip(factors).map(|(x, factor)| (x / f64::from(*factor)) as f32)
        };
        let weights = |(point, cluster): (&[f64], &u8)| {
            let own = cluster_of(&fit.vectors, *cluster, dimensions, components);
            weights(point, own, dimensions).into_iter().map(|weight| weight as f32)
        };
        Ok(Some(Self {
            components,
            vectors: fit.vectors.par_chunks_exact(dimensions).enumerate().flat_map_iter(back).collect(),
            weights: points.par_chunks_exact(dimensions).zip(&fit.clusters).flat_map_iter(weights).collect(),
            clusters: fit.clusters,
        }))
    }

    /// The vectors that are stored, of `length` numbers each.
    pub fn decoded(&self, length: usize) -> Vec<f32> {
        let of = |(vector, cluster): (usize, &u8)| {
            let own = &self.vectors[usize::from(*cluster) * (1 + self.components) * length..];
            let (mut sum, own) = (own[..length].to_vec(), own[length..].chunks_exact(length));
            for (weight, component) in
                self.weights[vector * self.components..].iter().zip(own).take(self.components)
            {
                sum.iter_mut().zip(component).for_each(|(sum, x)| *sum += weight * x);
            }
            sum
        };
        self.clusters.iter().enumerate().flat_map(of).collect()
    }
}

/// How many components fit into some bytes a vector; `None` if not one does.
fn components(count: usize, length: usize, clusters: usize, most_bytes: usize) -> Option<usize> {
    let vector = 2 * clusters * length;
    // A byte for the cluster of each vector, and the means.
    let rest = (most_bytes * count).checked_sub(count + vector)?;
    let components = rest.checked_div(2 * count + vector)?.min(MOST_COMPONENTS);
    (components > 0 && clusters <= count).then_some(components)
}

impl Fit {
    /// Divides points into clusters.
    fn new(
        points: &[f64],
        dimensions: usize,
        count: usize,
        components: usize,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let all = points.len() / dimensions;
        let point = |index: usize| &points[index * dimensions..][..dimensions];
        // Probes that follow each other are neighbours.
        let mut vectors: Vec<f64> = (0..count).flat_map(|k| point(k * all / count).to_vec()).collect();
        let mut fit = nearest(points, dimensions, vectors.clone(), 0);
        for round in 0..MEAN_ROUNDS + CLUSTER_ROUNDS {
            let components = if round < MEAN_ROUNDS { 0 } else { components };
            let own = |cluster: usize| -> Result<Vec<f64>, Stopped> {
                let is_own = |index: &usize| usize::from(fit.clusters[*index]) == cluster;
                let members: Vec<&[f64]> = (0..all).filter(is_own).map(point).collect();
                let mut own = mean(members.iter().copied(), dimensions);
                own.extend(principal(&members, &own, components, stop)?);
                Ok(own)
            };
            vectors = (0..count).into_par_iter().map(own).collect::<Result<Vec<_>, Stopped>>()?.concat();
            fit = nearest(points, dimensions, vectors.clone(), components);
        }
        Ok(fit)
    }
}

/// The nearest cluster of each point.
fn nearest(points: &[f64], dimensions: usize, vectors: Vec<f64>, components: usize) -> Fit {
    let count = vectors.len() / (dimensions * (1 + components));
    let of = |point: &[f64]| {
        let distance = |cluster: usize| {
            let own = cluster_of(&vectors, cluster as u8, dimensions, components);
            let whole: f64 = point.iter().zip(own).map(|(x, mean)| (x - mean) * (x - mean)).sum();
            whole - weights(point, own, dimensions).iter().map(|weight| weight * weight).sum::<f64>()
        };
        let distances = (0..count).map(|cluster| (distance(cluster), cluster as u8));
        distances.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
    };
    let found: Vec<(f64, u8)> = points.par_chunks_exact(dimensions).map(of).collect();
    let error = found.iter().map(|(distance, _)| distance.max(0.0)).sum();
    Fit { vectors, clusters: found.into_iter().map(|(_, cluster)| cluster).collect(), error }
}

/// The mean and the components of a cluster.
fn cluster_of(vectors: &[f64], cluster: u8, dimensions: usize, components: usize) -> &[f64] {
    let length = dimensions * (1 + components);
    &vectors[usize::from(cluster) * length..][..length]
}

/// The weight of each component of a cluster in a point.
fn weights(point: &[f64], cluster: &[f64], dimensions: usize) -> Vec<f64> {
    let (mean, components) = cluster.split_at(dimensions);
    let way: Vec<f64> = point.iter().zip(mean).map(|(x, mean)| x - mean).collect();
    components.chunks_exact(dimensions).map(|component| dot(component, &way)).collect()
}

fn mean<'a>(points: impl Iterator<Item = &'a [f64]>, dimensions: usize) -> Vec<f64> {
    let (mut sum, mut count) = (vec![0.0; dimensions], 0.0_f64);
    for point in points {
        add(&mut sum, 1.0, point);
        count += 1.0;
    }
    sum.into_iter().map(|x| x / count.max(1.0)).collect()
}

/// Orthonormal vectors that span the greatest principal components of points about their mean, by orthogonal
/// iteration; those of no variance are 0.
fn principal(points: &[&[f64]], mean: &[f64], count: usize, stop: Stop<'_>) -> Result<Vec<f64>, Stopped> {
    let dimensions = mean.len();
    if count == 0 {
        return Ok(Vec::new());
    }
    let mut covariance = vec![0.0; dimensions * dimensions];
    covariance.par_chunks_mut(BLOCK * dimensions).enumerate().try_for_each(|(block, rows)| {
        stop.check()?;
        let mut way = vec![0.0; dimensions];
        for point in points {
            (0..dimensions).for_each(|k| way[k] = point[k] - mean[k]);
            for (row, sums) in rows.chunks_exact_mut(dimensions).enumerate() {
                add(sums, way[BLOCK * block + row], &way);
            }
        }
        Ok(())
    })?;
    let start = |index: usize| (hash(index as u64) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
    let mut axes: Vec<f64> = (0..count * dimensions).map(start).collect();
    for _ in 0..PRODUCTS {
        stop.check()?;
        let product = |axis: &[f64]| {
            let mut sum = vec![0.0; dimensions];
            axis.iter().zip(covariance.chunks_exact(dimensions)).for_each(|(x, row)| add(&mut sum, *x, row));
            sum
        };
        axes = axes.par_chunks_exact(dimensions).flat_map_iter(product).collect();
        orthonormalise(&mut axes, dimensions);
    }
    Ok(axes)
}

/// Makes vectors orthonormal, one after the other; what remains of one that the others span is 0.
fn orthonormalise(vectors: &mut [f64], dimensions: usize) {
    for k in 0..vectors.len() / dimensions {
        let (before, rest) = vectors.split_at_mut(k * dimensions);
        let own = &mut rest[..dimensions];
        let length = dot(own, own).sqrt();
        // Twice: the first pass leaves what rounding added along the others.
        for _ in 0..2 {
            for other in before.chunks_exact(dimensions) {
                let along = dot(own, other);
                add(own, -along, other);
            }
        }
        let rest = dot(own, own).sqrt();
        let factor = if rest > 1e-12 * length && rest > 0.0 { 1.0 / rest } else { 0.0 };
        own.iter_mut().for_each(|x| *x *= factor);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(sum: &mut [f64], factor: f64, vector: &[f64]) {
    sum.iter_mut().zip(vector).for_each(|(sum, x)| *sum += factor * x);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(index: usize) -> f64 {
        hash(index as u64 + 77) as f64 / u64::MAX as f64 - 0.5
    }

    /// The squares of the differences of two lists.
    fn squares(one: &[f32], other: &[f32]) -> f64 {
        one.iter().zip(other).map(|(a, b)| f64::from(a - b) * f64::from(a - b)).sum()
    }

    fn compressed(vectors: &[f32], factors: &[f32], bytes: usize) -> ClusteredComponents {
        ClusteredComponents::new(vectors, factors, bytes, Stop::NEVER).unwrap().unwrap()
    }

    /// A cluster of vectors with known singular values misses those beyond its components and no more.
    #[test]
    fn a_cluster_keeps_the_greatest_singular_values() {
        const COUNT: usize = 40;
        const LENGTH: usize = 12;
        // Cosines over the vectors and over their numbers, both orthogonal and without a mean.
        let cosine = |k: usize, at: usize, of: usize| {
            let norm = (2.0 / of as f64).sqrt();
            norm * (std::f64::consts::PI * (k + 1) as f64 * (at as f64 + 0.5) / of as f64).cos()
        };
        let singular: [f64; 8] = [8.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.25, 0.1];
        let number = |index: usize| {
            let (vector, at) = (index / LENGTH, index % LENGTH);
            let sum = singular.iter().enumerate();
            sum.map(|(k, s)| s * cosine(k, vector, COUNT) * cosine(k, at, LENGTH)).sum::<f64>()
        };
        let vectors: Vec<f64> = (0..COUNT * LENGTH).map(number).collect();
        for components in [1, 3, 6] {
            let found = Fit::new(&vectors, LENGTH, 1, components, Stop::NEVER).unwrap();
            let missing: f64 = singular[components..].iter().map(|s| s * s).sum();
            assert!((found.error / missing - 1.0).abs() < 1e-2, "{components}: {} {missing}", found.error);
        }
    }

    /// Four lines in space are four clusters of one component, in whichever unit the numbers are.
    #[test]
    fn lines_are_clusters() {
        const LENGTH: usize = 9;
        let factors: Vec<f32> = (0..LENGTH).map(|k| 1.0 + k as f32).collect();
        let number = |index: usize| {
            let (vector, at) = (index / LENGTH, index % LENGTH);
            let line = 4 * vector / 400;
            let along = noise(vector);
            ((5.0 * noise(1000 + 10 * line + at) + along * noise(2000 + 10 * line + at))
                / f64::from(factors[at])) as f32
        };
        let vectors: Vec<f32> = (0..400 * LENGTH).map(number).collect();
        // 3 bytes, and 4 x 2 x 9 x 2 = 144 bytes for 400 vectors.
        let found = compressed(&vectors, &factors, 4);
        assert_eq!((found.vectors.len() / LENGTH, found.components), (8, 1));
        let whole: f64 = vectors.iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
        assert!(squares(&found.decoded(LENGTH), &vectors) < 1e-12 * whole);
    }

    #[test]
    fn bytes_are_kept_and_too_few_are_refused() {
        const LENGTH: usize = 20;
        for count in [3, 30, 700] {
            let vectors: Vec<f32> = (0..count * LENGTH).map(|index| noise(index) as f32).collect();
            for bytes in [2, 5, 20, 60] {
                let found = ClusteredComponents::new(&vectors, &[1.0; LENGTH], bytes, Stop::NEVER).unwrap();
                let Some(found) = found else {
                    assert!(count * bytes < count + 2 * LENGTH + 2 * (count + LENGTH), "{count} {bytes}");
                    continue;
                };
                let used = found.clusters.len() + 2 * (found.weights.len() + found.vectors.len());
                assert!(used <= count * bytes, "{used} of {count} x {bytes}");
                assert_eq!(found.weights.len(), count * found.components);
            }
        }
        assert_eq!(ClusteredComponents::new(&[], &[1.0; 4], 99, Stop::NEVER).unwrap(), None);
    }

    #[test]
    fn threads_do_not_change_it() {
        let vectors: Vec<f32> = (0..200 * 30).map(|index| noise(index) as f32).collect();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| compressed(&vectors, &[1.0; 30], 30))
        };
        assert_eq!(on(1), on(3));
    }
}
