//! The frames of files and of cube maps, and the permutations that lead to Specula's.
//!
//! EXR, RGBE and glTF files are right-handed with +Y up; the centre of their lat-long image looks along
//! +Z_file. Specula's frame has +Z up, and the image centre looks along +X: a cyclic permutation.

use glam::DVec3;

/// Converts from the file frame (+Y up) to Specula's: (x, y, z) = (z_file, x_file, y_file).
pub fn from_file(v: DVec3) -> DVec3 {
    DVec3::new(v.z, v.x, v.y)
}

/// Converts from Specula's frame to the file frame (+Y up): the inverse of [`from_file`].
pub fn to_file(v: DVec3) -> DVec3 {
    DVec3::new(v.y, v.z, v.x)
}

/// Converts from Specula's frame to cube coordinates: c = (-x_file, y_file, z_file) = (-y, z, x).
///
/// With these, the face table of KTX2, Vulkan, GL and D3D shows faces unmirrored from inside.
pub fn to_cube(v: DVec3) -> DVec3 {
    DVec3::new(-v.y, v.z, v.x)
}

/// Converts from cube coordinates to Specula's frame: the inverse of [`to_cube`].
pub fn from_cube(c: DVec3) -> DVec3 {
    DVec3::new(c.z, -c.x, c.y)
}
