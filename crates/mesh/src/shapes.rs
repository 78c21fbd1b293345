//! The built-in shapes, with analytic normals and tangents.
//!
//! Each is a grid of vertices over texture coordinates: u runs along the columns to the right, v along the
//! rows downward as seen from outside, as in glTF, so that a picture on the surface is not mirrored and the
//! bitangent N x T points up the picture: the fourth number of each tangent is +1. If a surface is closed,
//! the last column repeats the first with the same positions and another u, so that there is no gap.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::Mesh;

/// The names of the shapes that [`shape`] makes.
pub const SHAPES: [&str; 3] = ["sphere", "torus-knot", "plane"];

/// The shape with a name in [`SHAPES`].
///
/// - `sphere`: radius 1 about the origin, poles on Z, tangents toward growing phi (east). In a picture of
///   1080 rows its outline is everywhere within a tenth of a pixel of the circle.
/// - `torus-knot`: a trefoil in the ball of radius 1 about the origin: a tube of radius 0.16 that winds three
///   times around a torus of radii 0.58 and 0.26 while it goes twice around its axis, X. Tangents run along
///   the tube.
/// - `plane`: the square of side 2 about the origin at z = 0, seen from above; its tangents are +X.
pub fn shape(name: &str) -> Option<Mesh> {
    match name {
        "sphere" => Some(sphere(256, 128)),
        "torus-knot" => Some(torus_knot(512, 48)),
        "plane" => Some(plane()),
        _ => None,
    }
}

fn sphere(columns: usize, rows: usize) -> Mesh {
    let grid = Grid { columns, rows, around: true };
    grid.mesh(|column, row| {
        let (east, north) = math::sin_cos(TAU * column as f64 / columns as f64);
        // The poles are points: the sine of pi is not 0 in floating point.
        let (sine, cosine) = match row {
            0 => (0.0, 1.0),
            last if last == rows => (0.0, -1.0),
            _ => math::sin_cos(PI * row as f64 / rows as f64),
        };
        let normal = DVec3::new(sine * north, sine * east, cosine);
        Point { position: normal, normal, tangent: DVec3::new(-east, north, 0.0) }
    })
}

/// The tube's frame is that of the torus which the knot lies on: its normal is orthogonal to the knot
/// everywhere, and is continuous where the knot closes.
fn torus_knot(columns: usize, rows: usize) -> Mesh {
    let (about, around, tube) = (0.58, 0.26, 0.16);
    let (turns, windings) = (2.0, 3.0);
    let grid = Grid { columns, rows, around: true };
    grid.mesh(|column, row| {
        let t = TAU * column as f64 / columns as f64;
        let (sine, cosine) = math::sin_cos(turns * t);
        let (rise, reach) = math::sin_cos(windings * t);
        let outward = DVec3::new(0.0, cosine, sine);
        let centre = outward * (about + around * reach) + DVec3::X * (around * rise);
        let along = DVec3::new(0.0, -sine, cosine) * (turns * (about + around * reach))
            + (DVec3::X * reach - outward * rise) * (windings * around);
        let tangent = along.normalize();
        let up = outward * reach + DVec3::X * rise;
        // Downward rows, seen from outside with the tangent to the right.
        let (side, level) = math::sin_cos(TAU * (row % rows) as f64 / rows as f64);
        let normal = up * level + tangent.cross(up) * side;
        Point { position: centre + normal * tube, normal, tangent }
    })
}

fn plane() -> Mesh {
    let grid = Grid { columns: 1, rows: 1, around: false };
    grid.mesh(|column, row| Point {
        position: DVec3::new(2.0 * column as f64 - 1.0, 1.0 - 2.0 * row as f64, 0.0),
        normal: DVec3::Z,
        tangent: DVec3::X,
    })
}

struct Point {
    position: DVec3,
    normal: DVec3,
    tangent: DVec3,
}

/// A grid of squares of two triangles each.
struct Grid {
    columns: usize,
    rows: usize,
    /// Whether the last column lies on the first.
    around: bool,
}

