//! Look-ups on a cube: four texels around a direction, across edges and corners.
//!
//! The faces, their order and orientation are those of `sphere::Cube`, with the taps of `envmap::Texels`. A
//! tap across an edge is a texel of the neighbouring face. At a corner, where three faces meet, the fourth
//! texel is the mean of the other three. The texel across an edge is found with integers: in half texels, a
//! face is the square |s|, |t| <= edge - 1 at distance edge. A texel beside it has |s| = edge + 1, and there
//! the neighbouring face is at distance edge + 1. Floats are exact for these numbers up to an edge of 2^23.

use glam::{Vec2, Vec3};

/// A texel: face in file order, column and row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Texel {
    /// The index of the face, 0 to 5: +X -X +Y -Y +Z -Z of the cube coordinates.
    pub face: u32,
    /// The column, from the left.
    pub column: u32,
    /// The row, from the top.
    pub row: u32,
}

/// Four texels and their weights, which sum to 1.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// The texels.
    pub texel: [Texel; 4],
    /// The weights of the texels.
    pub weight: [f32; 4],
}

/// A point of a face's plane: (s, t) in the plane, t downward, times the plane's distance.
#[derive(Clone, Copy, Debug)]
struct OnFace {
    face: u32,
    at: Vec2,
    distance: f32,
}

/// Converts from the light's frame to cube coordinates.
fn to_cube(v: Vec3) -> Vec3 {
    Vec3::new(-v.y, v.z, v.x)
}

/// Converts from cube coordinates to the light's frame.
fn from_cube(c: Vec3) -> Vec3 {
    Vec3::new(c.z, -c.x, c.y)
}

/// The projection of a point in cube coordinates onto its face.
fn on_face(c: Vec3) -> OnFace {
    let a = c.abs();
    if a.x >= a.y && a.x >= a.z {
        let positive = c.x > 0.0;
        let s = if positive { -c.z } else { c.z };
        OnFace { face: if positive { 0 } else { 1 }, at: Vec2::new(s, -c.y), distance: a.x }
    } else if a.y >= a.z {
        let positive = c.y > 0.0;
        let t = if positive { c.z } else { -c.z };
        OnFace { face: if positive { 2 } else { 3 }, at: Vec2::new(c.x, t), distance: a.y }
    } else {
        let positive = c.z > 0.0;
        let s = if positive { c.x } else { -c.x };
        OnFace { face: if positive { 4 } else { 5 }, at: Vec2::new(s, -c.y), distance: a.z }
    }
}

/// The point, in cube coordinates, at (s, t) on the plane of a face at a distance.
fn point(face: u32, at: Vec2, distance: f32) -> Vec3 {
    match face {
        0 => Vec3::new(distance, -at.y, -at.x),
        1 => Vec3::new(-distance, -at.y, at.x),
        2 => Vec3::new(at.x, distance, at.y),
        3 => Vec3::new(at.x, -distance, -at.y),
        4 => Vec3::new(at.x, -at.y, distance),
        _ => Vec3::new(-at.x, -at.y, -distance),
    }
}

impl Texel {
    /// The texel's index: by faces, then rows.
    pub fn index(self, edge: u32) -> usize {
        ((self.face as usize * edge as usize) + self.row as usize) * edge as usize + self.column as usize
    }

    /// The texel's centre on a cube with corners at (+-`edge`, +-`edge`, +-`edge`), not normalised.
    #[inline]
    pub fn centre(self, edge: u32) -> Vec3 {
        let last = edge as i32 - 1;
        let at = Vec2::new((2 * self.column as i32 - last) as f32, (2 * self.row as i32 - last) as f32);
        from_cube(point(self.face, at, edge as f32))
    }
}

impl Taps {
    /// The bilinear value of a cube map, texels RGB.
    pub fn blend(&self, edge: u32, map: &[[f32; 3]]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for k in 0..4 {
            sum += Vec3::from(map[self.texel[k].index(edge)]) * self.weight[k];
        }
        sum
    }
}

/// The texel at a column and row, one of which may lie one step outside the face.
fn continued(edge: u32, face: u32, column: i32, row: i32) -> Texel {
    let last = edge as i32 - 1;
    if (0..=last).contains(&column) && (0..=last).contains(&row) {
        return Texel { face, column: column as u32, row: row as u32 };
    }
    let at = Vec2::new((2 * column - last) as f32, (2 * row - last) as f32);
    let beside = on_face(point(face, at, edge as f32));
    // The coordinate across the edge is the old distance, half a texel beyond the last centre.
    let whole = |s: f32| (((s as i32) + last) / 2).clamp(0, last) as u32;
    Texel { face: beside.face, column: whole(beside.at.x), row: whole(beside.at.y) }
}

