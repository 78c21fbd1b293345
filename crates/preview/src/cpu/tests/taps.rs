//! Pictures by a compact map.

use ::taps::{ScaleSpace, SurfaceFrame, Taps, Widths, fit, fit_facets};
use brdf::{Fresnel, Ggx};
use sphere::{DMat3, Direction};

use super::*;
use crate::{CompactMap, CompactTaps};

const GOLD: Fresnel = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };

fn gold() -> Material {
    Material::Ggx(Ggx::new(0.5, GOLD, [1.0; 3]).unwrap())
}

fn brushed() -> Material {
    Material::Ggx(Ggx::stretched([0.4, 0.7], GOLD, [1.0; 3]).unwrap())
}

/// A look that has nothing but its light, its material and a compact map of both; lamps stay beside the
/// levels.
fn compact(light: &Arc<Light>, material: Material) -> Look {
    let environment = light.environment();
    let lamps = environment.separate_lamps(Stop::NEVER).unwrap().lights;
    let widths = Widths::new(32).unwrap();
    let taps = if material.is_isotropic() {
        CompactTaps::Angle(fit(&material, 3, widths, Stop::NEVER).unwrap().table)
    } else {
        CompactTaps::View(fit_facets(&material, 4, widths, Stop::NEVER).unwrap().table)
    };
    let map = CompactMap {
        scales: Arc::new(ScaleSpace::new(environment, &lamps, widths, Stop::NEVER).unwrap()),
        taps: Arc::new(taps),
        material: material.clone(),
    };
    let sizes = MapSizes { edge: 8, slices: 4 };
    Look::without_maps(Arc::clone(light), material, sizes).with_compact_map(Some(Arc::new(map)))
}

fn lit() -> Arc<Light> {
    let lamp = DVec3::new(0.7, 0.5, 0.5).normalize();
    light(64, |w| uneven(w).map(|value| value + if w.dot(lamp) > 0.06_f64.cos() { 1500.0 } else { 0.0 }))
}

/// The oracle is `Taps::reflected` plus `LampPoints::radiance` or, of a brushed metal, `surface_radiance`,
/// all in f64, under a turned light.
#[test]
fn a_pixel_shows_the_taps_and_the_lights_beside_them() {
    for material in [gold(), brushed()] {
        let look = Arc::new(compact(&lit(), material));
        let map = look.compact_map().unwrap();
        let beside = map.lamps();
        let lamps = beside.for_views();
        assert!(!beside.lights.is_empty());
        let scene = Scene::of(sphere(), Arc::clone(&look));
        let turn = Rotation::from_yaw_pitch_roll(-0.4, 0.2, 0.1);
        let shot = Shot { turn, ..shot([48, 48], Show::One(Mode::Taps)) };
        let picture = render(&scene, &shot);
        let (mut count, mut brightest) = (0, 0.0_f64);
        for (place, seen) in seen(&scene, &shot).into_iter().enumerate() {
            let Some(Hit { surface, .. }) = seen else { continue };
            let exact = |v: glam::Vec3| Direction::normalised(v.as_dvec3());
            let [normal, tangent, view] = [surface.normal, surface.tangent, surface.view].map(exact);
            let soft = map.taps.table().reflected(&map.scales, SurfaceFrame::new(normal, tangent), view);
            let [z, x] = [normal, tangent].map(Direction::vector);
            let lit = if beside.material.is_isotropic() {
                lamps.radiance(exact(surface.central(look.centre())), view)
            } else {
                lamps.surface_radiance(DMat3::from_cols(x, z.cross(x), z), view)
            };
            for channel in 0..3 {
                let (found, expected) =
                    (f64::from(picture.radiance[place][channel]), soft[channel] + lit[channel]);
                // Roundings of f32, times the sharpness of the highlight.
                assert!((found - expected).abs() < 2e-3 * (1.0 + expected), "{found} {soft:?} {lit:?}");
                brightest = brightest.max(lit[channel]);
            }
            count += 1;
        }
        assert!(count > 800 && brightest > 3.0, "{count} {brightest}");
    }
}

#[test]
fn the_picture_is_near_brute_force() {
    for material in [gold(), brushed()] {
        let scene = Scene::of(sphere(), Arc::new(compact(&light(32, uneven), material)));
        let difference = Show::Difference { of: Mode::Taps, from: Mode::BruteForce, amplify: 1.0 };
        let shot = Shot { light_samples: 1024, ..shot([24, 24], difference) };
        let error = render(&scene, &shot).relative_rms.unwrap();
        assert!(error < 0.05, "{error}");
    }
}

#[test]
fn without_a_compact_map_there_is_brute_force() {
    let of = |look: Look| Scene::of(sphere(), Arc::new(look));
    let (light, show) = (light(16, uneven), Show::One(Mode::Taps));
    let made = of(compact(&light, gold()));
    assert!(made.offers(Mode::Taps) && !made.offers(Mode::LocalShrm) && !made.offers(Mode::Table));
    assert_eq!(made.available(show), show);
    let bare = of(Look::without_maps(light, gold(), MapSizes::default()));
    assert_eq!(bare.available(show), Show::One(Mode::BruteForce));
    let missing = bare.objects[0].look.compact_map().unwrap_err();
    assert_eq!(missing.to_string(), "this mode needs a scale space and taps");
}
