//! Points on the surfaces of a scene, of which each stands for the surface around it.
//!
//! A triangle is halved at its longest edge until its parts are as small as the area of a point, and each
//! part has a point, uniform in it: in the mean over seeds, the light of a part is that of the points of
//! the part, and nothing is lost or added at the edges of a surface, as it were if places took the nearest
//! point. Smaller triangles have points at random, in proportion to their area, and their places do take
//! the nearest one that faces the same way and lies in the same plane or nearly so. Nothing may be between
//! a place and its point: light does not pass walls from one to the other.
//!
//! The points of a triangle depend on a seed and its own corners: what changes elsewhere leaves them where
//! they are. The area of a point and the most points of a triangle are powers of two, so that they stay as
//! well. Of two points that are as near to a place, their coordinates choose, not their order in the grid.

use glam::Vec3;

use crate::random::{hash, hash_of, share_of};
use crate::surfaces::{Place, Surfaces};

/// The largest share of the points that lies on one triangle. The ground of a level may be a thousand times
/// as large as the level: triangles that would have more than [`TOO_LARGE`] times their share have no
/// points.
const LARGEST_SHARE: f64 = 0.25;
const TOO_LARGE: f64 = 4.0;

/// How far away a place looks for points, in sides of the square that a point stands for: random points that
/// have one in each such square leave 0.7 percent of places without one.
const REACH: f32 = 1.75;

/// The least cosine between the normals of a place and of its point.
const LEAST_COSINE: f32 = 0.9;

/// How far a point may be out of the plane of a place, as a share of its distance.
const OUT_OF_PLANE: f32 = 0.25;

/// The nearest points that a place looks at.
const CANDIDATES: usize = 3;

/// The most cells of the grid along an axis.
const MOST_CELLS: f32 = 64.0;

/// The points of a scene.
pub(crate) struct SurfacePoints {
    /// The points of large triangles, part by part, and those of small ones in the order of the grid's cells.
    places: Vec<Place>,
    /// A seed for the numbers of each point, and its place among the points of the same seed: those of
    /// neighbouring parts of a triangle are next to each other.
    sequences: Vec<Sequence>,
    of_triangle: Vec<OfTriangle>,
    /// The first point of each cell, x fastest, and the end.
    first: Vec<u32>,
    least: Vec3,
    counts: [usize; 3],
    /// The cells in a metre.
    scale: f32,
    reach: f32,
    /// The area that a point stands for, in square metres.
    pub(crate) area: f32,
    /// The most points of a triangle, about.
    pub(crate) most: f32,
}

/// A seed for the numbers of a point, and its place among the points of the same seed.
pub(crate) type Sequence = (u64, u32);

/// Which points a triangle has.
#[derive(Clone, Copy)]
enum OfTriangle {
    /// It is too large.
    None,
    /// The points of the grid that lie in it.
    Small,
    /// One for each of 2^halvings parts, from this one on, and of the back's after those of the front.
    Parts { first: u32, halvings: u32 },
}

