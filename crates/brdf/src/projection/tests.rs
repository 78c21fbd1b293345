//! Projections against closed forms and brute force.

use super::*;
use crate::{Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Model, Phong};
use glam::DVec3;
use sh::Basis;
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

/// F is about sqrt(-s log(tolerance)) [RH02, app. D].
#[test]
fn phong_needs_the_degrees_of_the_paper() {
    let exponents = [8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];
    let degrees =
        exponents.map(|s| project(&phong(s), tolerance(0.01), Stop::NEVER).unwrap().coefficients.f().get());
    assert_eq!(degrees, [6, 8, 12, 17, 24, 34, 48]);
}

#[test]
fn the_degree_chosen_is_the_least_that_captures_enough() {
    for material in [lambert(), phong(3.7), phong(100.0)] {
        for share in [0.3, 0.03, 0.001] {
            let chosen = project(&material, tolerance(share), Stop::NEVER).unwrap();
            assert!(chosen.captured >= 1.0 - share && chosen.captured <= 1.0);
            let f = chosen.coefficients.f().get();
            if f > 0 {
                assert!(project(&material, degree(f - 1, 0), Stop::NEVER).unwrap().captured < 1.0 - share);
            }
        }
    }
}

/// The paper on irradiance maps (Ramamoorthi and Hanrahan 2001): A_0 = pi, A_1 = 2 pi / 3, A_2 = pi / 4, for
/// albedo pi, A_l = Lambda_l rho_l00 Y_00.
#[test]
fn lambert_scales_the_first_degrees_by_1_two_thirds_and_a_quarter() {
    let material = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
    let projection = project(&material, degree(4, 0), Stop::NEVER).unwrap();
    assert_eq!(projection.coefficients.centre(), Centre::Normal);
    for (l, expected) in [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0].into_iter().enumerate() {
        let factor = sh::lambda(l) * projection.coefficients.get(l, 0, 0)[0] / (4.0 * PI).sqrt();
        assert!((factor - expected).abs() < 1e-15, "l {l}: {factor}");
    }
}

