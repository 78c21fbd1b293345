//! The texels nearest to points that lie as densely as there is light.

use std::f64::consts::{PI, TAU};
use std::num::NonZeroU32;

use rayon::prelude::*;
use sphere::{DVec3, Direction, NearestDirection};

use super::{LightMasses, Region};
use crate::Points;

/// The light of the texels of each point.
pub(super) fn regions(masses: &LightMasses, count: NonZeroU32) -> Vec<Region> {
    let grid = masses.grid();
    let points = points(masses, count);
    let nearest = NearestDirection::new(&points);
    let owners: Vec<Option<usize>> = (0..grid.len())
        .into_par_iter()
        .map(|texel| match masses.weight(texel) > 0.0 {
            true => nearest.nearest(masses.moment_of(texel).normalize_or(DVec3::Z)),
            false => None,
        })
        .collect();
    let mut regions = vec![Region::default(); points.len()];
    for (texel, owner) in owners.into_iter().enumerate() {
        if let Some(owner) = owner {
            regions[owner].add(masses, texel);
        }
    }
    regions
}

/// Hammersley's points by the inverse of the distribution of rows, then of the columns of a row; within a
/// texel they are spread evenly.
fn points(masses: &LightMasses, count: NonZeroU32) -> Vec<DVec3> {
    let grid = masses.grid();
    let row = |row: usize| Distribution::new((0..grid.width).map(|c| masses.weight(row * grid.width + c)));
    let rows: Vec<Distribution> = (0..grid.height).map(row).collect();
    let all = Distribution::new(rows.iter().map(Distribution::total));
    let set = Points::Hammersley { count };
    let half = 0.5 / f64::from(count.get());
    (0..u64::from(count.get()))
        .map(|index| {
            let [u, v] = set.get(index).map(f64::from);
            let (row, within) = all.invert(u + half);
            let (column, along) = rows[row].invert(v);
            // Even in z.
            let edge = |row: usize| math::cos(PI * row as f64 / grid.height as f64);
            let z = edge(row) + within * (edge(row + 1) - edge(row));
            let phi = TAU * (0.5 - (column as f64 + along) / grid.width as f64);
            Direction::from_angles(math::acos(z.clamp(-1.0, 1.0)), phi).vector()
        })
        .collect()
}

/// Sums of masses, up to each of them.
struct Distribution(Vec<f64>);

impl Distribution {
    fn new(masses: impl Iterator<Item = f64>) -> Self {
        let add = |sum: &mut f64, mass: f64| {
            *sum += mass;
            Some(*sum)
        };
        Self(masses.scan(0.0, add).collect())
    }

    fn total(&self) -> f64 {
        self.0.last().copied().unwrap_or_default()
    }

    /// The element that holds a share of the whole, and the share of the element before that; one that has
    /// mass.
    fn invert(&self, share: f64) -> (usize, f64) {
        let wanted = share * self.total();
        // The last element that has mass ends at the total.
        let last = self.0.partition_point(|sum| *sum < self.total());
        let index = self.0.partition_point(|sum| *sum <= wanted).min(last);
        let before = if index == 0 { 0.0 } else { self.0[index - 1] };
        let mass = self.0[index] - before;
        (index, if mass > 0.0 { ((wanted - before) / mass).clamp(0.0, 1.0) } else { 0.5 })
    }
}
