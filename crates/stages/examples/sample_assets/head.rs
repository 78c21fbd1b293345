//! The head of a statue, which casts shadows on itself: in a binary glTF.

use sphere::DVec3;

use super::glb::{Shape, glb};
use super::solid::{ellipsoid, joined, rod, surface, union};

/// The file.
pub(crate) fn glb_of_head() -> Vec<u8> {
    let bounds = [DVec3::new(-0.8, -1.45, -0.8), DVec3::new(0.8, 0.95, 0.8)];
    let (positions, normals, indices) = surface(head, bounds, 0.036);
    let single = |vectors: Vec<DVec3>| vectors.into_iter().map(|v| v.as_vec3().to_array()).collect();
    glb(&Shape { positions: single(positions), normals: single(normals), attributes: Vec::new(), indices })
}

/// The head looks along +Z. Its left and right are alike.
fn head(p: DVec3) -> f64 {
    let p = DVec3::new(p.x.abs(), p.y, p.z);
    let v = DVec3::new;
    let skull = union([
        ellipsoid(p, v(0.0, 0.27, -0.08), v(0.43, 0.48, 0.52)),
        ellipsoid(p, v(0.0, -0.04, 0.13), v(0.34, 0.5, 0.36)),
        ellipsoid(p, v(0.0, -0.4, 0.3), v(0.17, 0.13, 0.15)),
        ellipsoid(p, v(0.2, -0.1, 0.33), v(0.14, 0.13, 0.13)),
        rod(p, [v(0.04, 0.2, 0.45), v(0.22, 0.21, 0.37)], [0.055, 0.05]),
    ]);
    let socket = (p - v(0.16, 0.1, 0.53)).length() - 0.13;
    let carved = -joined(-skull, socket, 0.1);
    let face = union([
        carved,
        (p - v(0.155, 0.09, 0.385)).length() - 0.085,
        rod(p, [v(0.0, 0.16, 0.46), v(0.0, -0.09, 0.57)], [0.04, 0.07]),
        (p - v(0.06, -0.11, 0.53)).length() - 0.045,
        ellipsoid(p, v(0.0, -0.235, 0.47), v(0.12, 0.035, 0.06)),
        ellipsoid(p, v(0.0, -0.295, 0.46), v(0.1, 0.04, 0.06)),
    ]);
    let ear = -joined(
        -ellipsoid(p, v(0.43, 0.06, -0.02), v(0.07, 0.18, 0.12)),
        ellipsoid(p, v(0.5, 0.07, 0.03), v(0.05, 0.11, 0.07)),
        0.04,
    );
    let bust = joined(
        rod(p, [v(0.0, -0.3, -0.1), v(0.0, -0.95, -0.14)], [0.22, 0.25]),
        ellipsoid(p, v(0.0, -1.1, -0.12), v(0.56, 0.15, 0.36)),
        0.3,
    );
    joined(joined(face, ear, 0.05), bust, 0.1)
}
