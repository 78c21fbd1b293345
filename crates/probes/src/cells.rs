//! Cells of space: which of them rays cross, and what is in each.

use glam::Vec3;
use sh::{Stop, Stopped};

use crate::random::{hash, hash_of};
use crate::surfaces::Surfaces;

/// The cells along each axis. The outer ones reach to infinity.
const SIDE: usize = 32;

/// The cells along each axis of the box that the grid is made for: the outer ones are beyond it.
const CELLS_OF_BOX: f32 = 28.0;

/// How far the grid reaches beyond its box at each end, as a share of it, for the walls around the probes.
const GRID_MARGIN: f32 = 0.125;

/// How far surfaces reach beyond their boxes, in cells and as a share of their size: rays hit triangles a
/// little beyond their edges, and cross cells as exactly as single precision allows.
const SURFACE_MARGIN: f32 = 1.0 / 64.0;
const MARGIN_OF_SIZE: f32 = 1e-4;

/// The triangles between two questions whether to stop.
const BETWEEN_CHECKS: usize = 256;

/// The words of a set of cells.
pub(crate) const WORDS: usize = SIDE * SIDE * SIDE / 64;

/// All of space, divided into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellGrid {
    /// The corner between the outer cells and the others.
    least: Vec3,
    /// The cells in a metre.
    scale: Vec3,
}

/// A set of cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CellSet(Box<[u64; WORDS]>);

impl CellGrid {
    /// The cells for probes in a box. A box that is a little larger has the same ones.
    pub(crate) fn new([least, most]: [[f32; 3]; 2]) -> Self {
        let extent = (Vec3::from(most) - Vec3::from(least)).max(Vec3::ZERO);
        let extent = extent.max(Vec3::splat((1e-2 * extent.max_element()).max(1e-3)));
        let size = (extent * ((1.0 + 2.0 * GRID_MARGIN) / CELLS_OF_BOX)).map(round_up);
        let first = (Vec3::from(least) - GRID_MARGIN * extent) / size;
        Self { least: first.map(f32::floor) * size, scale: size.recip() }
    }

    /// A place, in cells.
    fn in_cells(&self, at: Vec3) -> [f32; 3] {
        ((at - self.least) * self.scale + Vec3::ONE).to_array()
    }

    /// The number of a cell.
    fn number([x, y, z]: [usize; 3]) -> usize {
        (z * SIDE + y) * SIDE + x
    }

    /// The cell of a place.
    pub(crate) fn cell_of(&self, at: Vec3) -> usize {
        Self::number(self.in_cells(at).map(along))
    }

    /// The cells in which a box is.
    fn cells_of(&self, least: Vec3, most: Vec3) -> impl Iterator<Item = usize> + use<> {
        let [first, last] = [least, most].map(|corner| self.in_cells(corner).map(along));
        let lines = (first[2]..=last[2]).flat_map(move |z| (first[1]..=last[1]).map(move |y| (y, z)));
        lines.flat_map(move |(y, z)| (first[0]..=last[0]).map(move |x| Self::number([x, y, z])))
    }

    /// A hash of the surfaces in each cell, by a hash of each triangle; 0 where there are none.
    ///
    /// # Errors
    /// If it was stopped.
    pub(crate) fn contents(
        &self,
        surfaces: &Surfaces<'_>,
        digests: &[u64],
        stop: Stop<'_>,
    ) -> Result<Vec<u64>, Stopped> {
        let mut contents = vec![0; 64 * WORDS];
        let wider = SURFACE_MARGIN * self.scale.recip();
        for (index, (corners, digest)) in surfaces.parts.triangles.iter().zip(digests).enumerate() {
            if index % BETWEEN_CHECKS == 0 {
                stop.check()?;
            }
            let [a, b, c] = corners.map(Vec3::from);
            let (least, most) = (a.min(b).min(c), a.max(b).max(c));
            let wider = wider + MARGIN_OF_SIZE * (most - least);
            for cell in self.cells_of(least - wider, most + wider) {
                contents[cell] = hash(contents[cell] ^ digest);
            }
        }
        Ok(contents)
    }

    /// A hash of the grid.
    pub(crate) fn digest(&self) -> u64 {
        hash_of(0, self.least.to_array().into_iter().chain(self.scale.to_array()))
    }
}

/// The cell along an axis.
fn along(at: f32) -> usize {
    (at.max(0.0) as usize).min(SIDE - 1)
}

/// The least number of three binary digits that is not smaller.
fn round_up(x: f32) -> f32 {
    const DROPPED: u32 = (1 << 21) - 1;
    f32::from_bits((x.to_bits() + DROPPED) & !DROPPED)
}

impl CellSet {
    pub(crate) fn new() -> Self {
        Self(Box::new([0; WORDS]))
    }

    /// The set with these words; `None` if there are not [`WORDS`].
    pub(crate) fn of_words(words: &[u64]) -> Option<Self> {
        words.try_into().ok().map(|words| Self(Box::new(words)))
    }

    pub(crate) fn words(&self) -> &[u64] {
        &self.0[..]
    }

    /// The cells in which two scenes differ.
    pub(crate) fn different(one: &[u64], other: &[u64]) -> Self {
        let mut set = Self::new();
        for (cell, (one, other)) in one.iter().zip(other).enumerate() {
            if one != other {
                set.add(cell);
            }
        }
        set
    }

