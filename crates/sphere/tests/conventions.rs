//! The tests of this crate that `CONVENTIONS.md` names.

#![allow(clippy::disallowed_methods)] // it may compute with std

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, PI, TAU};

use sphere::{
    AngularProbe, Cube, DMat3, DVec3, Direction, Face, LatLong, MirrorBall, OpenExrCube, OpenExrLatLong,
    Rotation, Zyz, from_cube, from_file, to_cube, to_file,
};

/// The file's axes in Specula's frame.
fn file(x: f64, y: f64, z: f64) -> Direction {
    Direction::normalised(from_file(DVec3::new(x, y, z)))
}

#[track_caller]
fn assert_looks(found: Direction, expected: Direction) {
    // All vectors here come from a few exact or correctly rounded operations.
    assert!((found.vector() - expected.vector()).length() < 1e-14, "{found:?} is not {expected:?}");
}

#[track_caller]
fn assert_same_rotation(found: Rotation, expected: Rotation) {
    let difference = found.matrix() - expected.matrix();
    let worst = difference.to_cols_array().into_iter().fold(0.0, |worst: f64, x| worst.max(x.abs()));
    assert!(worst < 2e-15, "{found:?} is not {expected:?}: {worst:e}");
}

#[test]
fn frame_is_right_handed_with_z_up() {
    assert_eq!(Direction::X.vector().cross(Direction::Y.vector()), Direction::Z.vector());
    assert_eq!(Direction::Z.theta(), 0.0);
    assert_eq!(Direction::X.theta(), FRAC_PI_2);
    assert_eq!(Direction::X.phi(), 0.0);
    assert_eq!(Direction::Y.phi(), FRAC_PI_2);
    assert_looks(Direction::from_angles(0.0, 1.0), Direction::Z);
    assert_looks(Direction::from_angles(FRAC_PI_2, FRAC_PI_2), Direction::Y);
    // Small angles keep their digits: acos(z) would return 0 here.
    assert!((Direction::from_angles(1e-9, 2.0).theta() - 1e-9).abs() < 1e-24);
}

#[test]
fn lat_long_centre_looks_along_x() {
    let grid = LatLong::with_rows(4);
    // u = (column + 0.5) / width: the centre of the image is the corner between columns 3 and 4.
    assert_looks(grid.direction_at(3.5, 1.5), Direction::X);
    assert_looks(grid.direction_at(1.5, 1.5), Direction::Y);
    assert_looks(grid.direction_at(1.5, -0.5), Direction::Z);
    assert_eq!(grid.position(Direction::X), (3.5, 1.5));
    assert_eq!(grid.position(Direction::Y), (1.5, 1.5));
    assert_eq!(grid.position(Direction::Z).1, -0.5);
}

#[test]
fn lat_long_pixel_centres_are_at_half_texels() {
    let grid = LatLong { width: 8, height: 4 };
    assert_eq!(grid.theta(0), PI / 8.0);
    assert_eq!(grid.theta(3), PI * 7.0 / 8.0);
    assert_eq!(grid.phi(0), TAU * 7.0 / 16.0);
    assert_eq!(grid.phi(7), -TAU * 7.0 / 16.0);
    for row in 0..4 {
        for column in 0..8 {
            let (x, y) = grid.position(grid.direction(row, column));
            assert!((x - column as f64).abs() < 1e-13 && (y - row as f64).abs() < 1e-13);
            assert_looks(grid.direction(row, column), grid.direction_at(column as f64, row as f64));
        }
    }
    let sum: f64 = (0..4).map(|row| 8.0 * grid.solid_angle(row)).sum();
    assert!((sum - 4.0 * PI).abs() < 1e-14);
}

#[test]
fn file_frame_is_a_cyclic_permutation() {
    assert_eq!(from_file(DVec3::X), DVec3::Y);
    assert_eq!(from_file(DVec3::Y), DVec3::Z);
    assert_eq!(from_file(DVec3::Z), DVec3::X);
    let v = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(to_file(from_file(v)), v);
    assert_eq!(from_file(to_file(v)), v);
    // A cyclic permutation keeps handedness.
    assert_eq!(
        DMat3::from_cols(from_file(DVec3::X), from_file(DVec3::Y), from_file(DVec3::Z)).determinant(),
        1.0
    );
}

