//! Pictures under a sun that is not in the maps.

use brdf::{Fresnel, Ggx, KajiyaKay, Phong};
use sh::{Lighting, Stop, Transform};
use shrm::{MapGrid, MapViews, Plain, View, ViewSet};
use sphere::Direction;

use super::*;

const SIZES: MapSizes = MapSizes { edge: 24, slices: 9 };

/// A sky with a sun of 3 degrees, 2000 times as bright, and its lighting as `project-sh` makes it by default.
fn sunny() -> (Arc<Light>, Lighting) {
    let sun = DVec3::new(0.7, 0.5, 0.5).normalize();
    let sky = |w: DVec3| {
        let up = 0.5 + 0.5 * w.z;
        let disk = if w.dot(sun) > 0.026_f64.cos() { 2000.0 } else { 0.0 };
        [0.3 + 0.2 * up + disk, 0.3 + 0.4 * up + disk, 0.3 + 0.7 * up + 0.8 * disk]
    };
    let light = light(128, sky);
    let separated = light.environment().separate_lamps(Stop::NEVER).unwrap();
    let transform = Transform::new(light.environment().grid(), Degree::new(30).unwrap()).unwrap();
    let series = transform.analyse(separated.soft.pixels());
    assert_eq!(separated.lights.len(), 1);
    (light, Lighting { series, lights: separated.lights })
}

fn gold() -> Material {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    Material::Ggx(Ggx::new(0.4, gold, [1.0; 3]).unwrap())
}

fn materials() -> [Material; 4] {
    [
        gold(),
        Material::Phong(Phong::new(150.0, [0.8, 0.9, 1.0]).unwrap()),
        Material::KajiyaKay(KajiyaKay::new(32.0, [0.9, 0.6, 0.3]).unwrap()),
        lambert(0.8),
    ]
}

/// The look of a material with the degrees that are chosen for the light.
fn sunny_look(light: &Arc<Light>, lighting: &Lighting, material: &Material) -> Arc<Look> {
    let brdf = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
    let (reflection, _) = Reflection::for_light(lighting, &brdf, material, Stop::NEVER).unwrap();
    Arc::new(Look::new(Arc::clone(light), reflection, Some(material.clone()), SIZES))
}

/// Returns the look as it is if all light is in the series, cut at the same degrees.
fn cut_look(look: &Look) -> Arc<Look> {
    let whole = look.reflection().unwrap().with_whole_light();
    Arc::new(Look::new(Arc::clone(look.light()), whole, look.material().cloned(), SIZES))
}

/// Returns the look on few texels: maps with lamps in them take long to make.
fn small(look: &Look) -> Arc<Look> {
    let (light, reflection) = (Arc::clone(look.light()), look.reflection().unwrap().clone());
    Arc::new(Look::new(light, reflection, look.material().cloned(), MapSizes { edge: 5, ..SIZES }))
}

/// Roundings of f32, times the sharpness of the highlights.
const CLOSE: f64 = 2e-3;

#[test]
fn the_shrm_modes_add_lamps_to_the_map() {
    let (light, lighting) = sunny();
    for material in materials() {
        let look = sunny_look(&light, &lighting, &material);
        let lamps = look.reflection().unwrap().lamps().unwrap();
        let scene = Scene::of(sphere(), Arc::clone(&look));
        let turn = Rotation::from_yaw_pitch_roll(-0.4, 0.2, 0.1);
        let shot = Shot { turn, ..shot([48, 48], Show::One(Mode::LocalShrm)) };
        let local = render(&scene, &shot);
        let global = render(&scene, &Shot { show: Show::One(Mode::GlobalShrm), ..shot.clone() });
        let back = turn.inverse().matrix() * shot.camera.view().vector();
        let (mut of_local, mut of_global) =
            (look.local().unwrap()[0].lookup(), look.global().unwrap()[0].lookup());
        let mut brightest: f64 = 0.0;
        for (place, seen) in seen(&scene, &shot).into_iter().enumerate() {
            let Some(Hit { surface, .. }) = seen else { continue };
            let exact = |v: glam::Vec3| Direction::normalised(v.as_dvec3());
            let (central, view) = (exact(surface.central(look.centre())), exact(surface.view));
            let lit = lamps.radiance(central, view);
            let soft =
                [of_local.radiance(central, view), of_global.radiance(central, Direction::normalised(back))];
            for (picture, soft) in [&local, &global].into_iter().zip(soft) {
                for channel in 0..3 {
                    let expected = f64::from(soft[channel].max(0.0)) + lit[channel];
                    let found = f64::from(picture.radiance[place][channel]);
                    assert!(
                        (found - expected).abs() < CLOSE * (1.0 + expected),
                        "{}: {found} {expected}",
                        material.name()
                    );
                }
            }
            brightest = brightest.max(lit[1]);
        }
        assert!(brightest > 0.1, "{}: {brightest}", material.name());
    }
}