/// The largest integer that is not above `x`. On some processors `floor` would be a function call.
#[inline]
pub(super) fn below(x: f32) -> i32 {
    let whole = x as i32;
    whole - i32::from(x < whole as f32)
}

/// The four texels around a direction, which need not have length 1.
pub fn taps(edge: u32, direction: Vec3) -> Taps {
    let OnFace { face, at, distance } = on_face(to_cube(direction));
    let position = (at / distance + 1.0) * (0.5 * edge as f32) - 0.5;
    let (left, top) = (below(position.x), below(position.y));
    let share = position - Vec2::new(left as f32, top as f32);
    let rest = 1.0 - share;
    let mut weight = [rest.x * rest.y, share.x * rest.y, rest.x * share.y, share.x * share.y];
    let last = edge as i32 - 1;
    if left >= 0 && top >= 0 && left < last && top < last {
        let at = |x: i32, y: i32| Texel { face, column: x as u32, row: y as u32 };
        return Taps {
            texel: [at(left, top), at(left + 1, top), at(left, top + 1), at(left + 1, top + 1)],
            weight,
        };
    }
    let mut texel = [Texel::default(); 4];
    let mut missing = 4;
    for k in 0..4 {
        let (column, row) = (left + (k & 1), top + (k >> 1));
        if (column < 0 || column > last) && (row < 0 || row > last) {
            missing = k as usize;
        } else {
            texel[k as usize] = continued(edge, face, column, row);
        }
    }
    if missing < 4 {
        let third = weight[missing] / 3.0;
        for k in 0..4 {
            weight[k] = if k == missing { 0.0 } else { weight[k] + third };
        }
        texel[missing] = texel[3 - missing];
    }
    Taps { texel, weight }
}

/// The bilinear value of a cube map in a direction; RGB texels in the order of `sphere::Cube`.
pub fn sample(edge: u32, map: &[[f32; 3]], direction: Vec3) -> Vec3 {
    taps(edge, direction).blend(edge, map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, apart, directions, noise_map, rounded};
    use envmap::Texels;
    use sphere::{Cube, Face};

    /// A place on a face is off by about 4 roundings times half the edge in texels. The map is continuous,
    /// and neighbours differ by at most 1 along each of two axes.
    #[test]
    fn values_match_envmap_across_edges_and_corners() {
        for edge in [1, 2, 3, 8, 63, 64, 500] {
            let map = noise_map(6 * edge * edge);
            let allowed = (8.0 * edge as f64 + 16.0) * ROUNDING;
            for direction in directions() {
                let (short, exact) = rounded(direction);
                let expected = Cube { edge }.taps(exact).blend(&map);
                let found = sample(edge as u32, &map, short * 3.0);
                assert!(apart(found, expected) < allowed, "edge {edge} at {short}: {found} {expected:?}");
            }
        }
    }

    #[test]
    fn texels_have_the_directions_of_sphere() {
        for edge in [1, 2, 7, 64] {
            let cube = Cube { edge };
            for index in 0..cube.len() {
                let (face, row, column) = (index / (edge * edge), index / edge % edge, index % edge);
                let texel = Texel { face: face as u32, column: column as u32, row: row as u32 };
                assert_eq!(texel.index(edge as u32), index);
                let expected = cube.direction(Face::ALL[face], row, column).vector().to_array();
                let found = texel.centre(edge as u32).normalize();
                assert!(apart(found, expected) < 4.0 * ROUNDING);
            }
        }
    }

    /// The texel across an edge, found with integers, compared with a small step across it in f64.
    #[test]
    fn the_texel_across_an_edge_is_the_neighbour_even_on_large_faces() {
        for edge in [1, 2, 5, 64, 4095, 4096] {
            let last = edge as i32 - 1;
            for face in 0..6 {
                for along in [0, 1, last / 2, last - 1, last] {
                    let along = along.clamp(0, last);
                    for (column, row) in [(-1, along), (last + 1, along), (along, -1), (along, last + 1)] {
                        let at = |k: i32| (f64::from(k.clamp(0, last)) + 0.5) / edge as f64;
                        let past = |k: i32| {
                            if k < 0 {
                                -1e-9
                            } else if k > last {
                                1.0 + 1e-9
                            } else {
                                at(k)
                            }
                        };
                        let cube = Cube { edge };
                        let beyond = cube.direction_at(Face::ALL[face], past(column), past(row));
                        let (neighbour, s, t) = cube.position(beyond);
                        let texel = |s: f64| ((s * edge as f64) as u32).min(last as u32);
                        let expected = Texel { face: neighbour as u32, column: texel(s), row: texel(t) };
                        assert_eq!(continued(edge as u32, face as u32, column, row), expected);
                    }
                }
            }
        }
    }
}