#[test]
fn openexr_lat_long_has_pixel_centres_on_the_poles() {
    let map = OpenExrLatLong { width: 9, height: 5 };
    for column in 0..9 {
        assert_looks(map.direction(0, column), Direction::Z);
        assert_looks(map.direction(4, column), file(0.0, -1.0, 0.0));
    }
    for row in 0..5 {
        assert_looks(map.direction(row, 0), map.direction(row, 8));
    }
    assert_looks(map.direction(2, 4), file(0.0, 0.0, 1.0));
    assert_looks(map.direction(2, 2), file(1.0, 0.0, 0.0));
    assert_looks(map.direction(2, 6), file(-1.0, 0.0, 0.0));
    assert_looks(map.direction(2, 0), file(0.0, 0.0, -1.0));
    assert_eq!(map.position(Direction::X), (4.0, 2.0));
    let sum: f64 = (0..45).map(|texel| map.solid_angle(texel / 9, texel % 9)).sum();
    assert!((sum - 4.0 * PI).abs() < 1e-14);
}

/// ImfEnvmap.cpp of OpenEXR 3, transcribed: the direction of (x, y) in a face, and the pixel of (x, y).
fn imf_cube(face: usize, x: usize, y: usize, edge: usize) -> ((usize, usize), [f64; 3]) {
    let last = edge - 1;
    let at = |k: usize| k as f64 / last as f64 * 2.0 - 1.0;
    let (column, row) = match face {
        0 => (y, last - x),
        1 => (last - y, last - x),
        2 => (x, last - y),
        3 => (x, y),
        4 => (last - x, last - y),
        _ => (x, last - y),
    };
    let (px, py) = (at(x), at(y));
    let direction = match face {
        0 => [1.0, px, py],
        1 => [-1.0, px, py],
        2 => [px, 1.0, py],
        3 => [px, -1.0, py],
        4 => [px, py, 1.0],
        _ => [px, py, -1.0],
    };
    ((face * edge + row, column), direction)
}

#[test]
fn openexr_cube_is_that_of_imf_envmap() {
    let cube = OpenExrCube { edge: 5 };
    for face in 0..6 {
        for (x, y) in (0..25).map(|k| (k % 5, k / 5)) {
            let ((row, column), [dx, dy, dz]) = imf_cube(face, x, y, 5);
            assert_looks(cube.direction(row, column), file(dx, dy, dz));
        }
        // Unmirrored from inside: right = forward x up.
        let at = |column, row| to_file(cube.direction_at(face, column, row).vector());
        let forward = at(2.0, 2.0);
        let (right, up) = (at(4.0, 2.0) - at(0.0, 2.0), at(2.0, 0.0) - at(2.0, 4.0));
        assert!((forward.cross(up).normalize() - right.normalize()).length() < 1e-15, "face {face}");
    }
}

#[test]
fn angular_probe_is_seen_from_inside() {
    let probe = AngularProbe { edge: 8 };
    assert_looks(probe.direction_at(3.5, 3.5).unwrap(), file(0.0, 0.0, 1.0));
    // Half way to the rim is a quarter turn: right -X_file, up +Y_file.
    assert_looks(probe.direction_at(5.5, 3.5).unwrap(), file(-1.0, 0.0, 0.0));
    assert_looks(probe.direction_at(3.5, 1.5).unwrap(), file(0.0, 1.0, 0.0));
    assert_looks(probe.direction_at(3.5, 7.5).unwrap(), file(0.0, 0.0, -1.0));
    // radius = angle / pi
    let tilted = probe.direction_at(3.5, 3.5 - 4.0 / 3.0).unwrap();
    assert_looks(tilted, file(0.0, FRAC_PI_3.sin(), FRAC_PI_3.cos()));
    assert_eq!(probe.position(file(-1.0, 0.0, 0.0)), (5.5, 3.5));
    // forward x up = right: unmirrored.
    assert_eq!(DVec3::Z.cross(DVec3::Y), -DVec3::X);
    // Pixel centres, not corners: the texel right and above of the centre looks along (-1, 1).
    let near = to_file(probe.direction(3, 4).unwrap().vector());
    assert!(near.x < 0.0 && (near.x + near.y).abs() < 1e-15);
}

#[test]
fn mirror_ball_is_mirrored() {
    let ball = MirrorBall { edge: 8 };
    assert_looks(ball.direction_at(3.5, 3.5).unwrap(), file(0.0, 0.0, 1.0));
    // radius = sin(angle / 2): a quarter turn is at sqrt(1/2) of the radius.
    let quarter = 4.0 * FRAC_PI_4.sin();
    assert_looks(ball.direction_at(3.5 + quarter, 3.5).unwrap(), file(1.0, 0.0, 0.0));
    assert_looks(ball.direction_at(3.5, 3.5 - quarter).unwrap(), file(0.0, 1.0, 0.0));
    assert_looks(ball.direction_at(3.5, 3.5 - 2.0).unwrap(), file(0.0, FRAC_PI_3.sin(), FRAC_PI_3.cos()));
    assert_looks(ball.direction_at(7.5, 3.5).unwrap(), file(0.0, 0.0, -1.0));
    // It preserves areas: every texel inside has 4 (2 / edge)^2.
    assert!((ball.solid_angle(3, 4) - 0.25).abs() < 1e-15);
}

