//! Delaunay tetrahedra of points in a box, in whole numbers, so that nothing is rounded.
//!
//! Points are added one by one (Bowyer 1981, Watson 1981): the tetrahedra whose sphere holds a new point go,
//! and those between the faces around them and the point come. All signs are exact. No tetrahedron is flat,
//! therefore, and together they fill the box, also if points are on one plane or on one sphere.
//!
//! Points of grids and octrees are: the eight corners of a cell lie on a sphere. The square of a length is
//! sheared a little for that reason: x x + y y + z z - (x y + y z + z x) / 16. There is then one best way to
//! divide the cells of a grid, along the diagonal (Kuhn), whose faces lie on few planes, and no four points
//! that are almost on a plane make a thin tetrahedron because coordinates were rounded.

use std::cmp::Reverse;

use sh::{Stop, Stopped};

/// The divisor of the products in the square of a length.
const SHEAR: i64 = 16;

/// The points that are added between two questions whether to stop.
const BETWEEN_CHECKS: usize = 256;

/// A place in whole numbers.
pub type WholePlace = [i64; 3];

/// Tetrahedra that fill a box and have some points in it as corners.
#[derive(Clone, Debug)]
pub struct Tetrahedra {
    places: Vec<WholePlace>,
    corners: Vec<[u32; 4]>,
    /// The tetrahedron beyond each face, or [`Self::NOTHING`].
    beyond: Vec<[u32; 4]>,
    /// The indices that no tetrahedron has for the time being.
    free: Vec<usize>,
    points: Vec<u32>,
}

/// A face around the removed tetrahedra: its corners, what is beyond it, and which face of that it is.
struct Around {
    corners: [u32; 3],
    beyond: u32,
    face: usize,
}

impl Tetrahedra {
    /// The largest coordinate: determinants then fit in 128 bits.
    pub const SIDE: i64 = 1 << 23;

    /// What is beyond a face of the box.
    pub const NOTHING: u32 = u32::MAX;

