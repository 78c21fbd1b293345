//! Whole pictures.

use std::sync::atomic::{AtomicU32, Ordering};

use super::*;

/// The largest difference of radiance and coverage.
fn largest_difference(one: &Picture, other: &Picture) -> f32 {
    let pairs = one.radiance.as_flattened().iter().zip(other.radiance.as_flattened());
    pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max)
}

/// In a uniform environment a white surface has the environment's radiance in every mode, and so does the
/// background. The weights of Fejér's rule are exact for a constant, so only rounding remains. Brute force
/// has the noise of its light samples.
#[test]
fn every_mode_reflects_a_constant_light_unchanged() {
    let constant = light(16, |_| [0.5, 1.0, 2.0]);
    let phong = Material::Phong(brdf::Phong::new(8.0, [1.0; 3]).unwrap());
    for (material, f) in [(lambert(1.0), 6), (phong, 12)] {
        let (table, _) = brdf::tabulate(&material, Degree::new(f).unwrap(), 16, Stop::NEVER).unwrap();
        let look = Arc::into_inner(look(&constant, &material, [f, 0])).unwrap();
        let scene = Scene::of(sphere(), Arc::new(look.with_table(Some(Arc::new(table)))));
        for background in [Background::Environment, Background::Harmonics] {
            for mode in shading_modes().filter(|mode| scene.offers(*mode)) {
                let brute = mode.is_brute_force();
                if brute && matches!(material, Material::Phong(_)) {
                    continue;
                }
                let light_samples = if brute { 256 } else { 1 };
                let shot = Shot { background, light_samples, ..shot([40, 30], Show::One(mode)) };
                let allowed = if brute { 0.1 } else { 2e-5 };
                for pixel in &render(&scene, &shot).radiance {
                    for (channel, expected) in [0.5, 1.0, 2.0].into_iter().enumerate() {
                        let off = (pixel[channel] / expected - 1.0).abs();
                        assert!(off < allowed, "{mode:?} {background:?}: {pixel:?}");
                    }
                }
            }
        }
    }
}

/// For a material that depends on the view, the maps show the field in f64 up to bilinear interpolation: (h
/// l)^2 / 8 of waves of degree l = 6 at texels of h = pi / 64, at most 1.1 % of the varying part.
#[test]
fn the_shrm_modes_show_the_reflected_field() {
    let light = light(32, uneven);
    let look = look(&light, &microfacet(0.4), [6, 4]);
    let scene = Scene::of(sphere(), Arc::clone(&look));
    let shot = shot([50, 50], Show::One(Mode::LocalShrm));
    let local = render(&scene, &shot);
    let global = render(&scene, &Shot { show: Show::One(Mode::GlobalShrm), ..shot.clone() });
    let field = look.reflection().unwrap();
    let mut count = 0;
    for (place, seen) in seen(&scene, &shot).into_iter().enumerate().step_by(7) {
        let Some(Hit { surface, .. }) = seen else { continue };
        let exact = |v: glam::Vec3| sphere::Direction::normalised(v.as_dvec3());
        let central = exact(surface.central(look.centre()));
        for (picture, view) in [(&local, exact(surface.view)), (&global, shot.camera.view())] {
            let expected = field.evaluate(central, view);
            for channel in 0..3 {
                let found = f64::from(picture.radiance[place][channel]);
                assert!((found - expected[channel]).abs() < 0.011, "{found} {expected:?}");
            }
        }
        count += 1;
    }
    assert!(count > 200);
}

