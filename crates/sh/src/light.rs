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

use crate::quadrature::gauss_legendre;
use crate::{Degree, Expansion, rotate, zonal_into};

/// The most rings of [`Light::points`]: a disk of 24 widths has about 3000 points.
pub const MOST_RINGS: usize = 30;

/// A disk whose radius is this share of a highlight's width is a point: the error is 1e-3 of the peak.
pub const POINT: f64 = 0.063;

/// A disk that is larger than this, in radians, is never a point: a horizon that cuts it in half leaves 2 /
/// (3 pi) of its radius of the cosine of a surface that faces it, and a point nothing.
const SUN: f64 = 0.005;

/// The share of its width that a highlight has across at oblique views: the cosine of some 55 degrees.
const OBLIQUE: f64 = 0.6;

/// The distance of the rings of a large disk, in radians, that a horizon may cut.
const HORIZON_STEP: f64 = 0.08;

/// A disk of constant radiance, far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// The direction of the light's centre.
    pub direction: Direction,
    /// The angle from the light's centre to its edge, in radians, 0 to pi / 2; 0 is a point.
    pub radius: f64,
    /// The irradiance of a surface that faces the light, RGB: the integral of radiance times cosine.
    pub irradiance: [f64; 3],
}

impl Light {
    /// The integral of the light's radiance over its disk, RGB: what a BRDF is multiplied with if the light
    /// is small. It is the irradiance times 2 / (1 + cos(radius)).
    pub fn flux(&self) -> [f64; 3] {
        self.irradiance.map(|irradiance| irradiance * 2.0 / (1.0 + math::cos(self.radius)))
    }

    /// The light with this [`Light::flux`].
    pub fn from_flux(direction: Direction, radius: f64, flux: [f64; 3]) -> Self {
        Self { direction, radius, irradiance: flux.map(|flux| flux * (1.0 + math::cos(radius)) / 2.0) }
    }