/// A map of turned lighting has other texels, and the background is not compared.
#[test]
fn lamps_turn_with_the_light() {
    let (light, lighting) = sunny();
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.4, 1.9);
    let turned = lighting.rotated(turn);
    let scene = |lighting: &Lighting| Scene::of(sphere(), sunny_look(&light, lighting, &gold()));
    for mode in [Mode::LocalShrm, Mode::GlobalShrm] {
        let shot = shot([40, 40], Show::One(mode));
        let by_turn = render(&scene(&lighting), &Shot { turn, ..shot.clone() });
        let by_light = render(&scene(&turned), &shot);
        let (mut apart, mut brightest): (f32, f32) = (0.0, 0.0);
        for (a, b) in by_turn.radiance.iter().zip(&by_light.radiance).filter(|(a, _)| a[3] == 1.0) {
            apart = (0..3).map(|c| (a[c] - b[c]).abs() / (1.0 + b[c])).fold(apart, f32::max);
            brightest = brightest.max(b[0]);
        }
        assert!(apart < 0.03 && brightest > 2.0, "{mode:?}: {apart} {brightest}");
    }
}

#[test]
fn a_degree_in_the_view_cuts_the_shrms_and_no_other_map() {
    let (light, lighting) = sunny();
    let sunny = sunny_look(&light, &lighting, &gold());
    let [whole, other, baked] = [0; 3].map(|_| Arc::into_inner(small(&sunny)).unwrap());
    let p = Degree::ZERO;
    let degrees = [p, Degree::new(1).unwrap()];
    let cut = other.with_degrees_in_view(Some(vec![degrees]));
    let grid = MapGrid::Cube(cut.cube());
    let reflection = cut.reflection().unwrap();
    let expected = reflection.cut_in_view(p).synthesise(grid, View::Local, Stop::NEVER).unwrap();
    assert!(whole.local().unwrap()[0].p() > p);
    assert_eq!(cut.local().unwrap(), std::slice::from_ref(&expected));
    assert_eq!(cut.global().unwrap(), [expected.to_global()]);
    let baked = baked.with_lamps_in_maps(true).with_degrees_in_view(Some(vec![degrees]));
    let expected = baked.reflection().unwrap().bake(grid, View::Local, degrees, Stop::NEVER).unwrap();
    assert_eq!(baked.local().unwrap(), [expected]);
    for other in [&cut, &baked] {
        assert_eq!(other.cabral().unwrap(), whole.cabral().unwrap());
        assert_eq!(other.kautz_mccool().unwrap(), whole.kautz_mccool().unwrap());
        assert_eq!(other.prefiltered().unwrap(), whole.prefiltered().unwrap());
    }
}