/// The coefficients rebuild rho_hat. The series of cos^s is cut at F = 1500, where its terms fall as
/// l^-(s+1); for Lambert, directly at the kink, the truncated rest is below albedo / (2 pi F) = 1e-4.
#[test]
fn coefficients_rebuild_rho_hat() {
    for (material, allowed) in [(lambert(), 1e-4), (phong(5.0), 1e-10), (phong(40.5), 1e-10)] {
        let projection = project(&material, degree(1500, 0), Stop::NEVER).unwrap();
        let mut y_l0 = vec![0.0; 1501];
        for i in 0..50 {
            let incident = Direction::from_angles(f64::from(i) * PI / 50.0 + 0.01, 0.4);
            sh::zonal_into(incident.vector().z, &mut y_l0);
            let expected = material.rho_hat_about_centre(incident, Direction::X);
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
    let plain = project(&phong(9.0), degree(5, 0), Stop::NEVER).unwrap();
    let wide = project(&phong(9.0), degree(5, 2), Stop::NEVER).unwrap();
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
    let projection = project(&black, tolerance(0.01), Stop::NEVER).unwrap();
    assert_eq!((projection.coefficients.f().get(), projection.captured), (0, 1.0));
}

#[test]
fn a_mirror_has_no_degree_by_tolerance() {
    let error = project(&phong(1e7), tolerance(0.01), Stop::NEVER).unwrap_err();
    assert!(matches!(error, ProjectionError::TooSharp { captured, .. } if captured > 0.2 && captured < 0.99));
    assert!(project(&phong(1e7), degree(2048, 0), Stop::NEVER).is_ok());
}

#[test]
fn too_many_coefficients_are_an_error() {
    assert_eq!(
        project(&lambert(), degree(2048, 2048), Stop::NEVER),
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

/// The model of [RH02, eq. 11].
fn microfacet(sigma: f64) -> impl Fn(Direction, Direction) -> [f64; 3] {
    let model = Microfacet::new(sigma, [1.0; 3]).unwrap();
    move |incident, outgoing| model.rho_hat(incident, outgoing)
}

/// A function of one pair of directions, toward one view.
fn toward_view(
    rho_hat: &(dyn Fn(Direction, Direction) -> [f64; 3] + Sync),
) -> impl Fn(Direction, &[Direction], &mut [[f64; 3]]) + Sync {
    move |outgoing, incident, values| {
        for (value, incident) in values.iter_mut().zip(incident) {
            *value = rho_hat(*incident, outgoing);
        }
    }
}

fn general_table(
    centre: Centre,
    rho_hat: &(dyn Fn(Direction, Direction) -> [f64; 3] + Sync),
    f: usize,
    p: usize,
) -> Projection {
    general(centre, &toward_view(rho_hat), reaches_below(rho_hat), degree(f, p), Stop::NEVER).unwrap()
}

/// The largest difference of two tensors, relative to their norm.
fn difference(found: &Projection, expected: impl Fn(usize, usize, usize) -> [f64; 3]) -> f64 {
    let coefficients = &found.coefficients;
    let mut worst: f64 = 0.0;
    for l in 0..=coefficients.f().get() {
        for p in 0..=coefficients.p().get() {
            for q in 0..=coefficients.p().get() {
                let expected = if q <= l.min(p) { expected(l, p, q) } else { [0.0; 3] };
                let found = coefficients.get(l, p, q);
                (0..3).for_each(|c| worst = worst.max((found[c] - expected[c]).abs()));
            }
        }
    }
    worst / found.total.sqrt()
}

/// The general projection of Phong about R and Lambert about N agrees with the closed forms: panels of 15
/// nodes integrate small powers of the cosine up to rounding, and power 512 up to the accuracy of the
/// refinement.
#[test]
fn the_general_projection_gives_the_closed_forms() {
    let mut cases = vec![(lambert(), 1e-13)];
    cases.extend([(1.0, 1e-12), (5.0, 1e-12), (32.0, 1e-10), (512.0, 1e-9)].map(|(s, a)| (phong(s), a)));
    for (material, allowed) in cases {
        let rho_hat = |incident: Direction, outgoing: Direction| material.rho_hat(incident, outgoing);
        let found = general_table(material.centre(), &rho_hat, 30, 4);
        let exact = material.radial().unwrap();
        let expected = exact.coefficients(30);
        let error = difference(&found, |l, p, _| if p == 0 { expected[l] } else { [0.0; 3] });
        let energy = found.total / exact.energy() - 1.0;
        println!("{}: {error:e} {energy:e}", material.name());
        assert!(
            error < allowed && energy.abs() < 10.0 * allowed,
            "{}: {error:e} {energy:e}",
            material.name()
        );
    }
}

/// Lambert about R: u(N.w_i) = sum of u_l Y_l0 = sum of u_l Lambda_l Y*_lq(w_i) Y_lq(N) with N at theta_o / 2
/// in w_o's azimuth, so that rho_lpq = 2 pi u_l Lambda_l times the integral of f_lq(theta_o / 2)
/// f_pq(theta_o) sin(theta_o).
#[test]
fn lambert_about_the_reflection_vector_has_its_closed_form() {
    let chalk = lambert();
    let rho_hat = |incident: Direction, outgoing: Direction| chalk.rho_hat(incident, outgoing);
    let found = general_table(Centre::Reflection, &rho_hat, 12, 6);
    let (nodes, weights) = sh::quadrature::gauss_legendre(400);
    let basis = Basis::new(Degree::new(12).unwrap());
    let at = |theta: f64| {
        let mut rows = vec![0.0; basis.degree().rows()];
        basis.evaluate_into(Direction::from_angles(theta, 0.0), &mut rows);
        move |l: usize, q: usize| rows[l * l + l + q] / if q > 0 { 2f64.sqrt() } else { 1.0 }
    };
    let u = chalk.radial().unwrap().coefficients(12);
    let y_00 = 1.0 / (4.0 * PI).sqrt();
    let error = difference(&found, |l, p, q| {
        let overlap: f64 = nodes
            .iter()
            .zip(&weights)
            .map(|(&theta, weight)| weight * at(theta / 2.0)(l, q) * at(theta)(p, q))
            .sum();
        u[l].map(|u| 2.0 * PI * u * y_00 * sh::lambda(l) * overlap)
    });
    println!("{error:e}");
    // The pieces have no kink inside, so that the error is within the stated accuracy.
    assert!(error < 1e-7, "{error:e}");
    assert!((found.total / chalk.radial().unwrap().energy() - 1.0).abs() < 1e-7);
}

/// A smooth function of both directions that changes with the azimuth between them. In the frame of the
/// surface about T, the local z is x, the local y is -y.
fn smooth(incident: Direction, outgoing: Direction) -> [f64; 3] {
    let (l, v) = (incident.vector(), outgoing.vector());
    let value = (1.5 * l.dot(v) + 0.5 * l.x * v.x - 0.7 * v.x).exp() * (1.3 + l.x);
    [value, 0.5 * value, value * l.dot(v)]
}

/// The sum of rho_lpq Y*_lq(w_i) Y_pq(w_o) in real harmonics: both signs of q give cos q(phi_o - phi_i), as
/// products of the cosine harmonics plus those of the sine harmonics do.
fn rebuilt(found: &Projection, incident: Direction, outgoing: Direction) -> [f64; 3] {
    let coefficients = &found.coefficients;
    let [y_i, y_o] =
        [(coefficients.f(), incident), (coefficients.p(), outgoing)].map(|(degree, direction)| {
            let mut rows = vec![0.0; degree.rows()];
            Basis::new(degree).evaluate_into(direction, &mut rows);
            rows
        });
    let mut sum = [0.0; 3];
    for l in 0..=coefficients.f().get() {
        for p in 0..=coefficients.p().get() {
            for q in 0..=l.min(p) {
                let (i, o) = (l * l + l, p * p + p);
                let mut product = y_i[i + q] * y_o[o + q];
                if q > 0 {
                    product += y_i[i - q] * y_o[o - q];
                }
                (0..3).for_each(|c| sum[c] += coefficients.get(l, p, q)[c] * product);
            }
        }
    }
    sum
}

#[test]
fn coefficients_rebuild_a_function_of_two_directions() {
    let found = general_table(Centre::Tangent, &smooth, 18, 18);
    assert!(found.captured > 1.0 - 1e-9);
    for i in 0..40 {
        let x = f64::from(i);
        let incident = Direction::from_angles((0.37 * x) % PI, 2.1 * x);
        let outgoing = Direction::from_angles((1.03 * x) % PI, 0.9 * x + 1.0);
        let [in_surface, out_surface] = Centre::Tangent.surface(incident, outgoing);
        let (value, expected) = (rebuilt(&found, incident, outgoing), smooth(in_surface, out_surface));
        for channel in 0..3 {
            // Values reach 20; above degree 18 exp(1.5 x) has a rest of 1e-12, and the quadrature is accurate
            // to 1e-6 of the norm.
            assert!((value[channel] - expected[channel]).abs() < 1e-6, "{value:?} {expected:?}");
        }
    }
}

/// Brute force in four dimensions: the midpoint rule over both directions, each with its own azimuth, and the
/// real harmonics. As the horizon cuts through its cells, its relative accuracy is about 1 / its number of
/// steps.
#[test]
fn coefficients_agree_with_brute_force() {
    let model = microfacet(0.35);
    let found = general_table(Centre::Reflection, &model, 4, 3);
    let basis = Basis::new(Degree::new(4).unwrap());
    let [theta_steps, phi_steps] = [90usize, 72];
    let grid = |turns: usize| {
        (0..theta_steps).flat_map(move |i| {
            (0..turns).map(move |j| {
                let theta = PI * (i as f64 + 0.5) / theta_steps as f64;
                let phi = 2.0 * PI * (j as f64 + 0.5) / turns as f64;
                let area = theta.sin() * PI / theta_steps as f64 * 2.0 * PI / turns as f64;
                (Direction::from_angles(theta, phi), area)
            })
        })
    };
    let rows = |direction: Direction| {
        let mut rows = vec![0.0; 25];
        basis.evaluate_into(direction, &mut rows);
        rows
    };
    let incident: Vec<_> = grid(phi_steps).map(|(w, area)| (w, area, rows(w))).collect();
    let mut sums = vec![[0.0; 25]; 16];
    // Four azimuths of w_o, unlike any symmetry of the grid.
    for (outgoing, area_o) in grid(5) {
        let y_o = rows(outgoing);
        for (w, area_i, y_i) in &incident {
            let [light, view] = Centre::Reflection.surface(*w, outgoing);
            let value = model(light, view)[0] * area_o * area_i;
            if value > 0.0 {
                for (o, row) in sums.iter_mut().enumerate() {
                    (0..25).for_each(|i| row[i] += value * y_o[o] * y_i[i]);
                }
            }
        }
    }
    let norm = (found.total / 3.0).sqrt();
    for l in 0..=4usize {
        for p in 0..=3usize {
            for q in 0..=l.min(p) {
                // Y_lq Y_pq summed over both real harmonics of q is the complex coefficient, twice for q > 0.
                let (i, o) = (l * l + l, p * p + p);
                let mut sum = sums[o + q][i + q];
                if q > 0 {
                    sum = (sum + sums[o - q][i - q]) / 2.0;
                }
                let value = found.coefficients.get(l, p, q)[0];
                assert!((sum - value).abs() < 3e-3 * norm, "{l} {p} {q}: {value} {sum} of {norm}");
            }
        }
    }
}

/// The degrees of [RH02, tab. 5]; the first and third agree within one.
#[test]
fn the_microfacet_model_needs_the_degrees_of_the_paper() {
    for (sigma, expected) in [(0.1, (23, 2)), (0.2, (11, 2)), (0.3, (7, 2)), (0.4, (5, 2)), (0.5, (4, 2))] {
        let model = microfacet(sigma);
        let found = general(
            Centre::Reflection,
            &toward_view(&model),
            reaches_below(&model),
            tolerance(0.03),
            Stop::NEVER,
        )
        .unwrap();
        let (f, p) = (found.coefficients.f().get(), found.coefficients.p().get());
        assert_eq!((f, p), expected, "sigma {sigma}");
        assert!(found.captured >= 0.97);
        assert!(general_table(Centre::Reflection, &model, f - 1, p).captured < 0.97);
        assert!(general_table(Centre::Reflection, &model, f, p - 1).captured < 0.97);
    }
}

/// cos^s(theta_i - theta_o) about the tangent needs P = 8 for s = 32, and no azimuth [RH02, sec. 7.1].
#[test]
fn the_hair_model_needs_degree_8_and_no_azimuth() {
    let hair = Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap());
    let found = project(&hair, tolerance(0.03), Stop::NEVER).unwrap();
    println!("{} {} {}", found.coefficients.f().get(), found.coefficients.p().get(), found.captured);
    assert_eq!(found.coefficients.p().get(), 8);
    assert!(found.coefficients.is_azimuth_free());
    assert_eq!(found.coefficients.highest(), (8, 0));
    assert!(!found.anisotropic);
}

/// Nodes concentrate at a highlight of one degree and at one beside R: a table for far higher degrees agrees.
#[test]
fn sharp_highlights_are_resolved() {
    let aside = |light: Direction, view: Direction| {
        let (l, v) = (light.vector(), view.vector());
        [if l.z > 0.0 {
            (400.0 * (l.dot(DVec3::new(-0.8 * v.x, -0.8 * v.y, v.z).normalize()) - 1.0)).exp()
        } else {
            0.0
        }; 3]
    };
    let narrow = microfacet(0.02);
    let models: [&(dyn Fn(Direction, Direction) -> [f64; 3] + Sync); 2] = [&narrow, &aside];
    for model in models {
        let coarse = general_table(Centre::Reflection, model, 30, 3);
        let fine = general_table(Centre::Reflection, model, 120, 12);
        let error = difference(&coarse, |l, p, q| fine.coefficients.get(l, p, q));
        println!("{error:e} {:e} {:e}", coarse.total / fine.total - 1.0, coarse.uncertainty);
        assert!(error < 1e-6 && (coarse.total / fine.total - 1.0).abs() < 1e-5, "{error:e}");
    }
}

/// The energies of all degrees add up to the integral of rho_hat^2 [Ram02, eq. 5.18], and give the share that
/// is captured.
#[test]
fn energies_add_up() {
    let model = microfacet(0.3);
    let found = general_table(Centre::Reflection, &model, 20, 6);
    let coefficients = &found.coefficients;
    for l in 0..=20 {
        let row = &found.energy_lp[l * 7..][..7];
        assert!((row.iter().sum::<f64>() - found.energy[l]).abs() <= 1e-15 * found.energy[0]);
        let of_2: f64 = (0..=2)
            .map(|q| if q == 0 { 1.0 } else { 2.0 } * 3.0 * coefficients.get(l, 2, q)[0].powi(2))
            .sum();
        assert!((row[2] - of_2).abs() <= 1e-15 * found.energy[0]);
    }
    let held: f64 = found.energy.iter().sum();
    assert!((held / found.total - found.captured).abs() < 1e-14 && found.captured > 0.99);
    assert!((found.energy_per_p().iter().sum::<f64>() - found.captured).abs() < 1e-14);
}

#[test]
fn cutting_degrees_changes_no_coefficient() {
    let model = microfacet(0.4);
    let (wide, narrow) =
        (general_table(Centre::Reflection, &model, 20, 6), general_table(Centre::Reflection, &model, 5, 2));
    assert!(difference(&narrow, |l, p, q| wide.coefficients.get(l, p, q)) < 1e-6);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let model = microfacet(0.15);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            general(
                Centre::Reflection,
                &toward_view(&model),
                reaches_below(&model),
                tolerance(0.03),
                Stop::NEVER,
            )
            .unwrap()
        })
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

/// Layers that are radially symmetric about the same centre have a radially symmetric sum, although no closed
/// form is used.
#[test]
fn radially_symmetric_layers_have_no_view_dependence() {
    let layers = Material::layers(vec![phong(3.0), phong(40.0)]).unwrap();
    let found = project(&layers, degree(12, 3), Stop::NEVER).unwrap();
    assert_eq!(found.coefficients.highest(), (0, 0));
    let parts = [3.0, 40.0].map(|s| phong(s).radial().unwrap().coefficients(12));
    let error = difference(&found, |l, p, _| match p {
        0 => [0, 1, 2].map(|c| parts[0][l][c] + parts[1][l][c]),
        _ => [0.0; 3],
    });
    assert!(error < 1e-9, "{error:e}");
}

#[test]
fn a_view_degree_past_the_incident_degree_is_defined() {
    let found = general_table(Centre::Reflection, &microfacet(0.3), 1, 5);
    assert_eq!(found.coefficients.rho().len(), 2 * 36);
    for p in 0..=5 {
        assert!((2..=5).all(|q| found.coefficients.get(1, p, q) == [0.0; 3]));
        assert!(p == 0 || found.coefficients.get(1, p, 1)[0] != 0.0);
    }
    let constant = general_table(Centre::Reflection, &microfacet(0.3), 0, 3);
    assert_eq!(constant.coefficients.rho().len(), 16);
}

#[test]
fn a_black_rho_hat_is_degree_0() {
    let black = |_: Direction, _: Direction| [0.0; 3];
    let found = general(
        Centre::Reflection,
        &toward_view(&black),
        reaches_below(&black),
        tolerance(0.01),
        Stop::NEVER,
    )
    .unwrap();
    assert_eq!((found.coefficients.f().get(), found.coefficients.p().get(), found.captured), (0, 0, 1.0));
    assert_eq!(found.energy_per_p(), [1.0]);
    assert_eq!(general_table(Centre::Reflection, &black, 3, 2).captured, 1.0);
}

#[test]
fn a_value_that_is_not_finite_is_an_error_with_its_place() {
    let broken = |light: Direction, _: Direction| [if light.vector().z > 0.99 { f64::NAN } else { 1.0 }; 3];
    let error =
        general(Centre::Normal, &toward_view(&broken), reaches_below(&broken), tolerance(0.01), Stop::NEVER)
            .unwrap_err();
    assert!(matches!(error, ProjectionError::NotFinite { theta_i, .. } if theta_i < 8.2), "{error}");
    assert!(error.to_string().starts_with("the material has no finite value at theta_i "));
    let infinite = |_: Direction, _: Direction| [1e200; 3];
    assert!(matches!(
        general(Centre::Normal, &toward_view(&infinite), reaches_below(&infinite), degree(2, 1), Stop::NEVER),
        Err(ProjectionError::NotFinite { .. })
    ));
}

#[test]
fn a_needle_is_too_sharp() {
    let needle = microfacet(1e-4);
    let error = general(
        Centre::Reflection,
        &toward_view(&needle),
        reaches_below(&needle),
        tolerance(0.01),
        Stop::NEVER,
    )
    .unwrap_err();
    assert!(matches!(error, ProjectionError::TooSharp { captured, .. } if captured < 0.9), "{error}");
}

/// GGX is brightest toward grazing views. If no usable degrees meet the tolerance, `captured` reports the
/// share, and there is no error.
#[test]
fn what_misses_the_tolerance_is_kept_if_it_holds_half() {
    let facets = Fresnel::Dielectric(1.5);
    let shiny = Material::Ggx(Ggx::new(0.3, facets, [1.0; 3]).unwrap());
    let found = project(&shiny, tolerance(0.03), Stop::NEVER).unwrap();
    let (f, p) = (found.coefficients.f().get(), found.coefficients.p().get());
    assert!(found.captured > 0.5 && found.captured < 0.97, "[{f}, {p}] {}", found.captured);
    assert!(p <= 32 && (f + 1) * (p + 1) * (p + 1) <= 1 << 17, "[{f}, {p}]");
}

/// With a small tolerance the cut at the horizon decides: a table of far higher degrees agrees.
#[test]
fn small_tolerances_are_met() {
    let model = microfacet(0.3);
    let found = general(
        Centre::Reflection,
        &toward_view(&model),
        reaches_below(&model),
        tolerance(1e-3),
        Stop::NEVER,
    )
    .unwrap();
    let (f, p) = (found.coefficients.f().get(), found.coefficients.p().get());
    let fine = general_table(Centre::Reflection, &model, 2 * f, 2 * p);
    let held: f64 = (0..=f).flat_map(|l| &fine.energy_lp[l * (2 * p + 1)..][..=p]).sum();
    println!("[{f}, {p}] {} {}", found.captured, held / fine.total);
    assert!((1.0 - held / fine.total) <= 1.001e-3 && found.captured >= 1.0 - 1e-3);
}

/// The mean over the turns of an isotropic material is the material itself.
#[test]
fn an_isotropic_material_is_its_own_mean() {
    let material = Material::Microfacet(Microfacet::new(0.3, [1.0, 0.5, 0.2]).unwrap());
    let (light, view) = (Direction::from_angles(0.9, 2.0), Direction::from_angles(0.6, -1.0));
    let (found, expected) = (material.mean_over_turns(19, light, view), material.rho_hat(light, view));
    assert!((found[1] - expected[1]).abs() < 1e-13 * expected[1]);
}
