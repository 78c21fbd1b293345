//! From meshes to triangles on the screen: transformed, clipped, and snapped to 1/256 of a sample.

use std::ops::RangeInclusive;

use glam::{Vec2, Vec3};
use mesh::Mesh;
use rayon::prelude::*;

use super::clip::{Corner, LOST, Planes};
use crate::shading::base_color::BaseColorMap;
use crate::{Object, Placed, Scene, ViewTransform};

/// The steps per sample along each axis.
pub(super) const STEPS: i32 = 256;

/// A corner on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertex {
    /// The corner's place in steps from the left and from the top of the picture.
    pub(super) at: [i32; 2],
    /// The depth z / w, 0 near to 1 far.
    pub(super) depth: f32,
    /// The nearness 1 / w.
    pub(super) nearness: f32,
    /// The position in the mesh's coordinates.
    pub(super) position: Vec3,
    /// The normal in the light's frame, of any length.
    pub(super) normal: Vec3,
    /// The tangent in the light's frame, of any length.
    pub(super) tangent: Vec3,
}

/// A triangle that may cover a sample: its corners run clockwise on the screen, whose y points down.
#[derive(Clone, Debug)]
pub(super) struct Triangle {
    pub(super) corners: [u32; 3],
    /// The index of the object in the scene.
    pub(super) object: u32,
    /// The index of the triangle in the mesh that it is, or that it is a part of.
    pub(super) in_mesh: u32,
    /// Whether the outer side of the triangle faces the viewer.
    pub(super) front: bool,
    /// The columns and rows of the samples inside both its bounding box and the picture.
    pub(super) columns: RangeInclusive<i32>,
    pub(super) rows: RangeInclusive<i32>,
}

/// Where a triangle comes from.
#[derive(Clone, Copy)]
struct TriangleOf {
    object: u32,
    in_mesh: u32,
    /// Whether the object is a mirror image of its mesh.
    mirrored: bool,
}

/// All triangles of a scene that may be visible, in the order of objects and of their meshes.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) vertices: Vec<Vertex>,
    pub(super) triangles: Vec<Triangle>,
    /// The coordinates of the vertices in the textures of their objects, 0 in an object without one; empty
    /// if no object has one.
    pub(super) coordinates: Vec<Vec2>,
    /// Whether each object has a texture.
    pub(super) is_textured: Vec<bool>,
}

impl Geometry {
    /// The geometry of a scene.
    pub(super) fn new(scene: &Scene, transform: &ViewTransform) -> Self {
        let is_textured = scene.objects.iter().map(|object| object.base_color_map().is_some()).collect();
        let mut geometry = Self { is_textured, ..Self::default() };
        for (number, object) in scene.objects.iter().enumerate() {
            geometry.add(number as u32, object, transform);
        }
        geometry
    }

