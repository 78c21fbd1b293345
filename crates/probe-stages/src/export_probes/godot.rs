//! Probes for Godot: `LightmapGIData` with tetrahedra and the tree that finds them, and a scene that shows
//! it. Here are those of volumes; [`points`] has those of points.
//!
//! Godot looks up one place for each object, in the tetrahedron that holds it. The eight probes of a cell lie
//! on a sphere, so that a Delaunay triangulation is free to divide each cell as it likes: here into six
//! tetrahedra along its diagonal (Kuhn), with a tree of planes along the axes, which Godot's own search for
//! good planes does not find.

mod capture;
mod points;

use std::fmt::Write;

use engine::Failure;
use probes::Lattice;
use sh::Stop;

use super::axes::{Grid, OF_FILES};
use super::light::{LitVolume, MaybeFiles, ProbeLight};
use capture::{Capture, FIRST_LEAF, MOST_TETRAHEDRA, Node, nine_colours};

/// The most volumes that are exported.
const MOST_VOLUMES: usize = 32;

/// The file of probes at points.
const POINTS: &str = "points.tres";

/// The orders of axes: the place in a cell is largest along the first of them.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [2, 0, 1], [1, 0, 2], [1, 2, 0], [2, 1, 0]];

/// The names of the files of so many volumes at most, in the order of their contents.
pub(crate) fn names() -> Vec<String> {
    let volumes = (0..MOST_VOLUMES).map(|index| format!("/{}", file_name(index)));
    let others = [&format!("/{POINTS}"), "/places.tscn", "/README.txt", "/light_probes.tscn"];
    volumes.chain(others.map(str::to_owned)).collect()
}

fn file_name(index: usize) -> String {
    format!("volume-{index}.tres")
}

/// The files of volumes and points.
///
/// # Errors
/// If there are too many volumes or probes, or it was stopped.
pub(crate) fn files(light: &ProbeLight<'_>, recipe: &str, stop: Stop<'_>) -> Result<MaybeFiles, Failure> {
    let volumes = light.few_volumes("preset = \"godot\"", MOST_VOLUMES)?;
    let (mut files, mut nodes, mut resources) = (Vec::new(), String::new(), String::new());
    let mut add = |node: &str, id: &str, file: &str| -> Result<(), Failure> {
        writeln!(resources, "[ext_resource type=\"LightmapGIData\" path=\"{file}\" id=\"{id}\"]")?;
        writeln!(
            nodes,
            "\n[node name=\"{node}\" type=\"LightmapGI\" parent=\".\"]\n\
             light_data = ExtResource(\"{id}\")"
        )?;
        Ok(())
    };
    for (index, lit) in volumes.iter().enumerate() {
        files.push(Some(Capture::new(lit)?.text()?.into_bytes()));
        add(&format!("Volume{index}"), &index.to_string(), &file_name(index))?;
    }
    files.resize(MOST_VOLUMES, None);
    // Godot blends what overlaps: the probes of volumes are among these, so that both have the same light.
    let has_points = light.places.scattered() > 0;
    files.push(if has_points {
        add("Points", "points", POINTS)?;
        Some(Capture::of_points(light.places.grid(), light.rows, stop)?.text()?.into_bytes())
    } else {
        None
    });
    let recipe = recipe.replace('\\', "\\\\").replace('"', "\\\"");
    let root =
        |name: &str| format!("\n[node name=\"{name}\" type=\"Node3D\"]\nmetadata/specula = \"{recipe}\"\n");
    let mut places = format!("[gd_scene format=3]\n{}", root("Places"));
    for (index, place) in light.places.grid().iter().enumerate() {
        let [x, y, z] = OF_FILES.vector(*place).map(|x| x as f32);
        writeln!(
            places,
            "\n[node name=\"Probe{index}\" type=\"LightmapProbe\" parent=\".\"]\n\
             transform = Transform3D(1, 0, 0, 0, 1, 0, 0, 0, 1, {x}, {y}, {z})"
        )?;
    }
    files.push(Some(places.into_bytes()));
    let on_points = if has_points { include_str!("godot_points.txt") } else { "" };
    files.push(Some([include_str!("godot.txt"), on_points].concat().into()));
    let steps = volumes.len() + usize::from(has_points) + 1;
    let scene =
        format!("[gd_scene load_steps={steps} format=3]\n\n{resources}{}{nodes}", root("LightProbes"));
    files.push(Some(scene.into_bytes()));
    Ok(files)
}

