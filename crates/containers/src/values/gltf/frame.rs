//! The file's coordinates, +Y up, in Specula's frame.

use glam::{DAffine3, DMat3, DVec3, Vec3};

/// A map of the file's coordinates as one of Specula's.
pub(super) fn in_our_frame(map: DAffine3) -> DAffine3 {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(sphere::from_file);
    let frame = DAffine3::from_mat3(DMat3::from_cols(axes[0], axes[1], axes[2]));
    frame * map * DAffine3::from_mat3(frame.matrix3.transpose())
}

/// The map of a matrix of the file, by columns, whose last row is 0 0 0 1.
pub(super) fn affine(matrix: [f32; 16]) -> DAffine3 {
    let columns = [0, 4, 8, 12].map(|at| [matrix[at], matrix[at + 1], matrix[at + 2]].map(f64::from));
    in_our_frame(DAffine3::from_cols_array_2d(&columns))
}

/// A vector of the file in Specula's frame.
pub(super) fn vector(vector: [f32; 3]) -> [f32; 3] {
    sphere::from_file(Vec3::from(vector).as_dvec3()).as_vec3().to_array()
}