    fn add(&mut self, number: u32, object: &Object, transform: &ViewTransform) {
        let Placed { clip, normal, tangent, mirrored } = transform.place(object);
        let (mesh, planes) = (&object.mesh, Planes::new(transform.size));
        let keeps_coordinates = self.is_textured.contains(&true);
        let coordinates = |vertex: usize| coordinates(object.base_color_map(), mesh, vertex);
        let corner = |vertex: usize| {
            let [x, y, z, _] = mesh.tangents()[vertex];
            Corner {
                clip: clip * Vec3::from(mesh.positions()[vertex]).extend(1.0),
                position: mesh.positions()[vertex].into(),
                normal: normal * Vec3::from(mesh.normals()[vertex]),
                tangent: tangent * Vec3::new(x, y, z),
                coordinates: if keeps_coordinates { coordinates(vertex) } else { Vec2::ZERO },
            }
        };
        let first = self.vertices.len() as u32;
        let (vertices, outside): (Vec<Vertex>, Vec<u8>) = (0..mesh.positions().len())
            .into_par_iter()
            .map(|vertex| {
                let corner = corner(vertex);
                (on_screen(&corner, transform.size), planes.outside(corner.clip))
            })
            .unzip();
        self.vertices.extend(vertices);
        if keeps_coordinates {
            self.coordinates.extend((0..mesh.positions().len()).map(coordinates));
        }
        for (in_mesh, &corners) in (0..).zip(mesh.triangles()) {
            let of = TriangleOf { object: number, in_mesh, mirrored };
            let bits = corners.map(|vertex| outside[vertex as usize]);
            if bits.contains(&LOST) || bits[0] & bits[1] & bits[2] != 0 {
                continue;
            }
            let crossed = bits[0] | bits[1] | bits[2];
            if crossed == 0 {
                self.push(of, corners.map(|vertex| first + vertex), transform.size);
                continue;
            }
            let polygon = planes.cut(corners.map(|vertex| corner(vertex as usize)), crossed);
            let start = self.vertices.len() as u32;
            self.vertices.extend(polygon.iter().map(|corner| on_screen(corner, transform.size)));
            if keeps_coordinates {
                self.coordinates.extend(polygon.iter().map(|corner| corner.coordinates));
            }
            for k in 2..polygon.len() as u32 {
                self.push(of, [start, start + k - 1, start + k], transform.size);
            }
        }
    }

    /// Adds a triangle if it has an area and may cover a sample.
    fn push(&mut self, of: TriangleOf, corners: [u32; 3], size: [u32; 2]) {
        let at = corners.map(|corner| self.vertices[corner as usize].at);
        let area = twice_the_area(at);
        let covered = |axis: usize| {
            let along = at.map(|at| at[axis]);
            let (least, most) = (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
            // Samples lie at the centres of their squares.
            let first = (least + STEPS / 2 - 1).div_euclid(STEPS);
            let last = (most - STEPS / 2).div_euclid(STEPS);
            first.max(0)..=last.min(size[axis] as i32 - 1)
        };
        let (columns, rows) = (covered(0), covered(1));
        if area == 0 || columns.is_empty() || rows.is_empty() {
            return;
        }
        let [a, b, c] = corners;
        // Counter-clockwise triangles have a negative area, because y points down.
        let corners = if area < 0 { [a, c, b] } else { corners };
        let TriangleOf { object, in_mesh, mirrored } = of;
        let front = (area < 0) != mirrored;
        self.triangles.push(Triangle { corners, object, in_mesh, front, columns, rows });
    }
}

/// The coordinates of a vertex in a texture.
fn coordinates(map: Option<&BaseColorMap>, mesh: &Mesh, vertex: usize) -> Vec2 {
    match (map, mesh.coordinates()) {
        (Some(map), Some(of_mesh)) => map.texture.placement().coordinates(of_mesh[vertex]).into(),
        _ => Vec2::ZERO,
    }
}

/// Twice the area of a triangle in square steps, positive if it is clockwise on the screen.
pub(super) fn twice_the_area([a, b, c]: [[i32; 2]; 3]) -> i64 {
    let from_a = |p: [i32; 2]| [i64::from(p[0]) - i64::from(a[0]), i64::from(p[1]) - i64::from(a[1])];
    let (b, c) = (from_a(b), from_a(c));
    b[0] * c[1] - b[1] * c[0]
}

/// The screen position of a corner; it is only meaningful inside the planes.
fn on_screen(corner: &Corner, size: [u32; 2]) -> Vertex {
    let [x, y, z, w] = corner.clip.to_array();
    let nearness = 1.0 / w;
    let step = |ndc: f32, size: u32| {
        let half = 0.5 * size as f32;
        ((ndc * half + half) * STEPS as f32).round_ties_even() as i32
    };
    Vertex {
        at: [step(x * nearness, size[0]), step(-y * nearness, size[1])],
        depth: z * nearness,
        nearness,
        position: corner.position,
        normal: corner.normal,
        tangent: corner.tangent,
    }
}
