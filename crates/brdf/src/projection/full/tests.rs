//! The fixed grids against the adaptive projection and closed forms.

use glam::DVec3;
use sh::{Degree, Stop};
use sphere::Direction;

use crate::projection::general;
use crate::projection::legendre::Legendre;
use crate::{Centre, Choice, Fresnel, Ggx, KajiyaKay, Material, Microfacet, OrenNayar, Phong, project};

/// The fixed grid gives the coefficients of the adaptive one. Oren-nayar has a kink away from the peak.
#[test]
fn full_coefficients_are_the_exact_ones() {
    let metal = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    let materials = [
        (Material::Microfacet(Microfacet::new(0.2, [1.0, 0.5, 0.2]).unwrap()), [20, 8]),
        (Material::Ggx(Ggx::new(0.5, metal, [1.0; 3]).unwrap()), [20, 8]),
        (Material::Ggx(Ggx::new(0.2, metal, [1.0; 3]).unwrap()), [100, 9]),
        (Material::OrenNayar(OrenNayar::new([0.8, 0.5, 0.1], 30.0).unwrap()), [60, 9]),
        (Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap()), [20, 8]),
    ];
    for (material, [highest_l, highest_p]) in materials {
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap();
        let exact = project(
            &material,
            Choice::Degree { f: Degree::new(highest_l).unwrap(), p: Degree::new(highest_p).unwrap() },
            Stop::NEVER,
        )
        .unwrap()
        .coefficients;
        let (mut apart, mut norm) = (0.0, 0.0);
        for l in 0..=highest_l {
            for p in 0..=highest_p {
                for q in 0..=p {
                    let (a, b) = (full.coefficients.get(l, p, q), exact.get(l, p, q));
                    for channel in 0..3 {
                        apart += (a[channel] - b[channel]).powi(2);
                        norm += b[channel].powi(2);
                    }
                }
            }
        }
        let share: f64 = (apart / norm).sqrt();
        assert!(share < 2e-3, "{}: {share:.1e}", material.name());
        assert!(full.captured > 0.9, "{}: {}", material.name(), full.captured);
    }
}

/// What a check of rings compares with: the coefficients of the full grid within a percent, also where F is
/// below P.
#[test]
fn a_sketch_is_near_the_full_coefficients() {
    let metal = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    let materials = [
        Material::Microfacet(Microfacet::new(0.2, [1.0, 0.5, 0.2]).unwrap()),
        Material::Ggx(Ggx::new(0.3, metal, [1.0; 3]).unwrap()),
        Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap()),
    ];
    for material in materials {
        let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        for f in [6, 60] {
            let f = Degree::new(f).unwrap();
            let sketch = project(&material, Choice::Sketch { f }, Stop::NEVER).unwrap().coefficients;
            let p = sketch.p();
            assert!(p.get() == 20 && sketch.f() <= f);
            let exact = full.cut_to(sketch.f(), p);
            let pairs = sketch.rho().as_flattened().iter().zip(exact.rho().as_flattened());
            let apart: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
            let norm: f64 = exact.rho().as_flattened().iter().map(|value| value * value).sum();
            let share = (apart / norm).sqrt();
            assert!(share < 1e-2, "{} {}: {share:.1e}", material.name(), f.get());
        }
    }
}

/// Phong about R in closed form needs no view, and its F is the least that keeps all but 1e-7.
#[test]
fn full_coefficients_of_a_radial_material_have_no_view() {
    let full =
        project(&Material::Phong(Phong::new(150.0, [1.0, 0.5, 0.25]).unwrap()), Choice::Full, Stop::NEVER)
            .unwrap();
    assert_eq!(full.coefficients.p(), Degree::ZERO);
    assert!((30..120).contains(&full.coefficients.f().get()), "{}", full.coefficients.f().get());
}

/// A product of two functions is one coefficient: for orders and degrees of each parity, in the full grid and
/// in the coarse one, also at F = 0. It goes below the horizon.
#[test]
fn a_product_is_one_coefficient_of_the_fixed_grids() {
    let legendre = Legendre::new(30, 24);
    let function = |l: usize, q: usize, theta: f64| {
        let mut found = 0.0;
        legendre.order(q, &[theta.cos()], &[theta.sin()], |degree, value| {
            if degree == l {
                found = value[0];
            }
        });
        found
    };
    for [l, p, q] in [[0, 0, 0], [6, 3, 0], [7, 5, 2], [9, 8, 5], [14, 17, 10], [17, 20, 17], [18, 19, 18]] {
        let model = |incident: Direction, outgoing: Direction| {
            let (light, view) = (incident.vector(), outgoing.vector());
            let reflected = DVec3::new(-view.x, -view.y, view.z);
            let across = |v: DVec3| (v - reflected * v.dot(reflected)).normalize_or_zero();
            let phi = across(light).dot(across(view)).clamp(-1.0, 1.0).acos();
            let angle = |v: DVec3| v.dot(reflected).clamp(-1.0, 1.0).acos();
            let product = function(l, q, angle(light)) * function(p, q, angle(view));
            [product * (q as f64 * phi).cos(), 0.0, 0.0]
        };
        let toward_view = |outgoing: Direction, incident: &[Direction], values: &mut [[f64; 3]]| {
            values.iter_mut().zip(incident).for_each(|(value, incident)| *value = model(*incident, outgoing));
        };
        for choice in [Choice::Full, Choice::Sketch { f: Degree::new(l).unwrap() }] {
            let found = general(Centre::Reflection, &toward_view, true, choice, Stop::NEVER).unwrap();
            let found = found.coefficients;
            assert!(found.f().get() >= l && found.p().get() >= p);
            for at_l in 0..=l {
                for at_p in 0..=20 {
                    for at_q in 0..=at_p.min(at_l) {
                        let expected = match q {
                            _ if [at_l, at_p, at_q] != [l, p, q] => 0.0,
                            0 => 1.0,
                            _ => 0.5,
                        };
                        let value = found.get(at_l, at_p, at_q)[0];
                        assert!(
                            (value - expected).abs() < 2e-3,
                            "{l} {p} {q}: {at_l} {at_p} {at_q} {value} {expected}"
                        );
                    }
                }
            }
        }
    }
}
