//! `light-field`, and `shade-vertices` under it.

use sh::{Degree, Expansion, Light};
use sphere::Direction;
use stages::artifacts::{BrdfTable, LightField, Lighting, Material, Transfer, VertexRadiance};

use crate::fixture::{Case, case, difference, lambert, sky_lighting};
use crate::vertices::pit;

/// A constant sky of this radiance, of some degree.
fn sky(radiance: f64, degree: usize) -> Lighting {
    let mut series = Expansion::zero(Degree::new(degree).unwrap());
    series.coefficients_mut()[0] = [radiance * (4.0 * std::f64::consts::PI).sqrt(); 3];
    Lighting(series.into())
}

/// Two skies: dark at the pit's open side, bright at its wall.
pub(crate) fn near(parameters: &str) -> Case {
    case("light-field", parameters)
        .keyed_input("lightings", &[("environment", "open")], sky(1.0, 2))
        .keyed_input("lightings", &[("environment", "wall")], sky(3.0, 4))
}

const POINTS: &str = "points = { open = [-1, 0, 0], wall = [1, 0, 0] }";

fn shaded(lighting: LightField) -> Case {
    let table = case("tabulate-brdf", "resolution = 16").input("material", Material(lambert(0.8)));
    case("shade-vertices", "camera = [0, 0, 0]")
        .input("mesh", pit())
        .input("table", (*table.artifact::<BrdfTable>()).clone())
        .input("lighting", lighting)
}

fn radiance(case: &Case) -> Vec<[f32; 3]> {
    case.artifact::<VertexRadiance>().0.value.clone()
}

#[test]
fn vertices_are_lit_by_the_light_near_them() {
    let ran = near(POINTS).run().unwrap();
    let field = ran.artifact::<LightField>();
    assert_eq!((field.0.points().len(), field.0.degree().get()), (2, 4));
    assert_eq!(ran.notes, ["degrees 2 to 4: the light field has degree 4"]);
    // In the middle between both, the mean; near the wall, more. A matte floor has 0.8 of the sky.
    let found = radiance(&shaded((*field).clone()));
    let weights = |x: f32, y: f32| [1.0, -1.0].map(|at: f32| 1.0 / ((x - at).powi(2) + y * y));
    for (vertex, (x, y)) in [(0, (-1.0, -1.0)), (1, (1.0, -1.0)), (4, (0.5, 0.0))] {
        let [wall, open] = weights(x, y);
        let expected = 0.8 * (3.0 * wall + open) / (wall + open);
        assert!((found[vertex][1] - expected).abs() < 1e-4, "{vertex}: {found:?} {expected}");
    }
    // Lamps of the lightings are in their series; light from far away is added to all points.
    let lamp = Light::from_flux(Direction::Z, 0.2, [1.0; 3]);
    let lamps =
        || Lighting(sh::Lighting { series: Expansion::zero(Degree::new(4).unwrap()), lights: vec![lamp] });
    let with_lamp = case("light-field", "points = { one = [5, 5, 5] }")
        .keyed_input("lightings", &[("environment", "one")], lamps())
        .run()
        .unwrap();
    assert_eq!(with_lamp.notes, ["1 separate light is added to its series, up to its degree"]);
    let (by_lamp, added) = (
        radiance(&shaded((*with_lamp.artifact::<LightField>()).clone())),
        radiance(&shaded((*field).clone()).input("lights", lamps())),
    );
    let sum: Vec<[f32; 3]> =
        (0..9).map(|vertex| [0, 1, 2].map(|c| found[vertex][c] + by_lamp[vertex][c])).collect();
    assert!(difference(&added, &sum) < 1e-5);
}

#[test]
fn one_point_is_light_from_far_away() {
    let field = case("light-field", "points = { sky = [1, 2, 3] }")
        .keyed_input("lightings", &[("environment", "sky")], sky_lighting())
        .artifact::<LightField>();
    let open = radiance(&crate::vertices::shaded(false));
    assert!(difference(&radiance(&shaded((*field).clone())), &open) < 1e-5);
    // With shadows, as the same light from far away has them.
    let bake = case("precompute-transfer", "directions = 512").input("mesh", pit()).artifact::<Transfer>();
    let found = radiance(&shaded((*field).clone()).input("transfer", (*bake).clone()));
    assert!(difference(&found, &radiance(&crate::vertices::shaded(true))) < 1e-5);
}

#[test]
fn every_lighting_has_a_point_and_every_point_a_lighting() {
    for (parameters, expected) in [
        ("", "the lighting \"open\" has no point"),
        ("points = { open = [0, 0, 0] }", "the lighting \"wall\" has no point"),
        (
            "points = { open = [0, 0, 0], wall = [1, 0, 0], door = [2, 0, 0] }",
            "the point \"door\" has no lighting",
        ),
        ("points = { open = [0, 0, 0], wall = [0, 0, 0] }", "points 0 and 1 are the same place"),
    ] {
        assert_eq!(near(parameters).failure(), expected);
    }
    let help = near("points = { open = [0, 0, 0], walls = [1, 0, 0] }").run().err().unwrap();
    assert!(format!("{help:?}").contains("did you mean"), "{help:?}");
    assert_eq!(case("light-field", "").failure(), "a light field needs at least one point");
    for bad in ["points = [1, 2, 3]", "points = { open = [0, 0] }", "points = { open = [0, 0, nan] }"] {
        assert_eq!(case("light-field", bad).errors().len(), 1, "{bad}");
    }
}
