//! The suns and lamps beside a reflected field, and the material that reflects them.
//!
//! A field cut at degrees F and P rings around the reflection of a small bright light. So such lights are not
//! in it: whoever can evaluate the material adds
//!
//! > sum over the lights of flux times rho_hat(direction of the light, V),
//!
//! and for readers that cannot, [`Reflection::bake`](crate::Reflection::bake) puts them into the map.

use brdf::Material;
use rayon::prelude::*;
use sh::Light;
use sphere::{DMat3, Direction};

use crate::mean_lobe::MeanLobe;
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
        let lobe = MeanLobe::plain(&self.material, plain);
        let lights = lobe.of(&self.lights);
        let value = |texel: usize| lights.radiance(grid.direction(texel)).map(|value| value as f32);
        (0..grid.len()).into_par_iter().map(value).collect()
    }

    /// The look-up of a soft field with the lamps added; what a cut left below zero is black.
    pub fn added(&self, soft: [f32; 3], central: Direction, view: Direction) -> [f32; 3] {
        let lamps = self.radiance(central, view);
        std::array::from_fn(|channel| soft[channel].max(0.0) + lamps[channel] as f32)
    }
}
