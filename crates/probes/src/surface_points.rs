//! Points on the surfaces of a scene, of which each stands for the surface around it.
//!
//! A triangle has points in proportion to its area, by a seed and its own corners: what changes elsewhere
//! leaves them where they are. The area of a point is a power of two, so that it stays as well. A place finds
//! the nearest point that faces the same way, lies in the same plane or nearly so, and can be seen from it:
//! light does not pass walls from a point to a place.

use glam::Vec3;
use sampling::PointsOfFour;

use crate::random::{hash, share_of};
use crate::surfaces::{Place, Surfaces};

/// The largest share of the points that lies on one triangle: the ground of a level may be a thousand times
/// as large as the level.
const LARGEST_SHARE: f64 = 0.25;

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

/// Points, in a grid of cells.
pub(crate) struct SurfacePoints {
    /// The points, in the order of their cells.
    places: Vec<Place>,
    /// The first point of each cell, x fastest, and the end.
    first: Vec<u32>,
    least: Vec3,
    counts: [usize; 3],
    /// The cells in a metre.
    scale: f32,
    reach: f32,
    /// The area that a point stands for, in square metres.
    pub(crate) area: f32,
}

impl SurfacePoints {
    /// About `count` points to twice as many, by a seed; fewer if some triangles are most of the scene.
    pub(crate) fn new(surfaces: &Surfaces<'_>, count: usize, seed: u64) -> Self {
        let triangles = 0..surfaces.parts.triangles.len() as u32;
        let areas = triangles.clone().map(|triangle| 0.5 * f64::from(surfaces.twice_normal(triangle).length()));
        let areas: Vec<f64> = areas.collect();
        let area = area_of_each(&areas, count);
        let most = LARGEST_SHARE * count as f64;
        let mut places = Vec::new();
        for triangle in triangles {
            let own = (areas[triangle as usize] / area).min(most);
            let corners = surfaces.parts.triangles[triangle as usize];
            let seed = corners.as_flattened().iter().fold(seed, |seed, x| hash(seed ^ u64::from(x.to_bits())));
            let sides = 1 + u64::from(surfaces.material(triangle).is_double_sided);
            for side in 0..sides {
                let seed = hash(seed ^ side);
                let points = PointsOfFour::new(seed);
                for index in 0..(own + f64::from(share_of(seed))) as u32 {
                    let [u, v, ..] = points.get(index);
                    let root = u.sqrt();
                    places.push(surfaces.place_on(triangle, [root * (1.0 - v), root * v], side == 0));
                }
            }
        }
        let corners = || places.iter().map(|place: &Place| place.position);
        let least = corners().fold(Vec3::INFINITY, Vec3::min);
        let extent = corners().fold(Vec3::NEG_INFINITY, Vec3::max) - least;
        let reach = REACH * (area as f32).sqrt();
        let scale = 1.0 / (2.0 * reach).max(extent.max_element() / MOST_CELLS);
        let counts = extent.to_array().map(|extent| (extent * scale) as usize + 1);
        let mut points = Self { places, first: Vec::new(), least, counts, scale, reach, area: area as f32 };
        points.sort();
        points
    }

    fn sort(&mut self) {
        let cell = |place: &Place| {
            let [x, y, z] = self.cell(place.position);
            (z * self.counts[1] + y) * self.counts[0] + x
        };
        let mut order: Vec<(u32, Place)> = self.places.iter().map(|place| (cell(place) as u32, *place)).collect();
        order.sort_by_key(|(cell, _)| *cell);
        let cells: usize = self.counts.iter().product();
        self.first = vec![0; cells + 1];
        order.iter().for_each(|(cell, _)| self.first[*cell as usize + 1] += 1);
        (0..cells).for_each(|cell| self.first[cell + 1] += self.first[cell]);
        self.places = order.into_iter().map(|(_, place)| place).collect();
    }

    /// The cell of a place, or the nearest one.
    fn cell(&self, at: Vec3) -> [usize; 3] {
        let at = (at - self.least) * self.scale;
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.counts[axis] - 1))
    }

    /// The points.
    pub(crate) fn places(&self) -> &[Place] {
        &self.places
    }

    /// The point that stands for a place, no farther away than `reach`.
    pub(crate) fn find(&self, surfaces: &Surfaces<'_>, place: &Place, reach: f32) -> Option<usize> {
        if self.places.is_empty() {
            return None;
        }
        let reach = reach.min(self.reach);
        let [least, most] = [-reach, reach].map(|reach| self.cell(place.position + Vec3::splat(reach)));
        let mut nearest = [(reach * reach, usize::MAX); CANDIDATES];
        for z in least[2]..=most[2] {
            for y in least[1]..=most[1] {
                let line = (z * self.counts[1] + y) * self.counts[0];
                let [from, to] = [line + least[0], line + most[0] + 1].map(|cell| self.first[cell] as usize);
                for index in from..to {
                    let other = &self.places[index];
                    let way = other.position - place.position;
                    let squared = way.length_squared();
                    if squared >= nearest[CANDIDATES - 1].0 || place.normal.dot(other.normal) < LEAST_COSINE {
                        continue;
                    }
                    let out = way.dot(place.normal).abs() - place.clearance - other.clearance;
                    if out > 0.0 && out * out > OUT_OF_PLANE * OUT_OF_PLANE * squared {
                        continue;
                    }
                    let mut last = CANDIDATES - 1;
                    while last > 0 && nearest[last - 1].0 > squared {
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

/// The area that each point stands for: a power of two for which there are at least `count` points, or a quarter
/// of them beside those of the largest triangles.
fn area_of_each(areas: &[f64], count: usize) -> f64 {
    let most = LARGEST_SHARE * count as f64;
    let all: f64 = areas.iter().sum();
    let power_of_two = |x: f64| f64::from_bits(x.to_bits() & (0x7ff << 52)).max(1e-30);
    let mut area = power_of_two(all / count as f64);
    loop {
        let others: f64 = areas.iter().filter(|own| **own < most * area).sum();
        if others / area >= 0.25 * count as f64 || others < 1e-4 * all {
            return area;
        }
        area *= 0.5;
    }
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
