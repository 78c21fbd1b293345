//! `project-brdf` and `convolve`.

use std::f64::consts::PI;

use brdf::Microfacet;
use containers::tensors::DegreeSource;
use sh::{Degree, Light};
use sphere::Direction;
use stages::artifacts::{Brdf, Lighting, Material, Reflection};

use crate::fixture::{case, lambert, phong, sky_lighting};

#[test]
fn a_tolerance_chooses_the_degrees() {
    // An exponent of 64 needs degree 17 for 99 percent [RH02, app. D].
    for (parameters, degrees) in
        [("tolerance = 0.01", (17, 0)), ("tolerance = 0.03", (15, 0)), ("degree = [5, 0]", (5, 0))]
    {
        let ran = case("project-brdf", parameters).input("material", Material(phong(64.0))).run().unwrap();
        let brdf = ran.artifact::<Brdf>();
        assert_eq!((brdf.0.coefficients.f().get(), brdf.0.coefficients.p().get()), degrees, "{parameters}");
        assert!(ran.notes[0].starts_with(&format!("degrees [{}, {}] hold ", degrees.0, degrees.1)));
    }
}

/// Without degree and tolerance there are more than any light needs, and `convolve` chooses for each.
#[test]
fn the_material_travels_with_more_than_enough_degrees() {
    let brdf = case("project-brdf", "").input("material", Material(phong(64.0))).artifact::<Brdf>();
    assert!(brdf.0.coefficients.f().get() > 30 && brdf.0.material.is_some());
    let lighting = sky_lighting();
    let brdf = (*brdf).clone();
    let ran = case("convolve", "").input("lighting", lighting).input("brdf", brdf).run().unwrap();
    let reflection = &ran.artifact::<Reflection>().0;
    assert!(
        reflection.is_for_light() && reflection.brdf().f().get() <= sky_lighting().0.series.degree().get()
    );
    assert!(ran.notes[0].contains("95 % of views are within 0.0"), "{:?}", ran.notes);
    let fixed = case("project-brdf", "degree = [5, 0]").input("material", Material(phong(64.0)));
    assert_eq!(fixed.artifact::<Brdf>().0.degrees, DegreeSource::Named);
}

/// A part has the coefficients that its layers have alone, and travels as the material.
#[test]
fn a_part_is_projected_about_its_own_centre() {
    let lacquer = brdf::Material::layers(vec![lambert(0.5), phong(32.0)]).unwrap();
    let part = |material: &brdf::Material, parameters: &str| {
        case("project-brdf", parameters).input("material", Material(material.clone())).run().unwrap()
    };
    for (name, alone) in [("diffuse", lambert(0.5)), ("specular", phong(32.0))] {
        for degree in ["", "degree = [7, 0]\n"] {
            let found = part(&lacquer, &format!("{degree}part = \"{name}\"")).artifact::<Brdf>();
            assert_eq!(*found, *part(&alone, degree).artifact::<Brdf>(), "{name} {degree}");
        }
    }
    // The parts of `standard` are not materials of files, but they travel as such.
    let plastic = brdf::StandardParameters { base_color: [0.8, 0.2, 0.1], ..Default::default() };
    let plastic = brdf::Material::Standard(brdf::Standard::new(plastic).unwrap());
    let found = part(&plastic, "part = \"diffuse\"").artifact::<Brdf>();
    assert_eq!(found.0.coefficients.centre(), brdf::Centre::Normal);
    assert_eq!(found.0.material, plastic.part(brdf::Part::Diffuse));

    let ran = part(&phong(32.0), "part = \"diffuse\"");
    assert!(ran.artifact::<Brdf>().0.coefficients.rho().iter().all(|rho| *rho == [0.0; 3]));
    assert!(ran.notes[0].contains("phong has no such part: it is black"), "{:?}", ran.notes);
}