/// A matte base under a highlight has a map of each part, each about its own direction: it looks like the sum
/// of what has the one and what has the other map alone. One map of both does not.
#[test]
fn a_map_of_each_part_shows_the_sum_of_both() {
    let light = light(32, uneven);
    let lacquer = Material::layers(vec![lambert(0.6), microfacet(0.4)]).unwrap();
    let of = |material: &Material| look(&light, material, [6, 4]).reflection().unwrap().clone();
    let parts = lacquer.split().unwrap().map(|part| of(&part));
    let scene = |reflection: Reflection, is_one: bool| {
        let sizes = MapSizes { edge: 32, slices: 16 };
        let look = Look::new(Arc::clone(&light), reflection, Some(lacquer.clone()), sizes);
        Scene::of(sphere(), Arc::new(look.with_parts_in_one_map(is_one)))
    };
    let [diffuse, specular] = parts.each_ref().map(|part| scene(part.clone(), false));
    let [both, one] = [false, true].map(|is_one| scene(of(&lacquer).with_parts(parts.clone()), is_one));
    let modes = [Mode::LocalShrm, Mode::GlobalShrm, Mode::Cabral, Mode::KautzMcCool, Mode::Prefiltered];
    for mode in modes {
        let shot = shot([50, 50], Show::One(mode));
        let [diffuse, specular, both, one] =
            [&diffuse, &specular, &both, &one].map(|scene| render(scene, &shot).radiance);
        let (mut count, mut apart) = (0, 0.0_f32);
        for (place, found) in both.iter().enumerate().filter(|(_, found)| found[3] > 0.0) {
            for channel in 0..3 {
                let expected = diffuse[place][channel] + specular[place][channel];
                assert!((found[channel] - expected).abs() < 1e-5, "{mode:?}: {} {expected}", found[channel]);
                apart = apart.max((one[place][channel] - expected).abs());
            }
            count += 1;
        }
        assert!(count > 1000 && apart > 0.05, "{mode:?}: {count} {apart}");
    }
}

/// Rotating the light in the shot equals rotating its coefficients. Coefficients rotate exactly; the maps
/// have other texels, as above. Cabral's views rotate with the light, and coincide after a fifth of a turn
/// about the pole.
#[test]
fn a_rotation_of_the_light_equals_a_rotated_light() {
    let still = light(32, uneven);
    let scene = |light: &Arc<Light>| Scene::of(sphere(), look(light, &microfacet(0.4), [6, 4]));
    let any = Rotation::from_yaw_pitch_roll(0.7, -0.4, 1.9);
    let fifth = Rotation::from_yaw_pitch_roll(std::f64::consts::TAU / 5.0, 0.0, 0.0);
    for (mode, turn, allowed) in [
        (Mode::LocalShrm, any, 0.011),
        (Mode::GlobalShrm, any, 0.011),
        (Mode::Cabral, fifth, 0.011),
        (Mode::KautzMcCool, any, 0.011),
        (Mode::Prefiltered, any, 0.011),
        (Mode::Irradiance, any, 1e-5),
    ] {
        let lighting = sh::rotate(still.lighting(), turn);
        let turned = Arc::new(Light::new(still.environment().clone(), Some(lighting)));
        let shot = Shot { background: Background::Harmonics, ..shot([40, 40], Show::One(mode)) };
        let by_turn = render(&scene(&still), &Shot { turn, ..shot.clone() });
        let by_light = render(&scene(&turned), &shot);
        let unturned = render(&scene(&still), &shot);
        for (by_turn, by_light) in by_turn.radiance.iter().zip(&by_light.radiance) {
            let allowed = if by_turn[3] > 0.0 { allowed } else { 0.011 };
            for channel in 0..3 {
                let apart = (by_turn[channel] - by_light[channel]).abs();
                assert!(apart < allowed, "{mode:?}: {by_turn:?} {by_light:?}");
            }
        }
        assert!(largest_difference(&by_turn, &unturned) > 0.2, "{mode:?}");
    }
}

/// A rotation by whole columns, here 5 of 64, is exact.
#[test]
fn a_rotated_environment_shows_in_mirrors_and_in_the_background() {
    let still = light(32, uneven);
    let turn = Rotation::from_yaw_pitch_roll(5.0 / 64.0 * std::f64::consts::TAU, 0.0, 0.0);
    let turned = Arc::new(Light::new(still.environment().rotated(turn, Stop::NEVER).unwrap(), None));
    let scene = |light: &Arc<Light>| Scene::of(sphere(), look(light, &lambert(1.0), [0, 0]));
    let shot = shot([40, 40], Show::One(Mode::Mirror));
    let by_turn = render(&scene(&still), &Shot { turn, ..shot.clone() });
    assert!(largest_difference(&by_turn, &render(&scene(&turned), &shot)) < 1e-4);
    assert!(largest_difference(&by_turn, &render(&scene(&still), &shot)) > 0.2);
}

