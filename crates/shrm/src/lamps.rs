//! The suns and lamps beside a reflected field, and the material that reflects them.
//!
//! A field cut at degrees F and P rings around the reflection of a small bright light. So such lights are not
//! in it: whoever can evaluate the material adds
//!
//! > sum over the lights of flux times rho_hat(direction of the light, V),
//!
//! and for readers that cannot, [`Reflection::bake`](crate::Reflection::bake) puts them into the map.

use std::f64::consts::{PI, TAU};

use brdf::{Centre, Material};
use rayon::prelude::*;
use sh::Light;
use sphere::{DMat3, Direction};

use crate::plain::Plain;
use crate::{MapGrid, frame, into_frame};

/// Lights, and the material that reflects them.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamps {
    /// The lights.
    pub lights: Vec<Light>,
    /// What reflects them.
    pub material: Material,
}

/// Light in the frame of a central direction, or of the world.
pub(crate) struct LocalLight {
    pub(crate) direction: Direction,
    pub(crate) flux: [f64; 3],
}

impl Lamps {
    /// The radiance of the lights alone toward `view`, in the world's frame, from a surface whose central
    /// direction is `central`.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        let (into_local, outgoing) = (frame(central).matrix().transpose(), into_frame(central, view));
        let surface = self.material.centre().surface_frame(outgoing);
        let (into_surface, view) = (surface * into_local, Direction::normalised(surface * outgoing.vector()));
        let mut sum = [0.0; 3];
        for light in &self.lights {
            let incident = Direction::normalised(into_surface * light.direction.vector());
            let (rho, flux) = (self.material.rho_hat(incident, view), light.flux());
            (0..3).for_each(|channel| sum[channel] += flux[channel] * rho[channel]);
        }
        sum
    }

    /// The lights in the frame of a central direction.
    pub(crate) fn about(&self, central: Direction) -> Vec<LocalLight> {
        let world: DMat3 = frame(central).matrix().transpose();
        let local = |light: &Light| LocalLight {
            direction: Direction::normalised(world * light.direction.vector()),
            flux: light.flux(),
        };
        self.lights.iter().map(local).collect()
    }

    /// Their radiance toward a view in that frame.
    pub(crate) fn seen(&self, lights: &[LocalLight], outgoing: Direction) -> [f64; 3] {
        let surface = self.material.centre().surface_frame(outgoing);
        let into_surface = |direction: Direction| Direction::normalised(surface * direction.vector());
        let view = into_surface(outgoing);
        let mut sum = [0.0; 3];
        for light in lights {
            let rho = self.material.rho_hat(into_surface(light.direction), view);
            (0..3).for_each(|channel| sum[channel] += light.flux[channel] * rho[channel]);
        }
        sum
    }

    /// What the lights add to a plain reflection map, at each of its texels: in the mean over all views or
    /// head on, as [`crate::Reflection::plain`] has the rest.
    pub fn plain(&self, plain: Plain, grid: MapGrid) -> Vec<[f32; 3]> {
        let light = self.mean(plain);
        let value = |texel: usize| light.radiance(grid.direction(texel)).map(|value| value as f32);
        (0..grid.len()).into_par_iter().map(value).collect()
    }

    /// The lights in the mean over the views that a plain map stands for.
    pub(crate) fn mean(&self, plain: Plain) -> MeanLight {
        let views = plain_views(self.material.centre(), plain);
        MeanLight { profile: Profile::new(&self.material, &views), lights: self.fluxes() }
    }

    /// The lights in the mean over all views at an angle theta_o from the central direction.
    pub(crate) fn ring(&self, theta: f64) -> MeanLight {
        let views: Vec<_> =
            graded(AZIMUTHS).map(|(phi, share)| (Direction::from_angles(theta, phi), share)).collect();
        MeanLight { profile: Profile::new(&self.material, &views), lights: self.fluxes() }
    }

    /// The lights' directions and fluxes.
    fn fluxes(&self) -> Vec<LocalLight> {
        let light = |light: &Light| LocalLight { direction: light.direction, flux: light.flux() };
        self.lights.iter().map(light).collect()
    }

    /// The look-up of a soft field with the lamps added; what a cut left below zero is black.
    pub(crate) fn added(&self, soft: [f32; 3], central: Direction, view: Direction) -> [f32; 3] {
        let lamps = self.radiance(central, view);
        std::array::from_fn(|channel| soft[channel].max(0.0) + lamps[channel] as f32)
    }
}

/// Lights in the mean over some views about the central direction.
pub(crate) struct MeanLight {
    profile: Profile,
    lights: Vec<LocalLight>,
}

impl MeanLight {
    /// Their radiance from a surface with this central direction.
    pub(crate) fn radiance(&self, central: Direction) -> [f64; 3] {
        self.profile.lit(&self.lights, central)
    }
}

