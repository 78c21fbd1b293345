//! How far the kinds say that they are.

use brdf::{Choice, Fresnel, Ggx, Material as Model, project};
use containers::tensors::{self, DegreeSource};
use sh::{Degree, Expansion, Light, Stop};
use shrm::Reflection;
use sphere::Direction;
use stages::artifacts::{Brdf, Environment, Lighting, Material, Reflection as Reflected};

use crate::fixture::{Case, case, environment, sky};

fn metal() -> Model {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    Model::Ggx(Ggx::new(0.5, gold, [1.0; 3]).unwrap())
}

fn lighting() -> sh::Lighting {
    let degree = Degree::new(4).unwrap();
    let mut rows = vec![[0.0; 3]; degree.rows()];
    (rows[0], rows[2], rows[20]) = ([3.5; 3], [1.2, 1.0, 0.8], [0.2, -0.1, 0.1]);
    let lamp = Light::from_flux(Direction::from_angles(1.2, 0.4), 0.01, [6.0, 5.0, 4.0]);
    sh::Lighting { series: Expansion::from_coefficients(degree, rows).unwrap(), lights: vec![lamp] }
}

/// A field with a lamp beside it.
fn reflected() -> Reflected {
    let brdf = project(&metal(), Choice::Full, Stop::NEVER).unwrap().coefficients;
    Reflected(Reflection::for_light(&lighting(), &brdf, &metal(), Stop::NEVER).unwrap().0)
}

fn brdf() -> Brdf {
    let coefficients = project(&metal(), Choice::Full, Stop::NEVER).unwrap().coefficients;
    let degrees = DegreeSource::Light;
    Brdf(tensors::Brdf { coefficients, material: Some(metal()), degrees, parts: None })
}

fn day() -> Environment {
    environment(32, sky)
}

#[test]
fn kinds_that_take_long_count_all_of_their_work() {
    let of_field = |kind, parameters| -> Case { case(kind, parameters).input("reflection", reflected()) };
    let cases = [
        case("project-brdf", "").input("material", Material(metal())),
        case("convolve", "").input("lighting", Lighting(lighting())).input("brdf", brdf()),
        of_field("export-shrm", "resolution = 5"),
        of_field("export-cabral", "resolution = 5"),
        of_field("export-cabral", "resolution = 20\nlayout = \"sphere\""),
        of_field("export-kautz-mccool", "resolution = 5"),
        of_field("export-view-maps", "resolution = 5\nviews = 3"),
        of_field("contact-sheet", "").input("environment", day()),
        of_field("preview", "size = 32\nresolution = 8\nframes = 3").input("environment", day()),
        of_field("preview", "size = 32\nresolution = 8\nmodes = [\"brute-force\"]")
            .input("environment", day())
            .input("material", Material(metal())),
        case("report", "sphere = 32\nresolution = 8")
            .keyed_input("environment", &[("environment", "day")], day())
            .keyed_input("material", &[("material", "gold")], Material(metal())),
    ];
    for case in cases {
        let share = case.run().unwrap().share_done;
        // Of brute force they count as if the surface filled the picture.
        assert!((0.75..=1.0).contains(&share), "{}: {share}", case.kind());
    }
}