#[test]
fn the_other_maps_hold_the_lamps_as_their_exports_do() {
    let (light, lighting) = sunny();
    for material in [gold(), lambert(0.8)] {
        let look = small(&sunny_look(&light, &lighting, &material));
        let reflection = look.reflection().unwrap();
        let grid = MapGrid::Cube(look.cube());
        let (soft, lamps) = (&look.local().unwrap()[0], reflection.lamps().unwrap());
        let with_lamps = |views| {
            let set = ViewSet::from_shrm(soft, views, Stop::NEVER).unwrap().unwrap();
            set.with_lamps(lamps, Stop::NEVER).unwrap()
        };
        assert_eq!(look.cabral().unwrap(), [with_lamps(MapViews::Icosahedron)]);
        assert_eq!(look.kautz_mccool().unwrap(), [with_lamps(MapViews::even_angles(SIZES.slices))]);
        let soft: Vec<[f32; 3]> = sh::synthesise_cube(&reflection.plain(Plain::Mean), look.cube()).unwrap();
        let lit = reflection.lamps().unwrap().plain(Plain::Mean, grid);
        for (texel, found) in look.prefiltered().unwrap()[0].iter().enumerate() {
            let sum = [0, 1, 2].map(|channel| (soft[texel][channel] + lit[texel][channel]).max(0.0));
            assert_eq!(*found, sum);
        }
    }
}

/// The error of a picture that 95 of 100 values on the sphere stay below, in stops above a hundredth of the
/// mean radiance.
fn p95(picture: &Picture, reference: &Picture, light: &Light) -> f32 {
    let dark = 0.01 * light.lighting().get(0, 0)[1] as f32 / (4.0 * std::f32::consts::PI).sqrt();
    let pixels = picture.radiance.iter().zip(&reference.radiance).filter(|(pixel, _)| pixel[3] == 1.0);
    let mut stops: Vec<f32> = pixels
        .flat_map(|(a, b)| [0, 1, 2].map(|c| ((a[c].max(0.0) + dark) / (b[c] + dark)).log2().abs()))
        .collect();
    stops.sort_by(f32::total_cmp);
    stops[stops.len() * 95 / 100]
}

/// Compares with the file of `export-shrm`: nothing is added to a map that holds the lamps.
#[test]
fn with_lamps_in_maps_a_picture_is_that_of_the_baked_map() {
    let (light, lighting) = sunny();
    let look = small(&sunny_look(&light, &lighting, &gold()));
    let reflection = look.reflection().unwrap().clone();
    let sizes = look.sizes();
    let p = sh::Degree::new(shrm::MOST_P).unwrap();
    let map =
        reflection.bake(MapGrid::Cube(look.cube()), View::Local, [p, Degree::MAX], Stop::NEVER).unwrap();
    let file = Look::from_map(Arc::clone(&light), map, None, sizes);
    let baked = Look::new(Arc::clone(&light), reflection, None, sizes).with_lamps_in_maps(true);
    let of = |look: Look| {
        let shot = shot([24, 24], Show::One(Mode::LocalShrm));
        render(&Scene::of(sphere(), Arc::new(look)), &shot).radiance
    };
    let beside = of(Look::new(Arc::clone(&light), look.reflection().unwrap().clone(), None, sizes));
    let (file, baked) = (of(file), of(baked));
    assert!(file == baked, "the picture of the file");
    assert!(beside != baked, "baking loses something");
}

/// `for_light` leaves 0.075 stops, and brute force has a noise of some hundredths: 0.05 in all, and 0.02 for
/// phong. The same degrees with the sun in the series ring: 1.8 and 5.3.
#[test]
fn a_sun_leaves_no_rings() {
    let (light, lighting) = sunny();
    let [gold, phong, ..] = materials();
    for material in [gold, phong] {
        let look = sunny_look(&light, &lighting, &material);
        let of = |look: &Arc<Look>, mode| {
            let shot = Shot { light_samples: 512, ..shot([32, 32], Show::One(mode)) };
            render(&Scene::of(sphere(), Arc::clone(look)), &shot)
        };
        let reference = of(&look, Mode::BruteForce);
        for mode in [Mode::LocalShrm, Mode::GlobalShrm] {
            let [beside, in_series] =
                [&look, &cut_look(&look)].map(|look| p95(&of(look, mode), &reference, &light));
            let name = material.name();
            assert!(beside < 0.1 && in_series > 1.0, "{name} {mode:?}: {beside} {in_series}");
        }
    }
}