/// The remedy that the warning names was tried: with it there is no warning, and the error is the one that
/// the warning states.
#[test]
fn a_cut_that_rings_is_a_warning_with_a_remedy_that_was_tried() {
    let sun = Light::from_flux(Direction::from_angles(0.9, 0.4), 0.005, [30.0, 25.0, 20.0]);
    let series = sky_lighting().0.series.to_degree(Degree::new(40).unwrap());
    // As `lamps = "series"` of project-sh leaves it: beside the series the sun would not ring.
    let whole = sh::Lighting { series, lights: vec![sun] }.whole();
    let lit = Lighting(whole.into());
    let run = |degree: &str, window: &str| {
        let brdf = case("project-brdf", degree).input("material", Material(phong(64.0))).artifact::<Brdf>();
        case("convolve", window).input("lighting", lit.clone()).input("brdf", (*brdf).clone()).run().unwrap()
    };
    let ran = run("degree = [6, 0]", "");
    let [warning] = &ran.warnings[..] else { panic!("{:?}", ran.warnings) };
    assert!(warning.starts_with("degree [6, 0] is too low here: "), "{warning}");
    let remedy = "; leave out `degree` in project-brdf";
    assert!(warning.ends_with(remedy), "what remains does not show: {warning}");
    assert!(warning.contains(" of the views turn black, and 5 % are off by more than "), "{warning}");
    let share = |text: &str, after: &str| -> f64 {
        text.split(after).nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    assert!(share(warning, "more than ") > 0.3, "{warning}");
    assert!(run("", "").warnings.is_empty());
    // What the manifest has is what is blamed.
    let ran = run("tolerance = 0.3", "");
    let [warning] = &ran.warnings[..] else { panic!("{:?}", ran.warnings) };
    assert!(warning.starts_with("tolerance 0.3 is too large here, it takes degrees [8, 0]: "), "{warning}");
    assert!(warning.ends_with("; leave out `tolerance` in project-brdf"), "{warning}");
    // Enough degrees, and soft light, are no reason.
    let soft = case("convolve", "").input("lighting", sky_lighting()).input(
        "brdf",
        (*case("project-brdf", "degree = [30, 0]")
            .input("material", Material(phong(64.0)))
            .artifact::<Brdf>())
        .clone(),
    );
    assert!(soft.run().unwrap().warnings.is_empty());
    // A window calms the rings.
    let negative = |ran: &crate::fixture::Ran| {
        ran.artifact::<Reflection>()
            .0
            .samples(sh::Stop::NEVER)
            .unwrap()
            .negative(shrm::degrees::BLACK_SHARE * lit.0.mean())
    };
    let calm = run("degree = [6, 0]", "window = \"hanning\"");
    assert!(negative(&calm) < 0.5 * negative(&ran), "{} {}", negative(&calm), negative(&ran));
}

/// The second row of [RH02, tab. 5].
#[test]
fn a_rough_surface_depends_on_the_view_and_the_note_says_how_much() {
    let model = Microfacet::new(0.2, [1.0; 3]).unwrap();
    let material = Material(brdf::Material::Microfacet(model));
    let ran = case("project-brdf", "tolerance = 0.03").input("material", material).run().unwrap();
    let brdf = ran.artifact::<Brdf>();
    assert_eq!((brdf.0.coefficients.f().get(), brdf.0.coefficients.p().get()), (11, 2));
    assert_eq!(ran.notes, ["degrees [11, 2] hold 97.2 % of the energy; p = 0, 1, ...: 87.2, 7.0, 3.0 %"]);
    assert!(ran.warnings.is_empty());
}

/// [RH02, sec. 7.1]: P = 4 is enough for an error below 0.03.
#[test]
fn skin_needs_p_4_as_in_the_paper() {
    let skin = include_str!("../../../../examples/skin/skin.toml");
    let skin = case("import-material", "").file("skin.toml", skin).source("skin.toml").artifact::<Material>();
    let ran = case("project-brdf", "tolerance = 0.03").input("material", (*skin).clone()).run().unwrap();
    let brdf = ran.artifact::<Brdf>();
    assert_eq!((brdf.0.coefficients.f().get(), brdf.0.coefficients.p().get()), (10, 4), "{:?}", ran.notes);
    assert!(ran.warnings.is_empty());
}

#[test]
fn lambert_has_the_coefficients_of_the_irradiance_paper() {
    let brdf =
        case("project-brdf", "degree = [3, 0]").input("material", Material(lambert(1.0))).artifact::<Brdf>();
    // A_l / pi = Lambda_l rho_l Y_00 = 1, 2/3, 1/4, 0.
    for (l, expected) in [1.0, 2.0 / 3.0, 0.25, 0.0].into_iter().enumerate() {
        let factor = sh::lambda(l) * brdf.0.coefficients.get(l, 0, 0)[0] / (4.0 * PI).sqrt();
        assert!((factor - expected).abs() < 1e-15, "{l}: {factor}");
    }
}

#[test]
fn parameters_that_contradict_each_other_are_errors() {
    for (parameters, expected) in [
        ("degree = [3, 0]\ntolerance = 0.1", "tolerance: degree already sets the degrees"),
        ("tolerance = 0", "tolerance: 0 is not a number above 0 and below 1"),
        ("degree = 3", "degree: 3 is not [F, P], two degrees from 0 to 2048"),
    ] {
        assert_eq!(case("project-brdf", parameters).errors(), [expected]);
    }
}

#[test]
fn convolution_works_to_the_smaller_degree() {
    let brdf =
        case("project-brdf", "degree = [9, 0]").input("material", Material(lambert(0.5))).artifact::<Brdf>();
    let reflection = case("convolve", "").input("lighting", sky_lighting()).input("brdf", (*brdf).clone());
    let reflection = reflection.artifact::<Reflection>();
    assert_eq!(reflection.0.lighting().degree().get(), 2);
    let field = reflection.0.radial().unwrap();
    let lighting = sky_lighting().0.series;
    for (row, factor) in [(0, 0.5), (2, 0.5 * 2.0 / 3.0), (4, 0.5 * 0.25)] {
        for channel in 0..3 {
            let expected = lighting.coefficients()[row][channel] * factor;
            assert!((field.coefficients()[row][channel] - expected).abs() < 1e-14);
        }
    }
}