    /// The spherical-harmonic coefficients of the light's radiance, up to a degree.
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
        Expansion::disk(self.direction, self.radius, self.flux(), degree)
    }

    /// Directions over the disk, each in the middle of an equal share of its solid angle: points of a spiral
    /// whose turns are the golden angle. One is its centre.
    ///
    /// # Example: all of them see the disk
    /// ```
    /// let lamp = sh::Light { direction: sphere::Direction::X, radius: 0.2, irradiance: [1.0; 3] };
    /// assert!(lamp.directions(100).all(|direction| direction.dot(lamp.direction) > 0.2f64.cos()));
    /// ```
    pub fn directions(&self, count: usize) -> impl Iterator<Item = Direction> {
        let (centre, reach) = (self.direction.vector(), math::sin(self.radius / 2.0));
        let (u, v) = centre.any_orthonormal_pair();
        let golden = PI * (3.0 - 5f64.sqrt());
        (0..count).map(move |index| {
            // The solid angle within theta is 4 pi sin^2(theta / 2).
            let share = if count == 1 { 0.0 } else { (index as f64 + 0.5) / count as f64 };
            let theta = 2.0 * math::asin(reach * share.sqrt());
            let ((sine, cosine), (y, x)) = (math::sin_cos(theta), math::sin_cos(golden * index as f64));
            Direction::normalised(centre * cosine + (u * x + v * y) * sine)
        })
    }

    /// Points in place of the disk, each with its share of the light; the shares sum to 1. The mean over them
    /// is that over the disk for functions whose features are not narrower than `width`, in radians (the
    /// standard deviation of a highlight seen head on): one point for a sun, otherwise rings at the nodes of
    /// Gauss in the solid angle, two for each width, but at most [`MOST_RINGS`].
    ///
    /// Tests: up to a radius of 14 widths, radiance is within 1.2e-3 of the highlight's largest at views up
    /// to 60 degrees from the normal, also where the horizon cuts the disk. Toward the horizon highlights are
    /// narrower across: within 0.05 at 84 degrees. Each point costs a look at the material.
    ///
    /// # Example: a sun is one point, a softbox is many
    /// ```
    /// let lamp = |radius| sh::Light { direction: sphere::Direction::X, radius, irradiance: [1.0; 3] };
    /// assert_eq!(lamp(0.0047).points(0.25).len(), 1);
    /// assert!((50..400).contains(&lamp(0.26).points(0.13).len()));
    /// ```
    pub fn points(&self, width: f64) -> Vec<(Direction, f64)> {
        if self.radius <= (POINT * width).min(SUN) {
            return vec![(self.direction, 1.0)];
        }
        let width = OBLIQUE * width;
        let across = self.radius / width.max(1e-6);
        // A horizon cuts disks of any size, but a small one holds too little of its sky to tell.
        let rings =
            (1.5 + 1.2 * across).max(1.0 + self.radius / HORIZON_STEP).min(MOST_RINGS as f64) as usize;
        let (centre, reach) = (self.direction.vector(), math::sin(self.radius / 2.0));
        let (u, v) = centre.any_orthonormal_pair();
        let (angles, weights) = gauss_legendre(rings);
        let step = (0.8 * width).min(1.5 * HORIZON_STEP).max(self.radius / (1.2 * MOST_RINGS as f64));
        let golden = PI * (3.0 - 5f64.sqrt());
        let mut points = Vec::new();
        for (ring, (angle, weight)) in angles.iter().zip(&weights).enumerate() {
            // The solid angle within theta is 4 pi sin^2(theta / 2).
            let theta = 2.0 * math::asin(reach * math::sin(angle / 2.0));
            let count = 5 + (2.0 * PI * math::sin(theta) / step) as usize;
            let (sine, cosine) = math::sin_cos(theta);
            for k in 0..count {
                let (y, x) = math::sin_cos(2.0 * PI * k as f64 / count as f64 + golden * ring as f64);
                let direction = Direction::normalised(centre * cosine + (u * x + v * y) * sine);
                points.push((direction, 0.5 * weight / count as f64));
            }
        }
        points
    }

    /// The irradiance of a surface with this normal, whose horizon hides the light's part below it.
    ///
    /// By Lambert's formula, half the integral of N . (r x dr) along the boundary of what is visible: with
    /// the centre at the elevation e above the horizon, and t the angle around the disk from its highest
    /// point, the edge is above the horizon where cos(t) > -cos(a) sin(e) / (sin(a) cos(e)) = cos(t_0), and
    ///
    /// > E / L = t_0 sin^2(a) sin(e) - sin(a) cos(a) cos(e) sin(t_0) + phi_0,
    ///
    /// phi_0 the azimuth from the centre's at which the edge crosses the horizon. A whole disk has pi
    /// sin^2(a) sin(e).
    ///
    /// # Example: a horizon through the middle of a sky hides half of its light, and of its width
    /// ```
    /// let sky = sh::Light { direction: sphere::Direction::X, radius: 1.5707963267948966, irradiance: [1.0; 3] };
    /// assert!((sky.irradiance_on(sphere::Direction::Z)[0] - 0.5).abs() < 1e-12);
    /// ```
    pub fn irradiance_on(&self, normal: Direction) -> [f64; 3] {
        let height = self.direction.dot(normal);
        let along = self.direction.vector().cross(normal.vector()).length();
        let (sine, cosine) = math::sin_cos(self.radius);
        let (low, reach) = (cosine * height, sine * along);
        if low >= reach {
            return self.irradiance.map(|irradiance| irradiance * height.max(0.0));
        }
        if low <= -reach {
            return [0.0; 3];
        }
        let t = math::acos(-low / reach);
        let phi = math::atan2(sine * math::sin(t), cosine * along - sine * math::cos(t) * height);
        let share = t * sine * sine * height - sine * cosine * along * math::sin(t) + phi;
        self.irradiance.map(|irradiance| irradiance * share / (PI * sine * sine))
    }
}

impl Expansion {
    /// A disk of constant radiance about a direction, of an angular radius in radians from 0 to pi, whose
    /// integral over the sphere is `flux`.
    ///
    /// # Example: a disk of radius pi is a constant sky
    /// ```
    /// use std::f64::consts::PI;
    /// let sky = sh::Expansion::disk(sphere::Direction::X, PI, [4.0 * PI; 3], sh::Degree::new(3)?);
    /// assert!((sky.get(0, 0)[0] - (4.0 * PI).sqrt()).abs() < 1e-12 && sky.get(2, 1)[0].abs() < 1e-12);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn disk(direction: Direction, radius: f64, flux: [f64; 3], degree: Degree) -> Self {
        let shares = disk(radius, degree.get());
        Self::zonal(direction, degree, |l| flux.map(|flux| flux * shares[l]))
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
    zonal_into(math::cos(radius), &mut edge);
    let legendre = |l: usize| edge[l] / ((2 * l + 1) as f64 / (4.0 * PI)).sqrt();
    // 1 - cos(a) without cancellation.
    let height = 2.0 * math::powi(math::sin(radius / 2.0), 2);
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

    /// Returns the light after a rotation.
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

impl std::ops::Add for &Lighting {
    type Output = Lighting;

    /// The sum of both series, to the higher of both degrees, and the lights of both.
    fn add(self, other: &Lighting) -> Lighting {
        let mut series = self.series.to_degree(self.series.degree().max(other.series.degree()));
        for (sum, row) in series.coefficients_mut().iter_mut().zip(other.series.coefficients()) {
            (0..3).for_each(|channel| sum[channel] += row[channel]);
        }
        Lighting { series, lights: [&self.lights[..], &other.lights].concat() }
    }
}

impl From<Expansion> for Lighting {
    /// Makes light without lights beside the series.
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

