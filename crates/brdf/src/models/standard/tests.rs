//! Tests of the model `standard`.

use super::*;
use crate::{Material, checks};

/// The example that has every term at once.
fn coated() -> Standard {
    Standard::examples().unwrap().swap_remove(0)
}

fn standard(parameters: StandardParameters) -> Standard {
    Standard::new(parameters).unwrap()
}

/// The white furnace: a white material is invisible under a constant sky. `checks` integrates rho_hat
/// adaptively, to 1e-3, and knows nothing of the tables; a line between two of their nodes is off by as
/// much again, and narrow sheen by more.
#[test]
fn a_white_material_reflects_all_light_toward_every_view() {
    let mut worst: f64 = 0.0;
    // Coat and sheen, with their roughnesses.
    let layers = [
        ([0.0, 0.3], [0.0, 0.5]),
        ([1.0, 0.02], [0.0, 0.5]),
        ([1.0, 0.1], [0.0, 0.5]),
        ([0.5, 0.6], [0.0, 0.5]),
        ([0.0, 0.3], [1.0, 0.3]),
        ([0.0, 0.3], [1.0, 0.1]),
        ([1.0, 0.1], [1.0, 0.1]),
    ];
    for metallic in [0.0, 0.4, 1.0] {
        for roughness in [0.02, 0.1, 0.2, 0.35, 0.6, 1.0] {
            for ([clearcoat, clearcoat_roughness], [sheen, sheen_roughness]) in layers {
                let parameters = StandardParameters {
                    metallic,
                    roughness,
                    clearcoat,
                    clearcoat_roughness,
                    sheen: [sheen; 3],
                    sheen_roughness,
                    ..StandardParameters::default()
                };
                for albedo in checks(&Material::Standard(standard(parameters))).albedo {
                    let errors = albedo.rgb.map(|value| (value - 1.0).abs());
                    assert!(greatest(errors) < 4e-3, "{parameters:?}: {albedo:?}");
                    worst = worst.max(greatest(errors));
                }
            }
        }
    }
    eprintln!("the greatest error in a white furnace is {worst:.1e}");
}

/// Colours and weights take light away and never add any; a dielectric's highlight is only as bright as
/// `specular` says.
#[test]
fn no_standard_material_makes_light() {
    let mut materials = vec![coated()];
    for ior in [1.0, 1.2, 2.4, 10.0] {
        for specular in [0.0, 0.5, 1.0] {
            for specular_color in [[0.0; 3], [1.0, 0.5, 0.1], [1e6; 3]] {
                let base_color = [1.0, 0.8, 0.1];
                materials.push(standard(StandardParameters {
                    base_color,
                    ior,
                    specular,
                    specular_color,
                    ..StandardParameters::default()
                }));
            }
        }
    }
    for material in materials {
        let greatest = checks(&Material::Standard(material.clone())).greatest();
        assert!(greatest.greatest() < 1.002, "{:?}: {greatest:?}", material.parameters());
    }
    // Without a highlight the rest is lambert.
    let matte = standard(StandardParameters { specular: 0.0, ..StandardParameters::default() });
    for albedo in checks(&Material::Standard(matte)).albedo {
        assert!((albedo.rgb[0] - 1.0).abs() < 1e-4, "{albedo:?}");
    }
}

/// Four pairs of (theta, phi) of light and view, against values that a program without this project's
/// code computed from the textbook forms: tangents, Smith's Lambda, and albedos by quadrature over the
/// light's height and azimuth at 160 cosines, for which it takes a parabola between them.
#[test]
fn fingerprints_of_every_term() {
    let rows = [
        ([(0.3, 0.2), (0.5, 2.9)], [7.930885e-01, 4.448126e-01, 1.829825e-01]),
        ([(1.1, 1.0), (0.9, -2.3)], [6.911599e-01, 3.960599e-01, 1.752653e-01]),
        ([(1.45, 0.4), (1.35, -2.6)], [8.404155e-02, 6.402254e-02, 4.919461e-02]),
        ([(0.7, 0.1), (0.6, 0.5)], [1.040385e-01, 5.888855e-02, 2.242269e-02]),
    ];
    let material = coated();
    let mut worst: f64 = 0.0;
    for ([light, view], expected) in rows {
        let [light, view] = [light, view].map(|(theta, phi)| Direction::from_angles(theta, phi));
        let found = material.rho_hat(light, view);
        let errors = [0, 1, 2].map(|channel| (found[channel] / expected[channel] - 1.0).abs());
        worst = worst.max(greatest(errors));
    }
    eprintln!("the formula differs by {worst:.1e}");
    assert!(worst < 2e-4, "{worst:e}");
}

