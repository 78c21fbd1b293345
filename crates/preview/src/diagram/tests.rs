//! Points lie where the shown functions are, and the picture follows light and camera.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

use brdf::{Choice, Lambert, Material, Microfacet, project};
use envmap::Environment;
use glam::DVec3;
use sh::{Degree, Stop};
use shrm::Reflection;
use sphere::{Direction, LatLong};

use super::*;
use crate::lobe::{NO_LOBE, NO_MATERIAL};
use crate::{Background, Camera, Cpu, Framing, MapSizes, Mode, PointSet, Renderer, Show};

fn environment(radiance: impl Fn(DVec3) -> [f32; 3]) -> Environment {
    let grid = LatLong::with_rows(32);
    let texel = |i: usize| radiance(grid.direction(i / grid.width, i % grid.width).vector());
    Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap()
}

fn sun() -> DVec3 {
    DVec3::new(0.7, 0.1, 0.6).normalize()
}

/// A sun with a radius of nine degrees in the dark.
fn small_sun(w: DVec3) -> [f32; 3] {
    if w.dot(sun()) > 0.988 { [900.0, 800.0, 600.0] } else { [0.0; 3] }
}

fn uneven(w: DVec3) -> [f32; 3] {
    [2.0 + w.x * w.y, 1.0 + 0.9 * w.y, 2.5 + w.z * w.x].map(|value| value as f32)
}

fn metal() -> Material {
    Material::Microfacet(Microfacet::new(0.25, [1.0, 0.8, 0.5]).unwrap())
}

fn look(environment: Environment, material: Material) -> Arc<Look> {
    let light = Arc::new(Light::new(environment, None));
    Arc::new(Look::without_maps(light, material, MapSizes::default()))
}

fn shot(camera_yaw: f64, light_yaw: f64) -> Shot {
    let framing = Framing::ball(DVec3::ZERO, 1.0);
    Shot {
        size: [180, 70],
        samples: 1,
        camera: Camera { yaw: camera_yaw, ..Camera::new(framing) },
        turn: Rotation::from_yaw_pitch_roll(light_yaw, 0.0, 0.0),
        show: Show::One(Mode::Samples),
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Plain,
        light_samples: 1,
        points: PointSet::Even,
    }
}

fn scene(look: &Arc<Look>) -> Scene {
    Scene::of(Arc::new(mesh::shape("sphere").unwrap()), Arc::clone(look))
}

fn picture(look: &Arc<Look>, shot: &Shot) -> Vec<[u8; 3]> {
    Cpu::new().render(&scene(look), shot, Stop::NEVER).unwrap().codes
}

/// The radiance of the texel that holds a direction, the sum of its channels.
fn texel(look: &Look, direction: [f32; 3]) -> f32 {
    let environment = look.light().environment();
    let grid = environment.grid();
    let (column, row) = grid.position(Direction::normalised(Vec3::from(direction).as_dvec3()));
    let inside = |x: f64, count: usize| ((x + 0.5) as usize) % count;
    environment.pixels()[inside(row, grid.height) * grid.width + inside(column, grid.width)].iter().sum()
}

fn is_point(code: &[u8; 3]) -> bool {
    *code == POINT
}

#[test]
fn all_points_of_the_light_lie_in_the_sun() {
    let look = look(environment(small_sun), metal());
    let sets = SampleSource::default().draw(&look, SurfaceFrame::new(&shot(0.0, 0.0)), PointSet::Even);
    let light = sets.light.unwrap();
    assert_eq!(light.len(), 512);
    assert!(light.iter().all(|direction| texel(&look, *direction) > 0.0));
    let product = sets.product.unwrap();
    assert!(product.iter().all(|direction| texel(&look, *direction) > 0.0));
}

