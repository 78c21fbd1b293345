//! `shade-vertices` with lamps that the material shades itself.

use sh::{Degree, Expansion, Light};
use sphere::Direction;
use stages::artifacts::{BrdfTable, Lighting, Material, VertexRadiance};

use crate::fixture::{Case, case, difference, lambert, sky_lighting};
use crate::vertices::pit;

/// A lamp behind the wall, which hides it from the floor.
fn lamp() -> Light {
    Light::from_flux(Direction::from_angles(1.0, 0.0), 0.02, [2.0, 1.0, 0.5])
}

fn lit_by(lights: Vec<Light>) -> Lighting {
    Lighting(sh::Lighting { series: Expansion::zero(Degree::new(4).unwrap()), lights })
}

fn ward() -> brdf::Material {
    brdf::Material::Ward(brdf::Ward::new([0.2, 0.5], [1.0; 3]).unwrap())
}

fn shaded(parameters: &str, material: &brdf::Material) -> Case {
    let table = case("tabulate-brdf", "resolution = 16").input("material", Material(material.clone()));
    case("shade-vertices", &format!("view = [-1, 0, 1]\n{parameters}"))
        .input("mesh", pit())
        .input("table", (*table.artifact::<BrdfTable>()).clone())
}

fn radiance(case: &Case) -> Vec<[f32; 3]> {
    case.artifact::<VertexRadiance>().0.value.clone()
}

#[test]
fn a_lamp_is_shaded_once_by_the_material_or_by_the_series() {
    let with = |lighting: Lighting, material: bool| {
        let case = shaded("shadow-rays = 0", &ward()).input("lighting", lighting);
        if material { case.input("material", Material(ward())) } else { case }
    };
    let view = Direction::new(sphere::DVec3::new(-1.0, 0.0, 1.0)).unwrap();
    // The floor's frame is the world's, and its lamp is small: rho_hat times its flux.
    let rho_hat = ward().rho_hat(lamp().direction, view);
    let expected = [0, 1, 2].map(|channel| rho_hat[channel] * lamp().flux()[channel]);
    let ran = with(lit_by(vec![lamp()]), true).run().unwrap();
    assert_eq!(ran.notes, ["the material shades 1 lamp"]);
    let sharp = &ran.artifact::<VertexRadiance>().0.value;
    for channel in 0..3 {
        let error = f64::from(sharp[4][channel]) / expected[channel] - 1.0;
        assert!(error.abs() < 0.02, "{sharp:?} {expected:?}");
    }
    // The series is cut at degree 4, and has another highlight.
    let soft = radiance(&with(lit_by(vec![lamp()]), false));
    let share = f64::from(soft[4][0]) / expected[0];
    assert!((0.5..0.97).contains(&share), "{soft:?} {expected:?}");
    // Beside a sky the sky is the table's: the sum of both apart.
    let sky = sky_lighting();
    let both = Lighting(sh::Lighting { lights: vec![lamp()], ..sky.0.clone() });
    let (alone, both) = (radiance(&with(sky.clone(), false)), radiance(&with(both, true)));
    let sum: Vec<[f32; 3]> =
        (0..9).map(|vertex| [0, 1, 2].map(|c| sharp[vertex][c] + alone[vertex][c])).collect();
    assert!(difference(&both, &sum) < 1e-5);
    // The port `lights` is the same light.
    let apart = with(sky, true).input("lights", lit_by(vec![lamp()]));
    assert!(difference(&radiance(&apart), &both) < 1e-5);
    let ran = with(sky_lighting(), true).run().unwrap();
    let expected = "there are no separate lamps, so the material is not used";
    assert!(ran.notes.iter().any(|note| note == expected), "{:?}", ran.notes);
}

#[test]
fn the_wall_is_in_the_way_of_the_lamp() {
    let chalk = lambert(0.8);
    let with = |rays: &str| {
        let case = shaded(rays, &chalk).input("lighting", lit_by(vec![lamp()]));
        radiance(&case.input("material", Material(chalk.clone())))
    };
    let (open, shadowed) = (with("shadow-rays = 0"), with(""));
    // The lamp is 33 degrees above the horizon, and the wall is 4 high and at most 2 away.
    assert!(open[..5].iter().all(|rgb| rgb[0] > 0.1), "{open:?}");
    assert!(shadowed[..5].iter().all(|rgb| rgb[0] == 0.0), "{shadowed:?}");
    // The wall's own face looks away from the lamp.
    assert!(open[5..].iter().chain(&shadowed[5..]).all(|rgb| *rgb == [0.0; 3]));
}

#[test]
fn a_table_of_several_materials_has_no_single_one() {
    let greys = case("tabulate-brdf", "resolution = 8\ndegree = 2")
        .keyed_input("materials", &[("material", "a")], Material(lambert(0.0)))
        .keyed_input("materials", &[("material", "b")], Material(lambert(0.5)))
        .artifact::<BrdfTable>();
    let case = case("shade-vertices", "")
        .input("mesh", pit())
        .input("table", (*greys).clone())
        .input("lighting", sky_lighting())
        .input("material", Material(lambert(0.5)));
    assert_eq!(case.failure(), "the table has 2 materials, but lamps are shaded with a single one");
}