impl Capture {
    /// The capture of a volume. Its probes reach to the ends of the box: Godot does not clamp what is beyond
    /// them, so that the outer ones of a grid of cells are there twice.
    ///
    /// # Errors
    /// If there are too many tetrahedra.
    fn new(lit: &LitVolume<'_>) -> Result<Self, Failure> {
        let grid = Grid::of(lit.volume, OF_FILES);
        let is_padded = lit.volume.lattice == Lattice::Centres;
        let bounds = if is_padded { grid.box_of_centres() } else { grid.box_of_corners() };
        // The places along each axis, and the probe that stands at each of them.
        let along = [0, 1, 2].map(|k| {
            let last = grid.counts[k] - 1;
            let own = (0..=last).map(|at| (grid.first[k] + at as f64 * grid.spacing[k], at));
            let (start, end) = ((bounds[0][k], 0), (bounds[1][k], last));
            let ends = |end| is_padded.then_some(end);
            ends(start).into_iter().chain(own).chain(ends(end)).collect::<Vec<_>>()
        });
        let cells = [0, 1, 2].map(|k| along[k].len() - 1);
        let tetrahedra = cells.iter().product::<usize>() * ORDERS.len();
        if tetrahedra > MOST_TETRAHEDRA {
            let name = &lit.volume.name;
            let message =
                format!("{name} has {tetrahedra} tetrahedra for Godot, and {MOST_TETRAHEDRA} are the most");
            return Err(Failure::new(message).help("place probes farther apart, or split the box"));
        }
        let (mut points, mut colours) = (Vec::new(), Vec::new());
        for z in &along[2] {
            for y in &along[1] {
                for x in &along[0] {
                    points.push([x.0, y.0, z.0].map(|x| x as f32));
                    colours.push(nine_colours(&lit.rows[grid.probe([x.1, y.1, z.1])]));
                }
            }
        }
        let places = along.map(|axis| axis.into_iter().map(|(place, _)| place).collect());
        let mut tree = Tree { places, cells, nodes: Vec::new() };
        tree.divide([[0; 3], cells]);
        let tree = tree.nodes;
        let mut capture = Self { bounds, points, colours, tetrahedra: Vec::new(), tree };
        capture.tetrahedra = tetrahedra_of(cells);
        Ok(capture)
    }
}

/// The six tetrahedra of each cell, x of cells fastest: from the least corner to the greatest, along the axes
/// in one of [`ORDERS`].
fn tetrahedra_of(cells: [usize; 3]) -> Vec<[usize; 4]> {
    let point = |at: [usize; 3]| (at[2] * (cells[1] + 1) + at[1]) * (cells[0] + 1) + at[0];
    let count = cells.iter().product();
    let cell = |index: usize| [index % cells[0], index / cells[0] % cells[1], index / (cells[0] * cells[1])];
    let tetrahedra = |index: usize| {
        ORDERS.map(|order| {
            let mut at = cell(index);
            let mut points = [point(at); 4];
            for (k, axis) in order.into_iter().enumerate() {
                at[axis] += 1;
                points[k + 1] = point(at);
            }
            points
        })
    };
    (0..count).flat_map(tetrahedra).collect()
}

/// The tree as it grows.
struct Tree {
    places: [Vec<f64>; 3],
    cells: [usize; 3],
    nodes: Vec<Node>,
}

impl Tree {
    /// Adds the nodes of some cells, from a first one up to an end; the index of the first node.
    fn divide(&mut self, [from, to]: [[usize; 3]; 2]) -> i32 {
        let lengths = [0, 1, 2].map(|k| to[k] - from[k]);
        let Some(axis) = (0..3).filter(|k| lengths[*k] > 1).max_by_key(|k| lengths[*k]) else {
            return self.cell(from);
        };
        let middle = from[axis] + lengths[axis] / 2;
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        let own = self.push(normal, self.places[axis][middle]);
        let (mut end, mut start) = (to, from);
        (end[axis], start[axis]) = (middle, middle);
        let under = self.divide([from, end]);
        let over = self.divide([start, to]);
        self.join(own, over, under)
    }

    /// Adds the nodes of a cell: along which axes a place in it is farther, in shares of the cell.
    fn cell(&mut self, at: [usize; 3]) -> i32 {
        let index = (at[2] * self.cells[1] + at[1]) * self.cells[0] + at[0];
        let leaf = |order: usize| FIRST_LEAF - (ORDERS.len() * index + order) as i32;
        // Whether the place is farther along one axis than along another.
        let [xy, yz, xz] = [[0, 1], [1, 2], [0, 2]];
        let own = self.farther(at, xy);
        let first = self.farther(at, yz);
        let second = self.farther(at, xz);
        self.join(second, leaf(1), leaf(2));
        self.join(first, leaf(0), second);
        let third = self.farther(at, xz);
        let fourth = self.farther(at, yz);
        self.join(fourth, leaf(4), leaf(5));
        self.join(third, leaf(3), fourth);
        self.join(own, first, third)
    }

    /// Adds a node over whose plane a place in a cell is farther along the first of two axes.
    fn farther(&mut self, at: [usize; 3], [one, other]: [usize; 2]) -> i32 {
        let start = |axis: usize| self.places[axis][at[axis]];
        let length = |axis: usize| self.places[axis][at[axis] + 1] - start(axis);
        let mut normal = [0.0; 3];
        normal[one] = length(other);
        normal[other] = -length(one);
        let norm = (normal[one] * normal[one] + normal[other] * normal[other]).sqrt();
        let normal = normal.map(|x| x / norm);
        let distance = normal[one] * start(one) + normal[other] * start(other);
        self.push(normal, distance)
    }

