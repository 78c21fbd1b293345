//! The capture of probes at any places: Delaunay tetrahedra in a box around them.
//!
//! Godot does not clamp. What is outside of the tetrahedra gets too much light or, by an empty leaf of the
//! tree, none. Godot's own baker therefore bakes a probe at each corner of the bounds. Here each corner has
//! the light of the nearest probe, and the corners are far away: an object beside the outer probes has the
//! light of these.

use engine::Failure;
use probes::{Cut, Side, Tetrahedra, WholePlace, plane_tree};
use sh::Stop;

use super::capture::{Capture, FIRST_LEAF, MOST_TETRAHEDRA, Node, nine_colours};
use crate::export_probes::axes::{OF_FILES, Rows};

/// The most probes: 35 MB of text if they are of an octree, and 145 MB at random places.
const MOST_PROBES: usize = 1 << 15;

/// How far around the probes objects are expected: in metres, and in shares of the longest distance of probes
/// along an axis.
const MARGIN: f64 = 1.0;
const MARGIN_SHARE: f64 = 0.125;

/// The size of the box, in sizes of the box in which objects are expected. There are versions of Godot that
/// leave objects without light from (sqrt(3) - 1) / 2 of the way from the middle of the bounds to the lowest
/// corner.
const GROWTH: f64 = 2.75;

impl Capture {
    /// The capture of probes at some places of ours. If several are at one place, the first one counts.
    ///
    /// # Errors
    /// If there are too many, or it was stopped.
    pub(super) fn of_points(places: &[[f32; 3]], rows: &[Rows], stop: Stop<'_>) -> Result<Self, Failure> {
        if places.len() > MOST_PROBES {
            let count = places.len();
            let message = format!("points.tres would have {count} probes, and {MOST_PROBES} are the most");
            return Err(Failure::new(message).help(
                "place probes farther apart or, if most of them are in volumes, the points in another stage",
            ));
        }
        let places: Vec<[f64; 3]> = places.iter().map(|place| OF_FILES.vector(*place)).collect();
        let steps = Steps::around(&places);
        let places: Vec<WholePlace> = places.iter().map(|place| steps.place(*place)).collect();
        let Some(all) = Tetrahedra::new(steps.size, &places, MOST_TETRAHEDRA, stop)? else {
            let message = format!("points.tres would have more than {MOST_TETRAHEDRA} tetrahedra");
            return Err(Failure::new(message).help("use fewer points; long straight rows of them need most"));
        };
        let tree = plane_tree(&all, stop)?;

        let square =
            |one: WholePlace, other: WholePlace| (0..3).map(|k| (one[k] - other[k]).pow(2)).sum::<i64>();
        let nearest = |to: &WholePlace| (0..places.len()).min_by_key(|probe| square(places[*probe], *to));
        // The corners of the box are first. The others each have a probe at their place.
        let corners = all.places().iter().take(8);
        let mut probes: Vec<usize> = corners.map(|corner| nearest(corner).unwrap_or(0)).collect();
        probes.resize(all.places().len(), 0);
        for (probe, point) in all.points().iter().enumerate().rev() {
            probes[*point as usize] = probe;
        }
        let metres = |place: &WholePlace| steps.metres(place.map(|x| x as f64));
        Ok(Self {
            bounds: [metres(&[0; 3]), metres(&steps.size)],
            points: all.places().iter().map(|place| metres(place).map(|x| x as f32)).collect(),
            colours: probes.iter().map(|probe| nine_colours(&rows[*probe])).collect(),
            tetrahedra: all.corners().iter().map(|corners| corners.map(|corner| corner as usize)).collect(),
            tree: tree.iter().map(|cut| steps.node(cut)).collect(),
        })
    }
}

/// Steps of a power of two, by which coordinates are whole numbers: 0 where the box starts.
struct Steps {
    /// The length of one, in metres.
    length: f64,
    /// Where the box starts, in steps from the origin.
    start: [f64; 3],
    size: WholePlace,
}

impl Steps {
    /// The steps in the box around some places.
    fn around(places: &[[f64; 3]]) -> Self {
        let along = |k: usize| places.iter().map(move |place| place[k]);
        let ends = [0, 1, 2].map(|k| [along(k).reduce(f64::min), along(k).reduce(f64::max)]);
        let ends = ends.map(|ends| ends.map(|end| end.unwrap_or(0.0)));
        let longest = ends.iter().map(|[least, most]| most - least).fold(0.0, f64::max);
        let margin = MARGIN.max(MARGIN_SHARE * longest);
        let ends = ends.map(|[least, most]| {
            let half = GROWTH * (0.5 * (most - least) + margin);
            [-half, half].map(|half| 0.5 * (least + most) + half)
        });
        // Coordinates of 24 bits are 32-bit floats, also far away from the origin.
        let side = Tetrahedra::SIDE as f64;
        let longest = ends.iter().map(|[least, most]| most - least).fold(0.0, f64::max);
        let farthest = ends.as_flattened().iter().map(|end| end.abs()).fold(0.0, f64::max);
        let length = power_of_two((longest / (side - 2.0)).max(farthest / (2.0 * side - 1.0)));
        let start = ends.map(|[least, _]| (least / length).floor());
        let size = [0, 1, 2].map(|k| ((ends[k][1] / length).ceil() - start[k]) as i64);
        Self { length, start, size }
    }

