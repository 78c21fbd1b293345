//! Suns and lamps that the material itself reflects beside a BRDF table and a transfer.

use brdf::{Fresnel, Ggx};
use sh::{Expansion, Lighting};
use sphere::Direction;

use super::vertices::{brushed, knot, rms, tabulated, transfer_of};
use super::*;

fn gold() -> Material {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    Material::Ggx(Ggx::new(0.45, gold, [1.0; 3]).unwrap())
}

/// A lamp of 3 degrees in the dark.
fn lamp() -> Lighting {
    let direction = Direction::normalised(DVec3::new(0.6, 0.5, 0.7));
    let lamp = sh::Light { direction, radius: 0.05, irradiance: [3.0, 2.0, 1.0] };
    Lighting { series: Expansion::zero(Degree::new(8).unwrap()), lights: vec![lamp] }
}

/// The lamp beside the series, or in it.
fn lights() -> [Arc<Light>; 2] {
    let beside = Light::of_lighting(lamp()).unwrap();
    let within = Light::new(beside.environment().clone(), Some(lamp().whole()));
    [Arc::new(beside), Arc::new(within)]
}

/// The reference sums the texels of a picture of the lamp, whose edge is blurred over 0.7 degrees. Degree 6
/// holds matte reflections, but blurs highlights.
#[test]
fn a_lamp_alone_is_as_sharp_as_in_brute_force() {
    for (material, worse) in [(lambert(0.8), 1.5), (gold(), 20.0), (brushed(), 5.0)] {
        let of = |light: &Arc<Light>| {
            let scene = Scene::of(sphere(), tabulated(light, material.clone(), 6));
            let shot = Shot { light_samples: 512, ..shot([24, 24], Show::One(Mode::Table)) };
            rms(&scene, &shot, [Mode::Table, Mode::BruteForce])
        };
        let [beside, within] = lights().each_ref().map(of);
        assert!(beside < 0.01, "{}: {beside}", material.name());
        assert!(within > worse * beside, "{}: {beside} {within}", material.name());
    }
}

/// The sixteen rays toward a lamp make steps in the edges of shadows.
#[test]
fn a_knot_shadows_itself_from_a_lamp_as_in_shadowed_brute_force() {
    let mesh = knot();
    let transfer = transfer_of(&mesh, 4);
    for material in [lambert(0.8), gold()] {
        let of = |light: &Arc<Light>| {
            let scene = Scene::of(Arc::clone(&mesh), tabulated(light, material.clone(), 4));
            let scene = scene.with_transfer(Some(Arc::clone(&transfer)));
            let shot = Shot { light_samples: 256, ..shot([40, 40], Show::One(Mode::Transfer)) };
            [Mode::Transfer, Mode::Table].map(|mode| rms(&scene, &shot, [mode, Mode::ShadowedBruteForce]))
        };
        let [[beside, unshadowed], [within, _]] = lights().each_ref().map(of);
        assert!(beside < 0.02, "{}: {beside}", material.name());
        assert!(
            unshadowed > 5.0 * beside && within > 5.0 * beside,
            "{}: {unshadowed} {within}",
            material.name()
        );
    }
}

/// A lamp of the reflection is taken out of the coefficients of a light that was analysed as a whole: what
/// remains is what the reflection was made of, to the difference of the lamp's texels from its disk.
#[test]
fn lamps_of_a_reflection_are_taken_out_of_the_whole_light() {
    let sky = Lighting { series: light(32, uneven).lighting().clone(), ..lamp() };
    let whole = Light::new(Light::of_lighting(sky.clone()).unwrap().environment().clone(), None);
    let brdf = project(&gold(), Choice::Full, Stop::NEVER).unwrap().coefficients;
    let (reflection, _) = Reflection::for_light(&sky, &brdf, &gold(), Stop::NEVER).unwrap();
    let sizes = MapSizes { edge: 8, slices: 4 };
    let (table, _) = brdf::tabulate(&gold(), Degree::new(4).unwrap(), 16, Stop::NEVER).unwrap();
    let look = Look::new(Arc::new(whole), reflection, Some(gold()), sizes).with_table(Some(Arc::new(table)));
    assert_eq!(look.beside_table().unwrap().lights, sky.lights);
    let soft = look.table_light();
    for (row, rgb) in sky.series.to_degree(Degree::new(4).unwrap()).coefficients().iter().enumerate() {
        for channel in 0..3 {
            let apart = (soft.coefficients()[row][channel] - rgb[channel]).abs();
            assert!(apart < 5e-3, "{row}: {apart}");
        }
    }
}

/// A table of several materials has no single one that could reflect a lamp.
#[test]
fn beside_a_table_of_several_materials_lamps_stay_in_the_coefficients() {
    let [beside, _] = lights();
    let tables = [0.2, 0.8]
        .map(|albedo| brdf::tabulate(&lambert(albedo), Degree::new(2).unwrap(), 8, Stop::NEVER).unwrap().0);
    let table = brdf::BrdfTable::joined(&tables).unwrap();
    let look = Look::without_maps(Arc::clone(&beside), lambert(0.5), MapSizes { edge: 8, slices: 4 });
    let look = look.with_table(Some(Arc::new(table)));
    assert_eq!(look.beside_table(), None);
    assert_eq!(look.table_light(), beside.lighting());
}