#[test]
fn cube_coordinates_are_minus_y_z_x() {
    assert_eq!(to_cube(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(-2.0, 3.0, 1.0));
    assert_eq!(from_cube(to_cube(DVec3::new(1.0, 2.0, 3.0))), DVec3::new(1.0, 2.0, 3.0));
    let f = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(to_cube(from_file(f)), DVec3::new(-f.x, f.y, f.z));
    let cube = Cube { edge: 2 };
    assert_looks(cube.direction_at(Face::PositiveZ, 0.5, 0.5), Direction::X);
    assert_looks(cube.direction_at(Face::NegativeX, 0.5, 0.5), Direction::Y);
    assert_looks(cube.direction_at(Face::PositiveY, 0.5, 0.5), Direction::Z);
}

/// The table of the GL, Vulkan and KTX2 specifications: (face, sc, tc, ma) with s = (sc / |ma| + 1) / 2.
fn face_table(c: DVec3) -> (Face, f64, f64) {
    let table = [
        (Face::PositiveX, c.x, -c.z, -c.y),
        (Face::NegativeX, -c.x, c.z, -c.y),
        (Face::PositiveY, c.y, c.x, c.z),
        (Face::NegativeY, -c.y, c.x, -c.z),
        (Face::PositiveZ, c.z, c.x, -c.y),
        (Face::NegativeZ, -c.z, -c.x, -c.y),
    ];
    let best = table.into_iter().fold(table[0], |best, entry| if entry.1 > best.1 { entry } else { best });
    (best.0, (best.2 / best.1 + 1.0) / 2.0, (best.3 / best.1 + 1.0) / 2.0)
}

#[test]
fn cube_faces_follow_the_table_of_ktx2() {
    let names: Vec<_> = Face::ALL.iter().map(|face| face.name()).collect();
    assert_eq!(names, ["px", "nx", "py", "ny", "pz", "nz"]);
    let cube = Cube { edge: 5 };
    for face in Face::ALL {
        for (row, column) in (0..25).map(|k| (k / 5, k % 5)) {
            let direction = cube.direction(face, row, column);
            let (s, t) = ((column as f64 + 0.5) / 5.0, (row as f64 + 0.5) / 5.0);
            for (found, x, y) in [face_table(to_cube(direction.vector())), cube.position(direction)] {
                assert_eq!(found, face);
                assert!((x - s).abs() < 1e-15 && (y - t).abs() < 1e-15);
            }
        }
    }
    let sum: f64 = (0..25).map(|k| 6.0 * cube.solid_angle(k / 5, k % 5)).sum();
    assert!((sum - 4.0 * PI).abs() < 1e-13);
}

#[test]
fn cube_faces_look_unmirrored_from_inside() {
    let cube = Cube { edge: 4 };
    for face in Face::ALL {
        // In Specula's right-handed frame an unmirrored view has right = forward x up.
        let at = |s, t| cube.direction_at(face, s, t).vector();
        let forward = at(0.5, 0.5);
        let (right, up) = (at(1.0, 0.5) - at(0.0, 0.5), at(0.5, 0.0) - at(0.5, 1.0));
        assert!((forward.cross(up).normalize() - right.normalize()).length() < 1e-15, "{face:?}");
    }
    // A lat-long image is unmirrored too: forward X, up Z, right -Y = X x Z.
    assert_eq!(DVec3::X.cross(DVec3::Z), -DVec3::Y);
}

#[test]
fn cube_edges_are_continuous() {
    let cube = Cube { edge: 4 };
    for face in Face::ALL {
        for k in 1..8 {
            let along = f64::from(k) / 8.0;
            for (s, t) in [(0.0, along), (1.0, along), (along, 0.0), (along, 1.0)] {
                let out = |x: f64| x + (x - 0.5).signum() * if x == 0.0 || x == 1.0 { 1e-9 } else { 0.0 };
                let edge = cube.direction_at(face, s, t);
                let (neighbour, x, y) = cube.position(cube.direction_at(face, out(s), out(t)));
                assert_ne!(neighbour, face);
                // Stepping over the edge by 1e-9 of a face moves the direction by no more than 2e-9.
                let there = cube.direction_at(neighbour, x, y);
                assert!((there.vector() - edge.vector()).length() < 2e-9, "{face:?} {s} {t}");
                let on_its_edge = x.min(y).min(1.0 - x).min(1.0 - y);
                assert!(on_its_edge < 1e-8, "{face:?} meets {neighbour:?} away from an edge");
            }
        }
    }
}

#[test]
fn yaw_turns_x_toward_y() {
    let quarter = Rotation::from_yaw_pitch_roll(FRAC_PI_2, 0.0, 0.0);
    assert_looks(quarter.apply(Direction::X), Direction::Y);
    assert_looks(quarter.apply(Direction::Z), Direction::Z);
    assert_looks(quarter.inverse().apply(Direction::Y), Direction::X);
}

#[test]
fn positive_pitch_lowers_x() {
    let nod = Rotation::from_yaw_pitch_roll(0.0, FRAC_PI_2, 0.0);
    assert_looks(nod.apply(Direction::X), Direction::from_angles(PI, 0.0));
    assert_looks(nod.apply(Direction::Z), Direction::X);
}

#[test]
fn positive_roll_turns_y_toward_z() {
    let roll = Rotation::from_yaw_pitch_roll(0.0, 0.0, FRAC_PI_2);
    assert_looks(roll.apply(Direction::Y), Direction::Z);
    assert_looks(roll.apply(Direction::X), Direction::X);
}

#[test]
fn the_angles_of_a_rotation_make_it_again() {
    for degrees in [[30.0, 0.0, 0.0], [-170.0, 20.0, 75.0], [10.0, 90.0, 0.0], [-35.5, -90.0, 20.0]] {
        let [yaw, pitch, roll] = degrees.map(f64::to_radians);
        let rotation = Rotation::from_yaw_pitch_roll(yaw, pitch, roll);
        let [yaw, pitch, roll] = rotation.yaw_pitch_roll();
        assert_same_rotation(Rotation::from_yaw_pitch_roll(yaw, pitch, roll), rotation);
        let [x, y, z, w] = rotation.quaternion();
        assert_same_rotation(Rotation::from_quaternion(x, y, z, w).unwrap(), rotation);
    }
}

#[test]
fn yaw_pitch_roll_is_rz_ry_rx() {
    let (yaw, pitch, roll) = (0.7, -0.4, 1.9);
    let matrix = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_y(pitch) * DMat3::from_rotation_x(roll);
    let rotation = Rotation::from_yaw_pitch_roll(yaw, pitch, roll);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        assert!((rotation.matrix() * axis - matrix * axis).length() < 1e-15);
        assert!((rotation.apply(Direction::new(axis).unwrap()).vector() - matrix * axis).length() < 1e-15);
    }
    // `after` reads right to left, as matrices do.
    let parts = Rotation::from_yaw_pitch_roll(yaw, 0.0, 0.0)
        .after(Rotation::from_yaw_pitch_roll(0.0, pitch, 0.0))
        .after(Rotation::from_yaw_pitch_roll(0.0, 0.0, roll));
    assert_same_rotation(parts, rotation);
    let quaternion = Rotation::from_quaternion(0.0, 0.0, 3.0, 3.0).unwrap();
    assert_same_rotation(quaternion, Rotation::from_yaw_pitch_roll(FRAC_PI_2, 0.0, 0.0));
    assert!(Rotation::from_quaternion(0.0, 0.0, 0.0, 0.0).is_none());
    assert!(Rotation::from_quaternion(f64::NAN, 0.0, 0.0, 1.0).is_none());
    assert!(Rotation::from_quaternion(f64::INFINITY, 0.0, 0.0, 1.0).is_none());
}

