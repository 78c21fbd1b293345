//! A room with a window, for light probes: in a binary glTF of a few kilobytes.
//!
//! All surfaces have one side, that of the room, so that a camera in front of the room looks into it.

use super::glb::{Material, Part, Shape, parts_as_glb};

/// The half width, the height and the half depth of the room, in metres.
const ROOM: [f32; 3] = [1.8, 3.0, 2.0];
/// The window in the left wall: from and to, along y and z.
const WINDOW: [[f32; 2]; 2] = [[0.7, 2.6], [-1.3, 1.3]];

/// The file.
pub(crate) fn glb_of_room() -> Vec<u8> {
    let [width, height, depth] = ROOM;
    let mut plaster = Quads::default();
    plaster.wall(1, height, -1.0, [[-depth, depth], [-width, width]]);
    plaster.wall(2, -depth, 1.0, [[-width, width], [0.0, height]]);
    plaster.wall(2, depth, -1.0, [[-width, width], [0.0, height]]);
    let [[sill, top], [left, right]] = WINDOW;
    for (y, z) in [
        ([0.0, sill], [-depth, depth]),
        ([top, height], [-depth, depth]),
        ([sill, top], [-depth, left]),
        ([sill, top], [right, depth]),
    ] {
        plaster.wall(0, -width, 1.0, [y, z]);
    }
    let mut clay = Quads::default();
    clay.wall(0, width, -1.0, [[0.0, height], [-depth, depth]]);
    let mut boards = Quads::default();
    boards.wall(1, 0.0, 1.0, [[-depth, depth], [-width, width]]);
    let mut stone = Quads::default();
    stone.block([0.3, 0.0, -depth], [width, 0.35, -0.9]);
    stone.block([-0.8, 0.0, -1.4], [-0.4, height, -1.0]);
    let mut frame = Quads::default();
    let [inner, bar] = [0.08 - width, 0.05];
    let middle = (left + right) / 2.0;
    for (y, z) in [
        ([sill - bar, sill + bar], [left - bar, right + bar]),
        ([top - bar, top + bar], [left - bar, right + bar]),
        ([sill, top], [left - bar, left + bar]),
        ([sill, top], [middle - bar / 2.0, middle + bar / 2.0]),
        ([sill, top], [right - bar, right + bar]),
    ] {
        frame.block([-width, y[0], z[0]], [inner, y[1], z[1]]);
    }
    let mut lantern = Quads::default();
    lantern.block([1.1, 0.35, -1.65], [1.45, 1.0, -1.3]);
    let matte = |name, colour| Material { name, colour, emission: [0.0; 3] };
    parts_as_glb(&[
        plaster.of(matte("plaster", [0.8, 0.78, 0.74])),
        clay.of(matte("clay", [0.6, 0.23, 0.14])),
        boards.of(matte("boards", [0.42, 0.3, 0.19])),
        stone.of(matte("stone", [0.5, 0.52, 0.54])),
        frame.of(matte("frame", [0.7, 0.7, 0.68])),
        lantern.of(Material { name: "lantern", colour: [0.8, 0.7, 0.5], emission: [1.0, 0.48, 0.16] }),
    ])
}

/// Rectangles along the axes.
#[derive(Default)]
struct Quads {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u16>,
}

impl Quads {
    /// A rectangle at a place on an axis; its normal has the sign `facing`, and `sides` are along the two
    /// other axes, x after z.
    fn wall(&mut self, axis: usize, at: f32, facing: f32, sides: [[f32; 2]; 2]) {
        let [u, v] = match axis {
            0 => [1, 2],
            1 => [2, 0],
            _ => [0, 1],
        };
        let first = self.positions.len() as u16;
        for [i, j] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
            let mut corner = [at; 3];
            corner[u] = sides[0][i];
            corner[v] = sides[1][j];
            let mut normal = [0.0; 3];
            normal[axis] = facing;
            self.positions.push(corner);
            self.normals.push(normal);
        }
        let order = if facing > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
        self.indices.extend(order.map(|corner| first + corner));
    }

    /// A solid block.
    fn block(&mut self, from: [f32; 3], to: [f32; 3]) {
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let sides = [[from[u], to[u]], [from[v], to[v]]];
            self.wall(axis, from[axis], -1.0, sides);
            self.wall(axis, to[axis], 1.0, sides);
        }
    }

    fn of(self, material: Material) -> Part {
        let Self { positions, normals, indices } = self;
        Part { material, shape: Shape { positions, normals, attributes: Vec::new(), indices } }
    }
}
