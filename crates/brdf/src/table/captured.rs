//! The energy of a material that the degrees up to each hold.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;
use sh::{Degree, Stop};
use sphere::Direction;

use super::{TableError, Views};
use crate::Material;

/// Views lie within this angle of the normal, in radians: nearer to grazing the energy has no bound.
const WIDEST: f64 = 75.0 * PI / 180.0;

/// Views between the normal and the widest, by Gauss' rule in the cosine.
const POLAR: usize = 16;

/// Views in a quarter of a circle.
const AZIMUTHS: usize = 8;

/// The share of the energy of rho_hat that the degrees 0 to l hold, for l up to `degree`: the sum of c_i(v)^2
/// up to degree l over the integral of rho_hat(s, v)^2 ds, both summed over the channels and over all views
/// within 75 degrees of the normal, by solid angle. Of a black material all of it.
///
/// Within 1e-3 of the shares by a brute-force integral. `stop` is asked for each view, on every thread.
///
/// # Example: three quarters of a matte surface are in degrees 0 and 1
/// ```
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([1.0; 3])?);
/// let shares = brdf::captured(&chalk, sh::Degree::new(2)?, sh::Stop::NEVER)?;
/// // 1/4 and 1/3 of pi, over the integral of cos^2 over the hemisphere, 2 pi / 3.
/// assert!((shares[0] - 3.0 / 8.0).abs() < 1e-6 && (shares[1] - 7.0 / 8.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The errors of [`super::tabulate`].
pub fn captured(material: &Material, degree: Degree, stop: Stop<'_>) -> Result<Vec<f64>, TableError> {
    // In a quarter of the views, if the other three are mirror images of it.
    let azimuths = match (material.is_isotropic(), material.is_orthotropic()) {
        (true, _) => 1,
        (false, true) => AZIMUTHS,
        (false, false) => 4 * AZIMUTHS,
    };
    let (nodes, weights) = sh::quadrature::gauss_legendre(POLAR);
    let views: Vec<(Direction, f64)> = (0..POLAR * azimuths)
        .map(|index| {
            let (polar, step) = (index / azimuths, index % azimuths);
            let z = math::cos(WIDEST) + (1.0 - math::cos(WIDEST)) * 0.5 * (1.0 + math::cos(nodes[polar]));
            let phi = TAU * (step as f64 + 0.5) / (4 * AZIMUTHS) as f64;
            (Direction::from_angles(math::acos(z), phi), weights[polar])
        })
        .collect();
    let at = Views::new(material, degree);
    let of_view = |(view, weight): &(Direction, f64)| {
        stop.check()?;
        let c = at.coefficients(*view)?.c;
        let square = |rgb: &[f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
        let held: Vec<f64> = (0..=degree.get())
            .map(|l| weight * c[l * l..(l + 1) * (l + 1)].iter().map(square).sum::<f64>())
            .collect();
        Ok((held, weight * at.energy(*view)?.iter().sum::<f64>()))
    };
    let found: Vec<(Vec<f64>, f64)> = views.par_iter().map(of_view).collect::<Result<_, TableError>>()?;
    let energy: f64 = found.iter().map(|(_, energy)| energy).sum();
    let mut sum = 0.0;
    let share = |l: usize| {
        sum += found.iter().map(|(held, _)| held[l]).sum::<f64>();
        if energy > 0.0 { sum / energy } else { 1.0 }
    };
    Ok((0..=degree.get()).map(share).collect())
}
