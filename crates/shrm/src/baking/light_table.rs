//! rho_hat at the views of a grid, tabulated by the angle between light and central direction.
//!
//! All lights and texels share one table: about its central direction, an isotropic material depends on the
//! light's angle and on the azimuth between light and view alone. Between the nodes it is interpolated.

use std::f64::consts::PI;

use brdf::SurfaceView;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sphere::Direction;

use super::solver::F32x8;
use super::view_grid::{MIRRORED, ViewGrid};
use crate::lamps::{Lamps, LocalLight};
use crate::mean_lobe::{angles, place};

/// Nodes of the azimuth over half a turn, besides the first.
const AZIMUTHS: usize = 64;

/// A light that adds less than this share of black to every view is left out of a texel.
const UNSEEN: f32 = 1e-3;

/// rho_hat over [angle, azimuth, channel, row of views].
pub(super) struct LightTable {
    angles: Vec<f64>,
    values: Vec<f32>,
    /// The largest value of each angle.
    largest: Vec<f32>,
    /// The number of azimuths of an angle: 1 if the material does not depend on it.
    azimuths: usize,
}

impl LightTable {
    pub(super) fn new(lamps: &Lamps, views: &ViewGrid) -> Self {
        let angles = angles(2e-4, 0.08, 0.03);
        let azimuths = if views.orders() == 0 { 1 } else { AZIMUTHS + 1 };
        let (centre, turns) = (lamps.material.centre(), lamps.material.turns());
        let of_azimuth = |azimuth: usize| {
            let phi = PI * azimuth as f64 / AZIMUTHS as f64;
            views.rows.iter().map(move |row| centre.toward(Direction::from_angles(row.0, phi)))
        };
        let seen: Vec<SurfaceView> = (0..azimuths).flat_map(of_azimuth).collect();
        let slice = |angle: &f64| -> Vec<f32> {
            let incident = Direction::from_angles(*angle, 0.0);
            let mut slice = Vec::with_capacity(azimuths * 3 * views.rows.len());
            for seen in seen.chunks_exact(views.rows.len()) {
                let value = |view: &SurfaceView| {
                    lamps.material.mean_over_turns(turns, view.incident(incident), view.outgoing())
                };
                let values: Vec<[f64; 3]> = seen.iter().map(value).collect();
                for channel in 0..3 {
                    slice.extend(values.iter().map(|value| value[channel] as f32));
                }
            }
            slice
        };
        let slices: Vec<Vec<f32>> = angles.par_iter().map(slice).collect();
        let largest = slices.iter().map(|slice| slice.iter().copied().fold(0.0, f32::max)).collect();
        Self { angles, values: slices.concat(), largest, azimuths }
    }

    /// The node below an azimuth, and the part of the step to the next.
    fn step(&self, azimuth: f64) -> (usize, f32) {
        if self.azimuths == 1 {
            return (0, 0.0);
        }
        let folded = azimuth.rem_euclid(2.0 * PI);
        let place = folded.min(2.0 * PI - folded) / PI * AZIMUTHS as f64;
        let step = (place as usize).min(AZIMUTHS - 1);
        (step, (place - step as f64) as f32)
    }
}

/// The light of a texel's lamps, to be added to a lane of every view.
pub(super) struct AddLights<'a> {
    pub(super) table: &'a LightTable,
    /// The lamps in the texel's own frame.
    pub(super) lights: &'a [LocalLight],
    /// The radiance e below which a value counts as black.
    pub(super) dark: f32,
    pub(super) views: &'a ViewGrid,
    pub(super) lane: usize,
    pub(super) lit: &'a mut [Vec<F32x8>; 3],
}

impl WithSimd for AddLights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { table, lights, dark, views, lane, lit } = self;
        let (rows, azimuths) = (views.rows.len(), views.quarter.len() * MIRRORED);
        let count = table.azimuths * 3 * rows;
        let mut sums = vec![0.0; azimuths * 3 * rows];
        for light in lights {
            let (k, share) = place(&table.angles, light.direction.theta());
            let flux = light.flux.map(|flux| flux as f32);
            let strongest = flux.iter().fold(0.0, |most: f32, flux| most.max(*flux));
            if strongest * table.largest[k].max(table.largest[k + 1]) < UNSEEN * dark {
                continue;
            }
            let (share, turn) = (share as f32, light.direction.phi());
            let of_azimuths = (0..views.quarter.len()).flat_map(|j| views.azimuths(j));
            for (azimuth, sums) in of_azimuths.zip(sums.chunks_exact_mut(3 * rows)) {
                let (step, part) = table.step(azimuth - turn);
                let next = (step + 1).min(table.azimuths - 1);
                let nodes = [(k, step), (k, next), (k + 1, step), (k + 1, next)];
                let [a, b, c, d] =
                    nodes.map(|(k, step)| &table.values[k * count + step * 3 * rows..][..3 * rows]);
                for channel in 0..3 {
                    let of_channel = channel * rows..(channel + 1) * rows;
                    let [a, b, c, d] = [a, b, c, d].map(|values| &values[of_channel.clone()]);
                    let [near, far] = [1.0 - share, share].map(|share| flux[channel] * share);
                    let weights = [near * (1.0 - part), near * part, far * (1.0 - part), far * part];
                    for (row, sum) in sums[of_channel].iter_mut().enumerate() {
                        *sum += weights[0] * a[row] + weights[1] * b[row];
                        *sum += weights[2] * c[row] + weights[3] * d[row];
                    }
                }
            }
        }
        for (azimuth, sums) in sums.chunks_exact(3 * rows).enumerate() {
            for (channel, sums) in sums.chunks_exact(rows).enumerate() {
                for (row, sum) in sums.iter().enumerate() {
                    lit[channel][row * azimuths + azimuth].0[lane] += sum;
                }
            }
        }
    }
}
