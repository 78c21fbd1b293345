//! The frames in which components are defined, and the places of texels on bordered cube faces.
//!
//! The axes of a face's centre a are u (along growing s), v (along growing t) and a, right-handed in the
//! world. The minimal rotation that carries a to the central direction C carries them to
//!
//! > X = u - (C . u) / (1 + C . a) (C + a),   Y = v - (C . v) / (1 + C . a) (C + a),   C.
//!
//! They are smooth on the face and beyond its edges. The other direction d (the normal if C is the
//! reflection vector, the view if C is the normal) has the place (d . X, d . Y) / sqrt(1 + d . C) on a disc:
//! its distance from the centre is sqrt(1 - cos(theta_v)), theta_v being the angle between d and C, so that
//! the rim is the horizon, and what varies with cos(theta_v) there is smooth.

use sphere::{Cube, DMat3, DVec3, Direction, Face};

/// The axes u, v and a of a face: the directions in which s and t grow at its centre, and its centre.
pub fn face_axes(face: Face) -> [DVec3; 3] {
    let at = |s: f64, t: f64| Cube { edge: 1 }.direction_at(face, s, t).vector();
    [(at(1.0, 0.5) - at(0.0, 0.5)).normalize(), (at(0.5, 1.0) - at(0.5, 0.0)).normalize(), at(0.5, 0.5)]
}

/// The axes X, Y and C of the frame of a central direction on a face, as columns: a rotation.
pub fn face_frame(face: Face, central: Direction) -> DMat3 {
    let ([u, v, a], c) = (face_axes(face), central.vector());
    let toward = (c + a) / (1.0 + c.dot(a));
    DMat3::from_cols(u - toward * c.dot(u), v - toward * c.dot(v), c)
}

/// The place of a direction on the disc, in a frame whose third axis is the central direction; within the
/// unit circle if it lies above the horizon.
pub(super) fn disc(frame: &DMat3, direction: DVec3) -> [f64; 2] {
    let local = frame.transpose() * direction;
    let scale = (1.0 + local.z.max(-0.5)).sqrt().recip();
    [local.x * scale, local.y * scale]
}

/// The direction of texel (row, column) of a face of `edge` texels with a border of one texel, in which row
/// and column 0 lie beyond the face's edge.
pub(super) fn bordered_direction(edge: usize, face: Face, row: usize, column: usize) -> Direction {
    let place = |index: usize| (index as f64 - 0.5) / edge as f64;
    Cube { edge: 1 }.direction_at(face, place(column), place(row))
}

/// The four texels about (s, t) of a bordered face, as indices row * (edge + 2) + column, and their bilinear
/// weights.
pub(super) fn bordered_taps(edge: usize, s: f64, t: f64) -> [(usize, f64); 4] {
    let at = |place: f64| {
        let x = place * edge as f64 + 0.5;
        let low = (x.max(0.0) as usize).min(edge);
        (low, x - low as f64)
    };
    let ((column, x), (row, y)) = (at(s), at(t));
    let first = row * (edge + 2) + column;
    [
        (first, (1.0 - x) * (1.0 - y)),
        (first + 1, x * (1.0 - y)),
        (first + edge + 2, (1.0 - x) * y),
        (first + edge + 3, x * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_rotations_that_carry_the_axes_of_the_face() {
        for face in Face::ALL {
            let [u, v, a] = face_axes(face);
            assert!(u.cross(v).distance(a) < 1e-15, "{face:?}: right-handed");
            for (row, column) in [(0, 0), (0, 5), (3, 2), (5, 5)] {
                let central = bordered_direction(4, face, row, column);
                let frame = face_frame(face, central);
                assert!((frame.determinant() - 1.0).abs() < 1e-14);
                assert!(
                    (frame.transpose() * frame - DMat3::IDENTITY)
                        .to_cols_array()
                        .iter()
                        .all(|x| x.abs() < 1e-14)
                );
                // The minimal rotation leaves alone what is across both a and C.
                let across = a.cross(central.vector());
                assert!((frame * DMat3::from_cols(u, v, a).transpose() * across).distance(across) < 1e-14);
            }
            let centre = face_frame(face, Direction::normalised(a));
            assert!(centre.x_axis.distance(u) < 1e-15 && centre.y_axis.distance(v) < 1e-15);
        }
    }

    #[test]
    fn bordered_texels_surround_every_place_of_a_face() {
        for (s, t) in [(0.0, 0.0), (1.0, 1.0), (0.3, 0.9), (0.5, 0.01)] {
            let taps = bordered_taps(8, s, t);
            let (mut x, mut y, mut sum) = (0.0, 0.0, 0.0);
            for (index, weight) in taps {
                x += weight * ((index % 10) as f64 - 0.5) / 8.0;
                y += weight * ((index / 10) as f64 - 0.5) / 8.0;
                sum += weight;
            }
            assert!((sum - 1.0f64).abs() < 1e-15 && (x - s).abs() < 1e-14 && (y - t).abs() < 1e-14);
        }
    }

    #[test]
    fn the_rim_of_the_disc_is_the_horizon() {
        let frame = face_frame(Face::PositiveY, Direction::from_angles(0.4, 2.0));
        for theta in [0.0, 0.3, 1.0, std::f64::consts::FRAC_PI_2] {
            let d = frame * Direction::from_angles(theta, 0.7).vector();
            let [x, y] = disc(&frame, d);
            assert!((x * x + y * y - (1.0 - theta.cos())).abs() < 1e-14);
            assert!((y * 0.7f64.cos() - x * 0.7f64.sin()).abs() < 1e-14);
        }
    }
}
