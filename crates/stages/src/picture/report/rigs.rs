//! Light rigs in a report: what a sphere loses if a few lights shine in place of the environment.
//!
//! The lights are those of `sample-light`, and each shines from one direction, as directional lights of a
//! renderer do. The sphere is brushed along +Z, projected into the surface.

use std::num::NonZeroU32;

use brdf::Material;
use engine::{Failure, Steps};
use envmap::{ToneMap, to_srgb8};
use rayon::prelude::*;
use sampling::{Error, Irradiance, LightMasses, Method, rig};
use sh::Light;
use sphere::{DMat3, Direction};

use crate::picture::report::figures::{RigFigures, RigMethod, RigSphere, RigSpheres, Settings};
use crate::picture::report::lit::{Lit, brute_force};
use crate::picture::report::rig_pictures::{LIGHTS, PICTURE, RigPictures, SHOWN};
use crate::picture::report::sphere::{Lattice, Sphere};

/// The figures and pictures of named materials under every environment. It takes a step for each pair.
pub(crate) fn study(
    lit: &[&Lit<'_>],
    materials: &[(String, &Material)],
    settings: &Settings,
    steps: &Steps<'_>,
) -> Result<(Vec<RigFigures>, Vec<RigPictures>), Failure> {
    let studied = lit.iter().map(|lit| under(lit, materials, settings, steps));
    Ok(studied.collect::<Result<Vec<_>, Failure>>()?.into_iter().unzip())
}

/// A rig of the lights of an environment.
struct Rig {
    method: RigMethod,
    asked: u32,
    irradiance: f64,
    lights: Vec<Light>,
}

/// The rigs of an environment; a black one has no lights.
fn rigs(lit: &Lit<'_>) -> Result<Vec<Rig>, Failure> {
    let masses = match LightMasses::of_environment(lit.environment) {
        Ok(masses) => Some(masses),
        Err(Error::NoMass) => None,
        Err(error) => return Err(error.into()),
    };
    let irradiance = masses.as_ref().map(Irradiance::of);
    let made = |method: RigMethod, count: u32| {
        let lights = match (&masses, NonZeroU32::new(count)) {
            (Some(masses), Some(count)) => rig(masses, count, method.method()),
            _ => Vec::new(),
        };
        let error = irradiance.as_ref().map_or(0.0, |irradiance| irradiance.error(&lights));
        Rig { method, asked: count, irradiance: error, lights }
    };
    let all = RigMethod::ALL.into_iter().flat_map(|method| LIGHTS.map(|count| (method, count)));
    Ok(all.map(|(method, count)| made(method, count)).collect())
}

impl RigMethod {
    fn method(self) -> Method {
        match self {
            Self::MedianCut => Method::MedianCut,
            Self::Warped => Method::Warped,
        }
    }
}

fn under(
    lit: &Lit<'_>,
    materials: &[(String, &Material)],
    settings: &Settings,
    steps: &Steps<'_>,
) -> Result<(RigFigures, RigPictures), Failure> {
    let rigs = rigs(lit)?;
    let sphere = Sphere::new(settings.sphere);
    let axes = sphere.brushed();
    let shown = |values: &[[f32; 3]]| sphere.picture(&to_srgb8(values, lit.exposure, ToneMap::Filmic));
    let mut figures = RigFigures { environment: lit.name.clone(), materials: Vec::new() };
    let mut pictures = RigPictures { lights: light_pictures(lit, &rigs)?, spheres: Vec::new() };
    for (name, material) in materials {
        let truth = brute_force(lit, material, &axes, steps)?;
        let (mut found, mut spheres) = (Vec::new(), Vec::new());
        for rig in &rigs {
            let values = shade(material, &axes, &rig.lights);
            found.push(RigSphere {
                method: rig.method,
                asked: rig.asked,
                lights: rig.lights.len(),
                irradiance: rig.irradiance,
                errors: sphere.errors(&values, &truth, lit.dark, Lattice::ALL),
            });
            if rig.method == SHOWN {
                spheres.push(shown(&values));
            }
        }
        spheres.push(shown(&truth));
        figures.materials.push(RigSpheres { material: name.clone(), spheres: found });
        pictures.spheres.push(spheres);
    }
    Ok((figures, pictures))
}

/// The radiance that each surface shows of lights, each from one direction.
fn shade(material: &Material, axes: &[DMat3], lights: &[Light]) -> Vec<[f32; 3]> {
    let pixel = |axes: &DMat3| {
        let local = |w: Direction| Direction::normalised(axes.transpose() * w.vector());
        let view = local(Sphere::view());
        let mut sum = [0.0; 3];
        for light in lights {
            let rho_hat = material.rho_hat(local(light.direction), view);
            (0..3).for_each(|channel| sum[channel] += rho_hat[channel] * light.irradiance[channel]);
        }
        sum.map(|value| value as f32)
    };
    axes.par_iter().map(pixel).collect()
}

/// The environment with a cross at each light of each rig that is shown, and without.
fn light_pictures(lit: &Lit<'_>, rigs: &[Rig]) -> Result<Vec<Vec<[u8; 3]>>, Failure> {
    let environment = lit.environment.resized(PICTURE)?;
    let plain = to_srgb8(environment.pixels(), lit.exposure, ToneMap::Filmic);
    let crossed = |rig: &Rig| {
        let mut picture = plain.clone();
        for light in &rig.lights {
            let (column, row) = PICTURE.position(light.direction);
            let (column, row) = (column.round() as isize, row.round() as isize);
            for (dx, dy) in [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)] {
                let x = (column + dx).rem_euclid(PICTURE.width.cast_signed());
                let y = (row + dy).clamp(0, PICTURE.height.cast_signed() - 1);
                picture[y.cast_unsigned() * PICTURE.width + x.cast_unsigned()] = [255, 64, 32];
            }
        }
        picture
    };
    let shown = rigs.iter().filter(|rig| rig.method == SHOWN);
    Ok(shown.map(crossed).chain([plain.clone()]).collect())
}
