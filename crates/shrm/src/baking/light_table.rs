//! rho_hat at the views of a grid, tabulated by the angle between light and central direction.
//!
//! All lights and texels share one table: about its central direction, an isotropic material depends on the
//! light's angle and on the azimuth between light and view alone. Between the nodes it is interpolated.

use std::f64::consts::PI;

use rayon::prelude::*;
use sphere::Direction;

use super::solver::F32x8;
use super::view_grid::{MIRRORED, ViewGrid};
use crate::lamps::{Lamps, LocalLight, angles, place};

/// Nodes of the azimuth over half a turn, besides the first.
const AZIMUTHS: usize = 64;

/// A light that adds less than this share of black to every view is left out of a texel.
const UNSEEN: f32 = 1e-3;

/// rho_hat over [angle, row of views, azimuth].
pub(super) struct LightTable {
    angles: Vec<f64>,
    values: Vec<[f32; 3]>,
    /// The largest value of each angle.
    largest: Vec<f32>,
    /// Azimuths of a row: 1 if the material does not depend on it.
    azimuths: usize,
}

impl LightTable {
    pub(super) fn new(lamps: &Lamps, views: &ViewGrid) -> Self {
        let angles = angles(2e-4, 0.08, 0.03);
        let azimuths = if views.orders() == 0 { 1 } else { AZIMUTHS + 1 };
        let slice = |angle: &f64| -> Vec<[f32; 3]> {
            let incident = Direction::from_angles(*angle, 0.0);
            let value = |theta: f64, azimuth: usize| {
                let phi = PI * azimuth as f64 / AZIMUTHS as f64;
                let view = Direction::from_angles(theta, phi);
                lamps.material.rho_hat_about_centre(incident, view).map(|value| value as f32)
            };
            views
                .rows
                .iter()
                .flat_map(|(theta, _)| (0..azimuths).map(move |azimuth| value(*theta, azimuth)))
                .collect()
        };
        let slices: Vec<Vec<[f32; 3]>> = angles.par_iter().map(slice).collect();
        let largest = slices
            .iter()
            .map(|slice| slice.as_flattened().iter().fold(0.0, |most: f32, value| most.max(*value)));
        let largest = largest.collect();
        Self { angles, values: slices.concat(), largest, azimuths }
    }

    /// Adds the light of a texel's lamps, in its own frame, to a lane of every view.
    pub(super) fn add(
        &self,
        lights: &[LocalLight],
        dark: f32,
        views: &ViewGrid,
        lane: usize,
        lit: &mut [Vec<F32x8>; 3],
    ) {
        let count = views.rows.len() * self.azimuths;
        for light in lights {
            let (k, share) = place(&self.angles, light.direction.theta());
            let flux = light.flux.map(|flux| flux as f32);
            let strongest = flux.iter().fold(0.0, |most: f32, flux| most.max(*flux));
            if strongest * self.largest[k].max(self.largest[k + 1]) < UNSEEN * dark {
                continue;
            }
            let [below, above] = [k, k + 1].map(|k| &self.values[k * count..][..count]);
            let share = share as f32;
            let at = |index: usize| -> [f32; 3] {
                std::array::from_fn(|c| {
                    flux[c] * (below[index][c] + share * (above[index][c] - below[index][c]))
                })
            };
            for (j, azimuths) in (0..views.quarter.len()).map(|j| (j, views.azimuths(j))) {
                for (mirrored, azimuth) in azimuths.into_iter().enumerate() {
                    let (step, part) = self.step(azimuth - light.direction.phi());
                    for row in 0..views.rows.len() {
                        let first = row * self.azimuths + step;
                        let mut value = at(first);
                        if part > 0.0 {
                            let next = at(first + 1);
                            (0..3).for_each(|c| value[c] += part * (next[c] - value[c]));
                        }
                        let view = (row * views.quarter.len() + j) * MIRRORED + mirrored;
                        (0..3).for_each(|channel| lit[channel][view].0[lane] += value[channel]);
                    }
                }
            }
        }
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
