//! The reflected light of one central direction, at the views of the fit.

use std::f64::consts::TAU;

use sh::{Expansion, rotate_orders};
use sphere::{DMat3, DQuat, DVec3, Direction, Rotation};

use super::basis::{RADII, angle_of, radii};
use super::lobes::{AZIMUTHS, Lobes, PointTable};
use crate::mean_lobe::place;

/// Azimuths of the views of the fit.
pub(super) const VIEWS: usize = 36;

/// The highest order m of the light in the azimuth about a central direction.
pub(super) const ORDERS: usize = 16;

/// The sums over l of light times lobe, for each order: [m, cosine or sine, channel, angle].
pub(super) fn harmonics(lighting: &Expansion, lobes: &Lobes, frame: &DMat3) -> Vec<f64> {
    let q = DQuat::from_mat3(frame);
    let rotation = Rotation::from_quaternion(q.x, q.y, q.z, q.w).unwrap_or(Rotation::IDENTITY);
    let orders = lobes.orders().min(lighting.degree().get());
    let local = rotate_orders(lighting, rotation.inverse(), orders);
    let (rows, count) = (local.coefficients(), lobes.count());
    let mut sums = vec![0.0; (orders + 1) * 6 * count];
    for m in 0..=orders {
        let sums = &mut sums[m * 6 * count..][..6 * count];
        let (cosine, sine) = sums.split_at_mut(3 * count);
        for l in m..=lobes.degree().min(lighting.degree().get()) {
            let (c, s) = (rows[l * l + l + m], rows[l * l + l - m]);
            for channel in 0..3 {
                let rho = lobes.of(m, l, channel);
                let at = channel * count..(channel + 1) * count;
                for (sum, rho) in cosine[at.clone()].iter_mut().zip(rho) {
                    *sum += rho * c[channel];
                }
                if m > 0 {
                    for (sum, rho) in sine[at].iter_mut().zip(rho) {
                        *sum += rho * s[channel];
                    }
                }
            }
        }
    }
    sums
}

/// The value at an azimuth of the sums of [`harmonics`], for each channel and angle.
pub(super) fn toward(sums: &[f64], count: usize, turns: &[[f64; 2]], values: &mut [f64]) {
    values.fill(0.0);
    for (sums, [cosine, sine]) in sums.chunks_exact(6 * count).zip(turns) {
        let (c, s) = sums.split_at(3 * count);
        for (value, (c, s)) in values.iter_mut().zip(c.iter().zip(s)) {
            *value += c * cosine + s * sine;
        }
    }
}

/// cos(m phi) and sin(m phi), m = 0 ..= orders.
pub(super) fn turns(phi: f64, orders: usize) -> Vec<[f64; 2]> {
    let turn = |m: usize| {
        let (sine, cosine) = math::sin_cos(m as f64 * phi);
        [cosine, sine]
    };
    (0..=orders).map(turn).collect()
}

/// What the fit reads: the lighting, the material's lobes, and lights that are baked.
pub(super) struct Field<'a> {
    pub(super) lighting: &'a Expansion,
    pub(super) lobes: Lobes,
    pub(super) baked: Option<Baked>,
    pub(super) turns: Vec<Vec<[f64; 2]>>,
}

/// Points of light that are in the map.
pub(super) struct Baked {
    pub(super) table: PointTable,
    /// Directions in the world and flux.
    pub(super) points: Vec<(Direction, [f64; 3])>,
    /// The radiance below which black is black.
    pub(super) dark: f32,
}

impl<'a> Field<'a> {
    pub(super) fn new(lighting: &'a Expansion, lobes: Lobes, baked: Option<Baked>) -> Self {
        let phi = |view: usize| TAU * view as f64 / VIEWS as f64;
        let turns = (0..VIEWS).map(|view| turns(phi(view), lobes.orders())).collect();
        Self { lighting, lobes, baked, turns }
    }

    /// The radiance at the views of the fit about a central direction with this frame: [azimuth, channel,
    /// radius].
    pub(super) fn views(&self, frame: &DMat3) -> Vec<f64> {
        let sums = harmonics(self.lighting, &self.lobes, frame);
        let mut values = vec![0.0; VIEWS * 3 * RADII];
        for (turns, values) in self.turns.iter().zip(values.chunks_exact_mut(3 * RADII)) {
            toward(&sums, RADII, turns, values);
            values.iter_mut().for_each(|value| *value = value.max(0.0));
        }
        if let Some(baked) = &self.baked {
            baked.add(frame, &mut values);
        }
        values
    }
}

impl Baked {
    /// Adds the points' light at the views of the fit. A point that adds less than a thousandth of black is
    /// left out.
    fn add(&self, frame: &DMat3, values: &mut [f64]) {
        let into: DMat3 = frame.transpose();
        let mut sums = vec![0.0_f32; values.len()];
        for (direction, flux) in &self.points {
            let local: DVec3 = into * direction.vector();
            let (theta, phi) = (math::acos(local.z.clamp(-1.0, 1.0)), math::atan2(local.y, local.x));
            let (k, share) = place(&self.table.angles, theta);
            let flux = flux.map(|flux| flux as f32);
            if flux.iter().fold(0.0, |most: f32, flux| most.max(*flux)) * self.table.largest(k)
                < 1e-3 * self.dark
            {
                continue;
            }
            let share = share as f32;
            for (view, sums) in sums.chunks_exact_mut(3 * RADII).enumerate() {
                let turn = (TAU * view as f64 / VIEWS as f64 - phi).rem_euclid(TAU);
                let place = turn.min(TAU - turn) / (TAU / 2.0) * AZIMUTHS as f64;
                let step = (place as usize).min(AZIMUTHS - 1);
                let part = (place - step as f64) as f32;
                let [a, b, c, d] = [(k, step), (k, step + 1), (k + 1, step), (k + 1, step + 1)]
                    .map(|(angle, azimuth)| self.table.node(angle, azimuth));
                let weights =
                    [(1.0 - share) * (1.0 - part), (1.0 - share) * part, share * (1.0 - part), share * part];
                for channel in 0..3 {
                    let at = channel * RADII..(channel + 1) * RADII;
                    let [a, b, c, d] = [a, b, c, d].map(|values| &values[at.clone()]);
                    for (i, sum) in sums[at].iter_mut().enumerate() {
                        let value =
                            weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i] + weights[3] * d[i];
                        *sum += flux[channel] * value;
                    }
                }
            }
        }
        values.iter_mut().zip(sums).for_each(|(value, sum)| *value += f64::from(sum));
    }
}

/// The views of the fit on the disc: [azimuth, radius].
pub(super) fn view_places() -> Vec<[f64; 2]> {
    let place = |view: usize| {
        let (sine, cosine) = math::sin_cos(TAU * (view / RADII) as f64 / VIEWS as f64);
        let r = radii()[view % RADII];
        [r * cosine, r * sine]
    };
    (0..VIEWS * RADII).map(place).collect()
}

/// The angles theta_v of the views of the fit.
pub(super) fn view_angles() -> [f64; RADII] {
    radii().map(angle_of)
}
