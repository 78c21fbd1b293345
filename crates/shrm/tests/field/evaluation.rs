//! Evaluation against the integral over incident light, with rho_hat built from the complex harmonics of its
//! definition.

use std::f64::consts::{PI, SQRT_2, TAU};

use brdf::BrdfCoefficients;
use sh::{Basis, quadrature};
use shrm::{Plain, Reflection, frame, into_frame};
use sphere::Direction;

use crate::materials::{degree, lighting, reflection, tensor};

/// Complex Y_lq with the Condon-Shortley phase, as (real, imaginary), from the real ones.
fn complex(real: &[f64], l: usize, q: isize) -> (f64, f64) {
    let (middle, order) = (l * l + l, q.unsigned_abs());
    if q == 0 {
        return (real[middle], 0.0);
    }
    let sign = if q > 0 && order % 2 == 1 { -1.0 } else { 1.0 };
    let (cosine, sine) = (real[middle + order] / SQRT_2, real[middle - order] / SQRT_2);
    (sign * cosine, sign * sine * q.signum() as f64)
}

/// rho_hat(w_i, w_o) = sum rho_lpq Y*_lq(w_i) Y_pq(w_o) over both signs of q; red.
fn rho_hat(brdf: &BrdfCoefficients, incident: &[f64], outgoing: &[f64]) -> f64 {
    let mut sum = (0.0, 0.0);
    for l in 0..=brdf.f().get() {
        for p in 0..=brdf.p().get() {
            let most = l.min(p) as isize;
            for q in -most..=most {
                let (a, b) = (complex(incident, l, q), complex(outgoing, p, q));
                let rho = brdf.get(l, p, q.unsigned_abs())[0];
                sum.0 += rho * (a.0 * b.0 + a.1 * b.1);
                sum.1 += rho * (a.0 * b.1 - a.1 * b.0);
            }
        }
    }
    assert!(sum.1.abs() < 1e-12, "rho_hat is real");
    sum.0
}

/// Gauss-Legendre rows and evenly spaced columns integrate the product exactly: its degree is 2 F.
#[test]
fn evaluation_is_the_integral_over_incident_light() {
    for (f, p) in [(0, 0), (3, 0), (1, 3), (4, 3), (6, 2)] {
        let (sky, brdf) = (lighting(f, 3), tensor(f, p, true, 11));
        let reflection = Reflection::convolve(&sky, &brdf);
        let (light, incident, outgoing) =
            (Basis::new(degree(f)), Basis::new(degree(f)), Basis::new(degree(p)));
        let (nodes, weights) = quadrature::gauss_legendre(f + 2);
        let columns = 2 * f + 3;
        for (central, view) in [
            (Direction::from_angles(0.4, 2.0), Direction::from_angles(1.2, -1.0)),
            (Direction::from_angles(2.4, -0.7), Direction::from_angles(0.1, 3.0)),
            (Direction::Z, Direction::from_angles(1.0, 0.5)),
            (Direction::from_angles(PI, 0.0), Direction::X),
        ] {
            let turn = frame(central);
            let mut y_o = vec![0.0; outgoing.degree().rows()];
            outgoing.evaluate_into(turn.inverse().apply(view), &mut y_o);
            let mut y_i = vec![0.0; incident.degree().rows()];
            let mut expected = 0.0;
            for (theta, weight) in nodes.iter().zip(&weights) {
                for column in 0..columns {
                    let w_i = Direction::from_angles(*theta, TAU * column as f64 / columns as f64);
                    incident.evaluate_into(w_i, &mut y_i);
                    expected += weight * TAU / columns as f64
                        * light.evaluate(&sky, turn.apply(w_i))[0]
                        * rho_hat(&brdf, &y_i, &y_o);
                }
            }
            let found = reflection.evaluate(central, view)[0];
            assert!((found - expected).abs() < 1e-12, "F {f}, P {p}: {found} {expected}");
        }
    }
}

#[test]
fn a_view_enters_the_frame_of_its_central_direction() {
    for k in 0..40 {
        let central = Direction::from_angles(f64::from(k) * PI / 39.0, 2.3 * f64::from(k));
        let view = Direction::from_angles(1.0 + 0.05 * f64::from(k), -1.7 * f64::from(k));
        let expected = frame(central).inverse().apply(view).vector();
        // At theta = pi sin(pi) is 1e-16 and not 0: phi is still defined.
        assert!((into_frame(central, view).vector() - expected).length() < 1e-14, "{k}");
    }
    for pole in [Direction::Z, Direction::normalised(-Direction::Z.vector())] {
        let expected = frame(pole).inverse().apply(Direction::Y).vector();
        assert!((into_frame(pole, Direction::Y).vector() - expected).length() < 1e-15);
    }
}

/// The mean over views is b_00 Y_00; head on, the view is the central direction.
#[test]
fn plain_maps_are_the_mean_over_views_and_the_view_head_on() {
    let reflection = reflection(5, 3, true);
    let (mean, head_on) = (reflection.plain(Plain::Mean), reflection.plain(Plain::HeadOn));
    let central = Direction::from_angles(0.9, -2.0);
    let b = reflection.coefficients(central);
    for channel in 0..3 {
        let expected = b[0][channel] / (4.0 * PI).sqrt();
        assert!((mean.evaluate(central)[channel] - expected).abs() < 1e-13);
        let expected = reflection.evaluate(central, central)[channel];
        assert!((head_on.evaluate(central)[channel] - expected).abs() < 1e-13);
    }
}

#[test]
fn azimuth_is_found_in_the_coefficients() {
    assert!(!reflection(4, 2, true).is_azimuth_free());
    assert!(reflection(4, 2, false).is_azimuth_free());
    assert!(reflection(4, 0, true).is_azimuth_free());
    assert!(reflection(0, 4, true).is_azimuth_free(), "there is no q > l");
}
