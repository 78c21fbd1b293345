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

use std::f64::consts::{FRAC_PI_2, PI};

use brdf::{Centre, LightSum, Material};
use rayon::prelude::*;
use sh::{Light, POINT};
use sphere::{DMat3, DVec3, Direction};

use crate::mean_lobe::{DiskMeans, MeanLobe};
use crate::plain::Plain;
use crate::{MapGrid, frame, into_frame};

/// Lights, and the material that reflects them.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamps {
    /// The lights.
    pub lights: Vec<Light>,
    /// The material that reflects the lights.
    pub material: Material,
}

/// A point of a light in the frame of a central direction.
pub(crate) struct LocalLight {
    pub(crate) direction: Direction,
    pub(crate) flux: [f64; 3],
}

/// Lamps for many views: the points of each, coarse for views that are far from its highlight.
#[derive(Debug)]
pub struct LampPoints<'a> {
    material: &'a Material,
    turns: usize,
    width: f64,
    /// Whether lamps below the horizon add nothing.
    has_horizon: bool,
    lamps: Vec<LampLevels>,
}

/// The points of one lamp.
#[derive(Debug)]
pub struct LampLevels {
    /// The lamp.
    pub light: Light,
    /// The lamp's irradiance of a surface that faces it, per channel.
    pub flux: [f64; 3],
    /// The lamp's centre alone.
    centre: [(Direction, f64); 1],
    /// The points for features of the highlight's width, of twice that, and so on: directions with their
    /// shares of the flux.
    pub levels: Vec<Vec<(Direction, f64)>>,
    /// The squares of the distances between the lamp's centre and the mirror image of the view from which on
    /// the centre is enough, and from which on each level is.
    centre_from: f64,
    levels_from: Vec<f64>,
    /// The height of the lamp's centre above the horizon from which on all of the lamp is seen.
    whole_from: f64,
}

/// The most points of all lamps together, where each view is to see the same ones.
const MOST_POINTS: usize = 1024;

/// Features of what a surface reflects are not wider than this, in radians: its cosine has them.
pub(crate) const WIDEST: f64 = 0.5;

/// A lamp whose centre is lower than its radius, by this much more than rounding moves its points, is below
/// the horizon.
const ROUNDING: f64 = 1e-9;

/// At a distance from the highlight's peak, features are as wide as this share of it: the tails of GGX fall
/// with the fourth power.
pub(crate) const TAIL: f64 = 0.2;

impl Lamps {
    /// The radiance of the lights alone toward `view`, in the world's frame, from a surface whose central
    /// direction is `central`. For many views, [`Lamps::for_views`] has the points once.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        self.for_views().radiance(central, view)
    }

    /// Prepares the points of the lights for many views.
    pub fn for_views(&self) -> LampPoints<'_> {
        let width = self.material.highlight_width();
        let levels = |light: &Light| {
            let widths = std::iter::successors(Some(width), |width| Some(2.0 * width));
            let mut levels: Vec<Vec<(Direction, f64)>> = Vec::new();
            for width in widths.take_while(|other| *other <= WIDEST.max(width)) {
                let points = light.points(width);
                let is_least = levels.last().is_some_and(|finer| finer.len() == points.len());
                levels.push(points);
                // A narrow highlight on a strand is a cone, about which this knows nothing.
                if is_least || self.material.centre() == Centre::Tangent {
                    break;
                }
            }
            // A feature is as wide as this at some distance, or nowhere.
            let from = |feature: f64| match feature / TAIL + light.radius {
                away if feature <= WIDEST && away <= PI => math::powi(2.0 * math::sin(0.5 * away), 2),
                _ => f64::INFINITY,
            };
            let levels_from = (0..levels.len()).map(|level| from(width * math::powi(2.0, level as i32)));
            LampLevels {
                light: *light,
                flux: light.flux(),
                centre: [(light.direction, 1.0)],
                centre_from: from(light.radius / POINT),
                levels_from: levels_from.collect(),
                whole_from: math::sin(light.radius.min(FRAC_PI_2)),
                levels,
            }
        };
        let lamps = self.lights.par_iter().map(levels).collect();
        let (material, turns) = (&self.material, self.material.turns());
        LampPoints { material, turns, width, has_horizon: material.has_horizon(), lamps }
    }

    /// The points of all lights, with the flux of each: the same for every view, and some thousand at most.
    /// If that is too few for a sharp highlight, they are further apart than [`Light::points`] promises.
    pub fn points(&self) -> Vec<(Direction, [f64; 3])> {
        let mut width = self.material.highlight_width();
        loop {
            let of_light = |light: &Light| {
                let flux = light.flux();
                let point = move |(direction, share)| (direction, flux.map(|flux| flux * share));
                light.points(width).into_iter().map(point)
            };
            let points: Vec<_> = self.lights.iter().flat_map(of_light).collect();
            if points.len() <= MOST_POINTS || width > WIDEST {
                return points;
            }
            width *= 1.25;
        }
    }

    /// The radiance of lights that [`in_frame`] gives, toward a view in the frame of their central direction.
    pub(crate) fn seen(&self, lights: &[LocalLight], outgoing: Direction) -> [f64; 3] {
        let surface = self.material.centre().surface_frame(outgoing);
        let view = Direction::normalised(surface * outgoing.vector());
        let mut sum = LightSum::turned(&self.material, self.material.turns(), view, surface);
        for light in lights {
            sum.add(light.direction, light.flux);
        }
        sum.total()
    }

    /// The light that the lamps add to a plain reflection map, at each of its texels: in the mean over all
    /// views or head on, as [`crate::Reflection::plain`] has the rest.
    pub fn plain(&self, plain: Plain, grid: MapGrid) -> Vec<[f32; 3]> {
        self.plain_over(plain, grid, &DiskMeans::new(&self.lights))
    }

    /// [`Lamps::plain`] with the means over the disks of the lights.
    pub fn plain_over(&self, plain: Plain, grid: MapGrid, disks: &DiskMeans) -> Vec<[f32; 3]> {
        let lights = MeanLobe::plain(&self.material, plain).over(&self.lights, disks);
        let value = |texel: usize| lights.radiance(grid.direction(texel)).map(|value| value as f32);
        (0..grid.len()).into_par_iter().map(value).collect()
    }
}

