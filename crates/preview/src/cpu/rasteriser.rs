//! The visible triangle and surface at each sample, found with integers.
//!
//! A clockwise triangle covers a sample to the right of all its edges. A sample on an edge belongs to the
//! triangle for which that is a top or left edge, so triangles that share an edge cover each sample on it
//! once. The nearest depth wins; of equal depths, the first drawn. Depth is linear on the screen. Position,
//! normal, tangent and coordinates are linear on the triangle: they are the sum of l_k v_k / w_k divided by
//! the sum of l_k / w_k.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::geometry::{Geometry, STEPS, Triangle, Vertex, twice_the_area};
use crate::ViewTransform;
use crate::shading::surface::Surface;
use crate::shading::texture::TextureSpot;

/// Triangles with fewer columns test every sample of their bounding box.
const MIN_COLUMNS: i32 = 16;

/// The index that stands for no triangle.
const NONE: u32 = u32::MAX;

/// The visible triangles in some rows of a picture.
#[derive(Debug)]
pub(super) struct Band {
    rows: Range<u32>,
    width: u32,
    /// The nearest triangle of each sample, and its depth.
    seen: Vec<(u32, f32)>,
}

/// The surface that a sample hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// The index of the object.
    pub(super) object: usize,
    /// The surface at the sample.
    pub(super) surface: Surface,
    /// The position in the mesh's coordinates. It lies in the plane of the triangle, while the end of the ray
    /// does so only up to the snapping of corners.
    pub(super) position: Vec3,
    /// The index of the triangle in the mesh.
    pub(super) triangle: usize,
    /// Whether it is the outer side of the triangle.
    pub(super) front: bool,
    /// The place in the texture of the object, if it has one.
    pub(super) spot: Option<TextureSpot>,
}

/// An edge of a triangle.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: [i64; 2],
    along: [i64; 2],
    /// The bias of the edge: 0 for a top or left edge, -1 for others.
    bias: i64,
}

impl Edge {
    fn new(from: [i32; 2], to: [i32; 2]) -> Self {
        let from = from.map(i64::from);
        let along = [i64::from(to[0]) - from[0], i64::from(to[1]) - from[1]];
        let is_top_or_left = along[1] < 0 || (along[1] == 0 && along[0] > 0);
        Self { from, along, bias: if is_top_or_left { 0 } else { -1 } }
    }

    /// Twice the area of the triangle between the edge and a sample, positive to the edge's right.
    fn area(&self, column: i32, row: i32) -> i64 {
        let middle = |k: i32| i64::from(k) * i64::from(STEPS) + i64::from(STEPS / 2);
        self.along[0] * (middle(row) - self.from[1]) - self.along[1] * (middle(column) - self.from[0])
    }

    /// The first and last column, between two given ones, of the samples to the edge's right in a row.
    fn within(&self, row: i32, first: i32, last: i32) -> (i32, i32) {
        let step = -self.along[1] * i64::from(STEPS);
        let start = self.area(first, row) + self.bias;
        let count = i64::from(last) - i64::from(first);
        if count < 0 {
            return (first, last);
        }
        // start + k step >= 0 for k from 0 to count.
        let (low, high) = match step {
            0 if start < 0 => (1, 0),
            0 => (0, count),
            1.. => ((-start.div_euclid(step)).max(0), count),
            _ => (0, start.div_euclid(-step).min(count)),
        };
        if low > high { (1, 0) } else { (first + low as i32, first + high as i32) }
    }
}

fn edges(at: [[i32; 2]; 3]) -> [Edge; 3] {
    [Edge::new(at[1], at[2]), Edge::new(at[2], at[0]), Edge::new(at[0], at[1])]
}

impl Band {
    /// The visible triangles in some rows of samples. `triangles` may cover them, in the order of drawing.
    pub(super) fn new(geometry: &Geometry, triangles: &[u32], size: [u32; 2], rows: Range<u32>) -> Self {
        let samples = size[0] as usize * rows.len();
        let mut band = Self { rows, width: size[0], seen: vec![(NONE, f32::INFINITY); samples] };
        for &number in triangles {
            band.draw(geometry, number);
        }
        band
    }

