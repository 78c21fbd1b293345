//! A tree of planes that finds the tetrahedron of a place.
//!
//! Each node has the plane of a face: the one that divides the tetrahedra most evenly and cuts fewest of
//! them. A tetrahedron that is cut is on both sides, as the part of it that is there: on each way down the
//! tree, only those are left that reach into the space between its planes.

use sh::{Stop, Stopped};

use crate::tetrahedra::{Tetrahedra, WholePlace};

/// What is nearer to a plane than this, in the unit of the coordinates, is on it: coordinates are rounded.
const PLANE_THICKNESS: f64 = 2.0;

/// The most planes that are tried at a node, and the most parts that each of them is tried on.
const PLANES: usize = 64;
const PARTS: usize = 512;

/// How many parts are counted on a side without a whole one: such a plane is the last choice.
const PARTS_OF_EMPTY_SIDE: f64 = 1e-3;

/// A node of a tree: its plane, and what is over and under it.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// The normal of the plane, of length 1. What is over the plane is on its side.
    pub normal: [f64; 3],
    /// A place on the plane, a corner of the face that it is of.
    pub at: [f64; 3],
    /// What is over the plane.
    pub over: Side,
    /// What is under the plane.
    pub under: Side,
}

/// What is on one side of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The node with this index, which comes after the one that leads to it.
    Node(usize),
    /// The tetrahedron with this index.
    Tetrahedron(usize),
}

/// The nodes that find the tetrahedron of a place in the box of some tetrahedra, the root first.
///
/// A place that is nearer to a face than two units may be found on the other side of it. There are about two
/// nodes for each tetrahedron between points of an octree, and nine between random points.
///
/// # Errors
/// If it was stopped.
pub fn plane_tree(all: &Tetrahedra, stop: Stop<'_>) -> Result<Vec<Cut>, Stopped> {
    let part = |tetrahedron: usize| Part {
        tetrahedron,
        corners: all.at(tetrahedron).map(in_floats).to_vec(),
        faces: (0..4).map(|face| (Tetrahedra::FACES[face].to_vec(), Some(face))).collect(),
    };
    let mut nodes = Vec::new();
    divide(all, (0..all.len()).map(part).collect(), &mut nodes, stop)?;
    Ok(nodes)
}

/// Adds the nodes that divide some parts, of which there is at least one.
fn divide(all: &Tetrahedra, parts: Vec<Part>, nodes: &mut Vec<Cut>, stop: Stop<'_>) -> Result<Side, Stopped> {
    let Some(plane) = best_plane(all, &parts) else { return Ok(Side::Tetrahedron(parts[0].tetrahedron)) };
    stop.check()?;
    let (mut over, mut under) = (Vec::new(), Vec::new());
    for part in parts {
        match plane.side(&part) {
            (true, true) => {
                over.push(part.over(&plane, 1.0));
                under.push(part.over(&plane, -1.0));
            }
            (true, false) => over.push(part),
            (false, true) => under.push(part),
            (false, false) => (),
        }
    }
    let own = nodes.len();
    let Plane { normal, at } = plane;
    nodes.push(Cut { normal, at, over: Side::Node(own), under: Side::Node(own) });
    let over = divide(all, over, nodes, stop)?;
    let under = divide(all, under, nodes, stop)?;
    nodes[own] = Cut { normal, at, over, under };
    Ok(Side::Node(own))
}

/// The plane of a face that divides some parts best, unless there is only one part.
fn best_plane(all: &Tetrahedra, parts: &[Part]) -> Option<Plane> {
    // A face that two tetrahedra share is tried once, and one of the box never.
    let is_tried = |(own, face): &(usize, usize)| {
        let beyond = all.beyond(*own)[*face];
        beyond != Tetrahedra::NOTHING && *own < beyond as usize
    };
    let of_part = |part: &Part| -> Vec<(usize, usize)> {
        let own = part.faces.iter().filter_map(|(_, face)| face.map(|face| (part.tetrahedron, face)));
        own.filter(is_tried).collect()
    };
    let faces: Vec<(usize, usize)> = parts.iter().flat_map(of_part).collect();
    let among: Vec<&Part> = spread(parts, PARTS).collect();
    let (mut best, mut best_score) = (None, 0.0);
    for (tetrahedron, face) in spread(&faces, PLANES) {
        let at = all.at(*tetrahedron);
        let plane = Plane::of(Tetrahedra::FACES[*face].map(|corner| at[corner]));
        let (mut over, mut under, mut cut) = (0_usize, 0_usize, 0_usize);
        for part in &among {
            match plane.side(part) {
                (true, false) => over += 1,
                (false, true) => under += 1,
                (true, true) => cut += 1,
                (false, false) => (),
            }
        }
        if over + cut == 0 || under + cut == 0 {
            continue;
        }
        let balance =
            (over.min(under) as f64 + PARTS_OF_EMPTY_SIDE) / (over.max(under) as f64 + PARTS_OF_EMPTY_SIDE);
        let whole = (over + under) as f64 / among.len() as f64;
        let score = balance * whole * whole;
        if score > best_score {
            (best, best_score) = (Some(plane), score);
        }
    }
    best
}