#[test]
fn zyz_angles_return() {
    let angles = [-3.0, -1.5, -1e-9, 0.0, 0.4, 2.0, PI];
    let betas = [0.0, 1e-300, 1e-16, 1e-9, 0.3, FRAC_PI_2, 3.0, PI - 1e-9, PI];
    for alpha in angles {
        for gamma in angles {
            for beta in betas {
                let rotation = Rotation::from_zyz(Zyz { alpha, beta, gamma });
                let found = rotation.zyz();
                assert!((0.0..=PI).contains(&found.beta), "{found:?}");
                assert!((found.beta - beta).abs() < 1e-15, "{found:?}");
                assert_same_rotation(Rotation::from_zyz(found), rotation);
            }
        }
    }
    // R_z(alpha) R_y(beta) takes the pole to (theta, phi) = (beta, alpha).
    let tilt = Rotation::from_zyz(Zyz { alpha: 0.5, beta: 0.8, gamma: 2.0 });
    assert_looks(tilt.apply(Direction::Z), Direction::from_angles(0.8, 0.5));
    assert_eq!(Rotation::IDENTITY.zyz(), Zyz { alpha: 0.0, beta: 0.0, gamma: 0.0 });
    assert_eq!(Rotation::from_yaw_pitch_roll(1.0, 0.0, 0.0).zyz().gamma, 0.0);
}