impl SurfacePoints {
    /// About `count` points to twice as many, by a seed; fewer if some triangles are most of the scene.
    pub(crate) fn new(surfaces: &Surfaces<'_>, count: usize, seed: u64) -> Self {
        let triangles = 0..surfaces.parts.triangles.len() as u32;
        // A normal that is too small or too large for single precision is none: there are no points.
        let area = |triangle: u32| 0.5 * f64::from(surfaces.twice_normal(triangle).length());
        let area = |triangle: u32| Some(area(triangle)).filter(|area| area.is_finite()).unwrap_or(0.0);
        let areas: Vec<f64> = triangles.clone().map(area).collect();
        let most = LARGEST_SHARE * power_of_two(count as f64);
        let area = area_of_each(&areas, count, most);
        let (mut places, mut small, mut of_triangle) = (Vec::new(), Vec::new(), Vec::new());
        let mut sequences = Vec::new();
        for triangle in triangles {
            let own = areas[triangle as usize] / area;
            let corners = surfaces.parts.triangles[triangle as usize];
            let seed = hash_of(seed, corners.into_iter().flatten());
            let sides = 1 + u64::from(surfaces.material(triangle).is_double_sided);
            let is_large = own >= 1.0;
            let mut halvings = 0;
            while is_large && f64::from(1_u32 << halvings) < own.min(most) {
                halvings += 1;
            }
            of_triangle.push(match is_large {
                false => OfTriangle::Small,
                true if own > TOO_LARGE * most => OfTriangle::None,
                true => OfTriangle::Parts { first: places.len() as u32, halvings },
            });
            if own > TOO_LARGE * most {
                continue;
            }
            for side in 0..sides {
                let point = |number: u32, part: [[f32; 3]; 3]| {
                    let seed = hash(seed ^ (u64::from(number) << 1) ^ side);
                    let (u, v) = (share_of(seed).sqrt(), share_of(hash(seed)));
                    let weights = [1.0 - u, u * (1.0 - v), u * v];
                    let at = |corner: usize| (0..3).map(|k| weights[k] * part[k][corner]).sum();
                    surfaces.place_on(triangle, [at(1), at(2)], side == 0)
                };
                if is_large {
                    let parts = 0..1 << halvings;
                    sequences.extend(parts.clone().map(|part| (hash(seed ^ !side), part)));
                    places.extend(parts.map(|part| point(part, corners_of_part(&corners, part, halvings))));
                } else if f64::from(share_of(hash(seed ^ !side))) < own {
                    small.push((point(0, WHOLE), (hash(!seed ^ side), 0)));
                }
            }
        }
        let corners = || small.iter().map(|(place, _): &(Place, _)| place.position);
        let least = corners().fold(Vec3::INFINITY, Vec3::min);
        let extent = (corners().fold(Vec3::NEG_INFINITY, Vec3::max) - least).max(Vec3::ZERO);
        let reach = REACH * (area as f32).sqrt();
        let scale = 1.0 / (2.0 * reach).max(extent.max_element() / MOST_CELLS);
        let counts = extent.to_array().map(|extent| (extent * scale) as usize + 1);
        let (area, most, first) = (area as f32, most as f32, Vec::new());
        let mut points =
            Self { places, sequences, of_triangle, first, least, counts, scale, reach, area, most };
        points.add_small(small);
        points
    }

    fn add_small(&mut self, small: Vec<(Place, Sequence)>) {
        let cell = |place: &Place| {
            let [x, y, z] = self.cell(place.position);
            (z * self.counts[1] + y) * self.counts[0] + x
        };
        let mut order: Vec<(usize, (Place, Sequence))> =
            small.into_iter().map(|point| (cell(&point.0), point)).collect();
        order.sort_by_key(|(cell, _)| *cell);
        let cells: usize = self.counts.iter().product();
        self.first = vec![0; cells + 1];
        order.iter().for_each(|(cell, _)| self.first[cell + 1] += 1);
        self.first[0] = self.places.len() as u32;
        (0..cells).for_each(|cell| self.first[cell + 1] += self.first[cell]);
        for (_, (place, sequence)) in order {
            self.places.push(place);
            self.sequences.push(sequence);
        }
    }

