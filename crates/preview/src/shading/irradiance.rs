//! A white diffuse surface from nine coefficients (Ramamoorthi and Hanrahan 2001): irradiance over pi about
//! the normal, the sum of A_l / pi L_lm Y_lm(N) with A_0 = pi, A_1 = 2 pi / 3 and A_2 = pi / 4. Nine
//! coefficients of a sun are negative on the far side: they have the least window without that, as the
//! irradiance that is exported for engines.

use glam::Vec3;
use sh::{Degree, Expansion, non_negative};

use super::harmonics::Harmonics;
use super::surface::Surface;

/// Nine coefficients of irradiance over pi.
#[derive(Clone, Debug)]
pub struct Irradiance {
    harmonics: Harmonics,
    rows: [Vec3; 9],
}

/// The factors A_l / pi of the first three degrees.
const SHARES: [f64; 3] = [1.0, 2.0 / 3.0, 0.25];

impl Irradiance {
    /// The irradiance of a lighting; coefficients that it lacks up to degree 2 are 0.
    pub fn new(lighting: &Expansion) -> Self {
        let mut irradiance = lighting.to_degree(Degree::new(2).unwrap_or(lighting.degree()));
        for (row, value) in irradiance.coefficients_mut().iter_mut().enumerate() {
            *value = value.map(|value| value * SHARES[row.isqrt()]);
        }
        // Without a positive mean no window helps, and nothing is changed.
        let irradiance = non_negative(&irradiance).map_or(irradiance, |found| found.expansion);
        let mut rows = [Vec3::ZERO; 9];
        for (value, row) in irradiance.coefficients().iter().zip(&mut rows) {
            *row = Vec3::from_array(value.map(|value| value as f32));
        }
        Self { harmonics: Harmonics::new(2), rows }
    }

    /// The coefficients, RGB, row l*l + l + m.
    pub fn rows(&self) -> &[Vec3; 9] {
        &self.rows
    }
}

/// The radiance toward any viewer.
pub fn irradiance(light: &Irradiance, surface: &Surface) -> Vec3 {
    let mut harmonics = [0.0; 9];
    light.harmonics.evaluate_into(surface.normal, &mut harmonics);
    let mut sum = Vec3::ZERO;
    for (row, harmonic) in light.rows.iter().zip(harmonics) {
        sum += row * harmonic;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{apart, reflection, surfaces};
    use brdf::{Choice, Lambert, Material, project};
    use glam::DVec3;
    use sh::{Basis, Stop};
    use shrm::Reflection;
    use sphere::Direction;

    #[test]
    fn it_matches_a_lambert_reflection_of_degree_2() {
        let white = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let brdf =
            project(&white, Choice::Degree { f: Degree::new(2).unwrap(), p: Degree::ZERO }, Stop::NEVER);
        let lighting = reflection(brdf::Centre::Normal, 6, 0).lighting().clone();
        let field = Reflection::convolve(&lighting, &brdf.unwrap().coefficients).radial().unwrap();
        let light = Irradiance::new(&lighting);
        for (surface, [normal, ..]) in surfaces() {
            // Nine terms of about 1.
            assert!(apart(irradiance(&light, &surface), field.evaluate(normal)) < 2e-6);
        }
    }

    #[test]
    fn a_sun_leaves_nothing_negative() {
        let mut y = [0.0; 9];
        Basis::new(Degree::new(2).unwrap())
            .evaluate_into(Direction::normalised(DVec3::new(0.6, 0.0, 0.8)), &mut y);
        let rows = y.iter().map(|y| [10.0 * y, 8.0 * y, 5.0 * y]).collect();
        let sun = Expansion::from_coefficients(Degree::new(2).unwrap(), rows).unwrap();
        let light = Irradiance::new(&sun);
        let seen: Vec<_> = surfaces().iter().map(|(surface, _)| irradiance(&light, surface)).collect();
        let least = seen.iter().map(|radiance| radiance.min_element()).fold(f32::INFINITY, f32::min);
        let most = seen.iter().map(|radiance| radiance.max_element()).fold(0.0, f32::max);
        assert!(least > -1e-4 * most && most > 1.0, "{least} to {most}");
    }

    #[test]
    fn a_light_of_degree_0_is_the_same_from_everywhere() {
        let light =
            Irradiance::new(&Expansion::from_coefficients(Degree::ZERO, vec![[1.0, 2.0, 3.0]]).unwrap());
        for (surface, _) in surfaces() {
            let y_00 = 0.25_f64.sqrt() / std::f64::consts::PI.sqrt();
            assert!(apart(irradiance(&light, &surface), [y_00, 2.0 * y_00, 3.0 * y_00]) < 1e-6);
        }
    }
}