    /// The corners of each face of a tetrahedron. The other corner, which has the number of the face, is on
    /// the side of its normal (b - a) x (c - a).
    pub const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];

    /// The tetrahedra of points in a box from 0 to `size`.
    ///
    /// The longest side of the box is at most [`Self::SIDE`] and five times the shortest. No point is on its
    /// surface or beyond. Points at the same place are one. The result depends on the order of the points.
    ///
    /// `None` if there are more than `most` tetrahedra.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn new(
        size: WholePlace,
        points: &[WholePlace],
        most: usize,
        stop: Stop<'_>,
    ) -> Result<Option<Self>, Stopped> {
        let mut all = Self::of_box(size);
        // Each second point, each second of the others, and so on, last ones first: a point that is added
        // beside all others would be in the spheres of many tetrahedra.
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|point| (Reverse(point.trailing_zeros()), *point));
        all.points = vec![0; points.len()];
        let (mut near, mut marks) = (0, vec![0; all.corners.len()]);
        for (count, point) in order.into_iter().enumerate() {
            if count % BETWEEN_CHECKS == 0 {
                stop.check()?;
            }
            if all.corners.len() - all.free.len() > most {
                return Ok(None);
            }
            let place = points[point];
            near = all.holding(place, near);
            let known = all.corners[near].into_iter().find(|corner| all.places[*corner as usize] == place);
            all.points[point] = known.unwrap_or(all.places.len() as u32);
            if known.is_none() {
                near = all.insert(place, near, &mut marks);
            }
        }
        all.close_gaps();
        Ok(Some(all).filter(|all| all.len() <= most))
    }

    /// The tetrahedra of a box without points: six along its diagonal.
    fn of_box(size: WholePlace) -> Self {
        let place = |corner: usize| [0, 1, 2].map(|k| size[k] * (corner >> k & 1) as i64);
        let places: Vec<WholePlace> = (0..8).map(place).collect();
        let axes = [0, 1, 2].into_iter().flat_map(|first| [1, 2].map(|more| (first, (first + more) % 3)));
        let tetrahedron = |(first, second): (u32, u32)| {
            let corners = [0, 1 << first, 1 << first | 1 << second, 7];
            let [a, b, c, d] = corners.map(|corner| corner as u32);
            if volume(corners.map(|corner| places[corner])) > 0 { [a, b, c, d] } else { [a, c, b, d] }
        };
        let corners: Vec<[u32; 4]> = axes.map(tetrahedron).collect();
        let count = corners.len();
        let beyond = vec![[Self::NOTHING; 4]; count];
        let mut all = Self { places, corners, beyond, free: Vec::new(), points: Vec::new() };
        all.link((0..count).flat_map(|tetrahedron| (0..4).map(move |face| (tetrahedron, face))));
        all
    }

    /// The number of tetrahedra.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Whether there are none, which never happens.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The places of all corners: the eight of the box, x fastest, and then those of the points.
    pub fn places(&self) -> &[WholePlace] {
        &self.places
    }

    /// The index in [`Self::places`] of each point.
    pub fn points(&self) -> &[u32] {
        &self.points
    }

    /// The indices in [`Self::places`] of the corners of each tetrahedron.
    pub fn corners(&self) -> &[[u32; 4]] {
        &self.corners
    }

    /// The tetrahedron beyond each of [`Self::FACES`] of a tetrahedron, or [`Self::NOTHING`].
    pub fn beyond(&self, tetrahedron: usize) -> [u32; 4] {
        self.beyond[tetrahedron]
    }

    /// The places of the corners of a tetrahedron.
    pub fn at(&self, tetrahedron: usize) -> [WholePlace; 4] {
        self.corners[tetrahedron].map(|corner| self.places[corner as usize])
    }

    /// The tetrahedron that holds a point, by a walk through faces that the point is beyond. Among Delaunay
    /// tetrahedra, such a walk does not return.
    fn holding(&self, point: WholePlace, mut near: usize) -> usize {
        loop {
            let at = self.at(near);
            let is_beyond = |face: &usize| {
                let [a, b, c] = Self::FACES[*face].map(|corner| at[corner]);
                volume([a, b, c, point]) < 0
            };
            match (0..4).find(is_beyond).map(|face| self.beyond[near][face]) {
                Some(next) if next != Self::NOTHING => near = next as usize,
                _ => return near,
            }
        }
    }

    /// Adds a point that a tetrahedron holds; the index of a tetrahedron at the point.
    ///
    /// A tetrahedron is marked with the index of the last point whose place its sphere holds.
    fn insert(&mut self, point: WholePlace, near: usize, marks: &mut Vec<usize>) -> usize {
        let own = self.places.len();
        self.places.push(point);
        marks[near] = own;
        let (mut removed, mut around, mut next) = (vec![near], Vec::new(), 0);
        while let Some(&tetrahedron) = removed.get(next) {
            next += 1;
            for (face, beyond) in self.beyond[tetrahedron].into_iter().enumerate() {
                let corners = Self::FACES[face].map(|corner| self.corners[tetrahedron][corner]);
                if beyond == Self::NOTHING {
                    around.push(Around { corners, beyond, face: 0 });
                    continue;
                }
                let other = beyond as usize;
                if marks[other] == own {
                    continue;
                }
                if is_in_sphere(self.at(other), point) {
                    marks[other] = own;
                    removed.push(other);
                    continue;
                }
                let back = self.beyond[other].iter().position(|back| *back == tetrahedron as u32);
                around.push(Around { corners, beyond, face: back.unwrap_or(0) });
            }
        }
        // New tetrahedra take the indices of removed ones.
        self.free.extend(removed);
        while self.free.len() < around.len() {
            self.free.push(self.corners.len());
            self.corners.push([0; 4]);
            self.beyond.push([Self::NOTHING; 4]);
            marks.push(0);
        }
        let added = self.free.split_off(self.free.len() - around.len());
        for (tetrahedron, Around { corners: [a, b, c], beyond, face }) in added.iter().zip(around) {
            self.corners[*tetrahedron] = [a, b, c, own as u32];
            self.beyond[*tetrahedron] = [Self::NOTHING, Self::NOTHING, Self::NOTHING, beyond];
            if beyond != Self::NOTHING {
                self.beyond[beyond as usize][face] = *tetrahedron as u32;
            }
        }
        self.link(added.iter().flat_map(|tetrahedron| (0..3).map(move |face| (*tetrahedron, face))));
        added[0]
    }

    /// Links those of some faces that have the same corners.
    fn link(&mut self, faces: impl Iterator<Item = (usize, usize)>) {
        let named = |(tetrahedron, face): (usize, usize)| {
            let mut corners = Self::FACES[face].map(|corner| self.corners[tetrahedron][corner]);
            corners.sort_unstable();
            (corners, tetrahedron, face)
        };
        let mut faces: Vec<_> = faces.map(named).collect();
        faces.sort_unstable();
        for pair in faces.windows(2) {
            let [(one, first, face), (other, second, back)] = [pair[0], pair[1]];
            if one == other {
                self.beyond[first][face] = second as u32;
                self.beyond[second][back] = first as u32;
            }
        }
    }

    /// Gives the indices that are free to the last tetrahedra.
    fn close_gaps(&mut self) {
        self.free.sort_unstable();
        while let Some(gap) = self.free.pop() {
            self.corners.swap_remove(gap);
            self.beyond.swap_remove(gap);
            let last = self.corners.len() as u32;
            for beyond in self.beyond.get(gap).copied().into_iter().flatten() {
                for back in self.beyond.get_mut(beyond as usize).into_iter().flatten() {
                    if *back == last {
                        *back = gap as u32;
                    }
                }
            }
        }
    }
}