    /// The cell of a place, or the nearest one.
    fn cell(&self, at: Vec3) -> [usize; 3] {
        let at = (at - self.least) * self.scale;
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.counts[axis] - 1))
    }

    /// The points, each with a seed and its place among the points of that seed.
    pub(crate) fn all(&self) -> impl Iterator<Item = (Place, Sequence)> {
        self.places.iter().copied().zip(self.sequences.iter().copied())
    }

    /// A box around all that the point which stands for a place depends on: other points that are as near,
    /// and what may be in between.
    pub(crate) fn box_of_find(&self, surfaces: &Surfaces<'_>, place: &Place) -> [Vec3; 2] {
        let (at, own) = (place.position, self.of_triangle.get(place.triangle as usize));
        let (one, other) = match own {
            None | Some(OfTriangle::None) => (at, at),
            Some(OfTriangle::Small) => (at - self.reach, at + self.reach),
            Some(OfTriangle::Parts { .. }) => {
                let other =
                    self.point_of_part(surfaces, place).map_or(at, |point| self.places[point].position);
                (at.min(other), at.max(other))
            }
        };
        // The way goes over a point above its middle, by an eighth of its length.
        let beyond = 0.25 * (other - one).length() + 2.0 * place.clearance;
        [one - beyond, other + beyond]
    }

    /// The point of the part of a large triangle in which a place is.
    fn point_of_part(&self, surfaces: &Surfaces<'_>, place: &Place) -> Option<usize> {
        let &OfTriangle::Parts { first, halvings } = self.of_triangle.get(place.triangle as usize)? else {
            return None;
        };
        let corners = &surfaces.parts.triangles[place.triangle as usize];
        let is_back = surfaces.twice_normal(place.triangle).dot(place.normal) < 0.0;
        let part = part_of(corners, place.weights, halvings);
        let point = (first + (u32::from(is_back) << halvings) + part) as usize;
        (point < self.places.len()).then_some(point)
    }

    /// The point that stands for a place.
    pub(crate) fn find(&self, surfaces: &Surfaces<'_>, place: &Place) -> Option<usize> {
        match *self.of_triangle.get(place.triangle as usize)? {
            OfTriangle::None => None,
            OfTriangle::Small => self.nearest(surfaces, place),
            OfTriangle::Parts { .. } => {
                let point = self.point_of_part(surfaces, place)?;
                sees(surfaces, place, &self.places[point]).then_some(point)
            }
        }
    }

    /// The nearest point of a small triangle that stands for a place.
    fn nearest(&self, surfaces: &Surfaces<'_>, place: &Place) -> Option<usize> {
        let reach = self.reach;
        let [least, most] = [-reach, reach].map(|reach| self.cell(place.position + Vec3::splat(reach)));
        let mut nearest = [(reach * reach, usize::MAX); CANDIDATES];
        let is_before = |squared: f32, index: usize, (others, other): (f32, usize)| {
            let position = |index: usize| self.places.get(index).map(|place| place.position.to_array());
            squared < others || squared == others && position(index) < position(other)
        };
        for z in least[2]..=most[2] {
            for y in least[1]..=most[1] {
                let line = (z * self.counts[1] + y) * self.counts[0];
                let [from, to] = [line + least[0], line + most[0] + 1].map(|cell| self.first[cell] as usize);
                for index in from..to {
                    let other = &self.places[index];
                    let way = other.position - place.position;
                    let squared = way.length_squared();
                    let is_near = is_before(squared, index, nearest[CANDIDATES - 1]);
                    if !is_near || place.normal.dot(other.normal) < LEAST_COSINE {
                        continue;
                    }
                    let out = way.dot(place.normal).abs() - place.clearance - other.clearance;
                    if out > 0.0 && out * out > OUT_OF_PLANE * OUT_OF_PLANE * squared {
                        continue;
                    }
                    let mut last = CANDIDATES - 1;
                    while last > 0 && is_before(squared, index, nearest[last - 1]) {
                        nearest[last] = nearest[last - 1];
                        last -= 1;
                    }
                    nearest[last] = (squared, index);
                }
            }
        }
        let found = nearest.iter().map(|(_, index)| *index).take_while(|index| *index != usize::MAX);
        let mut found = found.filter(|&index| sees(surfaces, place, &self.places[index]));
        found.next()
    }
}

/// The area that each point stands for: a power of two for which there are at least `count` points, or a
/// quarter of them beside those of the triangles with `most` or more, if there is an area beside them.
fn area_of_each(areas: &[f64], count: usize, most: f64) -> f64 {
    let all: f64 = areas.iter().sum();
    let mut area = power_of_two(all / count as f64).max(1e-30);
    loop {
        let others: f64 = areas.iter().filter(|own| **own < most * area).sum();
        if others / area >= 0.25 * count as f64 || others <= 1e-4 * all {
            return area;
        }
        area *= 0.5;
    }
}

/// The power of two that is at most x and more than half of it.
fn power_of_two(x: f64) -> f64 {
    f64::from_bits(x.to_bits() & (0x7ff << 52))
}

/// Whether nothing is between two places on surfaces that face about the same way.
///
/// The straight line between two places of a round column is inside it, hence the way over a point above the
/// middle of the line.
fn sees(surfaces: &Surfaces<'_>, one: &Place, other: &Place) -> bool {
    let [from, to] = [one.start(), other.start()];
    let is_blocked = |from: Vec3, to: Vec3| surfaces.caster.is_blocked(from, to - from, 1.0, |_| true);
    let way = to - from;
    let out = way.dot(one.normal).abs().max(way.dot(other.normal).abs());
    if out <= 2.0 * one.clearance.max(other.clearance) {
        return !is_blocked(from, to);
    }
    let above = 0.5 * (from + to) + 0.125 * way.length() * (one.normal + other.normal).normalize_or_zero();
    !is_blocked(from, above) && !is_blocked(above, to)
}

