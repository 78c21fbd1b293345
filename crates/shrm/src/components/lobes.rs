//! The material toward views at some angles theta_v, about its central direction: its harmonics in the
//! direction of the light, and what it reflects of a point of light.
//!
//! The frame has the central direction along +Z and the other direction of the disc (the normal if the
//! material is about R, the view if it is about N) at azimuth 0. Mirrored at the plane of both, an isotropic
//! material is the same: it has cosines alone, and toward an azimuth phi it is
//!
//! > rho_l,m cos(m phi) for the light's coefficient (l, m), rho_l,m sin(m phi) for (l, -m).

use std::f64::consts::PI;

use brdf::{Centre, Material, SurfaceView, TableError, Views};
use rayon::prelude::*;
use sh::{Degree, rotate};
use sphere::{Direction, Rotation, Zyz};

use crate::mean_lobe::angles;

/// The lowest view, in radians from the normal: what [`Views`] take.
const LOWEST: f64 = 1.566;

/// The harmonics rho_l,m of a material toward views at some angles.
pub(super) struct Lobes {
    degree: usize,
    orders: usize,
    count: usize,
    /// [m, l, channel, angle], l from 0.
    values: Vec<f64>,
}

impl Lobes {
    /// The harmonics up to a degree and an order, toward views at angles theta_v.
    pub(super) fn new(
        material: &Material,
        angles: &[f64],
        degree: Degree,
        orders: usize,
    ) -> Result<Self, TableError> {
        let views = Views::new(material, degree);
        let turns = material.turns();
        let toward = |theta: &f64| -> Result<Vec<[f64; 3]>, TableError> {
            let theta = theta.min(LOWEST);
            let mut sum = vec![[0.0; 3]; degree.rows()];
            for turn in 0..turns {
                let psi = std::f64::consts::TAU * turn as f64 / turns as f64;
                let c = views.coefficients(Direction::from_angles(theta, psi))?.c;
                let c = sh::Expansion::from_coefficients(degree, c).unwrap_or(sh::Expansion::zero(degree));
                // The surface's normal goes to azimuth 0 of the frame about R.
                let beta = if material.centre() == Centre::Reflection { theta } else { 0.0 };
                let local = rotate(&c, Rotation::from_zyz(Zyz { alpha: 0.0, beta, gamma: -psi }));
                for (sum, value) in sum.iter_mut().zip(local.coefficients()) {
                    (0..3).for_each(|channel| sum[channel] += value[channel] / turns as f64);
                }
            }
            Ok(sum)
        };
        let found: Vec<Vec<[f64; 3]>> = angles.par_iter().map(toward).collect::<Result<_, _>>()?;
        let (degree, count) = (degree.get(), angles.len());
        let orders = orders.min(degree);
        let mut lobes =
            Self { degree, orders, count, values: vec![0.0; (orders + 1) * (degree + 1) * 3 * count] };
        for m in 0..=orders {
            for l in m..=degree {
                for channel in 0..3 {
                    let row = lobes.place(m, l, channel);
                    for (view, found) in found.iter().enumerate() {
                        lobes.values[row + view] = found[l * l + l + m][channel];
                    }
                }
            }
        }
        Ok(lobes)
    }

    fn place(&self, m: usize, l: usize, channel: usize) -> usize {
        ((m * (self.degree + 1) + l) * 3 + channel) * self.count
    }

    /// rho_l,m of a channel, for each angle.
    pub(super) fn of(&self, m: usize, l: usize, channel: usize) -> &[f64] {
        &self.values[self.place(m, l, channel)..][..self.count]
    }

    /// The number of angles.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The highest order m.
    pub(super) fn orders(&self) -> usize {
        self.orders
    }

    /// The highest degree l.
    pub(super) fn degree(&self) -> usize {
        self.degree
    }
}

/// What the material reflects of a point of light with a flux of 1, by its angle to the central direction and
/// by the azimuth between it and the other direction, toward views at some angles.
pub(super) struct PointTable {
    pub(super) angles: Vec<f64>,
    /// [angle, azimuth, channel, view].
    values: Vec<f32>,
    /// The largest value of each angle.
    largest: Vec<f32>,
    count: usize,
}

/// Steps of the azimuth over half a turn.
pub(super) const AZIMUTHS: usize = 64;

impl PointTable {
    pub(super) fn new(material: &Material, views: &[f64]) -> Self {
        let angles = angles(2e-4, 0.08, 0.03);
        let (centre, turns, count) = (material.centre(), material.turns(), views.len());
        let toward = |theta: &f64, phi: f64| {
            let theta = theta.min(LOWEST);
            let from_centre = if centre == Centre::Reflection { 2.0 * theta } else { theta };
            centre.toward(Direction::from_angles(from_centre, phi))
        };
        let of_azimuth = |azimuth: usize| {
            let phi = PI * azimuth as f64 / AZIMUTHS as f64;
            views.iter().map(move |theta| toward(theta, phi))
        };
        let seen: Vec<SurfaceView> = (0..=AZIMUTHS).flat_map(of_azimuth).collect();
        let slice = |angle: &f64| -> Vec<f32> {
            let incident = Direction::from_angles(*angle, 0.0);
            let mut slice = Vec::with_capacity((AZIMUTHS + 1) * 3 * count);
            for seen in seen.chunks_exact(count) {
                let values = material.means_toward(turns, seen, incident);
                (0..3).for_each(|channel| slice.extend(values.iter().map(|value| value[channel] as f32)));
            }
            slice
        };
        let slices: Vec<Vec<f32>> = angles.par_iter().map(slice).collect();
        let largest = slices.iter().map(|slice| slice.iter().copied().fold(0.0, f32::max)).collect();
        Self { angles, values: slices.concat(), largest, count }
    }

    /// The values [channel, view] at a node.
    pub(super) fn node(&self, angle: usize, azimuth: usize) -> &[f32] {
        let size = 3 * self.count;
        &self.values[(angle * (AZIMUTHS + 1) + azimuth) * size..][..size]
    }

    /// The largest value at a node of the angle and at the next one.
    pub(super) fn largest(&self, angle: usize) -> f32 {
        self.largest[angle].max(self.largest[(angle + 1).min(self.largest.len() - 1)])
    }
}