    /// Adds a node without what is over and under it, and returns its index.
    fn push(&mut self, normal: [f64; 3], distance: f64) -> i32 {
        let normal = normal.map(|x| x as f32);
        self.nodes.push(Node { normal, distance: distance as f32, over: 0, under: 0 });
        self.nodes.len() as i32 - 1
    }

    /// Sets what is over and under a node, and returns its index.
    fn join(&mut self, node: i32, over: i32, under: i32) -> i32 {
        if let Some(own) = usize::try_from(node).ok().and_then(|node| self.nodes.get_mut(node)) {
            (own.over, own.under) = (over, under);
        }
        node
    }
}

#[cfg(test)]
mod tests {
    use probes::Volume;

    use super::capture::reader::{shaded, tap};
    use super::*;
    use crate::export_probes::axes::Rows;
    use crate::testkit::{bright_rows, direction, even_light, exact, noise};

    fn volume(lattice: Lattice) -> Volume {
        Volume::new("hall".into(), [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]], [5, 3, 4], lattice).unwrap()
    }

    /// Light that changes evenly over the room is that light wherever an object stands, up to where the outer
    /// probes are.
    #[test]
    fn the_tap_and_the_shader_show_even_light() {
        for lattice in [Lattice::Centres, Lattice::Corners] {
            let volume = volume(lattice);
            let light = even_light();
            let place = |index| volume.position(volume.cell(index));
            let rows: Vec<Rows> = (0..volume.len()).map(|index| light(place(index).map(f64::from))).collect();
            let valid = vec![true; volume.len()];
            let capture = Capture::new(&LitVolume { volume: &volume, rows: &rows, valid: &valid }).unwrap();
            let [least, most] = [place(0), place(volume.len() - 1)];
            for k in 0..400 {
                let at = [0, 1, 2].map(|axis| {
                    let [least, most] = [volume.bounds[0][axis], volume.bounds[1][axis]];
                    least + (0.5 + 0.5 * noise(900 * axis + k)) * (most - least)
                });
                let in_file = OF_FILES.vector(at).map(|x| x as f32);
                let (sh, weights) = tap(&capture, in_file);
                assert!(weights.iter().all(|weight| *weight > -1e-4), "{at:?} is not in {weights:?}");
                let normal = direction(k);
                let found = shaded(&sh, OF_FILES.vector(normal.map(|x| x as f32)));
                let clamped = [0, 1, 2].map(|axis| f64::from(at[axis].clamp(least[axis], most[axis])));
                let expected = exact(&light(clamped), normal);
                for channel in 0..3 {
                    let error = (found[channel] - expected[channel]).abs();
                    assert!(error < 1e-4, "{lattice:?} {at:?}: {found:?} {expected:?}");
                }
            }
        }
    }

    /// At a probe, an object has its light, whatever that of the others is.
    #[test]
    fn an_object_at_a_probe_has_its_light() {
        let volume = volume(Lattice::Corners);
        let rows = bright_rows(volume.len());
        let valid = vec![true; volume.len()];
        let capture = Capture::new(&LitVolume { volume: &volume, rows: &rows, valid: &valid }).unwrap();
        assert_eq!((capture.points.len(), capture.tetrahedra.len()), (60, 6 * 4 * 2 * 3));
        for (index, rows) in rows.iter().enumerate() {
            let at = OF_FILES.vector(volume.position(volume.cell(index))).map(|x| x as f32);
            let normal = direction(index);
            let found = shaded(&tap(&capture, at).0, OF_FILES.vector(normal.map(|x| x as f32)));
            let expected = exact(rows, normal);
            for channel in 0..3 {
                assert!((found[channel] - expected[channel]).abs() < 1e-4, "{found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn the_resource_has_all_numbers() {
        let volume = volume(Lattice::Centres);
        let rows = bright_rows(volume.len());
        let valid = vec![true; volume.len()];
        let capture = Capture::new(&LitVolume { volume: &volume, rows: &rows, valid: &valid }).unwrap();
        let text = capture.text().unwrap();
        let count = |key: &str| {
            let line = text.lines().find(|line| line.starts_with(&format!("\"{key}\""))).unwrap();
            line.split(['(', ')']).nth(1).unwrap().split(", ").count()
        };
        let (points, cells) = (7 * 5 * 6, 6 * 4 * 5);
        assert_eq!(count("bounds"), 6);
        assert_eq!((count("points"), count("sh")), (3 * points, 36 * points));
        assert_eq!((count("tetrahedra"), count("bsp")), (24 * cells, 6 * (cells - 1 + 5 * cells)));
    }
}