#[test]
fn points_of_lobe_and_product_lie_where_the_lobe_is() {
    let look = look(environment(uneven), metal());
    for yaw in [0.0, 1.3, 4.0] {
        let shot = shot(yaw, 0.4);
        let (mut source, frame) = (SampleSource::default(), SurfaceFrame::new(&shot));
        let sets = source.draw(&look, frame, PointSet::Even);
        let lobe = source.lobe().unwrap();
        // The mirror image of the view is half-way to the upper edge of the ball.
        let ball = MirrorBall::new(&shot);
        let mirror = ball.direction(Vec2::new(0.0, (FRAC_PI_6 as f32).sin())).unwrap();
        assert!(lobe.value(frame, mirror).max_element() > 0.7);
        for points in [sets.lobe.unwrap(), sets.product.unwrap()] {
            let mean = points.iter().map(|point| Vec3::from(*point)).sum::<Vec3>() / 512.0;
            assert!(mean.normalize().dot(mirror) > 0.97, "{mean} {mirror}");
            // Leaves in which the lobe changes sign are flat.
            let values = points.iter().map(|point| lobe.value(frame, Vec3::from(*point)).element_sum());
            assert!(values.filter(|value| *value > 0.0).count() > 500);
        }
    }
}

#[test]
fn a_turn_of_the_light_leaves_its_points_on_it_and_moves_the_others() {
    let look = look(environment(uneven), metal());
    let mut source = SampleSource::default();
    let [before, after] =
        [0.0, 0.5].map(|yaw| source.draw(&look, SurfaceFrame::new(&shot(0.0, yaw)), PointSet::Even));
    assert_eq!(before.light, after.light);
    assert!(before.lobe != after.lobe && before.product != after.product);
    // What is kept draws the same as what is new.
    assert_eq!(
        after,
        SampleSource::default().draw(&look, SurfaceFrame::new(&shot(0.0, 0.5)), PointSet::Even)
    );
}

/// The rays differ by rounding: a quarter turn moves every texel to another one.
#[test]
fn a_turned_light_is_shown_as_the_light_that_is_made_turned() {
    let here = look(environment(uneven), metal());
    let there = look(environment(|w| uneven(DVec3::new(w.y, -w.x, w.z))), metal());
    let [turned, made] = [shot(0.3, FRAC_PI_2), shot(0.3, 0.0)];
    let lobe = Lobe::of(&here).unwrap();
    let of = |look: &Look, shot: &Shot, at: Vec2| {
        let frame = SurfaceFrame::new(shot);
        let functions = Functions { light: look.light(), lobe: Some(&lobe), product_gain: 2.0, frame, shot };
        functions.display(MirrorBall::new(shot).direction(at).unwrap())
    };
    for k in 0..100 {
        let at = Vec2::from_angle(2.4 * k as f32) * (k as f32 / 101.0).sqrt();
        for (one, other) in of(&here, &turned, at).into_iter().zip(of(&there, &made, at)) {
            assert!(one.distance(other) < 1e-4, "{at}: {one} {other}");
        }
    }
}

#[test]
fn the_picture_follows_the_light_unless_the_camera_turns_with_it() {
    let look = look(environment(uneven), metal());
    let still = picture(&look, &shot(0.0, 0.0));
    let apart = |other: &[[u8; 3]]| {
        let far = |(one, other): (&[u8; 3], &[u8; 3])| (0..3).any(|k| one[k].abs_diff(other[k]) > 2);
        still.iter().zip(other).filter(|pair| far(*pair)).count()
    };
    assert!(apart(&picture(&look, &shot(0.0, 0.8))) > 1000);
    assert!(apart(&picture(&look, &shot(0.8, 0.0))) > 1000);
    // Rounding may move a point to the next leaf.
    assert!(apart(&picture(&look, &shot(0.8, 0.8))) < 50);
}

#[test]
fn what_is_kept_between_pictures_does_not_change_them() {
    let (first, second) = (look(environment(uneven), metal()), look(environment(small_sun), metal()));
    let white = look(environment(uneven), Material::Lambert(Lambert::new([0.8; 3]).unwrap()));
    let mut cpu = Cpu::new();
    for (look, yaw) in [(&first, 0.0), (&first, 0.6), (&second, 0.6), (&white, 0.6), (&first, 0.6)] {
        let kept = cpu.render(&scene(look), &shot(0.0, yaw), Stop::NEVER).unwrap().codes;
        assert_eq!(kept, picture(look, &shot(0.0, yaw)));
        assert!(kept.iter().any(is_point));
    }
}

