//! `sample-light`, `subtract-lights` and `export-light-rig`.

use engine::Product;
use sh::{Degree, Expansion, Light};
use sphere::{DVec3, Direction};
use stages::artifacts::{Environment, Lighting, Reflection};

use crate::fixture::{Case, case, environment, lambert, phong, reflection, sky, sky_lighting};

/// The sky of the fixtures with a sun.
pub(crate) fn sunny() -> Environment {
    let sun = Direction::from_angles(0.7, -1.0).vector();
    environment(64, |w| if w.dot(sun) > 0.997 { [400.0, 300.0, 200.0] } else { sky(w) })
}

pub(crate) fn sampled(parameters: &str) -> Case {
    case("sample-light", parameters).input("light", sunny())
}

pub(crate) fn lit() -> Lighting {
    (*sampled("count = 5").artifact::<Lighting>()).clone()
}

fn flux(lighting: &Lighting) -> [f64; 3] {
    lighting.0.lights.iter().map(Light::flux).fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
}

#[track_caller]
fn assert_close(found: [f64; 3], expected: [f64; 3]) {
    assert!((0..3).all(|c| (found[c] - expected[c]).abs() < 1e-6 * expected[c]), "{found:?} {expected:?}");
}

#[test]
fn a_rig_has_all_light_of_what_it_is_made_of() {
    for method in ["median-cut", "warped"] {
        for count in [1, 7, 32] {
            let ran = sampled(&format!("method = \"{method}\"\ncount = {count}")).run().unwrap();
            let rig = ran.artifact::<Lighting>();
            assert_close(flux(&rig), sunny().0.integral());
            assert!(ran.notes[0].contains(": irradiance to "), "{:?}", ran.notes);
            assert!(rig.0.series.coefficients() == [[0.0; 3]]);
        }
        let of = |case: Case| case.artifact::<Lighting>();
        let parameters = format!("method = \"{method}\"\ncount = 16");
        let mut lighting = sky_lighting();
        lighting.0.lights.push(Light::from_flux(Direction::X, 0.1, [3.0, 2.0, 1.0]));
        let total =
            |series: &Expansion| series.get(0, 0).map(|value| value * (4.0 * std::f64::consts::PI).sqrt());
        let whole = total(&lighting.0.series);
        let rig = of(case("sample-light", &parameters).input("light", lighting));
        assert_close(flux(&rig), [whole[0] + 3.0, whole[1] + 2.0, whole[2] + 1.0]);
        // What a matte white material reflects, in the mean, is the light: the map holds radiance.
        let reflected: Reflection = reflection(lambert(1.0), 2);
        let rig = of(case("sample-light", &parameters).input("light", reflected));
        assert_close(flux(&rig), total(&sky_lighting().0.series));
    }
    let views = ["mean", "head-on"].map(|view| {
        let case = case("sample-light", &format!("count = 4\nview = \"{view}\""));
        case.input("light", reflection(phong(5.0), 2)).artifact::<Lighting>().0.lights.len()
    });
    assert_eq!(views, [4, 4]);
}

#[test]
fn the_number_of_lights_follows_the_tolerance() {
    let ran = sampled("count = \"auto\"\ntolerance = 0.05").run().unwrap();
    let (few, many) = (ran.artifact::<Lighting>(), sampled("count = \"auto\"").artifact::<Lighting>());
    assert!(few.0.lights.len() < many.0.lights.len());
    assert!(
        ran.notes[0].contains("error of the irradiance 1: ") && ran.notes[0].contains(", 2: "),
        "{:?}",
        ran.notes
    );
    assert!(ran.warnings.is_empty());
    assert_eq!(sampled("tolerance = 0.1").errors(), ["tolerance: only count = \"auto\" uses it"]);
}

#[test]
fn light_that_cannot_be_sampled_is_an_error() {
    for count in ["0", "-1", "4097", "\"all\""] {
        let errors = sampled(&format!("count = {count}")).errors();
        assert!(errors.len() == 1 && errors[0].contains("count"), "{errors:?}");
    }
    let sample = |environment| case("sample-light", "count = 9").input("light", environment);
    assert_eq!(sample(environment(8, |_| [0.0; 3])).failure(), "no mass: the function is nowhere positive");
    let ran =
        sample(environment(8, |w| if w.z > 0.95 && w.x > 0.0 { [1.0; 3] } else { [0.0; 3] })).run().unwrap();
    let lights = ran.artifact::<Lighting>().0.lights.len();
    assert_eq!(ran.warnings, [format!("{lights} lights instead of 9: no other texels are lit")]);
    for value in [f64::NAN, f64::INFINITY] {
        let mut rows = vec![[1.0; 3]; 4];
        rows[3][1] = value;
        let broken = Expansion::from_coefficients(Degree::new(1).unwrap(), rows).unwrap();
        let case = case("sample-light", "").input("light", Lighting(broken.into()));
        assert!(case.failure().starts_with("the coefficient of l = 1, m = 1 is "), "{}", case.failure());
    }
    let negative = Expansion::from_coefficients(Degree::ZERO, vec![[-1.0; 3]]).unwrap();
    let case = case("sample-light", "").input("light", Lighting(negative.into()));
    assert_eq!(case.failure(), "no mass: the function is nowhere positive");
}