    #[inline]
    fn add(&mut self, cell: usize) {
        self.0[cell / 64 % WORDS] |= 1 << (cell % 64);
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0.iter()).for_each(|(own, other)| *own |= other);
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.0.iter().zip(other.0.iter()).any(|(own, other)| own & other != 0)
    }

    /// Adds the cells in which a box is.
    pub(crate) fn add_box(&mut self, grid: &CellGrid, least: Vec3, most: Vec3) {
        let [first, last] = [least, most].map(|corner| grid.in_cells(corner).map(along));
        // The cells along x are half a word.
        let line = (u64::MAX >> (63 - (last[0] - first[0]))) << first[0];
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                let start = CellGrid::number([0, y, z]);
                self.0[start / 64 % WORDS] |= line << (start % 64);
            }
        }
    }

    /// Adds the cells that a ray crosses up to a distance (Amanatides and Woo, "A fast voxel traversal
    /// algorithm for ray tracing", 1987).
    pub(crate) fn add_ray(&mut self, grid: &CellGrid, origin: Vec3, direction: Vec3, distance: f32) {
        const STRIDES: [usize; 3] = [1, SIDE, SIDE * SIDE];
        let (from, way) = (grid.in_cells(origin), (direction * grid.scale).to_array());
        let at = from.map(along);
        let mut cell = CellGrid::number(at);
        // For each axis how many cells there are on the way, how far it is to the next one, and from one to
        // another. The last one has no end.
        let mut left = [0, 1, 2].map(|k| if way[k] > 0.0 { SIDE - 1 - at[k] } else { at[k] });
        let border = |k: usize| (if way[k] > 0.0 { at[k] + 1 } else { at[k] }) as f32;
        let mut next = [0, 1, 2].map(|k| match left[k] {
            0 => f32::INFINITY,
            _ if way[k] == 0.0 => f32::INFINITY,
            _ => (border(k) - from[k]) / way[k],
        });
        let step = way.map(|way| 1.0 / way.abs());
        let strides = [0, 1, 2].map(|k| if way[k] > 0.0 { STRIDES[k] } else { STRIDES[k].wrapping_neg() });
        let distance = distance.min(f32::MAX);
        loop {
            self.add(cell);
            let axis = if next[0] <= next[1] { 0 } else { 1 };
            let axis = if next[2] < next[axis] { 2 } else { axis };
            if next[axis] > distance {
                return;
            }
            cell = cell.wrapping_add(strides[axis]);
            left[axis] -= 1;
            next[axis] = if left[axis] == 0 { f32::INFINITY } else { next[axis] + step[axis] };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::share_of;

    /// The cells of a ray are those of places along it.
    #[test]
    fn a_ray_crosses_the_cells_of_its_places() {
        let grid = CellGrid::new([[-3.0, 2.0, 0.0], [5.0, 2.5, 2.0]]);
        let mut seed = 1;
        let mut next = |least: f32, most: f32| {
            seed = hash(seed);
            least + (most - least) * share_of(seed)
        };
        for ray in 0..500 {
            let origin = Vec3::new(next(-6.0, 8.0), next(1.0, 4.0), next(-1.0, 4.0));
            let mut direction = Vec3::new(next(-1.0, 1.0), next(-1.0, 1.0), next(-1.0, 1.0)).normalize();
            if ray % 5 == 0 {
                direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][ray / 5 % 3];
            }
            let distance = if ray % 7 == 0 { f32::INFINITY } else { next(0.0, 6.0) };
            let mut crossed = CellSet::new();
            crossed.add_ray(&grid, origin, direction, distance);
            let mut places = CellSet::new();
            let steps = 20_000;
            for step in 0..=steps {
                places.add(
                    grid.cell_of(origin + direction * (distance.min(40.0) * step as f32 / steps as f32)),
                );
            }
            let count = |set: &CellSet| set.words().iter().map(|word| word.count_ones()).sum::<u32>();
            let mut both = crossed.clone();
            both.join(&places);
            // A corner of a cell may lie between two places, or on the other side of a rounding.
            assert!(count(&both) - count(&crossed) <= 1, "{ray}: {}", count(&both) - count(&crossed));
            let is_finite = distance.is_finite();
            assert!(
                !is_finite || count(&both) - count(&places) <= 2,
                "{ray}: {}",
                count(&both) - count(&places)
            );
        }
    }

    #[test]
    fn a_box_has_the_cells_of_its_places() {
        let grid = CellGrid::new([[0.0; 3], [28.0; 3]]);
        for (least, most) in [
            (Vec3::new(3.2, 4.1, 5.3), Vec3::new(3.3, 4.2, 5.4)),
            (Vec3::new(-9.0, 7.5, 20.0), Vec3::new(90.0, 12.5, 21.5)),
            (Vec3::new(1.0, 2.0, 3.0), Vec3::new(14.0, 2.0, 9.0)),
            (Vec3::splat(-100.0), Vec3::splat(100.0)),
        ] {
            let (mut set, mut expected) = (CellSet::new(), CellSet::new());
            set.add_box(&grid, least, most);
            grid.cells_of(least, most).for_each(|cell| expected.add(cell));
            assert_eq!(set, expected);
        }
    }

    #[test]
    fn a_box_that_is_a_little_larger_has_the_same_cells() {
        let grid = CellGrid::new([[0.0; 3], [10.0, 4.0, 3.0]]);
        assert_eq!(CellGrid::new([[0.0; 3], [10.01, 4.0, 3.01]]), grid);
        assert_ne!(CellGrid::new([[0.0; 3], [20.0, 4.0, 3.0]]), grid);
        // The box is within the inner cells, with a cell beyond it at each end.
        for (at, least) in [(Vec3::ZERO, true), (Vec3::new(10.0, 4.0, 3.0), false)] {
            for x in grid.in_cells(at) {
                assert!(if least { (2.0..6.0).contains(&x) } else { (20.0..30.0).contains(&x) }, "{x}");
            }
        }
    }
}
