//! Boxes with a regular grid of probes.

use glam::Vec3;

/// Where the probes of a box stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lattice {
    /// In the middle of each of the cells that divide the box.
    Centres,
    /// At the corners of the cells: the outer probes stand on the box.
    Corners,
}

/// A box with a regular grid of probes, along our axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Its name.
    pub name: String,
    /// The least and the greatest coordinates, in metres.
    pub bounds: [[f32; 3]; 2],
    /// The probes along x, y and z.
    pub counts: [usize; 3],
    /// Where they stand.
    pub lattice: Lattice,
}

/// The most probes of a volume along an axis: the largest texture of engines.
pub const MOST_ALONG: usize = 2048;

/// The most probes of a volume.
pub const MOST_PROBES: usize = 1 << 24;

/// The reason why a volume has no probes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// A side has no length, or is not finite.
    #[error("the box {0} is not one; expected finite coordinates, the least below the greatest")]
    Bounds(String),
    /// The spacing is not a number above 0.
    #[error("the spacing is {0} m; expected a number above 0")]
    Spacing(f32),
    /// There are too few probes along an axis, or too many.
    #[error(
        "the box {name} has {counts:?} probes along x, y and z; expected 1 to {MOST_ALONG} of cells' centres \
         and 2 to {MOST_ALONG} of corners, and {MOST_PROBES} in all; another spacing gives others"
    )]
    Counts {
        /// The name of the box.
        name: String,
        /// The probes along each axis.
        counts: [usize; 3],
    },
}

impl Volume {
    /// A checked volume.
    ///
    /// # Errors
    /// If the box has no inside, or there are too few probes or too many.
    pub fn new(
        name: String,
        bounds: [[f32; 3]; 2],
        counts: [usize; 3],
        lattice: Lattice,
    ) -> Result<Self, VolumeError> {
        let [least, most] = bounds;
        if !(0..3).all(|axis| least[axis] < most[axis] && (most[axis] - least[axis]).is_finite()) {
            return Err(VolumeError::Bounds(name));
        }
        let fewest = match lattice {
            Lattice::Centres => 1,
            Lattice::Corners => 2,
        };
        let are_right = counts.iter().all(|count| (fewest..=MOST_ALONG).contains(count));
        let all = counts.iter().fold(1_usize, |all, count| all.saturating_mul(*count));
        if !are_right || all > MOST_PROBES {
            return Err(VolumeError::Counts { name, counts });
        }
        Ok(Self { name, bounds, counts, lattice })
    }