pub(crate) fn subtracted(parameters: &str) -> Case {
    case("subtract-lights", parameters).input("environment", sunny()).input("lights", lit())
}

#[test]
fn an_environment_without_its_lamps_has_no_sun_and_all_other_light() {
    let separate = case("project-sh", "degree = 8\nlamps = \"separate\"").input("environment", sunny());
    let lighting = separate.artifact::<Lighting>();
    assert!(!lighting.0.lights.is_empty());
    let without =
        case("subtract-lights", "").input("environment", sunny()).input("lights", (*lighting).clone());
    let ran = without.run().unwrap();
    let rest = ran.artifact::<Environment>();
    let most = |environment: &Environment| {
        environment.0.pixels().as_flattened().iter().fold(0.0, |most: f32, value| most.max(*value))
    };
    // Lamps are cut at ten times the mean.
    let mean = sunny().0.integral()[0] / (4.0 * std::f64::consts::PI);
    assert!(most(&sunny()) == 400.0 && f64::from(most(&rest)) < 15.0 * mean, "{}", most(&rest));
    let [a, b] = [flux(&lighting), rest.0.integral()];
    assert_close([a[0] + b[0], a[1] + b[1], a[2] + b[2]], sunny().0.integral());
    assert!(ran.notes[0].contains(" of the light") && ran.warnings.is_empty(), "{:?}", ran.notes);
    assert!(
        ran.notes[1].starts_with("the rest and the lights together are the whole to "),
        "{:?}",
        ran.notes
    );
}

#[test]
fn the_strongest_lights_alone_can_be_subtracted() {
    let all = subtracted("").run().unwrap();
    assert!(all.artifact::<Environment>().0.integral()[0] < 1e-3 * sunny().0.integral()[0]);
    let one = subtracted("most = 1").run().unwrap();
    let left = one.artifact::<Environment>().0.integral()[1];
    let expected = sunny().0.integral()[1] - lit().0.lights[0].flux()[1];
    assert!((left / expected - 1.0).abs() < 1e-4, "{left} {expected}");
    // Without lights, or with more light than there is.
    let with = |lighting| case("subtract-lights", "").input("environment", sunny()).input("lights", lighting);
    let none = with(sky_lighting()).run().unwrap();
    assert_eq!(*none.artifact::<Environment>(), sunny());
    assert!(none.warnings[0].contains("no separate lights"));
    let mut bright = lit();
    bright.0.lights[0].irradiance = [1e9; 3];
    assert!(with(bright).run().unwrap().warnings[0].starts_with("the lights have more light"));
    let mut dark = lit();
    dark.0.lights[0].irradiance = [-1.0; 3];
    assert!(with(dark).failure().contains("cannot be subtracted"));
}

pub(crate) fn exported(parameters: &str) -> Case {
    case("export-light-rig", parameters).input("lights", lit())
}

/// The formats themselves are tested where they are written.
#[test]
fn every_format_holds_every_light() {
    for (format, endings) in [
        ("gltf", vec![".gltf".to_owned()]),
        ("usda", vec![".usda".into()]),
        ("csv", vec![".json".into(), ".csv".into()]),
        ("safetensors", vec![".safetensors".into()]),
    ] {
        let case = exported(&format!("format = \"{format}\""));
        assert_eq!(case.product(), Product::Files(endings));
        let files = case.files();
        let recipe = containers::read_recipe(&files[0]);
        assert_eq!(recipe.as_deref(), Some("{\"kind\":\"export-light-rig\"}"), "{format}");
    }
    let text = |format: &str| {
        String::from_utf8(exported(&format!("format = \"{format}\"")).files().pop().unwrap()).unwrap()
    };
    assert_eq!(text("gltf").matches("\"directional\"").count(), 5);
    assert_eq!(text("usda").matches("def DistantLight ").count(), 5);
    let table = text("csv");
    let first: Vec<f64> =
        table.lines().nth(1).unwrap().split(',').map(|word| word.parse().unwrap()).collect();
    let light = lit().0.lights[0];
    assert_eq!(DVec3::from_slice(&first), light.direction.vector());
    assert_eq!(table.lines().count(), 6);
    assert_eq!(exported("resolution = 64").errors(), ["resolution: only format = \"safetensors\" uses it"]);
}

#[test]
fn a_lighting_without_lights_is_no_rig() {
    let failure = case("export-light-rig", "").input("lights", sky_lighting()).failure();
    assert_eq!(failure, "the lighting has no separate lights");
    let mut both = sky_lighting();
    both.0.lights = lit().0.lights;
    let ran = case("export-light-rig", "").input("lights", both).run().unwrap();
    assert_eq!(ran.notes, ["only the lights are written, not the series"]);
}
