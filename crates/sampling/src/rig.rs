//! Light rigs: a few lights in place of distant light.
//!
//! The texels of a [`LightMasses`] are divided into regions, and each region becomes one [`Light`]: a disk
//! with the flux of its region, the integral of radiance over it, per channel. So the lights together have
//! the whole flux. With m the integral of w L(w) over the region and E that of L(w), in the mean of the
//! channels, the disk looks along m, and its radius a is that of a disk of constant radiance with the same
//! |m| / E:
//!
//! > |m| / E = (1 + cos a) / 2
//!
//! Then the irradiance of every surface that sees the whole region is exact, because it is n . m, and a
//! region whose light comes from one bright spot has a disk of that spot's size. At most a is pi / 2.
//!
//! - [`Method::MedianCut`] (Debevec 2005, "A median cut algorithm for light probe sampling"): the region with
//!   the greatest flux is cut into two of equal flux, across its longer side on the sphere, until there are
//!   enough. If their number is a power of two, the cuts of a smooth light are Debevec's.
//! - [`Method::Warped`]: Hammersley's points are mapped by the inverse of the distribution of rows, then of
//!   that within each row, so that they lie as densely as there is light. A region is all that is nearest to
//!   one point.

mod masses;
mod median_cut;
mod warped;

use std::f64::consts::PI;
use std::num::NonZeroU32;

use rayon::prelude::*;
use sh::Light;
use sphere::{DVec3, Direction};

pub use masses::LightMasses;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// How light is divided into regions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// Rectangles of equal flux.
    MedianCut,
    /// The regions of all that is nearest to each of the points of a warped low-discrepancy set.
    Warped,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 2] = [Self::MedianCut, Self::Warped];

    /// The method's name in manifests.
    pub const fn name(self) -> &'static str {
        match self {
            Self::MedianCut => "median-cut",
            Self::Warped => "warped",
        }
    }
}

/// At most `count` lights, the strongest first. There are fewer if fewer texels are lit, or if several points
/// of [`Method::Warped`] lie in one texel.
///
/// The sum of their [`Light::flux`] is that of the masses up to rounding: the tests see less than 1e-12 of
/// it.
///
/// # Example: a constant sky in two halves
/// ```
/// use std::num::NonZeroU32;
/// use sampling::{LightMasses, Method, rig};
///
/// let sky = envmap::Environment::new(sphere::LatLong::with_rows(16), vec![[1.0; 3]; 512]).expect("512 texels");
/// let masses = LightMasses::of_environment(&sky)?;
/// let lights = rig(&masses, NonZeroU32::new(2).expect("not 0"), Method::MedianCut);
/// assert_eq!(lights.len(), 2);
/// assert!((lights[0].flux()[0] - 2.0 * std::f64::consts::PI).abs() < 1e-12);
/// // A hemisphere looks like a hemisphere.
/// assert!((lights[0].radius - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
/// # Ok::<(), sampling::Error>(())
/// ```
pub fn rig(masses: &LightMasses, count: NonZeroU32, method: Method) -> Vec<Light> {
    let regions = match method {
        Method::MedianCut => median_cut::regions(masses, count),
        Method::Warped => warped::regions(masses, count),
    };
    let lit = regions.into_iter().filter(|region| region.flux.iter().any(|value| *value > 0.0));
    let mut lights: Vec<(f64, Light)> = lit.map(|region| (mean(region.flux), region.light())).collect();
    lights.sort_by(|a, b| b.0.total_cmp(&a.0));
    lights.into_iter().map(|(_, light)| light).collect()
}

/// A rig whose number of lights was chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// The lights, the strongest first.
    pub lights: Vec<Light>,
    /// The [`Irradiance::error`] of these lights.
    pub error: f64,
    /// The numbers of lights that were tried, and their errors.
    pub tried: Vec<(u32, f64)>,
}

/// The first rig of 1, 2, 4, ... lights, at most `most`, whose [`Irradiance::error`] is at most `tolerance`;
/// the last one if there is none.
pub fn rig_within(masses: &LightMasses, tolerance: f64, most: NonZeroU32, method: Method) -> Rig {
    let irradiance = Irradiance::of(masses);
    let (mut count, mut tried) = (NonZeroU32::MIN, Vec::new());
    loop {
        let lights = rig(masses, count, method);
        let error = irradiance.error(&lights);
        tried.push((count.get(), error));
        let next = count.saturating_mul(NonZeroU32::MIN.saturating_add(1));
        if error <= tolerance || next > most {
            return Rig { lights, error, tried };
        }
        count = next;
    }
}

/// The irradiance of surfaces all around.
#[derive(Clone, Debug)]
pub struct Irradiance {
    normals: Vec<DVec3>,
    rgb: Vec<[f64; 3]>,
}

impl Irradiance {
    /// Normals are spread evenly: [`sphere::spiral`].
    const NORMALS: usize = 128;

    /// The exact irradiance, from every texel.
    pub fn of(masses: &LightMasses) -> Self {
        let normals: Vec<DVec3> =
            (0..Self::NORMALS).map(|index| sphere::spiral(index, Self::NORMALS).vector()).collect();
        let rgb = normals.par_iter().map(|normal| masses.irradiance(*normal)).collect();
        Self { normals, rgb }
    }

    /// The error of the irradiance if these lights shine instead, each from one direction with its
    /// irradiance, as directional lights of a renderer do: the root mean square of the difference over
    /// normals and channels, as a share of the mean.
    pub fn error(&self, lights: &[Light]) -> f64 {
        let (mut square, mut sum) = (0.0, 0.0);
        for (normal, expected) in self.normals.iter().zip(&self.rgb) {
            let mut found = [0.0; 3];
            for light in lights {
                let cosine = normal.dot(light.direction.vector()).max(0.0);
                (0..3).for_each(|c| found[c] += light.irradiance[c] * cosine);
            }
            for c in 0..3 {
                square += math::powi(found[c] - expected[c], 2);
                sum += expected[c];
            }
        }
        let count = (3 * Self::NORMALS) as f64;
        (square / count).sqrt() / (sum / count)
    }
}

/// The light of some texels.
#[derive(Clone, Copy, Debug, Default)]
struct Region {
    flux: [f64; 3],
    /// The integral of the direction times the mean of the channels.
    moment: DVec3,
}

impl Region {
    fn add(&mut self, masses: &LightMasses, texel: usize) {
        let flux = masses.flux_of(texel);
        (0..3).for_each(|c| self.flux[c] += flux[c]);
        self.moment += masses.moment_of(texel);
    }

    fn light(&self) -> Light {
        let concentration = (self.moment.length() / mean(self.flux)).clamp(0.5, 1.0);
        // 1 - cos(a) without cancellation.
        let radius = 2.0 * math::asin((1.0 - concentration).sqrt());
        // The light of a whole constant sky has no direction: any.
        let direction = Direction::new(self.moment).unwrap_or(Direction::Z);
        Light::from_flux(direction, radius.min(PI / 2.0), self.flux)
    }
}

fn mean(rgb: [f64; 3]) -> f64 {
    rgb.iter().sum::<f64>() / 3.0
}

#[cfg(test)]
mod tests;
