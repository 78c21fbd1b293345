//! Projection of a material into spherical harmonics, and the choice of its degrees.
//!
//! A radially symmetric rho_hat has p = q = 0 only, so that P = 0 and its energy, the integral of rho_hat^2 over
//! both directions, is the sum of |rho_l00|^2 (thesis, equations 5.17 and 5.18). The degree chosen by tolerance is the
//! least F that captures 1 - tolerance of it (paper 1, Appendix C).

use sh::{Degree, Tolerance, degree_holding};

use crate::{BrdfCoefficients, Material};

/// How the degrees of a projection are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The least degrees that lose at most this share of the energy.
    Tolerance(Tolerance),
    /// The given degrees, whatever they lose.
    Degree {
        /// F, the degree in the incident direction.
        f: Degree,
        /// P, the degree in the outgoing direction.
        p: Degree,
    },
}

/// A material in spherical harmonics, and how much of it that is.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// rho_lpq up to the chosen degrees.
    pub coefficients: BrdfCoefficients,
    /// Sum over p, q and channels of |rho_lpq|^2, for l = 0 ..= F.
    pub energy: Vec<f64>,
    /// The share of the material's energy that the coefficients hold, 0 to 1; 1 for a black material.
    pub captured: f64,
}

/// Why a material could not be projected.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ProjectionError {
    /// A highlight so sharp that no supported degree meets the tolerance.
    #[error(
        "degree {highest} captures {captured:.4} of the energy and tolerance {tolerance} asks for more: \
         the highlight is too sharp; give a degree or a larger tolerance",
        highest = Degree::MAX.get()
    )]
    TooSharp {
        /// What the highest degree captures.
        captured: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// Degrees whose coefficients would fill more than [`MOST_COEFFICIENTS`].
    #[error("degrees [{f}, {p}] make more than {MOST_COEFFICIENTS} coefficients")]
    TooMany {
        /// F.
        f: usize,
        /// P.
        p: usize,
    },
}

/// The most entries (F+1)(P+1)^2 that a projection may have: 4 million, 100 MB.
pub const MOST_COEFFICIENTS: usize = 1 << 22;

/// The coefficients of a material, exact in closed form for the radially symmetric models.
///
/// # Errors
/// Where no supported degree meets the tolerance, or the given degrees make too many coefficients.
///
/// # Example: degree 2 captures 99 percent of a Lambertian surface
/// ```
/// use brdf::{Choice, Lambert, Material, project};
/// let chalk = Material::Lambert(Lambert::new([0.9; 3])?);
/// let projection = project(&chalk, Choice::Tolerance(sh::Tolerance::new(0.01)?))?;
/// assert_eq!(projection.coefficients.f().get(), 2);
/// assert!(projection.captured > 0.99);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn project(material: &Material, choice: Choice) -> Result<Projection, ProjectionError> {
    let lobe = material.radial().expect("every model so far is radially symmetric");
    let total = lobe.energy();
    let (f, p) = match choice {
        Choice::Degree { f, p } => (f, p),
        Choice::Tolerance(tolerance) => {
            let energy = energies(&lobe.coefficients(Degree::MAX.get()));
            let f = degree_holding(&energy, total, tolerance).and_then(|l| Degree::new(l).ok());
            let captured = energy.iter().sum::<f64>() / total;
            let tolerance = tolerance.get();
            (f.ok_or(ProjectionError::TooSharp { captured, tolerance })?, Degree::ZERO)
        }
    };
    let per_l = (p.get() + 1) * (p.get() + 1);
    let len = (f.get() + 1) * per_l;
    if len > MOST_COEFFICIENTS {
        return Err(ProjectionError::TooMany { f: f.get(), p: p.get() });
    }
    let radial = lobe.coefficients(f.get());
    let mut rho = vec![[0.0; 3]; len];
    for (l, &value) in radial.iter().enumerate() {
        rho[l * per_l] = value;
    }
    let energy = energies(&radial);
    let captured = if total > 0.0 { (energy.iter().sum::<f64>() / total).min(1.0) } else { 1.0 };
    let coefficients = BrdfCoefficients::new(material.centre(), f, p, rho)
        .ok_or(ProjectionError::TooMany { f: f.get(), p: p.get() })?;
    Ok(Projection { coefficients, energy, captured })
}