/// BRDF(L, V) = BRDF(V, L), up to rounding, with every term, also toward grazing.
#[test]
fn every_term_is_reciprocal() {
    let difference = checks(&Material::Standard(coated())).reciprocity;
    eprintln!("light and view exchanged differ by {difference:.1e}");
    assert!(difference < 1e-12, "{difference:e}");
}

/// Pairs of light and view over the hemisphere.
fn pairs() -> impl Iterator<Item = [Direction; 2]> {
    (0..400).map(|i| {
        let at = |k: f64| (f64::from(i) * k).fract();
        let above = |u: f64, v: f64| Direction::from_angles((1.0 - u).acos(), std::f64::consts::TAU * v);
        [above(at(0.618), at(0.414)), above(at(0.732), at(0.236))]
    })
}

#[test]
fn parts_sum_to_the_whole() {
    let plain = StandardParameters::default;
    let whole = [
        coated(),
        standard(plain()),
        standard(StandardParameters { metallic: 1.0, ..plain() }),
        standard(StandardParameters { specular: 0.0, ..plain() }),
        standard(StandardParameters { base_color: [0.0; 3], specular: 0.0, ..plain() }),
    ];
    for (material, centres) in whole.into_iter().zip([
        &[Centre::Reflection, Centre::Normal][..],
        &[Centre::Reflection, Centre::Normal],
        &[Centre::Reflection, Centre::Normal],
        &[Centre::Normal],
        &[],
    ]) {
        let parts = material.parts();
        assert_eq!(material.centre(), Centre::Reflection);
        assert_eq!(parts.iter().map(Model::centre).collect::<Vec<_>>(), centres);
        for [incident, outgoing] in pairs() {
            let expected = material.rho_hat(incident, outgoing);
            for channel in 0..3 {
                let sum: f64 = parts.iter().map(|part| part.rho_hat(incident, outgoing)[channel]).sum();
                assert!((sum - expected[channel]).abs() <= 1e-13 * expected[channel], "{material:?}");
            }
        }
        for part in parts {
            assert_eq!(part.parts(), std::slice::from_ref(&part));
            assert_eq!(Standard::from_values(&part.values()).unwrap(), material);
        }
    }
}

/// A smooth metal seen head on reflects its base colour, and glass 4 percent and its coat's 4 percent.
#[test]
fn highlights_have_the_reflectance_of_gltf() {
    let head_on = |parameters| {
        let parts = standard(parameters).parts();
        checks(&Material::Standard(parts[0].clone())).albedo[0].rgb
    };
    let plain = StandardParameters { roughness: 0.05, ..StandardParameters::default() };
    let metal = head_on(StandardParameters { metallic: 1.0, base_color: [0.9, 0.5, 0.1], ..plain });
    for (found, expected) in metal.into_iter().zip([0.9, 0.5, 0.1]) {
        assert!((found - expected).abs() < 1e-3, "{metal:?}");
    }
    for (parameters, expected) in [
        (plain, 0.04),
        (StandardParameters { specular: 0.5, ..plain }, 0.02),
        (StandardParameters { ior: 2.0, ..plain }, 1.0 / 9.0),
        (StandardParameters { ior: 2.0, specular_color: [0.5; 3], ..plain }, 0.5 / 9.0),
        // The coat takes its share of what the base would reflect.
        (StandardParameters { clearcoat: 1.0, ..plain }, 0.04 + 0.96 * 0.04),
    ] {
        let found = head_on(parameters)[0];
        assert!((found - expected).abs() < 1e-3, "{parameters:?}: {found} {expected}");
    }
}