impl LampPoints<'_> {
    /// The lamps, for a shader that chooses among their points as [`LampPoints::radiance`] does, by
    /// [`LampPoints::choice`].
    pub fn lamps(&self) -> &[LampLevels] {
        &self.lamps
    }

    /// What points are chosen by: the width of the highlight in radians; the width of a feature of what the
    /// surface reflects, as a share of its distance from the highlight's peak, and its maximum in radians;
    /// and the radius of a lamp that is seen as a point, as a share of a feature's width ([`POINT`]).
    pub fn choice(&self) -> [f64; 4] {
        [self.width, TAIL, WIDEST, POINT]
    }

    /// The radiance of the lights alone: see [`Lamps::radiance`].
    pub fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        let (into_local, outgoing) = (frame(central).matrix().transpose(), into_frame(central, view));
        let surface = self.material.centre().surface_frame(outgoing);
        let (into_surface, view) = (surface * into_local, surface * outgoing.vector());
        let mirrored = DVec3::new(-view.x, -view.y, view.z);
        let mut sum = LightSum::turned(self.material, self.turns, Direction::normalised(view), into_surface);
        for lamp in &self.lamps {
            let centre = into_surface * lamp.light.direction.vector();
            if self.has_horizon && centre.z < -lamp.whole_from - ROUNDING {
                continue;
            }
            for (direction, share) in lamp.points(centre, mirrored) {
                sum.add(*direction, lamp.flux.map(|flux| flux * share));
            }
        }
        sum.total()
    }

    /// The radiance of the lights alone toward `view` from a surface that may be brushed: `frame` has its
    /// tangent, N x tangent and its normal N as columns, in the world. The points of a light are the finest
    /// everywhere, because a streak is narrow far from the highlight's peak too.
    pub fn surface_radiance(&self, frame: DMat3, view: Direction) -> [f64; 3] {
        let to_surface = frame.transpose();
        let view = Direction::normalised(to_surface * view.vector());
        let mut sum = LightSum::turned(self.material, 1, view, to_surface);
        for lamp in &self.lamps {
            let height = frame.z_axis.dot(lamp.light.direction.vector());
            if self.has_horizon && height < -lamp.whole_from - ROUNDING {
                continue;
            }
            for (direction, share) in lamp.levels.first().into_iter().flatten() {
                sum.add(*direction, lamp.flux.map(|flux| flux * share));
            }
        }
        sum.total()
    }

    /// The look-up of a soft field with the lamps added; what a cut left below zero is black.
    pub fn added(&self, soft: [f32; 3], central: Direction, view: Direction) -> [f32; 3] {
        let lamps = self.radiance(central, view);
        std::array::from_fn(|channel| soft[channel].max(0.0) + lamps[channel] as f32)
    }
}

impl LampLevels {
    /// The points that a surface sees, with their shares of the flux: `centre` is the direction of the lamp's
    /// centre and `mirrored` the mirror image of the view, both in the surface's frame. They are dense enough
    /// for the features of what is reflected there: those whose width is a fifth of the distance from the
    /// lamp's edge, but at most half a radian.
    pub fn points(&self, centre: DVec3, mirrored: DVec3) -> &[(Direction, f64)] {
        let [finest, others @ ..] = self.levels.as_slice() else { return &[] };
        if others.is_empty() {
            return finest;
        }
        let distance = centre.distance_squared(mirrored);
        if distance >= self.centre_from && centre.z.abs() > self.whole_from {
            return &self.centre;
        }
        let wide = self.levels_from[1..].iter().take_while(|from| distance >= **from).count();
        &self.levels[wide]
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

#[cfg(test)]
mod tests {
    use sphere::spiral;

    use super::*;

    #[test]
    fn lamps_below_the_horizon_are_passed_by_to_the_bit() {
        let light = |k: usize| Light::from_flux(spiral(k, 40), 0.01 * k as f64, [1.0, 0.5, 0.1 * k as f64]);
        for material in Material::examples().unwrap() {
            let lamps = Lamps { lights: (0..40).map(light).collect(), material };
            let some = lamps.for_views();
            let all = LampPoints { has_horizon: false, ..lamps.for_views() };
            for k in 0..20 {
                let (central, view) = (spiral(k, 20), spiral((7 * k) % 20, 20));
                assert_eq!(some.radiance(central, view), all.radiance(central, view));
                let surface = frame(central).matrix();
                assert_eq!(some.surface_radiance(surface, view), all.surface_radiance(surface, view));
            }
        }
    }
}