/// At most so many of some things, evenly spread.
fn spread<T>(things: &[T], most: usize) -> impl Iterator<Item = &T> {
    things.iter().step_by(things.len().div_ceil(most).max(1))
}

fn in_floats(place: WholePlace) -> [f64; 3] {
    place.map(|x| x as f64)
}

fn minus(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| one[k] - other[k])
}

fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
}

fn cross(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// A plane: its normal of length 1, and a place on it.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: [f64; 3],
    at: [f64; 3],
}

impl Plane {
    fn of(face: [WholePlace; 3]) -> Self {
        let [a, b, c] = face.map(in_floats);
        let normal = cross(minus(b, a), minus(c, a));
        let length = dot(normal, normal).sqrt();
        Self { normal: normal.map(|x| x / length), at: a }
    }

    /// How far a place is over it.
    fn height(&self, place: [f64; 3]) -> f64 {
        dot(self.normal, minus(place, self.at))
    }

    /// Whether a part reaches over it, and under it.
    fn side(&self, part: &Part) -> (bool, bool) {
        let heights = part.corners.iter().map(|corner| self.height(*corner));
        let [least, most] =
            heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        (most > PLANE_THICKNESS, least < -PLANE_THICKNESS)
    }
}

/// A convex part of a tetrahedron.
#[derive(Clone, Debug)]
struct Part {
    tetrahedron: usize,
    corners: Vec<[f64; 3]>,
    /// The corners of each face, one beside the next, and which face of the tetrahedron it is a part of.
    faces: Vec<(Vec<usize>, Option<usize>)>,
}

impl Part {
    /// What is over a plane or, with a sign of -1, under it.
    fn over(&self, plane: &Plane, sign: f64) -> Self {
        let heights: Vec<f64> = self.corners.iter().map(|corner| sign * plane.height(*corner)).collect();
        let (mut corners, mut is_on_plane) = (Vec::new(), Vec::new());
        // The edge that each corner is on; one that stays is on an edge from itself to itself.
        let mut edges: Vec<[usize; 2]> = Vec::new();
        let mut corner = |edge: [usize; 2]| {
            edges.iter().position(|known| *known == edge).unwrap_or_else(|| {
                let ([a, b], [from, to]) = (edge.map(|end| self.corners[end]), edge.map(|end| heights[end]));
                let is_cut = edge[0] != edge[1];
                let share = if is_cut { from / (from - to) } else { 0.0 };
                edges.push(edge);
                corners.push([0, 1, 2].map(|k| a[k] + share * (b[k] - a[k])));
                is_on_plane.push(is_cut || from <= PLANE_THICKNESS);
                edges.len() - 1
            })
        };
        let mut faces = Vec::new();
        for (face, of) in &self.faces {
            let mut own = Vec::new();
            for (k, here) in face.iter().copied().enumerate() {
                let next = face[(k + 1) % face.len()];
                if heights[here] >= -PLANE_THICKNESS {
                    own.push(corner([here; 2]));
                }
                if heights[here].min(heights[next]) < -PLANE_THICKNESS
                    && heights[here].max(heights[next]) > PLANE_THICKNESS
                {
                    own.push(corner([here.min(next), here.max(next)]));
                }
            }
            faces.push((own, *of));
        }
        faces.retain(|(own, _)| own.len() > 2 && !own.iter().all(|corner| is_on_plane[*corner]));
        let mut cut: Vec<usize> = (0..corners.len()).filter(|corner| is_on_plane[*corner]).collect();
        if cut.len() > 2 {
            sort_around(&corners, plane.normal, &mut cut);
            faces.push((cut, None));
        }
        Self { tetrahedron: self.tetrahedron, corners, faces }
    }
}

