use engine::Product;
use sh::Light;
use sphere::{Direction, Rotation};
use stages::artifacts::{Brdf, Environment, Lighting, Material, Reflection};

use crate::fixture::{case, difference, environment, sky, sky_lighting};
use crate::parts::lacquer;

#[test]
fn a_yaw_of_a_quarter_moves_what_was_at_x_to_y() {
    // w turned back by a quarter about z is (y, -x, z).
    let turned = environment(16, |w| sky(sphere::DVec3::new(w.y, -w.x, w.z)));
    let rotated =
        case("rotate", "yaw = 90").input("lighting", environment(16, sky)).artifact::<Environment>();
    assert!(difference(rotated.0.pixels(), turned.0.pixels()) < 1e-6);
    let projected = case("project-sh", "degree = 2").input("environment", turned).artifact::<Lighting>();
    let rotated = case("rotate", "yaw = 90").input("lighting", sky_lighting()).artifact::<Lighting>();
    // The pixels are f32, so the two expansions agree to 6e-8 of 3.5.
    assert!(difference(rotated.0.series.coefficients(), projected.0.series.coefficients()) < 1e-6);
}

#[test]
fn angles_compose_as_the_manual_says() {
    let rotated = case("rotate", "yaw = 20\npitch = 30\nroll = 40").input("lighting", sky_lighting());
    let [yaw, pitch, roll] = [20.0, 30.0, 40.0].map(f64::to_radians);
    let expected = sh::rotate(&sky_lighting().0.series, Rotation::from_yaw_pitch_roll(yaw, pitch, roll));
    assert_eq!(rotated.artifact::<Lighting>().0.series, expected);
}

#[test]
fn a_quaternion_of_any_length_is_a_rotation() {
    // Half a turn about z, and a third about (1, 1, 1), which takes x to y.
    for (quaternion, angles) in [("[0, 0, 2, 0]", "yaw = 180"), ("[1, 1, 1, 1]", "yaw = 90\nroll = 90")] {
        let by = |parameters: &str| {
            case("rotate", parameters).input("lighting", sky_lighting()).artifact::<Lighting>()
        };
        let quaternion = by(&format!("quaternion = {quaternion}"));
        assert!(
            difference(quaternion.0.series.coefficients(), by(angles).0.series.coefficients()) < 1e-14,
            "{angles}"
        );
    }
}

#[test]
fn a_rotation_given_twice_or_not_at_all_is_an_error() {
    for (parameters, expected) in [
        ("yaw = 10\nquaternion = [0, 0, 1, 0]", "quaternion: yaw, pitch or roll already set the rotation"),
        ("quaternion = [0, 0, 0, 0]", "quaternion: an array is not [x, y, z, w], not all 0"),
        ("quaternion = [0, 0, 1]", "quaternion: an array is not [x, y, z, w], not all 0"),
    ] {
        assert_eq!(case("rotate", parameters).errors(), [expected]);
    }
}

/// Of a material with a highlight over a base, under a sky with a lamp: the field, its lamp and its parts.
#[test]
fn a_reflection_turns_with_its_light() {
    let brdf = case("project-brdf", "").input("material", Material(lacquer())).artifact::<Brdf>();
    let lamp = Light::from_flux(Direction::from_angles(0.7, 0.3), 0.01, [3.0, 2.0, 1.0]);
    let light = Lighting(sh::Lighting { lights: vec![lamp], ..sky_lighting().0 });
    let convolved = |light: Lighting| {
        let case = case("convolve", "").input("lighting", light).input("brdf", (*brdf).clone());
        case.artifact::<Reflection>()
    };
    let turn = "yaw = 35\npitch = -50\nroll = 110";
    let turned = case("rotate", turn).input("lighting", light.clone()).artifact::<Lighting>();
    let before = convolved((*turned).clone());
    let after = case("rotate", turn).input("lighting", (*convolved(light)).clone());
    assert_eq!(after.product(), Product::Artifact("reflection"));
    let after = after.artifact::<Reflection>();
    // The degrees were found at other places of the light, and may differ.
    let fields = |reflection: &Reflection| {
        let parts = reflection.0.parts().unwrap();
        [reflection.0.clone(), parts[0].clone(), parts[1].clone()]
    };
    for (before, after) in fields(&before).iter().zip(&fields(&after)) {
        let degree = before.lighting().degree().min(after.lighting().degree());
        let [a, b] = [before, after].map(|field| field.lighting().to_degree(degree));
        assert!(difference(a.coefficients(), b.coefficients()) < 1e-12);
        let [a, b] = [before, after].map(|field| &field.lamps().unwrap().lights[0]);
        assert_eq!(a, b);
        assert_eq!(before.material(), after.material());
        assert!(before.is_for_light() && after.is_for_light());
    }
}

#[test]
fn the_output_has_the_type_of_the_input() {
    let product = case("rotate", "yaw = 1").input("lighting", environment(4, sky)).product();
    assert_eq!(product, Product::Artifact("environment"));
    let product = case("rotate", "yaw = 1").input("lighting", sky_lighting()).product();
    assert_eq!(product, Product::Artifact("lighting"));
}
