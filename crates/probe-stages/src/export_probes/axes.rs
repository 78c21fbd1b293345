//! The axes of other worlds: places, harmonics and grids in them.
//!
//! A world's axes are ours, in another order and with other signs. Harmonics of degree 2 are turned as what
//! they are: a number, a vector and a symmetric matrix, L(d) = c + b d + d A d. Nothing is lost.

use probes::{Lattice, Volume};

/// Nine coefficients of radiance in red, green and blue, row l l + l + m.
pub(crate) type Rows = [[f32; 3]; 9];

/// What irradiance over pi has of radiance of degree 0, 1 and 2.
pub(crate) const IRRADIANCE: [f64; 3] = [1.0, 2.0 / 3.0, 0.25];

/// The factors of the harmonics of degree 2: of x y, and of 3 z z - 1.
const PRODUCT: f64 = 1.092_548_430_592_079;
const SQUARE: f64 = 0.315_391_565_252_520_05;

/// Each axis of a world: which of ours it is, and 1 or -1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axes(pub(crate) [(usize, f64); 3]);

/// Right-handed, +Y up, as in a glTF file and in worlds that it is loaded into as it is: (y, z, x) of ours.
pub(crate) const OF_FILES: Axes = Axes([(1, 1.0), (2, 1.0), (0, 1.0)]);

/// Left-handed, +Y up: Unity's importers of glTF mirror x of the file.
pub(crate) const OF_UNITY: Axes = Axes([(1, -1.0), (2, 1.0), (0, 1.0)]);

impl Axes {
    /// A place or a direction of ours.
    pub(crate) fn vector(&self, ours: [f32; 3]) -> [f64; 3] {
        self.0.map(|(axis, sign)| sign * f64::from(ours[axis]))
    }

    /// The coefficients in these axes of a light that is given in ours.
    ///
    /// The basis is of the same form: without Condon-Shortley phase, for the world's own x, y and z.
    pub(crate) fn rows(&self, ours: &Rows) -> Rows {
        let mut turned = [[0.0; 3]; 9];
        for channel in 0..3 {
            let c = ours.map(|row| f64::from(row[channel]));
            // Row 1, 2 and 3 belong to y, z and x.
            let vector = [c[3], c[1], c[2]];
            let [xy, yz, zx] = [4, 5, 7].map(|row| 0.5 * PRODUCT * c[row]);
            let [zz, difference] = [SQUARE * c[6], 0.5 * PRODUCT * c[8]];
            let matrix = [[difference - zz, xy, zx], [xy, -difference - zz, yz], [zx, yz, 2.0 * zz]];
            let entry = |i: usize, j: usize| {
                let ((row, one), (column, other)) = (self.0[i], self.0[j]);
                one * other * matrix[row][column]
            };
            let [x, y, z] = self.0.map(|(axis, sign)| sign * vector[axis]);
            let of_degree_2 = [
                2.0 * entry(0, 1) / PRODUCT,
                2.0 * entry(1, 2) / PRODUCT,
                0.5 * entry(2, 2) / SQUARE,
                2.0 * entry(0, 2) / PRODUCT,
                (entry(0, 0) - entry(1, 1)) / PRODUCT,
            ];
            let values = [c[0], y, z, x].into_iter().chain(of_degree_2);
            turned.iter_mut().zip(values).for_each(|(row, value)| row[channel] = value as f32);
        }
        turned
    }
}

/// The grid of a volume along the axes of a world.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Grid {
    /// The probes along each axis.
    pub(crate) counts: [usize; 3],
    /// Where the first probe along all axes stands, in metres.
    pub(crate) first: [f64; 3],
    /// The distance of probes along each axis, in metres.
    pub(crate) spacing: [f64; 3],
    axes: Axes,
    own: [usize; 3],
}

impl Grid {
    /// The grid of a volume.
    pub(crate) fn of(volume: &Volume, axes: Axes) -> Self {
        let [least, most] = volume.bounds;
        let lengths = [0, 1, 2].map(|axis| f64::from(most[axis]) - f64::from(least[axis]));
        let spacing = axes.0.map(|(axis, _)| match volume.lattice {
            Lattice::Centres => lengths[axis] / volume.counts[axis] as f64,
            Lattice::Corners => lengths[axis] / (volume.counts[axis] - 1).max(1) as f64,
        });
        let shift = if volume.lattice == Lattice::Centres { 0.5 } else { 0.0 };
        let first = [0, 1, 2].map(|k| {
            let (axis, sign) = axes.0[k];
            let start = if sign > 0.0 { least[axis] } else { most[axis] };
            sign * f64::from(start) + shift * spacing[k]
        });
        let counts = axes.0.map(|(axis, _)| volume.counts[axis]);
        Self { counts, first, spacing, axes, own: volume.counts }
    }

