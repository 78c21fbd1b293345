//! Normals that are missing in a file, or have length 0.

use glam::{DVec3, Vec3};

pub(crate) fn double(v: [f32; 3]) -> DVec3 {
    Vec3::from(v).as_dvec3()
}

/// The vector of length 1 in this direction; `None` if its length is 0.
pub(crate) fn unit(v: DVec3) -> Option<[f32; 3]> {
    // In f64 the length of a vector of f32 neither underflows nor overflows.
    v.try_normalize().map(|unit| unit.as_vec3().to_array())
}

/// Twice the area of a triangle, as a vector along its normal.
fn area(positions: &[[f32; 3]], corners: [u32; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|vertex| double(positions[vertex as usize]));
    (b - a).cross(c - a)
}

/// The normal of each triangle, for each of its three corners; +Z if it has no area.
pub(crate) fn flat_normals(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let of = |&corners: &[u32; 3]| unit(area(positions, corners)).unwrap_or([0.0, 0.0, 1.0]);
    triangles.iter().flat_map(|corners| [of(corners); 3]).collect()
}

/// Normalises all normals. One of length 0 becomes the mean of the triangles around its vertex, weighted by
/// area, or +Z.
pub(crate) fn unit_normals(normals: &mut [[f32; 3]], positions: &[[f32; 3]], triangles: &[[u32; 3]]) {
    let lost: Vec<bool> = normals.iter().map(|&normal| unit(double(normal)).is_none()).collect();
    let mut around = Vec::new();
    if lost.contains(&true) {
        around.resize(normals.len(), DVec3::ZERO);
        for &corners in triangles {
            let area = area(positions, corners);
            corners.into_iter().for_each(|vertex| around[vertex as usize] += area);
        }
    }
    for (vertex, normal) in normals.iter_mut().enumerate() {
        let found = if lost[vertex] { around[vertex] } else { double(*normal) };
        *normal = unit(found).unwrap_or([0.0, 0.0, 1.0]);
    }
}