    /// A volume whose probes are about so many metres apart along each axis.
    ///
    /// # Errors
    /// The errors of [`Volume::new`], and if the spacing is not above 0.
    pub fn with_spacing(
        name: String,
        bounds: [[f32; 3]; 2],
        spacing: f32,
        lattice: Lattice,
    ) -> Result<Self, VolumeError> {
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(VolumeError::Spacing(spacing));
        }
        let counts = [0, 1, 2].map(|axis| {
            let cells = ((bounds[1][axis] - bounds[0][axis]) / spacing).round().max(1.0) as usize;
            match lattice {
                Lattice::Centres => cells,
                Lattice::Corners => cells.saturating_add(1),
            }
        });
        Self::new(name, bounds, counts, lattice)
    }

    /// The number of probes.
    pub fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// Whether there are no probes, which never happens.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The distance between probes along each axis, in metres; of a single probe, the length of the box.
    pub fn spacing(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| {
            let length = self.bounds[1][axis] - self.bounds[0][axis];
            match self.lattice {
                Lattice::Centres => length / self.counts[axis] as f32,
                Lattice::Corners => length / (self.counts[axis] - 1).max(1) as f32,
            }
        })
    }

    /// The place of a probe in the grid; x changes fastest, then y.
    pub fn cell(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// The index of the probe at a place in the grid.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Where a probe stands, in metres.
    pub fn position(&self, cell: [usize; 3]) -> [f32; 3] {
        let shift = if self.lattice == Lattice::Centres { 0.5 } else { 0.0 };
        let spacing = self.spacing();
        [0, 1, 2].map(|axis| self.bounds[0][axis] + (cell[axis] as f32 + shift) * spacing[axis])
    }

    /// The neighbour of a probe in one of the 26 directions of [`neighbours`], if the grid has it.
    pub fn neighbour(&self, cell: [usize; 3], step: [i32; 3]) -> Option<usize> {
        let mut other = cell;
        for axis in 0..3 {
            other[axis] = cell[axis].checked_add_signed(step[axis] as isize)?;
            if other[axis] >= self.counts[axis] {
                return None;
            }
        }
        Some(self.index(other))
    }

    /// The cell between eight probes in which a point lies, and the point's place in it, each 0 to 1; a point
    /// outside is moved into the outer cells.
    pub(crate) fn around(&self, point: Vec3) -> ([usize; 3], [f32; 3]) {
        let spacing = self.spacing();
        let shift = if self.lattice == Lattice::Centres { 0.5 } else { 0.0 };
        let (mut cell, mut within) = ([0; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = (self.counts[axis] - 1) as f32;
            let at = ((point[axis] - self.bounds[0][axis]) / spacing[axis] - shift).clamp(0.0, last);
            let first = at.floor().min((last - 1.0).max(0.0));
            (cell[axis], within[axis]) = (first as usize, at - first);
        }
        (cell, within)
    }

    /// The probes around a point: their index, their step from the first of them, and their weight in a
    /// blend by place; weights sum to 1.
    pub(crate) fn corners(&self, point: Vec3) -> impl Iterator<Item = (usize, [i32; 3], f32)> + '_ {
        let (cell, within) = self.around(point);
        (0..8).filter_map(move |k| {
            let step = [k & 1, k >> 1 & 1, k >> 2 & 1];
            let index = self.neighbour(cell, step)?;
            let weight = |axis: usize| if step[axis] == 1 { within[axis] } else { 1.0 - within[axis] };
            Some((index, step, (0..3).map(weight).product()))
        })
    }

    /// Whether a point is in the box.
    pub(crate) fn contains(&self, point: Vec3) -> bool {
        (0..3).all(|axis| (self.bounds[0][axis]..=self.bounds[1][axis]).contains(&point[axis]))
    }
}

/// The steps to the 26 neighbours of a probe, x fastest, from (-1, -1, -1) to (1, 1, 1): the bits of
/// visibility are in this order.
pub fn neighbours() -> impl Iterator<Item = [i32; 3]> {
    let steps = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
    steps.filter(|step| *step != [0; 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_stand_at_corners_or_in_the_middle_of_cells() {
        let bounds = [[0.0, 0.0, 0.0], [2.0, 1.0, 4.0]];
        let of = |lattice| Volume::with_spacing("room".into(), bounds, 1.0, lattice).unwrap();
        let (centres, corners) = (of(Lattice::Centres), of(Lattice::Corners));
        assert_eq!((centres.counts, corners.counts), ([2, 1, 4], [3, 2, 5]));
        assert_eq!((centres.position([0, 0, 3]), corners.position([2, 1, 4])), ([0.5, 0.5, 3.5], bounds[1]));
        for volume in [centres, corners] {
            for index in 0..volume.len() {
                let cell = volume.cell(index);
                assert_eq!(volume.index(cell), index);
                let (first, within) = volume.around(volume.position(cell).into());
                let found = [0, 1, 2].map(|axis| first[axis] as f32 + within[axis]);
                assert_eq!(found, cell.map(|k| k as f32));
            }
        }
        assert_eq!(neighbours().count(), 26);
    }

    #[test]
    fn boxes_without_probes_say_why() {
        let unit = [[0.0; 3], [1.0; 3]];
        let error = |bounds, spacing| {
            Volume::with_spacing("hall".into(), bounds, spacing, Lattice::Corners).unwrap_err().to_string()
        };
        assert!(error([[0.0; 3], [1.0, 0.0, 1.0]], 0.5).starts_with("the box hall is not one"));
        assert!(error([[0.0; 3], [f32::NAN; 3]], 0.5).starts_with("the box hall is not one"));
        assert!(error(unit, 0.0).starts_with("the spacing is 0 m"));
        assert!(error(unit, 1e-4).starts_with("the box hall has [10001, 10001, 10001] probes"));
    }
}
