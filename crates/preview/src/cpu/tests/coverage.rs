//! The samples that triangles cover.

use super::*;

fn cover(scene: &Scene, shot: &Shot) -> Vec<usize> {
    seen(scene, shot).iter().map(|seen| usize::from(seen.is_some())).collect()
}

/// Irregular numbers in [-1, 1).
fn noise(k: usize) -> f32 {
    2.0 * crate::shading::testkit::noise(k) - 1.0
}

/// Triangles that divide a rectangle, many with corners on one line or on samples, are drawn one by one.
/// Together they cover the rectangle's samples, each once.
#[test]
fn triangles_that_share_edges_cover_each_sample_once() {
    let shot = shot([64, 48], Show::One(Mode::Irradiance));
    let [right, up, _] = shot.camera.axes();
    let at = |x: f32, y: f32| (right * f64::from(x) + up * f64::from(y)).as_vec3().to_array();
    let look = plain();
    for trial in 0..20 {
        const N: usize = 6;
        let point = |i: usize, j: usize| {
            let inner = [i, j].iter().all(|k| (1..N).contains(k));
            let shift = |k: usize| if inner && trial > 0 { 0.45 * noise(k + 1000 * trial) } else { 0.0 };
            let k = 2 * (i * (N + 1) + j);
            let scale = |i: usize, k: usize| 1.5 * ((i as f32 + shift(k)) / N as f32 - 0.5);
            at(scale(i, k), scale(j, k + 1))
        };
        let mut triangles = Vec::new();
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i, j + 1), point(i + 1, j + 1)];
            triangles.extend(if (i + j) % 2 == 0 { [[a, b, d], [d, c, a]] } else { [[a, b, c], [d, c, b]] });
        }
        let whole = {
            let [a, b, c, d] = [point(0, 0), point(N, 0), point(0, N), point(N, N)];
            cover(&Scene::of(soup(&[[a, b, d], [a, d, c]]), Arc::clone(&look)), &shot)
        };
        let mut sum = vec![0; 64 * 48];
        for triangle in &triangles {
            let alone = cover(&Scene::of(soup(&[*triangle]), Arc::clone(&look)), &shot);
            sum.iter_mut().zip(alone).for_each(|(sum, alone)| *sum += alone);
        }
        assert!(sum.iter().sum::<usize>() > 500);
        assert_eq!(sum, whole, "trial {trial}");
    }
}

/// The outline of the unit ball is a circle that touches the shorter side. The mesh lies inside the ball: its
/// rings of 256 corners miss up to (pi / 256)^2 / 2 of the radius. A circle of n samples' width has about n
/// samples on its edge.
#[test]
fn a_sphere_covers_its_projected_area() {
    let mesh = sphere();
    for (size, zoom) in [([400, 400], 1.0), ([500, 301], 1.0), ([300, 640], 0.5)] {
        let mut shot = shot(size, Show::One(Mode::Irradiance));
        shot.camera.zoom = zoom;
        let count = cover(&Scene::of(Arc::clone(&mesh), plain()), &shot).iter().sum::<usize>() as f64;
        let radius = zoom * f64::from(size[0].min(size[1])) / 2.0;
        let area = std::f64::consts::PI * radius * radius;
        let missed = area * (std::f64::consts::PI / 256.0).powi(2);
        assert!(count < area + radius.sqrt() * 4.0, "{size:?}: {count} of {area}");
        assert!(count > area - missed - radius.sqrt() * 4.0, "{size:?}: {count} of {area}");
    }
}

/// A floor that extends far behind the eye, and farther to the sides than screen coordinates do. A sample
/// hits it if its ray meets it between the near and the far plane, up to the f32 precision of the corners.
#[test]
fn a_mesh_that_extends_behind_the_eye_is_clipped() {
    let look = plain();
    for (reach, height) in [(30.0_f32, -0.5_f32), (1e3, -0.5), (1e5, -0.9)] {
        let corner = |x: f32, y: f32| [x * reach, y * reach, height];
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let shot = shot([80, 60], Show::One(Mode::Irradiance));
        let found = cover(&Scene::of(soup(&[[a, b, c], [a, c, d]]), Arc::clone(&look)), &shot);
        let (eye, projection) = (shot.camera.eye(), shot.camera.projection(shot.size));
        let mut differ = 0;
        for (place, found) in found.iter().enumerate() {
            let at = [(place % 80) as f64 + 0.5, (place / 80) as f64 + 0.5];
            let ray = shot.camera.ray(shot.size, at);
            let along = (f64::from(height) - eye.z) / ray.z;
            let point = eye + ray * along;
            let clip = projection * point.extend(1.0);
            let expected = along > 0.0 && (0.0..=1.0).contains(&(clip.z / clip.w));
            differ += usize::from(expected != (*found == 1));
        }
        assert!(found.iter().sum::<usize>() > 500, "{found:?}");
        // One row of samples at the far plane.
        assert!(differ <= 80, "{reach}: {differ} samples differ");
    }
}