#[test]
fn a_split_has_a_part_of_each_picture() {
    let scene = Scene::of(sphere(), look(&light(16, uneven), &microfacet(0.4), [6, 2]));
    let shot = shot([50, 30], Show::One(Mode::Mirror));
    let of = |show| render(&scene, &Shot { samples: 2, show, ..shot.clone() });
    let (left, right) = (of(Show::One(Mode::LocalShrm)), of(Show::One(Mode::Mirror)));
    for (at, divider) in [(0.0, 0), (0.37, 19), (1.0, 50), (7.0, 50), (-1.0, 0)] {
        let split = of(Show::Split { left: Mode::LocalShrm, right: Mode::Mirror, at });
        for place in 0..50 * 30 {
            let whole = if place % 50 < divider { &left } else { &right };
            assert_eq!(split.radiance[place], whole.radiance[place]);
            assert_eq!(split.codes[place], whole.codes[place]);
        }
        let same = of(Show::Split { left: Mode::Mirror, right: Mode::Mirror, at });
        assert_eq!(same, right);
    }
}

#[test]
fn a_difference_compares_both_pictures_and_has_an_rms() {
    let scene = Scene::of(sphere(), look(&light(16, uneven), &microfacet(0.4), [6, 2]));
    let shot = shot([50, 30], Show::One(Mode::Mirror));
    let of = |show| render(&scene, &Shot { show, exposure: -1.0, ..shot.clone() });
    let (one, other) = (of(Show::One(Mode::LocalShrm)), of(Show::One(Mode::Mirror)));
    let difference = of(Show::Difference { of: Mode::LocalShrm, from: Mode::Mirror, amplify: 3.0 });
    let (mut squares, mut from) = (0.0, 0.0);
    for place in 0..50 * 30 {
        let seen = one.radiance[place][3];
        let mut shown = [0.0; 3];
        for channel in 0..3 {
            let apart = (one.radiance[place][channel] - other.radiance[place][channel]).abs() * seen;
            assert_eq!(difference.radiance[place][channel], apart);
            squares += f64::from(apart).powi(2);
            from += f64::from(other.radiance[place][channel] * seen).powi(2);
            shown[channel] = 3.0 * apart;
        }
        assert_eq!(difference.radiance[place][3], seen);
        assert_eq!(difference.codes[place], envmap::to_srgb8(&[shown], -1.0, ToneMap::Plain)[0]);
    }
    let rms = difference.relative_rms.unwrap();
    assert!(rms > 0.01 && (rms / (squares / from).sqrt() - 1.0).abs() < 1e-6, "{rms}");
    assert_eq!((one.relative_rms, other.relative_rms), (None, None));
}

/// Both sides use the same shader.
#[test]
fn a_mode_equals_itself() {
    let scene = Scene::of(sphere(), look(&light(16, uneven), &microfacet(0.4), [6, 2]));
    let show = Show::Difference { of: Mode::LocalShrm, from: Mode::LocalShrm, amplify: 1e6 };
    let picture = render(&scene, &shot([30, 30], show));
    assert_eq!(picture.relative_rms, Some(0.0));
    assert!(picture.codes.iter().all(|code| *code == [0; 3]));
}

/// The modes that shade surfaces.
fn shading_modes() -> impl Iterator<Item = Mode> {
    Mode::ALL.into_iter().filter(|mode| !mode.is_diagram())
}