/// Angles from the central direction, dense about it: steps of `share` of the angle, from `least` to `most`.
pub(crate) fn angles(least: f64, share: f64, most: f64) -> Vec<f64> {
    let mut angles = vec![0.0];
    let mut angle: f64 = 0.0;
    while angle < PI {
        angle = (angle + (share * angle).clamp(least, most)).min(PI);
        angles.push(angle);
    }
    angles
}

/// The index k and the share of an angle between two of a table's angles k and k + 1.
pub(crate) fn place(angles: &[f64], angle: f64) -> (usize, f64) {
    let k = angles.partition_point(|node| *node <= angle).clamp(1, angles.len() - 1) - 1;
    (k, ((angle - angles[k]) / (angles[k + 1] - angles[k])).clamp(0.0, 1.0))
}

/// Azimuths of views over half a turn.
const AZIMUTHS: usize = 40;

/// Rows of the views of a mean.
const ROWS: usize = 64;

/// Nodes from 0 to pi and their weights, which sum to 1: closer together toward both ends, where highlights
/// of grazing views are narrow.
fn graded(count: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
    (0..count).map(move |j| {
        let turn = TAU * (j as f64 + 0.5) / count as f64;
        (0.5 * (turn - turn.sin()), (1.0 - turn.cos()) / count as f64)
    })
}

/// The views that a plain map stands for and their weights, which sum to 1: as `plain.rs` has them.
fn plain_views(centre: Centre, plain: Plain) -> Vec<(Direction, f64)> {
    let ring = |theta: f64, weight: f64| {
        graded(AZIMUTHS).map(move |(phi, share)| (Direction::from_angles(theta, phi), weight * share))
    };
    match (plain, centre) {
        (Plain::HeadOn, Centre::Tangent) => ring(PI / 2.0, 1.0).collect(),
        (Plain::HeadOn, _) => vec![(Direction::Z, 1.0)],
        (Plain::Mean, Centre::Normal) => {
            // The half turn of the nodes as the quarter turn of theta_o.
            let rows = graded(ROWS).map(|(angle, weight)| (angle / 2.0, weight * angle.sin()));
            normalised(rows.collect()).into_iter().flat_map(|(theta, weight)| ring(theta, weight)).collect()
        }
        (Plain::Mean, centre) => {
            let power = if centre == Centre::Tangent { 2 } else { 1 };
            let rows = graded(ROWS).map(|(theta, weight)| (theta, weight * theta.sin().powi(power)));
            normalised(rows.collect()).into_iter().flat_map(|(theta, weight)| ring(theta, weight)).collect()
        }
    }
}

/// The same with weights that sum to 1.
fn normalised(rows: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let sum: f64 = rows.iter().map(|row| row.1).sum();
    rows.into_iter().map(|(theta, weight)| (theta, weight / sum)).collect()
}

/// The mean of rho_hat over some views, by the angle between light and central direction: linear between
/// nodes in the sine of half that angle, which is half the distance of both.
struct Profile {
    sines: Vec<f64>,
    values: Vec<[f64; 3]>,
    /// The last node at or before k / [`BUCKETS`], squared.
    before: Vec<usize>,
}

/// Parts of the square root of the sine, each of which has a node or two.
const BUCKETS: usize = 1024;

impl Profile {
    /// For views of half a turn of azimuths: the other half is its mirror image.
    fn new(material: &Material, views: &[(Direction, f64)]) -> Self {
        let angles = angles(1e-4, 0.04, 0.02);
        let value = |angle: &f64| {
            let incident = Direction::from_angles(*angle, 0.0);
            let mut sum = [0.0; 3];
            for (view, weight) in views {
                let rho = material.rho_hat_about_centre(incident, *view);
                (0..3).for_each(|channel| sum[channel] += weight * rho[channel]);
            }
            sum
        };
        let values = angles.par_iter().map(value).collect();
        let sines: Vec<f64> = angles.iter().map(|angle| (angle / 2.0).sin()).collect();
        let bucket = |k: usize| (k as f64 / BUCKETS as f64).powi(2);
        let before = (0..=BUCKETS).map(|k| sines.partition_point(|sine| *sine <= bucket(k)) - 1).collect();
        Self { sines, values, before }
    }

    /// The lights' radiance in the mean, from a surface whose central direction is `central`.
    fn lit(&self, lights: &[LocalLight], central: Direction) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for light in lights {
            let rho = self.at(0.5 * central.vector().distance(light.direction.vector()));
            (0..3).for_each(|channel| sum[channel] += light.flux[channel] * rho[channel]);
        }
        sum
    }

    fn at(&self, sine: f64) -> [f64; 3] {
        let mut k = self.before[((sine.sqrt() * BUCKETS as f64) as usize).min(BUCKETS)];
        while k + 2 < self.sines.len() && self.sines[k + 1] <= sine {
            k += 1;
        }
        k = k.min(self.sines.len() - 2);
        let share = ((sine - self.sines[k]) / (self.sines[k + 1] - self.sines[k])).clamp(0.0, 1.0);
        let [a, b] = [self.values[k], self.values[k + 1]];
        std::array::from_fn(|channel| a[channel] + share * (b[channel] - a[channel]))
    }
}