    /// The file's values have ten digits; they were integrated over disks, not derived.
    #[test]
    fn disks_and_their_irradiance_are_those_of_the_reference_values() {
        const TEST: &str = "disks_and_their_irradiance_are_those_of_the_reference_values";
        let Some(reference) = test_data::reference(TEST, "prt-circular-lights.json") else { return };
        let list = |name: &str| reference[name].as_array().unwrap();
        let number = |case: &serde_json::Value, name: &str| case[name].as_f64().unwrap();
        let numbers = |value: &serde_json::Value| -> Vec<f64> {
            value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
        };
        let flux = |radius: f64| [4.0 * PI * (radius / 2.0).sin().powi(2); 3];
        for case in list("zonal") {
            let radius = number(case, "angular_radius").to_radians();
            let found = Expansion::disk(Direction::Z, radius, flux(radius), Degree::new(10).unwrap());
            for (l, expected) in numbers(&case["zonal"]).iter().enumerate() {
                assert!((found.get(l, 0)[0] - expected).abs() < 1e-8, "{radius} {l}");
            }
        }
        for case in list("directed") {
            let radius = number(case, "angular_radius").to_radians();
            let [x, y, z] = numbers(&case["direction"])[..] else { panic!("a direction") };
            let direction = Direction::normalised(sphere::DVec3::new(x, y, z));
            let found = Expansion::disk(direction, radius, flux(radius), Degree::new(4).unwrap());
            for (row, expected) in numbers(&case["sh"]).iter().enumerate() {
                assert!((found.coefficients()[row][0] - expected).abs() < 1e-8, "{radius} {row}");
            }
            for (window, name) in [(crate::Window::None, "range"), (crate::Window::Hanning, "range_hanning")]
            {
                let found = window.apply(&found);
                let mut negative = found.clone();
                negative.coefficients_mut().iter_mut().flatten().for_each(|value| *value = -*value);
                let range = [crate::minimum(&found).value, -crate::minimum(&negative).value];
                for (found, expected) in range.iter().zip(numbers(&case[name])) {
                    assert!((found - expected).abs() < 1e-5, "{radius} {name}: {found} {expected}");
                }
            }
        }
        for case in list("planes") {
            let radius = number(case, "angular_radius").to_radians();
            let elevation = number(case, "elevation").to_radians();
            let direction = Direction::from_angles(PI / 2.0 - elevation, 0.4);
            let light = Light::from_flux(direction, radius, flux(radius));
            let error = light.irradiance_on(Direction::Z)[0] - number(case, "irradiance");
            assert!(error.abs() < 1e-8, "{radius} {elevation}: {error:e}");
        }
    }

    /// The mean of a harmonic over the directions is its integral over the disk, which is a closed form.
    #[test]
    fn directions_over_a_disk_integrate_it() {
        let degree = Degree::new(3).unwrap();
        let basis = crate::Basis::new(degree);
        for (radius, count, limit) in
            [(0.0, 3, 1e-12), (1.2, 4000, 2e-3), (0.3, 1, 0.15), (PI / 2.0, 16, 0.1)]
        {
            let light = Light::from_flux(Direction::from_angles(0.7, -1.0), radius, [1.0; 3]);
            let (mut sums, mut row) = (vec![0.0; degree.rows()], vec![0.0; degree.rows()]);
            for direction in light.directions(count) {
                basis.evaluate_into(direction, &mut row);
                sums.iter_mut().zip(&row).for_each(|(sum, y)| *sum += y / count as f64);
            }
            let series = light.series(degree);
            for (sum, expected) in sums.iter().zip(series.coefficients()) {
                assert!((sum - expected[0]).abs() < limit, "{radius}: {sum} {expected:?}");
            }
        }
    }

    #[test]
    fn a_sum_has_the_higher_degree_and_all_lights() {
        let degree = |l| Degree::new(l).unwrap();
        let light = |x: f64| Light::from_flux(Direction::from_angles(x, 0.1), 0.2, [x; 3]);
        let soft = Expansion::from_coefficients(degree(1), vec![[1.0, 2.0, 3.0]; 4]).unwrap();
        let first = Lighting { series: soft, lights: vec![light(1.0)] };
        let second = Lighting { series: Expansion::zero(degree(3)), lights: vec![light(0.5)] };
        for sum in [&first + &second, &second + &first] {
            assert_eq!((sum.series.degree(), sum.lights.len()), (degree(3), 2));
            assert_eq!((sum.series.get(1, 0), sum.series.get(2, 0)), ([1.0, 2.0, 3.0], [0.0; 3]));
            assert!((sum.mean() - first.mean() - second.mean()).abs() < 1e-14);
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
