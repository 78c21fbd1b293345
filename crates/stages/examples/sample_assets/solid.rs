//! Solids made of rounded parts, and their surfaces as triangles.
//!
//! A solid is a distance: negative inside, about the distance from the surface near it. The surface is cut
//! out of a grid of cells (naive surface nets): each cell that it passes has a vertex, which is moved onto
//! it, and each edge of the grid that it cuts joins four of them.

use std::collections::BTreeMap;

use sphere::DVec3;

/// Parts closer than this run into each other.
const BLEND: f64 = 0.06;

/// The distance from both of two solids, with a fillet of size `k` between them.
pub(crate) fn joined(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// The distance from the union of parts.
pub(crate) fn union<const N: usize>(parts: [f64; N]) -> f64 {
    parts
        .into_iter()
        .fold(f64::MAX, |sum, part| if sum == f64::MAX { part } else { joined(sum, part, BLEND) })
}

/// About the distance from an ellipsoid.
pub(crate) fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3) -> f64 {
    let (near, far) = (((p - centre) / radii).length(), ((p - centre) / (radii * radii)).length());
    if far > 0.0 { near * (near - 1.0) / far } else { -radii.min_element() }
}

/// The distance from a rod with round ends, whose radius goes from one to the other.
pub(crate) fn rod(p: DVec3, [from, to]: [DVec3; 2], [first, last]: [f64; 2]) -> f64 {
    let along = to - from;
    let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (p - from - along * share).length() - (first + (last - first) * share)
}

/// The surface of a solid within a box, in cells of an edge: positions, normals and corners of triangles.
pub(crate) fn surface(
    distance: impl Fn(DVec3) -> f64,
    [least, most]: [DVec3; 2],
    cell: f64,
) -> (Vec<DVec3>, Vec<DVec3>, Vec<u16>) {
    let size = ((most - least) / cell).ceil().as_ivec3() + 1;
    let at = |[x, y, z]: [i32; 3]| least + DVec3::new(x.into(), y.into(), z.into()) * cell;
    let mut values = BTreeMap::new();
    for z in 0..size.z {
        for y in 0..size.y {
            for x in 0..size.x {
                values.insert([x, y, z], distance(at([x, y, z])));
            }
        }
    }
    let inside = |place: &[i32; 3]| values[place] < 0.0;
    let gradient = |p: DVec3| {
        let step = 1e-4;
        let along = |axis: DVec3| distance(p + axis * step) - distance(p - axis * step);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * step)
    };
    let (mut vertices, mut positions, mut normals) = (BTreeMap::new(), Vec::new(), Vec::new());
    for &[x, y, z] in values.keys().filter(|[x, y, z]| x + 1 < size.x && y + 1 < size.y && z + 1 < size.z) {
        let corners: Vec<[i32; 3]> = (0..8).map(|k| [x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)]).collect();
        let filled = corners.iter().filter(|corner| inside(corner)).count();
        if filled == 0 || filled == 8 {
            continue;
        }
        let mut p = at([x, y, z]) + DVec3::splat(0.5 * cell);
        for _ in 0..8 {
            let slope = gradient(p);
            let step = slope * (distance(p) / slope.length_squared());
            p -= step.clamp_length_max(0.5 * cell);
        }
        vertices.insert([x, y, z], positions.len() as u16);
        positions.push(p);
        normals.push(gradient(p).normalize());
    }
    let mut indices = Vec::new();
    for place in values.keys() {
        for axis in 0..3 {
            let mut next = *place;
            next[axis] += 1;
            if next[axis] >= size.to_array()[axis] || inside(place) == inside(&next) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                let mut cell = *place;
                cell[u] -= du;
                cell[v] -= dv;
                vertices[&cell]
            });
            // Counter-clockwise about the axis if the solid is on its near side.
            let [a, b, c, d] =
                if inside(place) { around } else { [around[0], around[3], around[2], around[1]] };
            indices.extend([a, b, c, a, c, d]);
        }
    }
    (positions, normals, indices)
}