/// Sorts corners on a plane around their middle.
fn sort_around(corners: &[[f64; 3]], normal: [f64; 3], on_plane: &mut [usize]) {
    let mean =
        |k: usize| on_plane.iter().map(|corner| corners[*corner][k]).sum::<f64>() / on_plane.len() as f64;
    let middle = [0, 1, 2].map(mean);
    let first = minus(corners[on_plane[0]], middle);
    let second = cross(normal, first);
    // A number that grows with the angle.
    let turn = |corner: &usize| {
        let [x, y] = [first, second].map(|axis| dot(axis, minus(corners[*corner], middle)));
        let share = y / (x.abs() + y.abs()).max(f64::MIN_POSITIVE);
        if x < 0.0 { 2.0 - share } else { share }
    };
    on_plane.sort_by(|one, other| turn(one).total_cmp(&turn(other)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(k: usize) -> f64 {
        f64::from(crate::random::share_of(crate::random::hash(k as u64)))
    }

    /// The tree leads each place to the tetrahedron that holds it.
    #[test]
    fn the_tree_finds_what_a_search_finds() {
        let size = [300_000, 200_000, 250_000];
        let random = |k: usize| [0, 1, 2].map(|axis| 90_000 + (1e5 * number(3 * k + axis)) as i64);
        let grid = |k: usize| [k % 6, k / 6 % 6, k / 36].map(|at| (9e4 + 2000.3 * at as f64).round() as i64);
        let line = |k: usize| [95_000, 96_000, 100_000 + 700 * k as i64];
        let sets: [Vec<WholePlace>; 5] = [
            Vec::new(),
            vec![[100_000; 3]],
            (0..300).map(random).collect(),
            (0..216).map(grid).collect(),
            (0..50).map(line).collect(),
        ];
        for points in sets {
            let all = Tetrahedra::new(size, &points, usize::MAX, Stop::NEVER).unwrap().unwrap();
            let nodes = plane_tree(&all, Stop::NEVER).unwrap();
            let faces = |own: usize| {
                let at = all.at(own);
                Tetrahedra::FACES.map(|face| Plane::of(face.map(|corner| at[corner])))
            };
            let faces: Vec<[Plane; 4]> = (0..all.len()).map(faces).collect();
            let mut found = vec![0; all.len()];
            // Places in each tetrahedron, in the box, and where the points are.
            let within = |k: usize| {
                let shares = [0, 1, 2, 3].map(|corner| 0.05 + number(40_000 + 4 * k + corner));
                let all_shares: f64 = shares.iter().sum();
                let corners = all.at(k % all.len()).map(in_floats);
                [0, 1, 2].map(|axis| (0..4).map(|c| shares[c] * corners[c][axis]).sum::<f64>() / all_shares)
            };
            let between = |least: f64, lengths: [f64; 3], k: usize| {
                [0, 1, 2].map(|axis| least + lengths[axis] * number(9000 + 3 * k + axis))
            };
            for k in 0..9000 {
                let at = match k % 3 {
                    0 => within(k / 3),
                    1 => between(0.0, in_floats(size), k),
                    _ => between(9e4, [1e5; 3], k),
                };
                let (mut side, mut depth) = (Side::Node(0), 0);
                let own = loop {
                    match side {
                        Side::Tetrahedron(own) => break own,
                        Side::Node(index) => {
                            let Cut { normal, at: on, over, under } = nodes[index];
                            side = if (Plane { normal, at: on }).height(at) > 0.0 { over } else { under };
                            assert!(!matches!(side, Side::Node(next) if next <= index));
                            depth += 1;
                        }
                    }
                };
                assert!(depth < 40, "{depth}");
                let height =
                    |own: usize| faces[own].iter().map(|face| face.height(at)).fold(f64::INFINITY, f64::min);
                let expected = (0..all.len()).find(|own| height(*own) >= 0.0).unwrap();
                assert!(own == expected || height(own) > -PLANE_THICKNESS, "{at:?}: {own} {expected}");
                found[own] += 1;
            }
            assert!(nodes.len() < 12 * all.len(), "{} for {}", nodes.len(), all.len());
            assert!(found.iter().filter(|count| **count > 0).count() > 99 * all.len() / 100);
        }
    }
}