/// Two looks in one scene look as they do alone.
#[test]
fn each_object_has_its_own_look() {
    let (first, second) = (light(16, uneven), light(16, |w| [1.0 + 0.5 * w.z, 1.0, 1.0]));
    let looks = [look(&first, &lambert(0.5), [4, 0]), look(&second, &microfacet(0.4), [6, 2])];
    let place = |x: f64| {
        let shift = DVec3::new(-0.3 * x, 0.5 * x, 0.0);
        DAffine3::from_scale_rotation_translation(DVec3::splat(0.5), glam::DQuat::IDENTITY, shift)
    };
    let object = |k: usize| placed(&sphere(), place([-1.0, 1.0][k]), &looks[k]);
    let scene = |objects| Scene { light: Arc::clone(&first), objects };
    let mut cpu = super::super::Cpu::new();
    for mode in shading_modes() {
        let shot = shot([60, 40], Show::One(mode));
        let mut of = |objects| cpu.render(&scene(objects), &shot, Stop::NEVER).unwrap();
        let both = of(vec![object(0), object(1)]);
        let alone = [of(vec![object(0)]), of(vec![object(1)])];
        let mut seen = [0, 0];
        for place in 0..60 * 40 {
            let expected = alone.iter().position(|alone| alone.radiance[place][3] > 0.0);
            expected.iter().for_each(|&k| seen[k] += 1);
            assert_eq!(both.radiance[place], alone[expected.unwrap_or(0)].radiance[place], "{mode:?}");
        }
        assert!(seen[0] > 200 && seen[1] > 200, "{seen:?}");
    }
}

#[test]
fn any_number_of_threads_makes_the_same_picture() {
    let scene = Scene::of(
        Arc::new(mesh::shape("torus-knot").unwrap()),
        look(&light(16, uneven), &microfacet(0.4), [6, 2]),
    );
    let on = |threads: usize, show: Show| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &Shot { samples: 3, light_samples: 4, ..shot([33, 21], show) }))
    };
    let differences = [Show::Difference { of: Mode::BruteForce, from: Mode::Cabral, amplify: 2.0 }];
    for show in Mode::ALL.map(Show::One).into_iter().chain(differences) {
        assert_eq!(on(1, show), on(3, show), "{show:?}");
    }
}

/// Samples are developed before they are averaged: a pixel half black and half far above white is a mid grey.
#[test]
fn samples_are_developed_before_they_are_averaged() {
    let bright = light(8, |w| [if w.z > 0.0 { 1000.0 } else { 0.0 }; 3]);
    let scene = Scene { light: bright, objects: Vec::new() };
    for tone in [ToneMap::Plain, ToneMap::Filmic] {
        let fine = Shot { tone, ..shot([20, 40], Show::One(Mode::Mirror)) };
        let coarse = Shot { size: [10, 20], samples: 2, ..fine.clone() };
        let (fine, coarse) = (render(&scene, &fine), render(&scene, &coarse));
        for (place, code) in coarse.codes.iter().enumerate() {
            let (x, y) = (place % 10, place / 10);
            let four = [0, 1, 20, 21].map(|k| 2 * y * 20 + 2 * x + k);
            let display = four.map(|k| tone.apply(fine.radiance[k][..3].try_into().unwrap())[0]);
            let mean = display.iter().sum::<f32>() / 4.0;
            let expected = envmap::to_srgb8(&[[mean; 3]], 0.0, ToneMap::Plain)[0];
            // The rays of the pictures differ by rounding.
            assert!(code[0].abs_diff(expected[0]) <= 1, "{code:?} {expected:?}");
        }
    }
}

/// The exposure is that of contact sheets and reports: `envmap` fixes it.
#[test]
fn by_default_a_constant_environment_is_shown_as_middle_grey_whatever_its_units() {
    for level in [1e-3, 7.0] {
        let scene = Scene::of(sphere(), look(&light(16, |_| [level; 3]), &lambert(0.5), [4, 0]));
        let settings = crate::ViewSettings { zoom: 0.25, ..crate::ViewSettings::default() };
        let shot = settings.shot(&scene, scene.framing(), [8, 8]);
        assert_eq!(render(&scene, &shot).codes[0], [118; 3], "{level}");
        let brighter = crate::ViewSettings { exposure: 1.0, ..settings };
        let brighter = brighter.shot(&scene, scene.framing(), [8, 8]);
        assert!((brighter.exposure - shot.exposure - 1.0).abs() < 1e-12);
    }
}