/// The corners of a triangle by their weights.
const WHOLE: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The corner opposite the longest edge.
fn apex([a, b, c]: [Vec3; 3]) -> usize {
    let lengths = [c - b, a - c, b - a].map(Vec3::length_squared);
    (0..3).fold(0, |most, k| if lengths[k] > lengths[most] { k } else { most })
}

/// The corners, by their weights, of a part of a triangle that was halved at its longest edge, as its parts
/// were: each bit of the part's number, the highest first, is the half.
fn corners_of_part(corners: &[[f32; 3]; 3], part: u32, halvings: u32) -> [[f32; 3]; 3] {
    let (mut places, mut weights) = (corners.map(Vec3::from), WHOLE);
    for step in (0..halvings).rev() {
        let apex = apex(places);
        let ends = [(apex + 1) % 3, (apex + 2) % 3];
        let moved = ends[1 - (part >> step & 1) as usize];
        places[moved] = 0.5 * (places[ends[0]] + places[ends[1]]);
        weights[moved] = [0, 1, 2].map(|k| 0.5 * (weights[ends[0]][k] + weights[ends[1]][k]));
    }
    weights
}

/// The part of a triangle in which a place is, by the weights of the second and third corner.
fn part_of(corners: &[[f32; 3]; 3], [u, v]: [f32; 2], halvings: u32) -> u32 {
    let (mut places, mut weights, mut part) = (corners.map(Vec3::from), [1.0 - u - v, u, v], 0);
    for _ in 0..halvings {
        let apex = apex(places);
        let ends = [(apex + 1) % 3, (apex + 2) % 3];
        let half = usize::from(weights[ends[1]] > weights[ends[0]]);
        let (kept, moved) = (ends[half], ends[1 - half]);
        places[moved] = 0.5 * (places[kept] + places[moved]);
        weights[kept] -= weights[moved];
        weights[moved] *= 2.0;
        part = part << 1 | half as u32;
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::scene::{Part, Scene, SceneParts};

    /// Triangles whose areas are 0 in single precision, or infinite, have no points.
    #[test]
    fn triangles_without_an_area_have_no_points() {
        for size in [1e-13, 1e-12, 1e8, 1e15] {
            let corners = [[0.0; 3], [size, 0.0, 0.0], [0.0, size, size]];
            let scene = Scene::new(SceneParts {
                triangles: vec![corners; 4],
                material_of: vec![0; 4],
                attributes_of: vec![SceneParts::NONE; 4],
                materials: vec![Material::default()],
                parts: vec![Part { name: "dust".into(), triangles: 4 }],
                ..SceneParts::default()
            });
            let scene = scene.unwrap();
            let points = SurfacePoints::new(&Surfaces::new(&scene), 100, 1);
            assert_eq!(points.all().count() > 0, size == 1e8, "{size}: {}", points.all().count());
        }
    }

    /// Each part has the same area, and finds the places in it.
    #[test]
    fn parts_of_a_triangle_are_as_large_and_know_their_places() {
        let corners = [[0.0, 0.0, 0.0], [5.0, 0.3, 0.0], [4.0, 2.0, 1.0]];
        for halvings in 0..8 {
            for part in 0..1 << halvings {
                let parts = corners_of_part(&corners, part, halvings);
                let [a, b, c] = parts;
                let area = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
                assert!((area * (1 << halvings) as f32 - 1.0).abs() < 1e-4, "{halvings} {part}: {area}");
                for weights in [[0.9, 0.05, 0.05], [0.1, 0.2, 0.7], [0.3, 0.6, 0.1]] {
                    let at = |k: usize| (0..3).map(|corner| weights[corner] * parts[corner][k]).sum::<f32>();
                    assert_eq!(part_of(&corners, [at(1), at(2)], halvings), part);
                }
            }
        }
    }
}