    fn draw(&mut self, geometry: &Geometry, number: u32) {
        let triangle = &geometry.triangles[number as usize];
        let [a, b, c] = triangle.corners.map(|corner| &geometry.vertices[corner as usize]);
        let at = [a.at, b.at, c.at];
        let edges = edges(at);
        let scale = 1.0 / twice_the_area(at) as f32;
        let (toward_b, toward_c) = ((b.depth - a.depth) * scale, (c.depth - a.depth) * scale);
        let first = (*triangle.rows.start()).max(self.rows.start as i32);
        let last = (*triangle.rows.end()).min(self.rows.end as i32 - 1);
        let steps = edges.map(|edge| -edge.along[1] * i64::from(STEPS));
        for row in first..=last {
            let (mut left, mut right) = (*triangle.columns.start(), *triangle.columns.end());
            // A division finds the samples between the edges; for a few samples, testing each is faster.
            if right - left >= MIN_COLUMNS {
                for edge in &edges {
                    (left, right) = edge.within(row, left, right);
                }
            }
            if left > right {
                continue;
            }
            let mut areas = edges.map(|edge| edge.area(left, row));
            let start = (row - self.rows.start as i32) as usize * self.width as usize;
            for seen in &mut self.seen[start + left as usize..=start + right as usize] {
                let [of_a, of_b, of_c] = areas;
                if (of_a + edges[0].bias) | (of_b + edges[1].bias) | (of_c + edges[2].bias) >= 0 {
                    let depth = a.depth + of_b as f32 * toward_b + of_c as f32 * toward_c;
                    if depth < seen.1 {
                        *seen = (number, depth);
                    }
                }
                areas = [of_a + steps[0], of_b + steps[1], of_c + steps[2]];
            }
        }
    }

    /// The surface that a sample of these rows hits.
    pub(super) fn seen(
        &self,
        geometry: &Geometry,
        transform: &ViewTransform,
        column: u32,
        row: u32,
    ) -> Option<Hit> {
        let place = (row - self.rows.start) as usize * self.width as usize + column as usize;
        let (number, _) = self.seen[place];
        if number == NONE {
            return None;
        }
        let triangle = &geometry.triangles[number as usize];
        let Interpolated { nearness, position, normal, tangent } =
            Interpolated::new(geometry, triangle, column, row);
        let surface = Surface::new(normal, tangent, transform.ray(column, row), triangle.front);
        Some(Hit {
            object: triangle.object as usize,
            surface,
            position: position / nearness,
            triangle: triangle.in_mesh as usize,
            front: triangle.front,
            spot: geometry.is_textured[triangle.object as usize]
                .then(|| spot(geometry, triangle, column, row)),
        })
    }
}

/// The values that are linear on a triangle, at a sample: sums of l_k v_k / w_k.
struct Interpolated {
    /// The sum of l_k / w_k, by which the other values are to be divided.
    nearness: f32,
    position: Vec3,
    normal: Vec3,
    tangent: Vec3,
}

impl Interpolated {
    fn new(geometry: &Geometry, triangle: &Triangle, column: u32, row: u32) -> Self {
        let corners: [&Vertex; 3] = triangle.corners.map(|corner| &geometry.vertices[corner as usize]);
        let at = corners.map(|corner| corner.at);
        let scale = 1.0 / twice_the_area(at) as f32;
        let mut sum = Self { nearness: 0.0, position: Vec3::ZERO, normal: Vec3::ZERO, tangent: Vec3::ZERO };
        for (corner, edge) in corners.into_iter().zip(edges(at)) {
            let share = edge.area(column as i32, row as i32) as f32 * scale * corner.nearness;
            sum.nearness += share;
            sum.position += corner.position * share;
            sum.normal += corner.normal * share;
            sum.tangent += corner.tangent * share;
        }
        sum
    }
}

/// The place of a sample in the texture of its triangle. The sums of l_k u_k / w_k and l_k / w_k are
/// linear on the screen, so the derivatives of their ratio follow from their steps.
fn spot(geometry: &Geometry, triangle: &Triangle, column: u32, row: u32) -> TextureSpot {
    let corners: [&Vertex; 3] = triangle.corners.map(|corner| &geometry.vertices[corner as usize]);
    let coordinates = triangle.corners.map(|corner| geometry.coordinates[corner as usize]);
    let at = corners.map(|corner| corner.at);
    let scale = 1.0 / twice_the_area(at) as f32;
    // The sums of l_k u_k / w_k and of l_k / w_k, and their steps to the right and down.
    let mut sums = [(Vec2::ZERO, 0.0); 3];
    for ((corner, edge), coordinates) in corners.into_iter().zip(edges(at)).zip(coordinates) {
        let area = edge.area(column as i32, row as i32);
        let [x, y] = edge.along.map(|along| along * i64::from(STEPS));
        for ((sum, nearness), step) in sums.iter_mut().zip([area, -y, x]) {
            let share = step as f32 * scale * corner.nearness;
            *sum += coordinates * share;
            *nearness += share;
        }
    }
    let [(sum, nearness), across, down] = sums;
    let at = sum / nearness;
    let step = |(step, of_nearness): (Vec2, f32)| (step - at * of_nearness) / nearness;
    TextureSpot { at, across: step(across), down: step(down) }
}
