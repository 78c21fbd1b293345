//! A teapot on a plate, with two numbers at each vertex between 0 and 1 that vary like noise (`_BLEND` and
//! `_WEAR`): in a binary glTF.

use sphere::DVec3;

use super::glb::{Shape, glb};
use super::noise::octaves;
use super::solid::{ellipsoid, joined, rod, surface, union};

/// The file.
pub(crate) fn glb_of_teapot() -> Vec<u8> {
    let bounds = [DVec3::new(-1.2, -0.8, -1.2), DVec3::new(1.3, 0.8, 1.2)];
    let (positions, normals, indices) = surface(teapot, bounds, 0.04);
    // From end to end: noise is mostly about its mean.
    let wide = |noise: f64| ((noise - 0.5) * 3.0 + 0.5).clamp(0.0, 1.0) as f32;
    let blend = positions.iter().map(|p| wide(octaves(3.5 * p.x + 2.0 * p.z, 3.5 * p.y - 3.0 * p.z, 3)));
    let wear = positions.iter().map(|p| wide(octaves(2.5 * p.x - 1.5 * p.y + 40.0, 2.5 * p.z + 20.0, 2)));
    let attributes = vec![("_BLEND", blend.collect()), ("_WEAR", wear.collect())];
    let single = |vectors: Vec<DVec3>| vectors.into_iter().map(|v| v.as_vec3().to_array()).collect();
    glb(&Shape { positions: single(positions), normals: single(normals), attributes, indices })
}

/// The spout is on the side of +X, the handle on that of -X.
fn teapot(p: DVec3) -> f64 {
    let v = DVec3::new;
    // About the axis y, as far as the handle, which is a ring about z.
    let about = p.x.hypot(p.z);
    let ring = (v(p.x + 0.66, p.y - 0.02, 0.0).length() - 0.29).hypot(p.z) - 0.055;
    let spout = union([
        rod(p, [v(0.45, -0.18, 0.0), v(0.8, -0.02, 0.0)], [0.17, 0.1]),
        rod(p, [v(0.8, -0.02, 0.0), v(1.05, 0.32, 0.0)], [0.1, 0.065]),
    ]);
    let lid = joined(
        ellipsoid(p, v(0.0, 0.3, 0.0), v(0.34, 0.17, 0.34)),
        (p - v(0.0, 0.54, 0.0)).length() - 0.085,
        0.07,
    );
    let body = joined(ellipsoid(p, v(0.0, -0.08, 0.0), v(0.64, 0.43, 0.64)), rim(about, p.y), 0.03);
    let foot = (about - 0.3).hypot(p.y + 0.53) - 0.06;
    let pot = [spout, ring, lid, foot].into_iter().fold(body, |sum, part| joined(sum, part, 0.06));
    let edge = (about - 0.95).hypot(p.y + 0.57) - 0.05;
    let plate = ((p.y + 0.63).abs() - 0.035).max(about - 0.95);
    pot.min(joined(plate, edge, 0.06))
}

/// The rim on which the lid lies, a ring about y.
fn rim(about: f64, y: f64) -> f64 {
    (about - 0.36).hypot(y - 0.29) - 0.035
}