    /// The number of probes.
    pub(crate) fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// The index in the volume of the probe at a place in the grid.
    pub(crate) fn probe(&self, at: [usize; 3]) -> usize {
        let mut cell = [0; 3];
        for (k, (axis, sign)) in self.axes.0.into_iter().enumerate() {
            cell[axis] = if sign > 0.0 { at[k] } else { self.counts[k] - 1 - at[k] };
        }
        (cell[2] * self.own[1] + cell[1]) * self.own[0] + cell[0]
    }

    /// The indices in the volume of all probes, in the order of the grid: its x changes fastest, then y.
    pub(crate) fn probes(&self) -> impl Iterator<Item = usize> {
        let [nx, ny, _] = self.counts;
        (0..self.len()).map(move |index| self.probe([index % nx, index / nx % ny, index / (nx * ny)]))
    }

    /// The box of which the outer probes are the corners: its least and its greatest coordinates.
    pub(crate) fn box_of_corners(&self) -> [[f64; 3]; 2] {
        let last = [0, 1, 2].map(|k| self.first[k] + (self.counts[k] - 1) as f64 * self.spacing[k]);
        [self.first, last]
    }

    /// The box that has a cell for each probe, which stands in its middle.
    pub(crate) fn box_of_centres(&self) -> [[f64; 3]; 2] {
        let [least, most] = self.box_of_corners();
        let half = |end: [f64; 3], sign: f64| [0, 1, 2].map(|k| end[k] + 0.5 * sign * self.spacing[k]);
        [half(least, -1.0), half(most, 1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{harmonics, noise};

    /// A light has the same radiance in all worlds.
    #[test]
    fn turned_rows_have_the_same_radiance() {
        let ours: Rows = std::array::from_fn(|row| [0, 1, 2].map(|channel| noise(3 * row + channel)));
        for axes in [OF_FILES, OF_UNITY] {
            let turned = axes.rows(&ours);
            for k in 0..50 {
                let d = [noise(100 + k), noise(200 + k), noise(300 + k)];
                let length = d.map(|x| x * x).iter().sum::<f32>().sqrt();
                let d = d.map(|x| x / length);
                let radiance = |rows: &Rows, d: [f64; 3]| {
                    rows.iter().zip(harmonics(d)).map(|(row, y)| f64::from(row[1]) * y).sum::<f64>()
                };
                let difference = radiance(&ours, d.map(f64::from)) - radiance(&turned, axes.vector(d));
                assert!(difference.abs() < 1e-6, "{axes:?}: {difference}");
            }
        }
    }

    #[test]
    fn grids_in_other_axes_have_the_places_of_the_volume() {
        for lattice in [Lattice::Centres, Lattice::Corners] {
            let bounds = [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]];
            let volume = Volume::new("hall".into(), bounds, [2, 3, 4], lattice).unwrap();
            for axes in [OF_FILES, OF_UNITY] {
                let grid = Grid::of(&volume, axes);
                let mut seen: Vec<usize> = grid.probes().collect();
                for (index, probe) in seen.iter().enumerate() {
                    let [nx, ny, _] = grid.counts;
                    let at = [index % nx, index / nx % ny, index / (nx * ny)];
                    let found = [0, 1, 2].map(|k| grid.first[k] + at[k] as f64 * grid.spacing[k]);
                    let expected = axes.vector(volume.position(volume.cell(*probe)));
                    assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-6), "{found:?}");
                }
                seen.sort_unstable();
                assert!(seen.into_iter().eq(0..volume.len()));
                let own = match lattice {
                    Lattice::Centres => grid.box_of_centres(),
                    Lattice::Corners => grid.box_of_corners(),
                };
                let ends = bounds.map(|end| axes.vector(end));
                for k in 0..3 {
                    let [one, other] = [ends[0][k], ends[1][k]];
                    assert_eq!([own[0][k], own[1][k]], [one.min(other), one.max(other)]);
                }
            }
        }
    }
}