fn energies(radial: &[[f64; 3]]) -> Vec<f64> {
    radial.iter().map(|rho| rho.iter().map(|v| v * v).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Centre, Lambert, Phong};
    use sphere::Direction;
    use std::f64::consts::PI;

    fn tolerance(share: f64) -> Choice {
        Choice::Tolerance(Tolerance::new(share).unwrap())
    }

    fn degree(f: usize, p: usize) -> Choice {
        Choice::Degree { f: Degree::new(f).unwrap(), p: Degree::new(p).unwrap() }
    }

    fn phong(exponent: f64) -> Material {
        Material::Phong(Phong::new(exponent, [1.0, 0.5, 0.25]).unwrap())
    }

    fn lambert() -> Material {
        Material::Lambert(Lambert::new([0.8, 0.4, 0.0]).unwrap())
    }

    /// Paper 1, Appendix D: F is about sqrt(-s log(tolerance)).
    #[test]
    fn phong_needs_the_degrees_of_the_paper() {
        let exponents = [8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];
        let degrees = exponents.map(|s| project(&phong(s), tolerance(0.01)).unwrap().coefficients.f().get());
        assert_eq!(degrees, [6, 8, 12, 17, 24, 34, 48]);
    }

    #[test]
    fn the_degree_chosen_is_the_least_that_captures_enough() {
        for material in [lambert(), phong(3.7), phong(100.0)] {
            for share in [0.3, 0.03, 0.001] {
                let chosen = project(&material, tolerance(share)).unwrap();
                assert!(chosen.captured >= 1.0 - share && chosen.captured <= 1.0);
                let f = chosen.coefficients.f().get();
                if f > 0 {
                    assert!(project(&material, degree(f - 1, 0)).unwrap().captured < 1.0 - share);
                }
            }
        }
    }

    /// The paper on irradiance maps (Ramamoorthi and Hanrahan 2001): A_0 = pi, A_1 = 2 pi / 3, A_2 = pi / 4, for
    /// albedo pi, A_l = Lambda_l rho_l00 Y_00.
    #[test]
    fn lambert_scales_the_first_degrees_by_1_two_thirds_and_a_quarter() {
        let material = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        let projection = project(&material, degree(4, 0)).unwrap();
        assert_eq!(projection.coefficients.centre(), Centre::Normal);
        for (l, expected) in [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0].into_iter().enumerate() {
            let factor = sh::lambda(l) * projection.coefficients.get(l, 0, 0)[0] / (4.0 * PI).sqrt();
            assert!((factor - expected).abs() < 1e-15, "l {l}: {factor}");
        }
    }

    /// The coefficients rebuild rho_hat. The series of cos^s is cut at F = 1500, where its terms fall as l^-(s+1); for
    /// Lambert, right at the kink, what is left out is below albedo / (2 pi F) = 1e-4.
    #[test]
    fn coefficients_rebuild_rho_hat() {
        for (material, allowed) in [(lambert(), 1e-4), (phong(5.0), 1e-10), (phong(40.5), 1e-10)] {
            let projection = project(&material, degree(1500, 0)).unwrap();
            let mut y_l0 = vec![0.0; 1501];
            for i in 0..50 {
                let incident = Direction::from_angles(f64::from(i) * PI / 50.0 + 0.01, 0.4);
                sh::zonal_into(incident.vector().z, &mut y_l0);
                let expected = material.rho_hat(incident, Direction::X);
                for channel in 0..3 {
                    let rho = |l: usize| projection.coefficients.get(l, 0, 0)[channel];
                    let sum: f64 = (0..=1500).map(|l| rho(l) * y_l0[l]).sum::<f64>() / (4.0 * PI).sqrt();
                    assert!(
                        (sum - expected[channel]).abs() < allowed * (1.0 + expected[0]),
                        "{}: {sum} {expected:?}",
                        material.name()
                    );
                }
            }
        }
    }

    #[test]
    fn a_degree_in_the_view_adds_zeros_only() {
        let plain = project(&phong(9.0), degree(5, 0)).unwrap();
        let wide = project(&phong(9.0), degree(5, 2)).unwrap();
        assert_eq!(wide.coefficients.rho().len(), 6 * 9);
        assert_eq!((wide.captured, &wide.energy), (plain.captured, &plain.energy));
        for l in 0..=5 {
            assert_eq!(wide.coefficients.get(l, 0, 0), plain.coefficients.get(l, 0, 0));
            assert_eq!(wide.coefficients.get(l, 2, 1), [0.0; 3]);
        }
    }

    #[test]
    fn a_black_material_is_degree_0() {
        let black = Material::Lambert(Lambert::new([0.0; 3]).unwrap());
        let projection = project(&black, tolerance(0.01)).unwrap();
        assert_eq!((projection.coefficients.f().get(), projection.captured), (0, 1.0));
    }

    #[test]
    fn a_mirror_has_no_degree_by_tolerance() {
        let error = project(&phong(1e7), tolerance(0.01)).unwrap_err();
        assert!(
            matches!(error, ProjectionError::TooSharp { captured, .. } if captured > 0.2 && captured < 0.99)
        );
        assert!(project(&phong(1e7), degree(2048, 0)).is_ok());
    }

    #[test]
    fn too_many_coefficients_are_an_error() {
        assert_eq!(
            project(&lambert(), degree(2048, 2048)),
            Err(ProjectionError::TooMany { f: 2048, p: 2048 })
        );
    }

    #[test]
    fn impossible_parameters_are_errors_that_name_them() {
        for bad in [-0.1, f64::NAN, f64::INFINITY] {
            assert_eq!(Lambert::new([0.5, bad, 0.5]).unwrap_err().parameter, "albedo");
            assert_eq!(Phong::new(bad, [0.5; 3]).unwrap_err().parameter, "exponent");
            assert_eq!(Phong::new(1.0, [0.5, 0.5, bad]).unwrap_err().parameter, "specular");
        }
        let message = Phong::new(-1.0, [1.0; 3]).unwrap_err().to_string();
        assert_eq!(message, "exponent: -1 is not a number from 0 to 1e9");
    }
}
