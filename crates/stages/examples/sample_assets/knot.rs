//! A trefoil of a thick tube, which casts shadows on itself: positions and normals in a binary glTF.

use std::f64::consts::TAU;

use sphere::DVec3;

use super::glb::{Shape, glb};

/// The vertices around the knot, and around its tube.
const COLUMNS: u16 = 144;
const ROWS: u16 = 16;

/// The file.
pub(crate) fn glb_of_knot() -> Vec<u8> {
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for column in 0..COLUMNS {
        for row in 0..ROWS {
            let (position, normal) = point(f64::from(column), f64::from(row));
            positions.push(position.as_vec3().to_array());
            normals.push(normal.as_vec3().to_array());
            let vertex = |column: u16, row: u16| column % COLUMNS * ROWS + row % ROWS;
            let [a, b] = [vertex(column, row), vertex(column + 1, row)];
            let [c, d] = [vertex(column + 1, row + 1), vertex(column, row + 1)];
            indices.extend([a, c, b, a, d, c]);
        }
    }
    glb(&Shape { positions, normals, attributes: Vec::new(), indices })
}

/// The point of the tube at a column and a row, and its normal, in the file's frame.
fn point(column: f64, row: f64) -> (DVec3, DVec3) {
    let (about, around, tube) = (0.56, 0.26, 0.2);
    let t = TAU * column / f64::from(COLUMNS);
    let (sine, cosine) = (2.0 * t).sin_cos();
    let (rise, reach) = (3.0 * t).sin_cos();
    // The knot lies on a torus about +Z of the file, the front.
    let outward = DVec3::new(cosine, sine, 0.0);
    let centre = outward * (about + around * reach) + DVec3::Z * (around * rise);
    let along = DVec3::new(-sine, cosine, 0.0) * (2.0 * (about + around * reach))
        + (DVec3::Z * reach - outward * rise) * (3.0 * around);
    let up = outward * reach + DVec3::Z * rise;
    let (side, level) = (TAU * row / f64::from(ROWS)).sin_cos();
    let normal = up * level + along.normalize().cross(up) * side;
    (centre + normal * tube, normal)
}
