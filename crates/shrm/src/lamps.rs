//! The suns and lamps beside a reflected field, and the material that reflects them.
//!
//! A field cut at degrees F and P rings around the reflection of a small bright light. So such lights are not
//! in it: whoever can evaluate the material adds
//!
//! > sum over the lights of flux times the mean of rho_hat(w, V) over the directions w of the disk,
//!
//! as a sum over a few of its points ([`sh::Light::points`]): one for a sun, more for a lamp that is large
//! beside the material's highlight. A map is looked up without the tangent, so that an anisotropic material
//! is taken in the mean over all turns of the surface here, as in the field
//! ([`brdf::Material::mean_over_turns`]).
//!
//! For readers that cannot, [`Reflection::bake`](crate::Reflection::bake) puts them into the map.

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

/// A point of a light in the frame of a central direction.
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
        let (turns, mut sum) = (self.material.turns(), [0.0; 3]);
        for (direction, flux) in self.points() {
            let incident = Direction::normalised(into_surface * direction.vector());
            let rho = self.material.mean_over_turns(turns, incident, view);
            (0..3).for_each(|channel| sum[channel] += flux[channel] * rho[channel]);
        }
        sum
    }

    /// The points of all lights, with the flux of each.
    pub fn points(&self) -> Vec<(Direction, [f64; 3])> {
        let width = self.material.highlight_width();
        let of_light = |light: &Light| {
            let flux = light.flux();
            let point = move |(direction, share)| (direction, flux.map(|flux| flux * share));
            light.points(width).into_iter().map(point)
        };
        self.lights.iter().flat_map(of_light).collect()
    }

    /// The points of the lights in the frame of a central direction.
    pub(crate) fn about(&self, central: Direction) -> Vec<LocalLight> {
        in_frame(&self.points(), central)
    }

    /// Their radiance toward a view in that frame.
    pub(crate) fn seen(&self, lights: &[LocalLight], outgoing: Direction) -> [f64; 3] {
        let surface = self.material.centre().surface_frame(outgoing);
        let into_surface = |direction: Direction| Direction::normalised(surface * direction.vector());
        let view = into_surface(outgoing);
        let (turns, mut sum) = (self.material.turns(), [0.0; 3]);
        for light in lights {
            let rho = self.material.mean_over_turns(turns, into_surface(light.direction), view);
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

/// Points of lights in the frame of a central direction.
pub(crate) fn in_frame(points: &[(Direction, [f64; 3])], central: Direction) -> Vec<LocalLight> {
    let world: DMat3 = frame(central).matrix().transpose();
    let local = |(direction, flux): &(Direction, [f64; 3])| LocalLight {
        direction: Direction::normalised(world * direction.vector()),
        flux: *flux,
    };
    points.iter().map(local).collect()
}
