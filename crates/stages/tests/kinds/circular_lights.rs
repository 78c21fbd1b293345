//! `circular-lights` and `sum-lighting`.

use std::f64::consts::PI;

use stages::artifacts::Lighting;

use crate::fixture::{Case, case, sky_lighting};

/// A lamp, a sun and a sky that fills more than a hemisphere.
const STUDIO: &str = "
[[light]]
direction = [0.3, -0.5, 0.8]
angular_radius = 15.0
radiance = [10.0, 9.0, 7.0]

[[light]]
direction = [0, 0, 2]
solid_angle = 0.02
irradiance = 3

[[light]]
direction = [0, 0, 1]
angular_radius = 120
radiance = 0.5
";

fn lights(parameters: &str, text: &str) -> Case {
    case("circular-lights", parameters).file("studio.toml", text).source("studio.toml")
}

pub(crate) fn studio(parameters: &str) -> Case {
    lights(parameters, STUDIO)
}

#[test]
fn disks_are_lights_beside_the_series_or_in_it() {
    let ran = studio("degree = 6").run().unwrap();
    let separate = ran.artifact::<Lighting>();
    assert_eq!(ran.notes, ["1 of 3 disks are larger than 90 degrees and in the series"]);
    let [lamp, sun] = &separate.0.lights[..] else { panic!("two lights") };
    assert!(
        (lamp.radius - 15f64.to_radians()).abs() < 1e-15
            && (lamp.direction.vector().length() - 1.0).abs() < 1e-12
    );
    // A disk of radiance L has the irradiance pi sin^2(a) L.
    assert!((lamp.irradiance[1] - 9.0 * PI * 15f64.to_radians().sin().powi(2)).abs() < 1e-12);
    assert_eq!(sun.irradiance.map(|value| (value * 1e9).round() / 1e9), [3.0; 3]);
    assert!((2.0 * PI * (1.0 - sun.radius.cos()) - 0.02).abs() < 1e-12);
    // A constant sky of 0.5 over the share (1 - cos(120)) / 2 = 3/4 of the sphere.
    assert!((separate.0.series.get(0, 0)[0] - 0.5 * 0.75 * (4.0 * PI).sqrt()).abs() < 1e-12);

    let ran = studio("degree = 6\nlamps = \"series\"").run().unwrap();
    let series = ran.artifact::<Lighting>();
    assert_eq!(ran.notes, ["3 disks in a series of degree 6"]);
    assert!(series.0.lights.is_empty());
    let (found, expected) = (&series.0.series, separate.0.whole());
    let pairs = found.coefficients().as_flattened().iter().zip(expected.coefficients().as_flattened());
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12));

    let windowed = studio("degree = 6\nwindow = \"hanning\"").artifact::<Lighting>();
    assert!(windowed.0.lights.is_empty(), "a window is for a series");
    let factor = sh::Window::Hanning.factor(3, found.degree());
    assert_eq!(windowed.0.series.get(3, 1), found.get(3, 1).map(|value| value * factor));
    assert_eq!(
        studio("lamps = \"separate\"\nwindow = \"hanning\"").errors(),
        ["window: only lamps = \"series\" uses it"]
    );
}

#[test]
fn every_error_of_a_file_has_its_place() {
    let failure = lights(
        "",
        "size = 3
[[light]]
angular_radius = 0
radiance = -1

[[light]]
direction = [0, 0, 0]
angular_radius = 5
solid_angle = 20

[[light]]
direction = [1, 0]
solid_angle = 20
irradiance = 1",
    )
    .failure();
    for expected in [
        "studio.toml:1:1",
        "studio.toml:3:18",
        "degrees above 0, at most 180",
        "studio.toml:4:12",
        "\"direction\" is missing",
        "studio.toml:7:13",
        "\"solid_angle\" and \"angular_radius\" exclude each other",
        "\"radiance\" or \"irradiance\" is missing",
        "studio.toml:12:13",
        "steradians above 0",
    ] {
        assert!(failure.contains(expected), "{expected}: {failure}");
    }
    assert!(lights("", "").failure().contains("there are no lights"));
    assert!(lights("", "light = 3").failure().contains("[[light]]"));
    assert!(lights("", "[[light]").failure().contains("studio.toml:1"));
}

#[test]
fn a_sum_holds_the_light_of_both() {
    let lamps = studio("degree = 4").artifact::<Lighting>();
    let ran = case("sum-lighting", "")
        .input("lighting", sky_lighting())
        .input("added", (*lamps).clone())
        .run()
        .unwrap();
    let sum = ran.artifact::<Lighting>();
    assert_eq!(ran.notes, ["degrees 2 and 4: the sum has degree 4"]);
    assert_eq!((sum.0.lights.len(), sum.0.series.degree().get()), (2, 4));
    assert!((sum.0.mean() - lamps.0.mean() - sky_lighting().0.mean()).abs() < 1e-12);
}