#[test]
fn the_coefficients_of_a_reflection_are_shown_as_they_are() {
    let bare = look(environment(uneven), metal());
    let degree = |l| Degree::new(l).unwrap();
    let choice = Choice::Degree { f: degree(6), p: degree(4) };
    let brdf = project(&metal(), choice, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection::convolve(bare.light().lighting(), &brdf);
    let made = Look::new(Arc::clone(bare.light()), reflection, None, MapSizes::default());
    assert_eq!(Lobe::of(&made).unwrap().degree(), degree(6));
    assert_eq!(Lobe::of(&bare).unwrap().degree(), degree(19));
    let full =
        project(&metal(), Choice::Degree { f: degree(24), p: degree(20) }, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection::convolve(bare.light().lighting(), &full);
    let made = Look::new(Arc::clone(bare.light()), reflection, None, MapSizes::default());
    // The series over views stops at degree 20.
    let frame = SurfaceFrame::new(&shot(0.0, 0.0));
    let [one, other] = [Lobe::of(&made), Lobe::of(&bare)].map(|lobe| lobe.unwrap().turned(frame));
    for (one, other) in one.coefficients().iter().zip(other.coefficients()) {
        assert!((one[0] - other[0]).abs() < 0.02, "{one:?} {other:?}");
    }
}

#[test]
fn a_black_light_has_a_caption_and_no_points() {
    let look = look(environment(|_| [0.0; 3]), metal());
    let sets = SampleSource::default().draw(&look, SurfaceFrame::new(&shot(0.0, 0.0)), PointSet::Even);
    assert_eq!((sets.light, sets.product), (Err("the light is black"), Err("the light is black")));
    let codes = picture(&look, &shot(0.0, 0.0));
    let is_in_column = |k: usize, column: usize| k % 180 / 60 == column;
    for column in [0, 2] {
        let drawn = || codes.iter().enumerate().filter(|(k, _)| is_in_column(*k, column));
        assert!(!drawn().any(|(_, code)| is_point(code)));
        let rows = drawn().filter(|(k, _)| (20..40).contains(&(k / 180)));
        assert!(rows.filter(|(_, code)| code[0] > 100).count() > 20, "a caption");
    }
    assert!(codes.iter().enumerate().any(|(k, code)| is_in_column(k, 1) && is_point(code)), "the lobe's");
}

#[test]
fn what_cannot_be_sampled_has_a_caption() {
    let light = Arc::new(Light::new(environment(uneven), None));
    let sets = |look: Look| {
        SampleSource::default().draw(&Arc::new(look), SurfaceFrame::new(&shot(0.0, 0.0)), PointSet::Even)
    };
    let unknown = sets(Look::of_light(Arc::clone(&light), None, MapSizes::default()));
    assert!(unknown.light.is_ok());
    assert_eq!((unknown.lobe, unknown.product), (Err(NO_MATERIAL), Err(NO_MATERIAL)));
    let black = Material::Lambert(Lambert::new([0.0; 3]).unwrap());
    let black = sets(Look::without_maps(light, black, MapSizes::default()));
    assert_eq!((black.lobe, black.product), (Err(NO_LOBE), Err(NO_LOBE)));
    // A surface that faces away from a small sun.
    let look = look(environment(small_sun), Material::Lambert(Lambert::new([0.8; 3]).unwrap()));
    let behind = SampleSource::default().draw(
        &look,
        SurfaceFrame::new(&shot(std::f64::consts::PI, 0.0)),
        PointSet::Even,
    );
    assert!(behind.light.is_ok() && behind.lobe.is_ok());
    let empty = Scene { objects: Vec::new(), ..scene(&look) };
    let codes = Cpu::new().render(&empty, &shot(0.0, 0.0), Stop::NEVER).unwrap().codes;
    assert!(codes.iter().any(|code| code[0] > 100) && !codes.iter().any(is_point));
}

#[test]
fn any_size_is_drawn() {
    let look = look(environment(uneven), metal());
    for size in [[1, 1], [2, 300], [300, 2], [17, 9], [640, 360]] {
        let shot = Shot { size, samples: 2, ..shot(0.2, 0.3) };
        assert_eq!(picture(&look, &shot).len(), (size[0] * size[1]) as usize);
    }
}

#[test]
fn beside_another_mode_it_fills_its_side() {
    let look = look(environment(uneven), metal());
    let show = Show::Split { left: Mode::Mirror, right: Mode::Samples, at: 0.5 };
    let both = picture(&look, &Shot { show, ..shot(0.0, 0.0) });
    let mirror = picture(&look, &Shot { show: Show::One(Mode::Mirror), ..shot(0.0, 0.0) });
    let diagram = picture(&look, &Shot { size: [90, 70], ..shot(0.0, 0.0) });
    for row in 0..70 {
        assert_eq!(both[180 * row..][..90], mirror[180 * row..][..90]);
        assert_eq!(both[180 * row + 90..][..90], diagram[90 * row..][..90]);
    }
}

/// The mean over the sphere, by texels. The light is white, as is the lobe, so that no colours
/// correlate.
#[test]
fn the_product_is_as_bright_as_the_light_in_the_mean() {
    let white = Material::Microfacet(Microfacet::new(0.4, [1.0; 3]).unwrap());
    let look = look(environment(|w| [2.0 + w.x as f32 + 0.5 * w.z as f32; 3]), white);
    let shot = shot(0.4, 1.0);
    let (mut source, frame) = (SampleSource::default(), SurfaceFrame::new(&shot));
    let sets = source.draw(&look, frame, PointSet::Even);
    let grid = look.light().environment().grid();
    let (mut light, mut product) = (0.0, 0.0);
    for index in 0..grid.len() {
        let (row, column) = (index / grid.width, index % grid.width);
        let value = f64::from(look.light().environment().pixels()[index][0]) * grid.solid_angle(row);
        let direction = grid.direction(row, column).vector().as_vec3();
        light += value;
        product += value * f64::from(source.lobe().unwrap().value(frame, direction).x);
    }
    // Texels of six degrees.
    assert!((f64::from(sets.product_gain) * product / light - 1.0).abs() < 0.03);
}

/// Chi-square of all points over the cells that they have equal shares of: 64 zones of a uniform lobe under a
/// uniform light. With 8 expected in each it has 63 degrees of freedom, mean 63 and deviation 11. Even points
/// have 8 in each, within what the steps of the texels move.
#[test]
fn random_points_are_not_even() {
    let look = look(environment(|_| [1.0; 3]), metal());
    let chi = |set| {
        let sets = SampleSource::default().draw(&look, SurfaceFrame::new(&shot(0.0, 0.0)), set);
        let mut counts = [0.0; 64];
        for [_, _, z] in sets.light.unwrap() {
            counts[((32.0 * (1.0 + z)) as usize).min(63)] += 1.0;
        }
        counts.iter().map(|count: &f64| (count - 8.0).powi(2) / 8.0).sum::<f64>()
    };
    let [even, random] = PointSet::ALL.map(chi);
    assert!(even < 4.0 && (20.0..120.0).contains(&random), "{even} {random}");
}

#[test]
fn the_picture_has_the_points_of_its_shot() {
    let look = look(environment(uneven), metal());
    let mut cpu = Cpu::new();
    let mut kept = |points| {
        let shot = Shot { points, ..shot(0.0, 0.0) };
        let kept = cpu.render(&scene(&look), &shot, Stop::NEVER).unwrap().codes;
        assert_eq!(kept, picture(&look, &shot));
        kept
    };
    let [even, random] = PointSet::ALL.map(&mut kept);
    assert!(even != random && even == kept(PointSet::Even));
}