    /// A place in steps.
    fn place(&self, metres: [f64; 3]) -> WholePlace {
        [0, 1, 2].map(|k| ((metres[k] / self.length).round() - self.start[k]) as i64)
    }

    fn metres(&self, place: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| (place[k] + self.start[k]) * self.length)
    }

    /// A node of the tree. Its distance fits the rounded normal at the face that the plane is of.
    fn node(&self, Cut { normal, at, over, under }: &Cut) -> Node {
        let normal = normal.map(|x| x as f32);
        let at = self.metres(*at);
        let distance = (0..3).map(|k| f64::from(normal[k]) * at[k]).sum::<f64>() as f32;
        let [over, under] = [over, under].map(|side| match side {
            Side::Node(index) => *index as i32,
            Side::Tetrahedron(index) => FIRST_LEAF - *index as i32,
        });
        Node { normal, distance, over, under }
    }
}

/// The least power of two that is not less than a number above 0.
fn power_of_two(number: f64) -> f64 {
    const FRACTION: u64 = (1 << (f64::MANTISSA_DIGITS - 1)) - 1;
    f64::from_bits((number.to_bits() + FRACTION) & !FRACTION)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export_probes::godot::capture::reader::{found, shaded, tap};
    use crate::testkit::{bright_rows, direction, even_light, exact, noise};

    fn capture(places: &[[f32; 3]], rows: &[Rows]) -> Capture {
        Capture::of_points(places, rows, Stop::NEVER).unwrap()
    }

    /// The middles of the leaves of an octree that is divided at a ball and at a slanted wall.
    fn octree() -> Vec<[f32; 3]> {
        fn add(middle: [f32; 3], size: f32, levels: u32, points: &mut Vec<[f32; 3]>) {
            let from_ball = middle.map(|x| (x - 1.7).powi(2)).iter().sum::<f32>().sqrt() - 1.2;
            let from_wall = 0.9 * (middle[0] - 0.3 * middle[1] - 0.4);
            if levels == 0 || from_ball.abs().min(from_wall.abs()) > 0.87 * size {
                points.push(middle);
                return;
            }
            for k in 0..8 {
                let side = [k & 1, k >> 1 & 1, k >> 2 & 1].map(|side| size * (0.5 * side as f32 - 0.25));
                add([0, 1, 2].map(|k| middle[k] + side[k]), 0.5 * size, levels - 1, points);
            }
        }
        let mut points = Vec::new();
        for cell in 0..27 {
            let at = [cell % 3, cell / 3 % 3, cell / 9].map(|k| 1.07 * (k as f32 + 0.5));
            add(at, 1.07, 2, &mut points);
        }
        points
    }

    /// A place between two others, by a number for each axis.
    fn between([least, most]: [[f64; 3]; 2], k: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis| {
            let share = 0.5 + 0.5 * f64::from(noise(5000 * axis + k));
            (least[axis] + share * (most[axis] - least[axis])) as f32
        })
    }

    #[test]
    fn an_object_at_a_probe_has_its_light() {
        let far = |place: [f32; 3]| [place[0] - 3000.0, place[1] + 500.0, place[2]];
        // Floats of 3 km are 0.2 mm apart.
        for (places, most) in [(octree(), 1e-4), (octree().into_iter().map(far).collect(), 1e-2)] {
            let rows = bright_rows(places.len());
            let capture = capture(&places, &rows);
            assert_eq!(capture.points.len(), 8 + places.len());
            for (index, (place, rows)) in places.iter().zip(&rows).enumerate() {
                let at = OF_FILES.vector(*place).map(|x| x as f32);
                let normal = direction(index);
                let found = shaded(&tap(&capture, at).0, OF_FILES.vector(normal.map(|x| x as f32)));
                let expected = exact(rows, normal);
                let error = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
                assert!(error < most, "{place:?}: {found:?} {expected:?}");
            }
        }
    }

    /// Light that changes evenly is that light between the probes.
    #[test]
    fn even_light_stays_even() {
        let random = (0..500).map(|k| [0, 1, 2].map(|axis| 2.0 * noise(700 * axis + k))).collect();
        for places in [octree(), random] {
            let light = even_light();
            let rows: Vec<Rows> = places.iter().map(|place| light(place.map(f64::from))).collect();
            let capture = capture(&places, &rows);
            let end = |take: fn(f32, f32) -> f32, axis: usize| {
                f64::from(places.iter().map(|place| place[axis]).reduce(take).unwrap())
            };
            let bounds =
                [f32::min, f32::max].map(|take: fn(f32, f32) -> f32| [0, 1, 2].map(|k| end(take, k)));
            let mut between_probes = 0;
            for k in 0..2000 {
                let at = between(bounds, k);
                let in_file = OF_FILES.vector(at).map(|x| x as f32);
                let (sh, weights) = tap(&capture, in_file);
                assert!(weights.iter().all(|weight| *weight > -1e-3), "{at:?} is not in {weights:?}");
                // The first points are the corners of the box.
                if found(&capture, in_file).iter().any(|corner| *corner < 8) {
                    continue;
                }
                between_probes += 1;
                let normal = direction(k);
                let shaded = shaded(&sh, OF_FILES.vector(normal.map(|x| x as f32)));
                let expected = exact(&light(at.map(f64::from)), normal);
                let error = (0..3).map(|k| (shaded[k] - expected[k]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-4, "{at:?}: {shaded:?} {expected:?}");
            }
            assert!(between_probes > 1500, "{between_probes}");
        }
    }

    /// Few points, and points on a line or a plane: wherever an object is, its light is between theirs.
    #[test]
    fn few_points_light_the_box() {
        let line = |count: usize| (0..count).map(|k| [1.0, 2.0 + 0.3 * k as f32, 1.5]).collect::<Vec<_>>();
        let slanted = (0..9).map(|k| [0.1 * k as f32, 0.7 - 0.3 * k as f32, 5.0 + 0.2 * k as f32]).collect();
        let plane = (0..80).map(|k| [(k % 8) as f32, (k / 8) as f32, 1.0]).collect();
        let cube = (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|x| x as f32)).collect();
        for places in [line(1), line(2), line(3), line(20), slanted, plane, cube] {
            let rows = bright_rows(places.len());
            let capture = capture(&places, &rows);
            for k in 0..500 {
                let (sh, weights) = tap(&capture, between(capture.bounds, k));
                assert!(weights.iter().all(|weight| *weight > -1e-3), "{weights:?}");
                let of = |colours: &Rows| f64::from(colours[0][1]);
                let least = capture.colours.iter().map(of).fold(f64::INFINITY, f64::min);
                let most = capture.colours.iter().map(of).fold(0.0, f64::max);
                assert!((0.999 * least..1.001 * most).contains(&sh[0][1]), "{least} {sh:?} {most}");
            }
        }
    }

    /// The first one of several probes at one place counts.
    #[test]
    fn probes_at_one_place_are_one() {
        let places = [[0.0; 3], [1.0; 3], [0.0; 3], [1.0; 3]];
        let rows = bright_rows(4);
        let capture = capture(&places, &rows);
        assert_eq!(capture.points.len(), 8 + 2);
        for (place, colours) in capture.points.iter().zip(&capture.colours).skip(8) {
            assert!(*colours == nine_colours(&rows[if place[0] < 0.5 { 0 } else { 1 }]), "{place:?}");
        }
    }

    /// The weight of `RendererSceneCull::_update_instance_lightmap_captures`, before it took absolute values.
    #[test]
    fn objects_around_the_probes_have_a_weight_in_all_versions() {
        for places in [vec![[1.0, 2.0, 3.0]], octree(), vec![[0.0; 3], [20.0, 4.0, 0.0]]] {
            let Capture { bounds: [least, most], .. } = capture(&places, &bright_rows(places.len()));
            let in_file: Vec<[f64; 3]> = places.iter().map(|place| OF_FILES.vector(*place)).collect();
            let end = |take: fn(f64, f64) -> f64, k: usize| {
                in_file.iter().map(|place| place[k]).reduce(take).unwrap()
            };
            for corner in 0..8 {
                let inner = [0, 1, 2].map(|k| {
                    let place =
                        if corner >> k & 1 == 0 { end(f64::min, k) - 1.0 } else { end(f64::max, k) + 1.0 };
                    (place - least[k]) / (most[k] - least[k]) * 2.0 - 1.0
                });
                let largest = inner.into_iter().fold(f64::NEG_INFINITY, f64::max);
                let length = inner.iter().map(|x| x * x).sum::<f64>().sqrt();
                let blend = length + (largest - length) * largest;
                assert!(blend * blend < 0.999, "{inner:?} {blend}");
            }
        }
    }

    #[test]
    fn too_many_points_are_refused() {
        let places = vec![[0.0; 3]; MOST_PROBES + 1];
        let failure = Capture::of_points(&places, &[], Stop::NEVER).map(|_| ()).unwrap_err();
        assert!(failure.to_string().starts_with("points.tres would have 32769 probes"), "{failure}");
        assert!(failure.help.unwrap().starts_with("place probes farther apart"));
    }
}
