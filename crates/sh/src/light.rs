//! Distant light as a series and the lights beside it.
//!
//! A series cut at degree F rings around a light that is smaller than its waves. So the suns and lamps of an
//! environment leave the series and are kept as what they are: disks with a direction, an angular radius and
//! an irradiance. A disk of radiance L and angular radius a about the axis has the coefficients
//!
//! > L 2 pi N_l (P_(l-1)(cos a) - P_(l+1)(cos a)) / (2 l + 1), N_l = sqrt((2 l + 1) / (4 pi)),
//!
//! the integral of Y_l0 over the disk, and pi sin^2(a) L is the irradiance of a surface that faces it.

use std::f64::consts::PI;

use sphere::{Direction, Rotation};

use crate::{Degree, Expansion, rotate, zonal_into};

/// A disk of constant radiance, far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The direction of its centre.
    pub direction: Direction,
    /// The angle from its centre to its edge, in radians, 0 to pi / 2; 0 is a point.
    pub radius: f64,
    /// The irradiance of a surface that faces it, RGB: the integral of radiance times cosine.
    pub irradiance: [f64; 3],
}

impl Light {
    /// The integral of its radiance over its disk, RGB: what its BRDF is multiplied with if the light is
    /// small. It is the irradiance times 2 / (1 + cos(radius)).
    pub fn flux(&self) -> [f64; 3] {
        self.irradiance.map(|irradiance| irradiance * 2.0 / (1.0 + self.radius.cos()))
    }

    /// The light with this [`Light::flux`].
    pub fn from_flux(direction: Direction, radius: f64, flux: [f64; 3]) -> Self {
        Self { direction, radius, irradiance: flux.map(|flux| flux * (1.0 + radius.cos()) / 2.0) }
    }

    /// Its coefficients.
    ///
    /// # Example: a hemisphere of radiance 1 / pi has the irradiance 1
    /// ```
    /// use std::f64::consts::PI;
    /// let sky = sh::Light { direction: sphere::Direction::Z, radius: PI / 2.0, irradiance: [1.0; 3] };
    /// let series = sky.series(sh::Degree::new(4)?);
    /// assert!((series.get(0, 0)[0] - 2.0 / (4.0 * PI).sqrt()).abs() < 1e-12);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn series(&self, degree: Degree) -> Expansion {
        let shares = disk(self.radius, degree.get());
        let flux = self.flux();
        Expansion::zonal(self.direction, degree, |l| flux.map(|flux| flux * shares[l]))
    }
}

/// The zonal coefficients of a disk about the axis whose integral is 1.
fn disk(radius: f64, degree: usize) -> Vec<f64> {
    let mut centre = vec![0.0; degree + 1];
    zonal_into(1.0, &mut centre);
    // Below this the differences of the closed form cancel, and a point is right to 1e-9 up to degree 2048.
    if radius < 1e-8 {
        return centre;
    }
    let mut edge = vec![0.0; degree + 2];
    zonal_into(radius.cos(), &mut edge);
    let legendre = |l: usize| edge[l] / ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
    // 1 - cos(a) without cancellation.
    let height = 2.0 * (radius / 2.0).sin().powi(2);
    (0..=degree)
        .map(|l| match l {
            0 => centre[0],
            l => centre[l] * (legendre(l - 1) - legendre(l + 1)) / ((2 * l + 1) as f64 * height),
        })
        .collect()
}

/// Distant light: a series, and the lights that are not part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting {
    /// Everything but the lights, as spherical-harmonic coefficients.
    pub series: Expansion,
    /// The lights beside the series.
    pub lights: Vec<Light>,
}

impl Lighting {
    /// All light in one series: that of the lights, cut at the series' degree, is added.
    pub fn whole(&self) -> Expansion {
        let mut whole = self.series.clone();
        for light in &self.lights {
            let series = light.series(whole.degree());
            for (sum, row) in whole.coefficients_mut().iter_mut().zip(series.coefficients()) {
                (0..3).for_each(|channel| sum[channel] += row[channel]);
            }
        }
        whole
    }

    /// The light after a rotation.
    pub fn rotated(&self, rotation: Rotation) -> Self {
        let turned = |light: &Light| Light { direction: rotation.apply(light.direction), ..*light };
        Self { series: rotate(&self.series, rotation), lights: self.lights.iter().map(turned).collect() }
    }

    /// The mean radiance over the sphere and the three channels, lights included.
    pub fn mean(&self) -> f64 {
        let series: f64 = self.series.get(0, 0).iter().sum::<f64>() * (4.0 * PI).sqrt();
        let lights: f64 = self.lights.iter().flat_map(Light::flux).sum();
        (series + lights) / (12.0 * PI)
    }
}

impl From<Expansion> for Lighting {
    /// Light without lights beside the series.
    fn from(series: Expansion) -> Self {
        Self { series, lights: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint rule over the disk in 4000 rings, which is exact to about 1e-7.
    #[test]
    fn the_coefficients_of_a_disk_are_its_integrals() {
        let degree = 20;
        for radius in [1e-9, 0.004, 0.3, 1.2] {
            let found = disk(radius, degree);
            let mut sums = vec![0.0; degree + 1];
            let rings = 4000;
            let height = 1.0 - f64::cos(radius.max(1e-6));
            let mut row = vec![0.0; degree + 1];
            for ring in 0..rings {
                zonal_into(1.0 - height * (f64::from(ring) + 0.5) / f64::from(rings), &mut row);
                sums.iter_mut().zip(&row).for_each(|(sum, y)| *sum += y / f64::from(rings));
            }
            for l in 0..=degree {
                assert!(
                    (found[l] - sums[l]).abs() < 1e-6,
                    "radius {radius}, l {l}: {} {}",
                    found[l],
                    sums[l]
                );
            }
        }
    }

    #[test]
    fn whole_light_and_its_mean_hold_the_lights() {
        let degree = Degree::new(6).unwrap();
        let light = Light::from_flux(Direction::from_angles(0.7, -1.0), 0.1, [4.0 * PI, 0.0, 2.0 * PI]);
        let lighting = Lighting { series: Expansion::zero(degree), lights: vec![light] };
        assert!((lighting.mean() - 0.5).abs() < 1e-12, "{}", lighting.mean());
        assert!((Lighting::from(lighting.whole()).mean() - 0.5).abs() < 1e-12);
        let rotation = Rotation::from_yaw_pitch_roll(0.3, 1.0, -0.4);
        let (first, last) = (lighting.rotated(rotation).whole(), rotate(&lighting.whole(), rotation));
        for (a, b) in first.coefficients().as_flattened().iter().zip(last.coefficients().as_flattened()) {
            assert!((a - b).abs() < 1e-12);
        }
    }
}