#[test]
fn exposure_does_not_change_a_flat_background() {
    let scene = Scene::of(sphere(), look(&light(16, uneven), &lambert(0.5), [4, 0]));
    let flat = Shot {
        background: Background::Flat([0.2, 0.3, 0.4]),
        camera: Camera { zoom: 0.5, ..shot([1, 1], Show::One(Mode::Mirror)).camera },
        ..shot([40, 40], Show::One(Mode::LocalShrm))
    };
    let [dark, bright] = [-2.0, 2.0].map(|exposure| render(&scene, &Shot { exposure, ..flat.clone() }));
    let code = envmap::to_srgb8(&[[0.2, 0.3, 0.4]], 0.0, ToneMap::Plain)[0];
    let mut seen = [0, 0];
    for place in 0..1600 {
        let covered = dark.radiance[place][3] > 0.0;
        seen[usize::from(covered)] += 1;
        if covered {
            assert!(bright.codes[place][0] > dark.codes[place][0]);
        } else {
            assert_eq!([dark.codes[place], bright.codes[place]], [code; 2]);
            assert_eq!(dark.radiance[place], [0.2, 0.3, 0.4, 0.0]);
        }
    }
    assert!(seen[0] > 100 && seen[1] > 100);
}

#[test]
fn a_picture_is_cancelled_within_a_million_light_samples() {
    let scene = Scene::of(sphere(), look(&light(16, uneven), &lambert(0.5), [4, 0]));
    let shot = Shot { light_samples: 3_000_000, ..shot([2, 2], Show::One(Mode::BruteForce)) };
    let calls = AtomicU32::new(0);
    let stop = || calls.fetch_add(1, Ordering::Relaxed) >= 20;
    let stopped = super::super::Cpu::new().render(&scene, &shot, Stop::when(&stop));
    assert_eq!(stopped, Err(RenderError::Cancelled));
    // Twelve million light samples would be 183 calls; the preparation makes few.
    assert!(calls.into_inner() < 40);
    let at_once = super::super::Cpu::new().render(&scene, &shot, Stop::when(&|| true));
    assert_eq!(at_once, Err(RenderError::Cancelled));
}

#[test]
fn brute_force_needs_a_material() {
    let light = light(16, uneven);
    let known = look(&light, &lambert(0.5), [4, 0]);
    let reflection = known.reflection().unwrap().clone();
    let unknown = Look::new(light, reflection, None, MapSizes { edge: 8, slices: 4 });
    let scene = Scene::of(sphere(), Arc::new(unknown));
    let made =
        super::super::Cpu::new().render(&scene, &shot([4, 4], Show::One(Mode::BruteForce)), Stop::NEVER);
    assert!(matches!(made, Err(RenderError::Missing { .. })), "{made:?}");
}

/// The oracle is the picture by brute force of the same look with its maps.
#[test]
fn without_maps_the_modes_that_need_them_are_drawn_by_brute_force() {
    let (light, material) = (light(16, uneven), lambert(0.5));
    let whole = Scene::of(sphere(), look(&light, &material, [4, 0]));
    let sizes = MapSizes { edge: 8, slices: 4 };
    let bare = Scene::of(sphere(), Arc::new(Look::without_maps(light, material, sizes)));
    let picture = |scene: &Scene, show| render(scene, &Shot { light_samples: 8, ..shot([24, 16], show) });
    let brute = picture(&whole, Show::One(Mode::BruteForce));
    let split = Show::Split { left: Mode::LocalShrm, right: Mode::Cabral, at: 0.5 };
    let difference = Show::Difference { of: Mode::Prefiltered, from: Mode::BruteForce, amplify: 8.0 };
    for show in [split, difference].into_iter().chain(Mode::ALL.map(Show::One)) {
        let drawn = picture(&bare, show);
        match show {
            Show::One(mode) if !mode.needs_maps() => assert_eq!(drawn, picture(&whole, show), "{show:?}"),
            _ => assert_eq!(drawn, brute, "{show:?}"),
        }
    }
    let mirrored = Show::Split { left: Mode::Mirror, right: Mode::LocalShrm, at: 0.5 };
    let expected = Show::Split { left: Mode::Mirror, right: Mode::BruteForce, at: 0.5 };
    assert_eq!(picture(&bare, mirrored), picture(&whole, expected));
}