impl Grid {
    /// The mesh of the points at (column, row); a triangle whose corners coincide, as at a pole, is left out.
    fn mesh(&self, point: impl Fn(usize, usize) -> Point) -> Mesh {
        let &Self { columns, rows, around } = self;
        let (mut positions, mut normals, mut tangents, mut coordinates) = (vec![], vec![], vec![], vec![]);
        for row in 0..=rows {
            for column in 0..=columns {
                let at = point(if around { column % columns } else { column }, row);
                positions.push(at.position.as_vec3().to_array());
                normals.push(at.normal.as_vec3().to_array());
                tangents.push(at.tangent.as_vec3().extend(1.0).to_array());
                coordinates.push([column as f32 / columns as f32, row as f32 / rows as f32]);
            }
        }
        let mut triangles = vec![];
        for row in 0..rows {
            for column in 0..columns {
                let upper = row * (columns + 1) + column;
                let lower = upper + columns + 1;
                for corners in [[upper, lower, lower + 1], [upper, lower + 1, upper + 1]] {
                    let [a, b, c] = corners.map(|k| positions[k]);
                    if a != b && b != c && c != a {
                        triangles.push(corners.map(|k| k as u32));
                    }
                }
            }
        }
        Mesh::from_complete(positions, normals, tangents, Some(coordinates), triangles)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use glam::Vec3;

    use super::*;

    fn all() -> impl Iterator<Item = (&'static str, Mesh)> {
        SHAPES.into_iter().map(|name| (name, shape(name).unwrap()))
    }

    #[test]
    fn every_name_has_a_sound_mesh_and_no_other_has() {
        for (name, mesh) in all() {
            let again = Mesh::new(
                mesh.positions().to_vec(),
                mesh.normals().to_vec(),
                mesh.tangents().to_vec(),
                mesh.coordinates().map(<[_]>::to_vec),
                mesh.triangles().to_vec(),
            );
            assert_eq!(again.as_ref(), Ok(&mesh), "{name}");
            assert!(mesh.bounds().1 < 1.5, "{name}: {:?}", mesh.bounds());
        }
        assert_eq!(shape("teapot"), None);
    }

    /// Each edge of a closed surface occurs once in either direction, if vertices at the same position count
    /// as one.
    #[test]
    fn sphere_and_knot_are_watertight() {
        for (name, mesh) in all().filter(|(name, _)| *name != "plane") {
            let mut edges = HashMap::new();
            for corners in mesh.triangles() {
                let at = corners.map(|k| mesh.positions()[k as usize].map(|x| (x + 0.0).to_bits()));
                for (from, to) in [(at[0], at[1]), (at[1], at[2]), (at[2], at[0])] {
                    *edges.entry((from, to)).or_insert(0) += 1;
                }
            }
            for (&(from, to), &count) in &edges {
                assert_eq!((count, edges.get(&(to, from))), (1, Some(&1)), "{name}: {from:?} {to:?}");
            }
        }
    }

    #[test]
    fn triangles_are_counter_clockwise_from_outside_and_frames_are_orthonormal() {
        for (name, mesh) in all() {
            for corners in mesh.triangles() {
                let [a, b, c] = corners.map(|k| Vec3::from(mesh.positions()[k as usize]));
                let face = (b - a).cross(c - a).normalize();
                for k in corners {
                    let normal = Vec3::from(mesh.normals()[*k as usize]);
                    assert!(face.dot(normal) > 0.99, "{name}: {corners:?} {face} {normal}");
                }
            }
            for (normal, tangent) in mesh.normals().iter().zip(mesh.tangents()) {
                let (normal, [x, y, z, sign]) = (Vec3::from(*normal), *tangent);
                let tangent = Vec3::new(x, y, z);
                assert!((normal.length() - 1.0).abs() < 1e-6 && (tangent.length() - 1.0).abs() < 1e-6);
                assert!(normal.dot(tangent).abs() < 1e-6 && sign == 1.0, "{name}: {normal} {tangent} {sign}");
            }
        }
    }

    /// Tangents lead toward growing u and bitangents toward falling v, so that a picture is not mirrored.
    #[test]
    fn tangents_follow_the_coordinates() {
        for (name, mesh) in all() {
            let coordinates = mesh.coordinates().unwrap();
            for &corners in mesh.triangles() {
                let [a, b, c] = corners.map(|k| k as usize);
                let at = |k: usize| Vec3::from(mesh.positions()[k]);
                let (p, q) = (at(b) - at(a), at(c) - at(a));
                let [(pu, pv), (qu, qv)] = [b, c]
                    .map(|k| (coordinates[k][0] - coordinates[a][0], coordinates[k][1] - coordinates[a][1]));
                let area = pu * qv - qu * pv;
                let (along_u, along_v) = ((p * qv - q * pv) / area, (q * pu - p * qu) / area);
                let [x, y, z, sign] = mesh.tangents()[a];
                let (normal, tangent) = (Vec3::from(mesh.normals()[a]), Vec3::new(x, y, z));
                assert!(along_u.dot(tangent) > 0.0, "{name}: {corners:?}");
                assert!(along_v.dot(normal.cross(tangent) * sign) < 0.0, "{name}: {corners:?}");
            }
        }
    }

    /// The middle of an edge lies nearer to the centre by 1 - cos(half its angle); 540 pixels are the radius
    /// at 1080 rows.
    #[test]
    fn the_spheres_outline_is_round_to_a_tenth_of_a_pixel() {
        let mesh = shape("sphere").unwrap();
        for corners in mesh.triangles() {
            let at = corners.map(|k| Vec3::from(mesh.positions()[k as usize]));
            for (from, to) in [(at[0], at[1]), (at[1], at[2]), (at[2], at[0])] {
                let sag = 540.0 * (1.0 - ((from + to) / 2.0).length());
                assert!(sag < 0.1, "{sag}");
            }
        }
    }

    /// The knot stays within the unit ball, and strands of the tube keep apart: the tube does not cut itself.
    #[test]
    fn the_knot_does_not_touch_itself() {
        for position in shape("torus-knot").unwrap().positions() {
            assert!(Vec3::from(*position).length() < 1.0 + 1e-6, "{position:?}");
        }
        let curve = |t: f64| {
            let (sine, cosine) = (2.0 * t).sin_cos();
            let (rise, reach) = (3.0 * t).sin_cos();
            DVec3::new(0.26 * rise, (0.58 + 0.26 * reach) * cosine, (0.58 + 0.26 * reach) * sine)
        };
        for i in 0..360_u32 {
            for j in 0..i {
                let distance = curve(f64::from(i).to_radians()).distance(curve(f64::from(j).to_radians()));
                let neighbours = (i - j).min(360 - (i - j)) < 40;
                assert!(neighbours || distance > 2.0 * 0.16, "{i} {j}: {distance}");
            }
        }
    }
}
