//! The fit of facet taps at one view: what spots of light look like, and what some taps make of them.

use std::f64::consts::TAU;

use sphere::DVec3;

use super::lobe::Ellipses;
use crate::facets::mirrored;
use crate::fit::least_squares::Normal;
use crate::fit::residuals::{AMBIENT, Residuals};
use crate::fit::spots::{Between, Spots};

/// The slopes and the azimuths of the centres of narrow spots.
const SLOPES: usize = 10;
const AZIMUTHS: usize = 12;

/// The steepest slope of a centre.
const STEEPEST: f64 = 1.6;

/// The angles from R of the centres of the widest spots.
const RINGS: usize = 7;

/// The farthest of them, in radians.
const FARTHEST: f64 = 1.9;

/// The parameters of a tap: the slopes p and q, the place between levels and the logarithm of the weight.
pub(super) const OF_TAP: usize = 4;

/// The parameters of a tap about the normal: the place between kernels and the logarithm of the weight.
pub(super) const OF_NORMAL: usize = 2;

/// The lobe of one view, normalised to an albedo of 1, under every spot.
pub(super) struct View<'a> {
    /// The view in the frame of the surface.
    pub(super) direction: DVec3,
    spots: &'a [Spots],
    taps: usize,
    /// The centre and what the lobe reflects of each spot, size by size.
    tests: Vec<Vec<(DVec3, f64)>>,
}

/// A tap, ready for look-ups.
struct Placed {
    direction: DVec3,
    /// The derivatives of the direction by both slopes.
    turned: [DVec3; 2],
    between: Between,
    weight: f64,
}

impl Placed {
    fn new(view: DVec3, [p, q, x, weight]: [f64; OF_TAP]) -> Self {
        let h = DVec3::new(p, q, 1.0);
        let (squared, facing) = (h.length_squared(), view.dot(h));
        let by = |axis: DVec3, slope: f64| {
            2.0 / squared * (view.dot(axis) * h + facing * axis - 2.0 * slope * facing / squared * h)
        };
        Self {
            direction: mirrored(view, [p, q]),
            turned: [by(DVec3::X, p), by(DVec3::Y, q)],
            between: Between::levels(x),
            weight: math::exp(weight),
        }
    }
}

/// The centres of spots about the mirror image of a view: as the lobe lies, or for the widest in rings.
fn centres(view: DVec3, scale: Option<[f64; 2]>) -> Vec<DVec3> {
    let r = DVec3::new(-view.x, -view.y, view.z);
    let mut centres = vec![r];
    if let Some(scale) = scale {
        let ellipses = Ellipses::new(scale, STEEPEST);
        for i in 1..=SLOPES {
            for j in 0..AZIMUTHS {
                let azimuth = TAU * (j as f64 + 0.5) / AZIMUTHS as f64;
                centres.push(mirrored(view, ellipses.at(i as f64 / SLOPES as f64, azimuth).0));
            }
        }
    } else {
        let (u, w) = r.any_orthonormal_pair();
        for i in 1..=RINGS {
            let (s, c) = math::sin_cos(FARTHEST * i as f64 / RINGS as f64);
            for j in 0..AZIMUTHS {
                let (y, x) = math::sin_cos(TAU * (j as f64 + 0.5) / AZIMUTHS as f64);
                centres.push(s * x * u + s * y * w + c * r);
            }
        }
    }
    centres
}

impl<'a> View<'a> {
    /// The fit of one channel of a lobe's shares, or of the sum of all if `channel` is `None`. Each entry of
    /// `scales` says within which slopes the centres of spots of one size are dense; the widest have none.
    pub(super) fn new(
        direction: DVec3,
        lobe: &[(DVec3, [f64; 3])],
        channel: Option<usize>,
        spots: &'a [Spots],
        scales: &[Option<[f64; 2]>],
        taps: usize,
    ) -> Self {
        let of = |rgb: &[f64; 3]| channel.map_or_else(|| rgb.iter().sum(), |channel| rgb[channel]);
        let whole: f64 = lobe.iter().map(|(_, rgb)| of(rgb)).sum();
        let shares: Vec<(DVec3, f64)> = (lobe.iter())
            .map(|(direction, rgb)| (*direction, of(rgb) / whole.max(1e-30)))
            .filter(|(_, share)| *share > 1e-8)
            .collect();
        let size = |(spots, scale): (&Spots, &Option<[f64; 2]>)| {
            let seen = |centre: DVec3| {
                let share =
                    |(direction, share): &(DVec3, f64)| share * spots.radiance(centre.dot(*direction));
                (centre, shares.iter().map(share).sum())
            };
            centres(direction, *scale).into_iter().map(seen).collect()
        };
        let tests = spots.iter().zip(scales).map(size).collect();
        Self { direction, spots, taps, tests }
    }

    /// The number of residuals.
    pub(super) fn len(&self) -> usize {
        self.tests.iter().map(Vec::len).sum::<usize>() + 1
    }

    /// The sum of squared residuals in stops; adds to the normal equations, if they are given.
    pub(super) fn evaluate(&self, parameters: &[f64], normal: Option<&mut Normal>) -> f64 {
        let (taps, normals) = parameters.split_at(OF_TAP * self.taps);
        let taps: Vec<Placed> =
            taps.as_chunks().0.iter().map(|parameters| Placed::new(self.direction, *parameters)).collect();
        let normals: Vec<(Between, f64)> = (normals.as_chunks::<OF_NORMAL>().0.iter())
            .map(|[x, weight]| (Between::normals(*x), math::exp(*weight)))
            .collect();
        let mut row = vec![0.0; parameters.len()];
        let mut residuals = Residuals::new(normal);
        for (spots, tests) in self.spots.iter().zip(&self.tests) {
            for (centre, truth) in tests {
                let mut sum = AMBIENT;
                let (of_taps, of_normals) = row.split_at_mut(OF_TAP * taps.len());
                for (tap, row) in taps.iter().zip(of_taps.as_chunks_mut::<OF_TAP>().0) {
                    let seen = spots.in_levels(tap.direction.dot(*centre), tap.between);
                    sum += tap.weight * seen.value;
                    let by_slope = tap.turned.map(|turned| tap.weight * seen.by_cosine * turned.dot(*centre));
                    *row = [by_slope[0], by_slope[1], tap.weight * seen.by_place, tap.weight * seen.value];
                }
                for ((between, weight), row) in normals.iter().zip(of_normals.as_chunks_mut::<OF_NORMAL>().0)
                {
                    let seen = spots.about_normal(centre.z, *between);
                    sum += weight * seen.value;
                    *row = [weight * seen.by_place, weight * seen.value];
                }
                residuals.add_spot(sum, *truth, &mut row);
            }
        }
        let weights = taps.iter().map(|tap| tap.weight).chain(normals.iter().map(|normal| normal.1));
        let of_taps = (0..taps.len()).map(|tap| OF_TAP * tap + OF_TAP - 1);
        let of_normals = (0..normals.len()).map(|tap| OF_TAP * taps.len() + OF_NORMAL * tap + 1);
        residuals.add_uniform(of_taps.chain(of_normals).zip(weights), &mut row);
        residuals.cost
    }
}