#[test]
fn the_nearer_object_is_visible_in_any_order() {
    let look = plain();
    let ball = |x: f64| {
        placed(
            &sphere(),
            DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.6),
                glam::DQuat::from_rotation_z(x),
                DVec3::new(x, 0.2 * x, 0.1),
            ),
            &look,
        )
    };
    let scene = |objects: Vec<Object>| Scene { light: Arc::clone(look.light()), objects };
    let shot = shot([90, 90], Show::One(Mode::Irradiance));
    let forward = seen(&scene(vec![ball(-0.3), ball(0.4)]), &shot);
    let backward = seen(&scene(vec![ball(0.4), ball(-0.3)]), &shot);
    let mut both = [0, 0];
    for (one, other) in forward.iter().zip(&backward) {
        assert_eq!(one.map(|seen| seen.object), other.map(|seen| 1 - seen.object));
        assert_eq!(one.map(|seen| seen.surface), other.map(|seen| seen.surface));
        one.iter().for_each(|seen| both[seen.object] += 1);
    }
    assert!(both[0] > 100 && both[1] > 100, "{both:?}");
}

/// Triangles without an area, with corners at the eye or at the limits of f32, and places that are flat, a
/// point or NaN: any picture will do, but it has no NaN.
#[test]
fn degenerate_triangles_cause_no_nan() {
    let eye = shot([8, 8], Show::One(Mode::Mirror)).camera.eye().as_vec3().to_array();
    let odd = [
        [[0.0; 3]; 3],
        [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]],
        [[f32::MAX; 3], [-f32::MAX; 3], [f32::MAX, -f32::MAX, 0.0]],
        [[1e30, 0.0, 0.0], [0.0, 1e30, 0.0], [0.0, 0.0, 1e30]],
        [[-1e20, -1e20, 0.0], [1e20, -1e20, 0.0], [0.0, 1e20, 0.0]],
        [eye, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [eye, eye, [0.0, 0.0, 1.0]],
        [[1e-40, 0.0, 0.0], [0.0, 1e-40, 0.0], [0.0, 0.0, 1e-40]],
    ];
    let bright = look(&light(8, uneven), &lambert(1.0), [2, 0]);
    let places = [
        DAffine3::IDENTITY,
        DAffine3::from_scale(DVec3::ZERO),
        DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0)),
        DAffine3::from_scale(DVec3::splat(1e-30)),
        DAffine3::from_scale(DVec3::splat(1e30)),
        DAffine3::from_scale(DVec3::splat(f64::MAX)),
        DAffine3::from_translation(DVec3::new(f64::NAN, 0.0, f64::INFINITY)),
    ];
    for place in places {
        for mesh in [soup(&odd), soup(&[]), sphere()] {
            let objects = vec![placed(&mesh, place, &bright)];
            let scene = Scene { light: Arc::clone(bright.light()), objects };
            for size in [[16, 16], [1, 1], [3, 200]] {
                for show in [Mode::LocalShrm, Mode::Mirror].map(Show::One) {
                    let picture = render(&scene, &shot(size, show));
                    assert_eq!(picture.radiance.len(), (size[0] * size[1]) as usize);
                    assert!(
                        picture.radiance.as_flattened().iter().all(|value| value.is_finite()),
                        "{place:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_ball_without_size_and_a_picture_without_pixels_are_drawn() {
    let scene = Scene::of(sphere(), plain());
    for size in [[0, 0], [0, 5], [5, 0]] {
        let picture = render(&scene, &shot(size, Show::One(Mode::Mirror)));
        assert_eq!((picture.size, picture.codes.len(), picture.radiance.len()), (size, 0, 0));
    }
    let mut shot = shot([6, 6], Show::One(Mode::Mirror));
    shot.camera.framing.radius = 0.0;
    // The light is 1 everywhere.
    assert!(render(&scene, &shot).radiance.iter().all(|pixel| (pixel[0] - 1.0).abs() < 1e-6));
}

#[test]
fn a_picture_that_is_too_large_is_an_error_of_this_renderer() {
    let scene = Scene::of(sphere(), plain());
    for size in [[u32::MAX, u32::MAX], [1 << 15, 1 << 15], [1 << 21, 1]] {
        let made = super::super::Cpu::new().render(&scene, &shot(size, Show::One(Mode::Mirror)), Stop::NEVER);
        assert!(made.is_err_and(|error| error.is_of_the_device()), "{size:?}");
    }
}