fn minus(one: WholePlace, other: WholePlace) -> WholePlace {
    [0, 1, 2].map(|k| one[k] - other[k])
}

fn determinant([a, b, c]: [WholePlace; 3]) -> i128 {
    let minor = |i: usize, j: usize| i128::from(b[i] * c[j] - b[j] * c[i]);
    i128::from(a[0]) * minor(1, 2) - i128::from(a[1]) * minor(0, 2) + i128::from(a[2]) * minor(0, 1)
}

/// Six times the volume of a tetrahedron, above 0 if the last corner is on the side of (b - a) x (c - a).
fn volume([a, b, c, d]: [WholePlace; 4]) -> i128 {
    determinant([b, c, d].map(|corner| minus(corner, a)))
}

/// Whether a point is in the sphere around a tetrahedron, and not on it.
fn is_in_sphere(corners: [WholePlace; 4], point: WholePlace) -> bool {
    let corners = corners.map(|corner| minus(corner, point));
    let share = |k: usize| {
        let [x, y, z] = corners[k];
        let square = SHEAR * (x * x + y * y + z * z) - (x * y + y * z + z * x);
        i128::from(square) * determinant(Tetrahedra::FACES[k].map(|corner| corners[corner]))
    };
    share(0) + share(1) + share(2) + share(3) < 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(k: usize, most: i64) -> i64 {
        1 + (crate::random::share_of(crate::random::hash(k as u64)) as f64 * (most - 2) as f64) as i64
    }

    /// Checks that tetrahedra fill the box, are linked with those beyond their faces, have all points as
    /// corners, and hold no point in their spheres, which says that two of them have nothing in common.
    fn check(size: WholePlace, points: &[WholePlace]) -> Tetrahedra {
        let all = Tetrahedra::new(size, points, usize::MAX, Stop::NEVER).unwrap().unwrap();
        let whole = 6 * size.map(i128::from).iter().product::<i128>();
        assert_eq!((0..all.len()).map(|own| volume(all.at(own))).sum::<i128>(), whole);
        let mut is_corner = vec![false; all.places().len()];
        for own in 0..all.len() {
            assert!(volume(all.at(own)) > 0, "none is flat or turned");
            all.corners()[own].iter().for_each(|corner| is_corner[*corner as usize] = true);
            for (face, beyond) in all.beyond(own).into_iter().enumerate() {
                let mut corners = Tetrahedra::FACES[face].map(|corner| all.corners()[own][corner]);
                corners.sort_unstable();
                if beyond == Tetrahedra::NOTHING {
                    let is_on =
                        |k: usize, at: i64| corners.iter().all(|c| all.places()[*c as usize][k] == at);
                    assert!((0..3).any(|k| is_on(k, 0) || is_on(k, size[k])), "a face of the box");
                    continue;
                }
                let other = beyond as usize;
                let back = all.beyond(other).iter().position(|back| *back as usize == own).unwrap();
                let mut same = Tetrahedra::FACES[back].map(|corner| all.corners()[other][corner]);
                same.sort_unstable();
                assert_eq!(corners, same);
                let apex = all.places()[all.corners()[other][back] as usize];
                assert!(!is_in_sphere(all.at(own), apex));
            }
        }
        assert!(is_corner.into_iter().all(|is| is));
        for (point, index) in points.iter().zip(all.points()) {
            assert_eq!(all.places()[*index as usize], *point);
        }
        let mut unique = points.to_vec();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(all.places().len(), 8 + unique.len());
        all
    }

    #[test]
    fn tetrahedra_fill_the_box_and_have_all_points_as_corners() {
        let side = Tetrahedra::SIDE;
        for size in [[side; 3], [side, side / 5, side / 2], [7, 9, 5]] {
            assert_eq!(check(size, &[]).len(), 6);
            assert!(Tetrahedra::new(size, &[], 5, Stop::NEVER).unwrap().is_none());
            for count in [1, 2, 3, 4, 50, 400] {
                let place = |k: usize| [0, 1, 2].map(|axis| number(3 * k + axis, size[axis]));
                check(size, &(0..count).map(place).collect::<Vec<_>>());
            }
        }
    }

    /// Points on a line, on a plane, on a sphere, of a grid, and most of them twice.
    #[test]
    fn points_may_be_on_a_line_a_plane_or_a_sphere() {
        let size = [1 << 20; 3];
        let line: Vec<WholePlace> = (1..100).map(|k| [k * 7, k * 5, 400 + k]).collect();
        let axis: Vec<WholePlace> = (1..100).map(|k| [500, k * 1000, 600]).collect();
        let plane: Vec<WholePlace> = (0..200).map(|k| [1 + k % 20 * 3000, 77, 1 + k / 20 * 3000]).collect();
        let slanted: Vec<WholePlace> = plane.iter().map(|[x, _, z]| [*x, 2 * x + 3 * z, *z]).collect();
        let grid = |step: i64| (0..512).map(move |k| [k % 8, k / 8 % 8, k / 64].map(|k| 1000 + k * step));
        let squares = |a: i64, b: i64, c: i64| a * a + b * b + c * c == 81;
        let cube = || (0..19 * 19 * 19).map(|k: i64| [k % 19 - 9, k / 19 % 19 - 9, k / 361 - 9]);
        let sphere: Vec<WholePlace> = cube()
            .filter(|[a, b, c]| squares(*a, *b, *c))
            .map(|place| place.map(|x| 5000 + 64 * x))
            .collect();
        assert!(sphere.len() > 90);
        let grid_twice: Vec<WholePlace> = grid(512).chain(grid(1024)).collect();
        for points in [line, axis, plane, slanted, sphere, grid(1000).collect(), grid_twice] {
            check(size, &points);
        }
    }

    /// The cells of a grid are divided along the diagonal, whatever their sides, and also if coordinates are
    /// rounded.
    #[test]
    fn the_cells_of_a_grid_are_divided_alike() {
        for sides in [[1000.0; 3], [1000.3, 2000.7, 3000.9]] {
            let place = |k: usize| {
                let at = [k % 6, k / 6 % 6, k / 36];
                [0, 1, 2].map(|axis| 30_000 + (sides[axis] * at[axis] as f64).round() as i64)
            };
            let all = check([60_000; 3], &(0..216).map(place).collect::<Vec<_>>());
            let is_inner = |corners: &&[u32; 4]| corners.iter().all(|corner| *corner >= 8);
            assert_eq!(all.corners().iter().filter(is_inner).count(), 6 * 125);
        }
    }
}
