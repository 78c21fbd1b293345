//! Points for probes that are denser at surfaces: the middle of the leaves of an octree.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::surfaces::Surfaces;
use crate::validity::Viewer;

/// How often a cell without surfaces is halved less than one with them.
const LEVELS: u32 = 2;

/// The distance between scattered points far away from surfaces, in distances of those at surfaces.
pub const SCATTER_RATIO: usize = 1 << LEVELS;

/// Points in a box, about `spacing` metres apart at surfaces and [`SCATTER_RATIO`] times that far away from
/// them; none inside of a solid.
///
/// The box is divided into cells, and those that a triangle meets are halved along all axes, until they are
/// no longer than `spacing`. There are as many coarse cells as the box has lengths of [`SCATTER_RATIO`]
/// spacings: it is for the caller to have counted them. Uses all threads; the result does not depend on their
/// number.
///
/// # Errors
/// If it was stopped.
pub fn scatter(
    surfaces: &Surfaces<'_>,
    bounds: [[f32; 3]; 2],
    spacing: f32,
    stop: Stop<'_>,
) -> Result<Vec<[f32; 3]>, Stopped> {
    let viewer = Viewer::new(surfaces);
    let triangles: Vec<[Vec3; 3]> =
        surfaces.parts.triangles.iter().map(|corners| corners.map(Vec3::from)).collect();
    let [least, most] = bounds.map(Vec3::from);
    let counts = ((most - least) / (spacing * SCATTER_RATIO as f32)).ceil().max(Vec3::ONE);
    let size = (most - least) / counts;
    let counts = counts.to_array().map(|count| count as usize);
    // The triangles whose bounds meet each coarse cell, in the order of the scene.
    let mut met: Vec<Vec<u32>> = vec![Vec::new(); counts.iter().product()];
    for (triangle, corners) in (0..).zip(&triangles) {
        let ends = [corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2])];
        let cells = ends.map(|end| (end - least) / size);
        // Half a percent of a cell more: a surface between two cells is in both.
        let [from, to] = [cells[0] - 0.005, cells[1] + 0.005];
        let range = |axis: usize| {
            let last = (counts[axis] - 1) as f32;
            let is_beside = to[axis] < 0.0 || from[axis] > last + 1.0;
            let cells = from[axis].clamp(0.0, last) as usize..to[axis].clamp(0.0, last) as usize + 1;
            if is_beside { 0..0 } else { cells }
        };
        for (z, y) in range(2).flat_map(|z| range(1).map(move |y| (z, y))) {
            range(0).for_each(|x| met[(z * counts[1] + y) * counts[0] + x].push(triangle));
        }
    }
    let of_cell = |index: usize| {
        stop.check()?;
        let [nx, ny, _] = counts;
        let at = [index % nx, index / nx % ny, index / (nx * ny)].map(|k| k as f32 + 0.5);
        let mut points = Vec::new();
        add(&triangles, least + size * Vec3::from(at), size, &met[index], LEVELS, &mut points);
        points.retain(|point| !viewer.view(*point).is_inside());
        Ok(points.into_iter().map(|point| point.to_array()).collect::<Vec<_>>())
    };
    let found: Vec<Vec<[f32; 3]>> =
        (0..met.len()).into_par_iter().map(of_cell).collect::<Result<_, Stopped>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// Adds the middle of a cell, or of the cells in it if a triangle meets it.
fn add(triangles: &[[Vec3; 3]], middle: Vec3, size: Vec3, near: &[u32], levels: u32, points: &mut Vec<Vec3>) {
    let half = 0.5 * size;
    let meets = |triangle: &&u32| are_met(triangles[**triangle as usize], middle, 1.01 * half);
    let near: Vec<u32> = near.iter().filter(meets).copied().collect();
    if near.is_empty() || levels == 0 {
        points.push(middle);
        return;
    }
    for k in 0..8 {
        let side = [k & 1, k >> 1 & 1, k >> 2 & 1].map(|side| side as f32 - 0.5);
        add(triangles, middle + half * Vec3::from(side), half, &near, levels - 1, points);
    }
}

/// Whether a triangle meets a box: no axis separates them (Akenine-Möller 2001, "Fast 3D triangle-box overlap
/// testing").
fn are_met(corners: [Vec3; 3], middle: Vec3, half: Vec3) -> bool {
    let corners = corners.map(|corner| corner - middle);
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let across = edges.iter().flat_map(|edge| axes.map(|axis| edge.cross(axis)));
    axes.into_iter().chain([edges[0].cross(edges[1])]).chain(across).all(|axis| {
        let [a, b, c] = corners.map(|corner| corner.dot(axis));
        let reach = half.dot(axis.abs());
        a.min(b).min(c) <= reach && a.max(b).max(c) >= -reach
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle meets a box if one of many points of it is in the box; near the border, points say nothing.
    #[test]
    fn a_triangle_meets_the_boxes_that_hold_points_of_it() {
        let number = |k: u64| crate::random::share_of(crate::random::hash(k)) * 4.0 - 2.0;
        let (mut met, mut missed) = (0, 0);
        for k in 0..2000 {
            let corners = [0, 1, 2].map(|c| Vec3::from([0, 1, 2].map(|axis| number(9 * k + 3 * c + axis))));
            let [a, b, c] = corners;
            let nearest = (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (i, j))).map(|(i, j)| {
                let [u, v] = [i, j].map(|k| k as f32 / 60.0);
                (a + (b - a) * u + (c - a) * v).abs().max_element()
            });
            let nearest = nearest.fold(f32::INFINITY, f32::min);
            let found = are_met(corners, Vec3::ZERO, Vec3::splat(0.5));
            // Points are at most 0.1 apart.
            if nearest <= 0.5 {
                assert!(found, "{corners:?}");
                met += 1;
            } else if nearest > 0.6 {
                assert!(!found, "{corners:?}");
                missed += 1;
            }
        }
        assert!(met > 200 && missed > 200, "{met} {missed}");
    }
}
