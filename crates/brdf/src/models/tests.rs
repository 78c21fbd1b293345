//! Properties of every model, and each model against values that were derived independently.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;
use sh::Stop;
use sphere::Direction;

use super::*;
use crate::{Centre, checks};

fn glass() -> Fresnel {
    Fresnel::Dielectric(1.5)
}

fn lobe(cx: f64, cz: f64, n: f64) -> LafortuneLobe {
    LafortuneLobe { cx, cz, n, weight: [1.0; 3] }
}

/// The examples of every model, most of them with the greatest weight that makes no light.
pub(crate) fn every_model() -> Vec<Material> {
    Material::examples().unwrap()
}

#[test]
fn the_list_has_every_model_once_with_examples_of_all_its_parameters() {
    for (index, model) in MODELS.iter().enumerate() {
        assert!(MODELS[..index].iter().all(|other| other.name != model.name), "{}", model.name);
        let examples: Vec<_> =
            every_model().into_iter().filter(|material| material.name() == model.name).collect();
        assert!(!examples.is_empty(), "{}", model.name);
        for parameter in model.parameters {
            // A conductor or a dielectric, and one roughness for both directions or two, are a choice.
            let has = |material: &Material| material.values().get(parameter.name).is_some();
            assert!(parameter.absent == Absent::Optional || examples.iter().any(has), "{}", parameter.name);
        }
    }
}

#[test]
fn a_model_is_what_its_values_make() {
    for material in every_model() {
        let again = Material::analytic(material.name(), &material.values()).unwrap().unwrap();
        assert_eq!(again, material);
        let text = MODELS.iter().find(|model| model.name == material.name()).unwrap();
        for (name, _) in material.values().iter() {
            assert!(text.parameters.iter().any(|parameter| parameter.name == name), "{name}");
        }
    }
    assert!(Material::analytic("fong", &Values::default()).is_none());
}

#[test]
fn every_model_gives_a_renderer_constants_and_different_lobes() {
    let all = Material::layers(every_model().into_iter().filter(|m| m.centre() != Centre::Tangent).collect());
    for material in every_model().into_iter().chain([all.unwrap()]) {
        let (mut words, lobes) = (Vec::new(), material.lobes());
        material.constants().iter().for_each(|constants| constants.pack(&mut words));
        // Integers are finite numbers, too.
        let is_finite = words.iter().all(|word| f32::from_bits(*word).is_finite());
        assert!(words.len() >= 3 && is_finite, "{material:?}");
        assert!(!lobes.is_empty(), "{material:?}");
        assert!((1..lobes.len()).all(|k| !lobes[..k].contains(&lobes[k])), "{material:?}: {lobes:?}");
    }
}

