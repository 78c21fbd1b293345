//! What Godot reads: `probe_data` of a `LightmapGIData`.

use std::f64::consts::PI;
use std::fmt::Write;

use engine::Failure;

use crate::export_probes::axes::{OF_FILES, Rows};

/// The most tetrahedra of a resource: more than a hundred megabytes of text.
pub(super) const MOST_TETRAHEDRA: usize = 1 << 20;

/// A leaf of the tree is the number of its tetrahedron, from 1 on, with a minus.
pub(super) const FIRST_LEAF: i32 = -1;

/// What Godot captures light from: `probe_data` of a `LightmapGIData`.
pub(super) struct Capture {
    pub(super) bounds: [[f64; 3]; 2],
    pub(super) points: Vec<[f32; 3]>,
    /// Nine colours a point, radiance over pi.
    pub(super) colours: Vec<Rows>,
    pub(super) tetrahedra: Vec<[usize; 4]>,
    pub(super) tree: Vec<Node>,
}

/// A node of the tree: a plane, and what is over and under it, a later node or a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) normal: [f32; 3],
    pub(super) distance: f32,
    pub(super) over: i32,
    pub(super) under: i32,
}

/// The nine colours of a probe: radiance over pi, in the axes of files.
pub(super) fn nine_colours(rows: &Rows) -> Rows {
    OF_FILES.rows(rows).map(|row| row.map(|value| (f64::from(value) / PI) as f32))
}

impl Capture {
    /// The text of the resource.
    ///
    /// # Errors
    /// None: text is written into memory.
    pub(super) fn text(&self) -> Result<String, Failure> {
        let [least, most] = self.bounds;
        let [sx, sy, sz] = [0, 1, 2].map(|k| (most[k] - least[k]) as f32);
        let [x, y, z] = least.map(|x| x as f32);
        let mut text =
            String::from("[gd_resource type=\"LightmapGIData\" format=3]\n\n[resource]\nprobe_data = {\n");
        writeln!(text, "\"baked_exposure\": 1.0,\n\"bounds\": AABB({x}, {y}, {z}, {sx}, {sy}, {sz}),")?;
        let words = |node: &Node| {
            let [x, y, z] = node.normal.map(|x| x.to_bits() as i32);
            [x, y, z, node.distance.to_bits() as i32, node.over, node.under]
        };
        array(&mut text, "bsp", "PackedInt32Array", self.tree.iter().flat_map(words))?;
        writeln!(text, "\"interior\": false,\n\"lightprobe_hash\": 0,")?;
        array(&mut text, "points", "PackedVector3Array", self.points.as_flattened().iter())?;
        let colour = |row: &[f32; 3]| [row[0], row[1], row[2], 1.0];
        let colours = self.colours.as_flattened().iter().flat_map(colour);
        array(&mut text, "sh", "PackedColorArray", colours)?;
        let tetrahedra = self.tetrahedra.as_flattened().iter();
        array(&mut text, "tetrahedra", "PackedInt32Array", tetrahedra)?;
        text.push_str("}\n");
        Ok(text)
    }
}

/// Writes an entry of a dictionary with an array.
fn array(
    text: &mut String,
    key: &str,
    name: &str,
    values: impl Iterator<Item: std::fmt::Display>,
) -> Result<(), Failure> {
    write!(text, "\"{key}\": {name}(")?;
    for (index, value) in values.enumerate() {
        let comma = if index == 0 { "" } else { ", " };
        write!(text, "{comma}{value}")?;
    }
    let comma = if key == "tetrahedra" { "" } else { "," };
    writeln!(text, "){comma}")?;
    Ok(())
}

/// How Godot reads a capture, for tests.
#[cfg(test)]
pub(super) mod reader {
    use super::*;

    /// `LightStorage::lightmap_tap_sh_light` and the weights of the four points, before they are clamped.
    pub(crate) fn tap(capture: &Capture, at: [f32; 3]) -> ([[f64; 3]; 9], [f64; 4]) {
        let corners = found(capture, at);
        let weights = weights(capture, corners, at);
        let mut sum = [[0.0; 3]; 9];
        for (corner, weight) in corners.into_iter().zip(weights) {
            for (sum, row) in sum.iter_mut().zip(capture.colours[corner]) {
                (0..3).for_each(|k| sum[k] += weight.clamp(0.0, 1.0) * f64::from(row[k]));
            }
        }
        (sum, weights)
    }

    /// The corners of the tetrahedron that the tree finds.
    pub(crate) fn found(capture: &Capture, at: [f32; 3]) -> [usize; 4] {
        let mut node = 0;
        while node >= 0 {
            let Node { normal, distance, over, under } = capture.tree[node as usize];
            let next = if (0..3).map(|k| normal[k] * at[k]).sum::<f32>() > distance { over } else { under };
            assert!(next < 0 || next > node, "children come after their parents");
            node = next;
        }
        capture.tetrahedra[node.unsigned_abs() as usize - 1]
    }

    /// The weights of the corners of a tetrahedron at a place, none below 0 if the place is in it.
    fn weights(capture: &Capture, corners: [usize; 4], at: [f32; 3]) -> [f64; 4] {
        let points = corners.map(|corner| capture.points[corner].map(f64::from));
        let volume = |p: [[f64; 3]; 4]| {
            let [a, b, c] = [1, 2, 3].map(|k| [0, 1, 2].map(|axis| p[k][axis] - p[0][axis]));
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        [0, 1, 2, 3].map(|corner| {
            let mut moved = points;
            moved[corner] = at.map(f64::from);
            volume(moved) / volume(points)
        })
    }

    /// The capture of `scene_forward_clustered.glsl`: what a white surface reflects.
    pub(crate) fn shaded(sh: &[[f64; 3]; 9], [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (c1, c2, c3, c4, c5) = (0.429043, 0.511664, 0.743125, 0.886227, 0.247708);
        [0, 1, 2].map(|k| {
            let sh = |row: usize| sh[row][k];
            c1 * sh(8) * (x * x - y * y) + c3 * sh(6) * z * z + c4 * sh(0) - c5 * sh(6)
                + 2.0 * c1 * (sh(4) * x * y + sh(7) * x * z + sh(5) * y * z)
                + 2.0 * c2 * (sh(3) * x + sh(1) * y + sh(2) * z)
        })
    }
}
