//! The surfaces that samples hit.

use glam::DQuat;

use super::*;

/// The first point of the unit ball on a sample's ray, which is also its normal.
fn meets(shot: &Shot, column: u32, row: u32) -> Option<DVec3> {
    let (eye, at) = (shot.camera.eye(), [f64::from(column) + 0.5, f64::from(row) + 0.5]);
    let ray = shot.camera.ray(shot.size, at).normalize();
    let middle = -eye.dot(ray);
    let square = 1.0 - (eye + ray * middle).length_squared();
    (square > 0.0).then(|| eye + ray * (middle - square.sqrt()))
}

/// A face of the mesh has edges of up to h = sqrt(2) 2 pi / 256 and lies up to s = h^2 / 8 below the ball. A
/// ray at the angle t from the normal meets it s tan(t) aside. The interpolated normal, set to length 1, is
/// the ball's normal at that point up to the third power of the corners' distance. Snapping moves corners by
/// up to half a step along each axis of the screen, on which the ball's radius is 80 samples.
#[test]
fn interpolated_normals_match_those_of_the_sphere() {
    let scene = Scene::of(sphere(), plain());
    let mut shot = shot([200, 160], Show::One(Mode::Irradiance));
    for turn in [Rotation::IDENTITY, Rotation::from_yaw_pitch_roll(0.5, 1.0, -2.0)] {
        shot.turn = turn;
        let mut count = 0;
        for (place, seen) in seen(&scene, &shot).iter().enumerate() {
            let (column, row) = (place as u32 % 200, place as u32 / 200);
            let (Some(seen), Some(normal)) = (seen, meets(&shot, column, row)) else { continue };
            let toward = (shot.camera.eye() - normal).normalize();
            let back = turn.inverse().matrix();
            assert!((seen.surface.view.as_dvec3() - back * toward).length() < 1e-6);
            let cosine = toward.dot(normal);
            if cosine < 0.15 {
                continue;
            }
            let tangent_of_angle = (1.0 - cosine * cosine).sqrt() / cosine;
            let step = 0.5_f64.sqrt() / 256.0 / 80.0;
            let sagitta = (std::f64::consts::TAU / 256.0).powi(2) / 4.0;
            let error = (seen.surface.normal.as_dvec3() - back * normal).length();
            assert!(error < 1e-5 + sagitta * tangent_of_angle + step / cosine, "{error:e} at {column} {row}");
            // The tangent follows the parallel.
            let along = DVec3::new(-normal.y, normal.x, 0.0).normalize();
            let tangent = seen.surface.tangent.as_dvec3();
            if normal.z.abs() < 0.9 {
                assert!((1.0 - tangent.dot(back * along).abs()).abs() < 1e-3, "{tangent} {along}");
            }
            count += 1;
        }
        assert!(count > 15_000, "{count}");
    }
}

/// A plate seen from below shows its underside, whose normal points down.
#[test]
fn back_faces_have_flipped_normals() {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let [a, b, c, d] = corners.map(|corner: [f32; 3]| corner);
    let scene = Scene::of(soup(&[[a, b, c], [a, c, d]]), plain());
    let mut shot = shot([40, 40], Show::One(Mode::Irradiance));
    for pitch in [0.6, -0.6] {
        shot.camera.pitch = pitch;
        let normals: Vec<_> = seen(&scene, &shot).into_iter().flatten().map(|s| s.surface.normal.z).collect();
        assert!(normals.len() > 100);
        assert!(normals.iter().all(|z| (f64::from(*z) - pitch.signum()).abs() < 1e-6), "{pitch}");
    }
}

/// Places rotate, scale and mirror meshes, including their normals.
#[test]
fn places_rotate_scale_and_mirror() {
    let look = plain();
    let shot = shot([60, 60], Show::One(Mode::Irradiance));
    let knot = Arc::new(mesh::shape("torus-knot").unwrap());
    let turn = DQuat::from_euler(glam::EulerRot::ZYX, 0.4, -1.0, 2.0);
    let shift = DVec3::new(0.1, -0.2, 0.05);
    for scale in [DVec3::splat(0.7), DVec3::splat(-0.7), DVec3::new(0.6, 0.6, -0.6)] {
        let place = DAffine3::from_scale_rotation_translation(scale, turn, shift);
        let matrix = place.matrix3;
        let direction = |v: [f32; 3]| (matrix * glam::Vec3::from(v).as_dvec3()).normalize().as_vec3();
        let points = knot
            .positions()
            .iter()
            .map(|p| place.transform_point3(glam::Vec3::from(*p).as_dvec3()).as_vec3().to_array());
        let tangents = knot.tangents().iter().map(|&[x, y, z, w]| direction([x, y, z]).extend(w).to_array());
        // A mirror image reverses the triangles.
        let mirrored = matrix.determinant() < 0.0;
        let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let moved = Mesh::new(
            points.collect(),
            knot.normals().iter().map(|n| direction(*n).to_array()).collect(),
            tangents.collect(),
            None,
            knot.triangles().iter().map(turned).collect(),
        );
        let objects = vec![placed(&knot, place, &look)];
        let found = seen(&Scene { light: Arc::clone(look.light()), objects }, &shot);
        let expected = seen(&Scene::of(Arc::new(moved.unwrap()), Arc::clone(&look)), &shot);
        let mut differ = 0;
        for (found, expected) in found.iter().zip(&expected) {
            match (found, expected) {
                (None, None) => {}
                (Some(found), Some(expected)) => {
                    let apart = (found.surface.normal - expected.surface.normal).length();
                    differ += usize::from(apart > 1e-4);
                }
                _ => differ += 1,
            }
        }
        assert!(found.iter().flatten().count() > 500);
        // Rounding of positions occasionally moves an edge across a sample.
        assert!(differ < 10, "{scale}: {differ}");
    }
}