/// Values past each end of each range, NaN and infinity, are refused with the parameter's name; the ends are
/// not.
#[test]
fn a_value_out_of_range_is_an_error_that_names_its_parameter() {
    fn error_of(range: &Range, make: impl Fn(f64) -> Option<ParameterError>) {
        let below = if range.least == 0.0 { -1e-9 } else { range.least - 1e-6 * range.least.abs() };
        for bad in [below, range.most * (1.0 + 1e-6), f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let error = make(bad).unwrap_or_else(|| panic!("{bad} passed"));
            assert_eq!(error.expected, range.words);
        }
        for good in [range.least, range.most] {
            // A lobe's own bound may still refuse the greatest power.
            assert!(make(good).is_none_or(|error| error.parameter == "n"), "{good}");
        }
    }
    let mut seen = 0;
    for material in every_model() {
        let text = MODELS.iter().find(|model| model.name == material.name()).unwrap();
        let make = |values: Values| Material::analytic(text.name, &values).unwrap().err();
        for parameter in text.parameters {
            let with = |value: Value| material.values().with(parameter.name, value);
            match (parameter.value_type, material.values().get(parameter.name)) {
                // Optional parameters are tested if the example has them.
                (_, None) if parameter.absent == Absent::Optional => continue,
                (ValueType::Number(range), _) => error_of(&range, |value| make(with(Value::Number(value)))),
                (ValueType::Colour(range), _) => {
                    error_of(&range, |value| make(with(Value::Colour([range.least, value, range.least]))))
                }
                (ValueType::Records(inner), Some(Value::Records(records))) => {
                    for inner in inner {
                        let (ValueType::Number(range) | ValueType::Colour(range)) = inner.value_type else {
                            panic!("nested")
                        };
                        error_of(&range, |value| {
                            let value = match inner.value_type {
                                ValueType::Colour(_) => Value::Colour([value; 3]),
                                _ => Value::Number(value),
                            };
                            let mut records = records.clone();
                            records[1].set(inner.name, value);
                            let error = make(with(Value::Records(records)))?;
                            assert_eq!(
                                (error.parameter, error.record),
                                (inner.name, Some((parameter.name, 1)))
                            );
                            Some(error)
                        });
                    }
                }
                other => panic!("{}: {other:?}", parameter.name),
            }
            seen += 1;
        }
    }
    assert!(seen > 25, "{seen}");
    let error = Phong::new(-1.0, [1.0; 3]).unwrap_err();
    assert_eq!(error.to_string(), "exponent: -1 is not a number from 0 to 1e9");
    let error = Lafortune::new([0.0; 3], vec![lobe(-1.0, 1.0, 5.0), lobe(-1.0, 2.0, 1e4)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "lobes[1].n: 10000 is not a power that keeps the lobe, max(|cx|, |cz|)^n, at 1e9 or below"
    );
}

#[test]
fn missing_and_contradicting_parameters_are_errors() {
    let ggx = |values: Values| Material::analytic("ggx", &values).unwrap().unwrap_err().to_string();
    let rough =
        || Values::default().with("roughness", Value::Number(0.5)).with("specular", Value::Number(1.0));
    assert_eq!(ggx(Values::default()), "roughness is missing; expected a number");
    assert_eq!(ggx(rough()), "ior is missing; give ior, or n and k");
    let n = rough().with("n", Value::Number(1.0));
    assert_eq!(ggx(n.clone()), "n has no effect without k; give both");
    assert_eq!(ggx(rough().with("k", Value::Number(1.0))), "k has no effect without n; give both");
    assert_eq!(ggx(n.with("ior", Value::Number(1.5))), "ior conflicts with n or k; give ior, or n and k");
}

/// Directions over the whole sphere, and exactly at the poles and the horizon.
fn directions() -> Vec<Direction> {
    let mut all: Vec<_> = (0..60)
        .map(|i| {
            let i = f64::from(i);
            Direction::from_angles((1.0 - 2.0 * (i * 0.618_034).fract()).acos(), i * 2.399_963)
        })
        .collect();
    let angles = [0.0, 1e-9, 1e-4, FRAC_PI_2 - 1e-4, FRAC_PI_2 - 1e-12, FRAC_PI_2, FRAC_PI_2 + 1e-12, PI];
    all.extend(
        angles
            .iter()
            .flat_map(|&theta| [0.0, 0.7, PI, PI + 0.7].map(|phi| Direction::from_angles(theta, phi))),
    );
    all.extend([Direction::X, Direction::Y, Direction::Z]);
    all.extend([-DVec3::X, -DVec3::Y, -DVec3::Z].map(Direction::from_unit));
    all.push(Direction::from_unit(DVec3::new(-1.0, 0.0, 1e-300)));
    all
}

fn above() -> impl Iterator<Item = Direction> + Clone {
    directions().into_iter().filter(|direction| direction.vector().z > 0.01)
}

#[test]
fn every_value_is_finite_and_not_negative() {
    let standard = |roughness: f64, clearcoat: f64, sheen_roughness: f64| {
        Material::Standard(
            Standard::new(StandardParameters {
                metallic: 0.5,
                roughness,
                clearcoat,
                specular_color: [1e6; 3],
                sheen: [1.0; 3],
                sheen_roughness,
                ..StandardParameters::default()
            })
            .unwrap(),
        )
    };
    let extreme = [
        standard(0.01, 1.0, 0.1),
        standard(1.0, 0.0, 1.0),
        Material::Microfacet(Microfacet::new(1e-4, [1e6; 3]).unwrap()),
        Material::Ggx(Ggx::new(0.01, Fresnel::GOLD, [1e6; 3]).unwrap()),
        Material::Ggx(Ggx::new(1.0, Fresnel::Dielectric(1.0), [1e6; 3]).unwrap()),
        Material::TorranceSparrow(TorranceSparrow::new(0.01, glass(), [1e6; 3]).unwrap()),
        Material::TorranceSparrow(TorranceSparrow::new(1.0, Fresnel::GOLD, [1e6; 3]).unwrap()),
        Material::Ward(Ward::new([0.01, 1.0], [1e6; 3]).unwrap()),
        Material::Ggx(Ggx::stretched([0.01, 1.0], Fresnel::GOLD, [1e6; 3]).unwrap()),
        Material::PoulinFournier(PoulinFournier::new(1e9, [1e6; 3], [1e6; 3], 100.0, 2.0).unwrap()),
        Material::PoulinFournier(PoulinFournier::new(0.0, [1e6; 3], [1e6; 3], 2.0, 0.01).unwrap()),
        Material::AshikhminShirley(AshikhminShirley::new([1e9, 0.0], [1e6; 3], [0.0, 0.5, 1.0]).unwrap()),
        Material::BlinnPhong(BlinnPhong::new(1e9, [1e6; 3]).unwrap()),
        Material::BlinnPhong(BlinnPhong::new(0.0, [1e6; 3]).unwrap()),
        Material::KajiyaKay(KajiyaKay::new(0.0, [1e6; 3]).unwrap()),
        Material::KajiyaKay(KajiyaKay::new(1e9, [1e6; 3]).unwrap()),
        Material::Phong(Phong::new(1e9, [1e6; 3]).unwrap()),
        Material::OrenNayar(OrenNayar::new([1e6; 3], 90.0).unwrap()),
        Material::Lafortune(
            Lafortune::new([1e6; 3], vec![lobe(-10.0, 10.0, 9.0), lobe(1.0, -1.0, 0.0)]).unwrap(),
        ),
    ];
    for material in every_model().into_iter().chain(extreme) {
        for incident in directions() {
            for outgoing in directions() {
                // A caller's rounding may put the view slightly below the horizon; rho_hat accepts every
                // view.
                let values =
                    [material.rho_hat(incident, outgoing), material.rho_hat_about_centre(incident, outgoing)];
                for value in values.as_flattened() {
                    let fine = value.is_finite() && *value >= 0.0;
                    assert!(fine, "{material:?} {incident:?} {outgoing:?}: {values:?}");
                    // A map holds 32-bit floats.
                    assert!(*value < 1e30, "{material:?} {incident:?} {outgoing:?}: {values:?}");
                }
            }
        }
    }
}

#[test]
fn only_models_whose_text_says_so_reflect_light_from_below_the_horizon() {
    for material in every_model() {
        let reaches = directions()
            .into_iter()
            .filter(|incident| incident.vector().z < 0.0)
            .any(|incident| above().any(|outgoing| material.rho_hat(incident, outgoing) != [0.0; 3]));
        assert_eq!(reaches, matches!(material.name(), "phong" | "kajiya-kay"), "{}", material.name());
    }
}

/// rho_hat includes the cosine, so that reciprocity is a property of the BRDF, rho_hat / cos. The models that
/// are defined by rho_hat itself (phong, microfacet and kajiya-kay) are not reciprocal.
#[test]
fn brdfs_are_reciprocal_unless_rho_hat_defines_them() {
    for material in every_model() {
        let reciprocal = !matches!(material.name(), "phong" | "microfacet" | "kajiya-kay");
        let difference = checks(&material).reciprocity;
        match reciprocal {
            true => assert!(difference < 1e-11, "{}: {difference}", material.name()),
            false => assert!(difference > 0.5, "{}: {difference}", material.name()),
        }
        let mut worst: f64 = 0.0;
        for incident in above() {
            for outgoing in above() {
                let there = material.rho_hat(incident, outgoing)[0] / incident.vector().z;
                let back = material.rho_hat(outgoing, incident)[0] / outgoing.vector().z;
                worst = worst.max((there - back).abs() / there.max(back).max(1e-9));
            }
        }
        assert_eq!(worst < 1e-9, reciprocal, "{}: {worst}", material.name());
    }
}

#[test]
fn isotropy_is_what_a_turn_about_the_normal_shows() {
    let turn = |direction: Direction| {
        let v = direction.vector();
        let (sine, cosine) = 0.8f64.sin_cos();
        Direction::normalised(DVec3::new(v.x * cosine - v.y * sine, v.x * sine + v.y * cosine, v.z))
    };
    for material in every_model() {
        let worst = above().flat_map(|incident| above().map(move |outgoing| (incident, outgoing))).fold(
            0.0,
            |worst: f64, (incident, outgoing)| {
                let one = material.rho_hat(incident, outgoing)[0];
                let other = material.rho_hat(turn(incident), turn(outgoing))[0];
                worst.max((one - other).abs() / one.max(1.0))
            },
        );
        assert_eq!(worst < 1e-9, material.is_isotropic(), "{}: {worst}", material.name());
    }
}

/// The furnace test, from sharp to rough: no view sees more than the model's weight of a constant sky. The
/// fit of Smith's masking is accurate to 0.35 percent, the integrals to 0.1 percent.
#[test]
fn no_view_sees_more_light_than_falls_on_the_surface() {
    let white = [1.0; 3];
    let mirror = Fresnel::Conductor { n: [0.01; 3], k: [50.0; 3] };
    let mut materials = every_model();
    for roughness in [0.03, 0.1, 0.3, 0.6, 1.0] {
        materials.push(Material::Ggx(Ggx::new(roughness, mirror, white).unwrap()));
        materials.push(Material::TorranceSparrow(TorranceSparrow::new(roughness, mirror, white).unwrap()));
        materials.push(Material::Ward(Ward::new([roughness; 2], white).unwrap()));
        materials.push(Material::Microfacet(Microfacet::new(roughness, white).unwrap()));
        materials.push(Material::Ward(Ward::new([roughness, 0.3], white).unwrap()));
        materials.push(Material::Ggx(Ggx::stretched([roughness, 0.4], mirror, white).unwrap()));
        materials.push(Material::OrenNayar(OrenNayar::new(white, 90.0 * roughness).unwrap()));
    }
    for (distance, height) in [(2.0, 0.5), (2.0, 1.0), (3.0, 1.6)] {
        let cylinders = PoulinFournier::new(10.0, [0.4; 3], [0.6; 3], distance, height).unwrap();
        materials.push(Material::PoulinFournier(cylinders));
    }
    for exponent in [0.0, 1.0, 10.0, 100.0, 1e5] {
        materials.push(Material::BlinnPhong(BlinnPhong::new(exponent, white).unwrap()));
        materials.push(Material::AshikhminShirley(
            AshikhminShirley::new([exponent, 30.0], white, [0.0, 0.5, 1.0]).unwrap(),
        ));
    }
    for material in materials {
        let greatest = checks(&material).greatest();
        // A + B / 2 - 1 is 0.0151 at most.
        let most = if material.name() == "oren-nayar" { 1.016 } else { 1.005 };
        assert!(greatest.greatest() < most, "{material:?}: {greatest:?}");
    }
}

/// With facets that reflect everything and little roughness, a view along the normal loses no light either.
#[test]
fn a_smooth_mirror_reflects_everything() {
    let mirror = Fresnel::Conductor { n: [0.01; 3], k: [50.0; 3] };
    let white = [1.0; 3];
    for material in [
        Material::Ggx(Ggx::new(0.05, mirror, white).unwrap()),
        Material::TorranceSparrow(TorranceSparrow::new(0.01, mirror, white).unwrap()),
        Material::Ward(Ward::new([0.01; 2], white).unwrap()),
        Material::BlinnPhong(BlinnPhong::new(1e5, white).unwrap()),
        Material::Microfacet(Microfacet::new(0.005, white).unwrap()),
        Material::AshikhminShirley(AshikhminShirley::new([1e5; 2], [0.0; 3], white).unwrap()),
    ] {
        let head_on = checks(&material).albedo[0].rgb[0];
        // k = 50, n = 0.01 reflect 0.99998; GGX's tail leaves the hemisphere with about alpha^2 of the light.
        assert!((head_on - 1.0).abs() < 2e-3, "{}: {head_on}", material.name());
    }
}

/// Every model can be projected, including black ones and P > F; anisotropic ones are averaged and marked.
#[test]
fn every_model_is_projected() {
    let degree = |l| sh::Degree::new(l).unwrap();
    let black = Material::Microfacet(Microfacet::new(0.3, [0.0; 3]).unwrap());
    for material in every_model().into_iter().chain([black]) {
        let choice = crate::Choice::Degree { f: degree(3), p: degree(4) };
        let found = crate::project(&material, choice, Stop::NEVER).unwrap();
        assert!(
            found.coefficients.rho().as_flattened().iter().all(|rho| rho.is_finite()),
            "{}",
            material.name()
        );
        assert!((0.0..=1.0).contains(&found.captured), "{}: {}", material.name(), found.captured);
        let turned = !material.is_isotropic() && material.centre() != Centre::Tangent;
        assert_eq!(found.anisotropic, turned, "{}", material.name());
    }
}

/// The factor of blinn-phong is exact for a view along the normal, and every other view sees less.
#[test]
fn blinn_phong_reflects_its_weight_head_on() {
    for exponent in [0.0, 0.5, 3.0, 40.0, 1e4] {
        let checks = checks(&Material::BlinnPhong(BlinnPhong::new(exponent, [0.7; 3]).unwrap()));
        assert!((checks.albedo[0].rgb[0] - 0.7).abs() < 1e-4, "{exponent}: {:?}", checks.albedo[0]);
        assert_eq!(checks.greatest().theta, 0.0);
    }
}

#[test]
fn special_cases_are_other_models() {
    let lambert = Lambert::new([0.8; 3]).unwrap();
    let smooth = OrenNayar::new([0.8; 3], 0.0).unwrap();
    let only_diffuse = Lafortune::new([0.8; 3], vec![]).unwrap();
    let uniform = BlinnPhong::new(0.0, [0.8; 3]).unwrap();
    // Phong's lobe, by the cosine of the angle to the mirror direction.
    let mirror_lobe = Lafortune::new([0.0; 3], vec![lobe(-1.0, 1.0, 7.0)]).unwrap();
    let phong = Phong::new(7.0, [TAU / 8.0; 3]).unwrap();
    for incident in above() {
        for outgoing in above() {
            let expected = lambert.rho_hat(incident, outgoing)[0];
            for found in [
                smooth.rho_hat(incident, outgoing)[0],
                only_diffuse.rho_hat(incident, outgoing)[0],
                uniform.rho_hat(incident, outgoing)[0],
            ] {
                assert!((found - expected).abs() < 1e-14);
            }
            let cosine = incident.vector().z;
            let expected = phong.rho_hat(incident, outgoing)[0] * cosine;
            assert!((mirror_lobe.rho_hat(incident, outgoing)[0] - expected).abs() < 1e-14);
        }
    }
    // An index of refraction of 1 reflects nothing, and neither does a black material.
    let air = Ggx::new(0.3, Fresnel::Dielectric(1.0), [1.0; 3]).unwrap();
    assert!(air.rho_hat(Direction::Z, Direction::Z)[0] < 1e-30);
    assert_eq!(Microfacet::new(0.3, [0.0; 3]).unwrap().rho_hat(Direction::Z, Direction::Z), [0.0; 3]);
}

/// Compares a material at four pairs of (theta, phi) of light and view with values that were computed
/// independently, from the textbook form in angles: with theta_h by arc cosine, tangents and complex Fresnel
/// amplitudes, none of which the models here use.
pub(super) fn assert_fingerprint(model: &impl Model, expected: [f64; 4]) {
    let pairs = [
        [(0.3, 0.2), (0.5, 2.9)],
        [(1.1, 1.0), (0.9, -2.3)],
        [(1.45, 0.4), (1.35, -2.6)],
        [(0.7, 0.1), (0.6, 0.5)],
    ];
    for ([light, view], expected) in pairs.into_iter().zip(expected) {
        let found =
            model.rho_hat(Direction::from_angles(light.0, light.1), Direction::from_angles(view.0, view.1));
        let error = (found[0] - expected).abs();
        assert!(error <= 1e-11 * expected.max(1e-3), "{model:?}: {} {expected}", found[0]);
    }
}

/// The fit of Smith's masking against its exact form with the error function, at the third and second pair
/// above.
#[test]
fn the_fit_of_the_masking_is_close() {
    let model = TorranceSparrow::new(0.4, glass(), [1.0; 3]).unwrap();
    for ([light, view], exact) in
        [([(1.1, 1.0), (0.9, -2.3)], 5.451112850553e-02), ([(1.45, 0.4), (1.35, -2.6)], 2.365777960776e-01)]
    {
        let found = model
            .rho_hat(Direction::from_angles(light.0, light.1), Direction::from_angles(view.0, view.1))[0];
        assert!((found / exact - 1.0).abs() < 0.0035, "{found} {exact}");
    }
}