/// The oracle is the albedo of the material that has the other base colour, integrated without the tables of
/// albedos. The tolerance is that of the white furnace.
#[test]
fn the_response_to_a_base_colour_is_the_albedo_of_that_material() {
    let mut worst: f64 = 0.0;
    let plain = StandardParameters { base_color: [0.5, 0.1, 0.8], ..StandardParameters::default() };
    let coated = coated().parameters();
    for parameters in [
        plain,
        StandardParameters { metallic: 1.0, roughness: 0.3, ..plain },
        StandardParameters { metallic: 1.0, roughness: 1.0, ..plain },
        coated,
    ] {
        let response = standard(parameters).base_color_response();
        for base_color in [[0.0; 3], [0.02, 0.4, 0.9], [1.0; 3], parameters.base_color] {
            let other = standard(StandardParameters { base_color, ..parameters });
            for found in checks(&Material::Standard(other)).albedo {
                let [matte, rest] = response.albedo(base_color, found.theta.to_radians().cos());
                for channel in 0..3 {
                    let error = (matte[channel] + rest[channel] - found.rgb[channel]).abs();
                    assert!(error < 4e-3, "{parameters:?} {base_color:?} {found:?}: {matte:?} {rest:?}");
                    worst = worst.max(error);
                }
            }
        }
    }
    eprintln!("the greatest error of the response is {worst:.1e}");
}

/// The matte base is what a white base adds to a black one.
#[test]
fn the_matte_base_has_the_zonal_coefficients_of_its_response() {
    let with = |base_color| {
        standard(StandardParameters { base_color: [base_color; 3], ior: 2.0, ..coated().parameters() })
    };
    let dielectric = |base_color| {
        let parameters = StandardParameters { metallic: 0.0, ..with(base_color).parameters() };
        standard(parameters)
    };
    let (white, black) = (dielectric(1.0), dielectric(0.0));
    let response = white.base_color_response();
    let view = sphere::Direction::from_angles(0.7, 0.3);
    let (mut sums, steps) = ([0.0; 3], 20_000);
    for step in 0..steps {
        let cosine = (f64::from(step) + 0.5) / f64::from(steps);
        let light = sphere::Direction::from_angles(cosine.acos(), 1.0);
        let matte = white.rho_hat(light, view)[1] - black.rho_hat(light, view)[1];
        let legendre = [1.0, cosine, 1.5 * cosine * cosine - 0.5];
        let weight = 2.0 * PI / f64::from(steps) * matte;
        sums.iter_mut().zip(legendre).for_each(|(sum, p)| *sum += weight * p);
    }
    let [[.., matte], _] = response.albedo([1.0; 3], 0.7_f64.cos());
    for (found, expected) in response.matte.iter().zip(sums) {
        assert!((found * matte - expected).abs() < 1e-4, "{found} {expected} {matte}");
    }
    assert!((response.matte[0] - 1.0).abs() < 1e-12);
}

/// Four pairs at once have the bits of each pair alone, also below the horizon and where fewer than four are
/// left.
#[test]
fn values_of_many_pairs_are_those_of_each() {
    let coat = StandardParameters { sheen: [0.0; 3], ..coated().parameters() };
    let metal = StandardParameters { metallic: 1.0, roughness: 0.3, ..StandardParameters::default() };
    let mut materials =
        vec![standard(coat), standard(metal), coated(), standard(StandardParameters::default())];
    materials.extend(standard(coat).parts());
    let fraction = |index: usize, step: f64| (0.5 + index as f64 * step).fract();
    let pairs: Vec<[sphere::Direction; 2]> = (0..1003)
        .map(|index| {
            let light = sphere::Direction::from_angles(
                PI * fraction(index, 0.754_877),
                2.0 * PI * fraction(index, 0.569_84),
            );
            let view = sphere::Direction::from_angles(
                0.5 * PI * fraction(index, 0.672_1),
                PI * fraction(index, 0.331_7),
            );
            [light, view]
        })
        .collect();
    for material in materials {
        let mut values = vec![[f64::NAN; 3]; pairs.len()];
        material.rho_hats(&pairs, &mut values);
        for (value, [light, view]) in values.iter().zip(&pairs) {
            let expected = material.rho_hat(*light, *view);
            assert_eq!(value.map(f64::to_bits), expected.map(f64::to_bits), "{light:?} {view:?}");
        }
        let lights: Vec<sphere::Direction> = pairs.iter().map(|[light, _]| *light).collect();
        for [_, view] in pairs.iter().step_by(97).copied() {
            material.rho_hats_toward(view, &lights, &mut values);
            for (value, light) in values.iter().zip(&lights) {
                let expected = material.rho_hat(*light, view);
                assert_eq!(value.map(f64::to_bits), expected.map(f64::to_bits), "{light:?} {view:?}");
            }
        }
    }
}
