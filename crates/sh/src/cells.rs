//! Exact integrals of an expansion over the cells of a grid, and their adjoint: the exact projection of
//! piecewise constant texels.
//!
//! The mass of cell (j, c) is the sum over m of A_jm cos(m phi_c) + B_jm sin(m phi_c), times the length 2
//! sin(m w / 2) / m of the column, with A_jm = sum over l of a_lm I_lm of row j and B_jm of a_l,-m: rows
//! first, then columns. I_lm is from [`ZoneIntegrals`], the columns are an FFT, in which orders past half of
//! the columns alias as they do in the sum.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;
use sphere::LatLong;

use crate::f64x4::{F64x4, LANES, SimdLevel};
use crate::fft::{self, Complex4, Fft, cis};
use crate::{Degree, Parallel, Sample, ZoneIntegrals};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Rows between parallels, from the north pole to the south pole, of equally wide columns.
#[derive(Clone, Debug, PartialEq)]
pub struct CellGrid {
    /// The parallels between the rows, from the north: one more than rows.
    parallels: Vec<Parallel>,
    columns: usize,
    /// Whether phi falls from pi as the column rises, as in a lat-long image; otherwise it rises from 0.
    falling: bool,
}

impl CellGrid {
    /// Cells of equal area: rows equal in z from z = 1 down, columns from phi = 0 upward.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn equal_area(rows: usize, columns: usize) -> Self {
        assert!(rows > 0 && columns > 0, "a grid has cells");
        // 1 - |z| = 2 j / rows from the nearer pole.
        let parallel = |j: usize| {
            let from_pole = 2.0 * j.min(rows - j) as f64 / rows as f64;
            Parallel::from_pole(2 * j > rows, from_pole)
        };
        Self { parallels: (0..=rows).map(parallel).collect(), columns, falling: false }
    }

    /// The texels of a lat-long image: rows equal in theta, phi = pi at the left and falling.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn lat_long(grid: LatLong) -> Self {
        assert!(!grid.is_empty(), "a grid has cells");
        let parallel = |j: usize| Parallel::from_theta(PI * j as f64 / grid.height as f64);
        Self { parallels: (0..=grid.height).map(parallel).collect(), columns: grid.width, falling: true }
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.parallels.len() - 1
    }

    /// The number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The parallels south and north of a row.
    pub fn edges(&self, row: usize) -> [Parallel; 2] {
        [self.parallels[row + 1], self.parallels[row]]
    }

    /// The solid angle of each cell of a row, in steradians.
    pub fn area(&self, row: usize) -> f64 {
        let [south, north] = self.edges(row);
        north.above(south) * TAU / self.columns as f64
    }
}

/// A plan for integrals over the cells of one grid, of expansions of one degree.
///
/// Masses are exact to rounding: 1e-11 of the largest coefficient up to degree 256, and the adjoint identity
/// holds to 1e-12; the tests also compare with reference values. Rows are divided into fixed blocks, so
/// results are the same for any number of threads, bit for bit.
pub struct CellTransform {
    grid: CellGrid,
    zones: ZoneIntegrals,
    fft: Fft,
    /// For each m, 2 sin(m w / 2) / m e^(-i m phi_0), phi_0 the centre of the first column; conjugated if phi
    /// falls.
    turns: Vec<[f64; 2]>,
}

/// Rows of the adjoint are summed in this many blocks.
const BLOCKS: usize = 16;

impl CellTransform {
    /// A plan for a grid and a degree; any degree goes with any grid.
    pub fn new(grid: CellGrid, degree: Degree) -> Self {
        let columns = grid.columns;
        let turns = (0..=degree.get())
            .map(|m| {
                // phi_0 = pi / columns, or pi - pi / columns: reduced before it is rounded.
                let step = PI * (m % (2 * columns)) as f64 / columns as f64;
                let length = match m {
                    0 => TAU / columns as f64,
                    // sin(m w / 2) has the period 2 columns.
                    _ => 2.0 * math::sin(step) / m as f64,
                };
                let sign = if grid.falling && m % 2 == 1 { -1.0 } else { 1.0 };
                cis(-step).map(|part| sign * length * part)
            })
            .collect();
        let fft = Fft::new(SimdLevel::detect(), columns);
        Self { grid, zones: ZoneIntegrals::new(degree), fft, turns }
    }

    /// The grid.
    pub fn grid(&self) -> &CellGrid {
        &self.grid
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.zones.degree()
    }

    /// The integral of the function over each cell, row by row from the north. Coefficients are in order l*l
    /// + l + m, `N` channels of them, at most 4.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    ///
    /// # Example: the cells of a hemisphere's cosine
    /// ```
    /// use sh::{CellGrid, CellTransform, Degree};
    ///
    /// let cells = CellTransform::new(CellGrid::equal_area(2, 4), Degree::new(1)?);
    /// let z = (4.0 * std::f64::consts::PI / 3.0).sqrt();
    /// let masses = cells.masses(&[[0.0], [0.0], [z], [0.0]]);
    /// assert!((masses[0][0] - std::f64::consts::PI / 4.0).abs() < 1e-15);
    /// assert_eq!(masses[4][0], -masses[0][0]);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn masses<const N: usize>(&self, coefficients: &[[f64; N]]) -> Vec<[f64; N]> {
        self.cells(coefficients, |_| 1.0)
    }

    /// The mean of the function over each cell, row by row from the north, otherwise as
    /// [`CellTransform::masses`].
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn means<const N: usize>(&self, coefficients: &[[f64; N]]) -> Vec<[f64; N]> {
        self.cells(coefficients, |row| 1.0 / self.grid.area(row))
    }

    fn cells<const N: usize>(
        &self,
        coefficients: &[[f64; N]],
        scale: impl Fn(usize) -> f64 + Sync,
    ) -> Vec<[f64; N]> {
        const { assert!(N <= LANES, "one channel a lane") };
        let top = self.degree().get();
        assert_eq!(coefficients.len(), self.degree().rows(), "one coefficient for each row");
        let columns = self.grid.columns;
        let mut cells = vec![[0.0; N]; self.grid.rows() * columns];
        cells.par_chunks_mut(columns).enumerate().for_each(|(row, cells)| {
            let integrals = self.integrals(row);
            let mut integrals = integrals.iter();
            let mut data = vec![fft::ZERO; columns];
            for m in 0..=top {
                let mut sums = [[0.0; N]; 2];
                for l in m..=top {
                    let integral = integrals.next().copied().unwrap_or_default() * scale(row);
                    for (sum, index) in sums.iter_mut().zip([l * l + l + m, l * l + l - m]) {
                        (0..N).for_each(|n| sum[n] += integral * coefficients[index][n]);
                    }
                }
                // Re of (A - i B) e^(i m phi), or of its conjugate.
                let [re, im] = self.turns[m];
                let sign = if m == 0 {
                    0.0
                } else if self.grid.falling {
                    -1.0
                } else {
                    1.0
                };
                let [a, b] = sums;
                let z = &mut data[m % columns];
                for n in 0..N {
                    let b = sign * b[n];
                    z[0].0[n] += a[n] * re - b * im;
                    z[1].0[n] += a[n] * im + b * re;
                }
            }
            self.fft.run(&mut data, &mut Vec::new());
            for (cell, value) in cells.iter_mut().zip(&data) {
                *cell = std::array::from_fn(|n| value[0].0[n]);
            }
        });
        cells
    }

    /// The integrals of texel times Y_lm over the sphere, for a function that is constant in each cell: the
    /// adjoint of [`CellTransform::masses`]. Coefficients are in order l*l + l + m.
    ///
    /// # Panics
    /// If the number of values is not that of the cells.
    pub fn project<T: Sample, const N: usize>(&self, values: &[[T; N]]) -> Vec<[f64; N]> {
        const { assert!(N <= LANES, "one channel a lane") };
        let (rows, columns) = (self.grid.rows(), self.grid.columns);
        assert_eq!(values.len(), rows * columns, "one value for each cell");
        let length = rows.div_ceil(BLOCKS);
        let blocks: Vec<Vec<[f64; N]>> = (values.par_chunks(length * columns).enumerate())
            .map(|(block, values)| {
                let mut sums = vec![[0.0; N]; self.degree().rows()];
                let (mut data, mut spare) = (Vec::new(), Vec::new());
                for (row, texels) in values.chunks_exact(columns).enumerate() {
                    self.add_row(block * length + row, texels, &mut data, &mut spare, &mut sums);
                }
                sums
            })
            .collect();
        let mut coefficients = vec![[0.0; N]; self.degree().rows()];
        for sum in blocks {
            for (total, part) in coefficients.iter_mut().zip(sum) {
                (0..N).for_each(|n| total[n] += part[n]);
            }
        }
        coefficients
    }

    /// Adds what the texels of one row contribute to all coefficients.
    fn add_row<T: Sample, const N: usize>(
        &self,
        row: usize,
        texels: &[[T; N]],
        data: &mut Vec<Complex4>,
        spare: &mut Vec<Complex4>,
        sums: &mut [[f64; N]],
    ) {
        let (top, columns) = (self.degree().get(), self.grid.columns);
        data.clear();
        data.extend(texels.iter().map(|texel| {
            let lane = |n: usize| texel.get(n).map_or(0.0, |value| value.to_f64());
            [F64x4::from_fn(lane), F64x4::ZERO]
        }));
        self.fft.run(data, spare);
        let integrals = self.integrals(row);
        let mut integrals = integrals.iter();
        for m in 0..=top {
            // Sum of f e^(-i m phi), or of its conjugate.
            let [re, im] = self.turns[m];
            let [x, y] = &data[m % columns];
            let sign = if self.grid.falling { 1.0 } else { -1.0 };
            let cosine: [f64; N] = std::array::from_fn(|n| x.0[n] * re - y.0[n] * im);
            let sine: [f64; N] = std::array::from_fn(|n| sign * (x.0[n] * im + y.0[n] * re));
            for l in m..=top {
                let integral = integrals.next().copied().unwrap_or_default();
                if m > 0 {
                    (0..N).for_each(|n| sums[l * l + l - m][n] += integral * sine[n]);
                }
                (0..N).for_each(|n| sums[l * l + l + m][n] += integral * cosine[n]);
            }
        }
    }

    fn integrals(&self, row: usize) -> Vec<f64> {
        let top = self.degree().get();
        let mut integrals = vec![0.0; (top + 1) * (top + 2) / 2];
        let [south, north] = self.grid.edges(row);
        self.zones.evaluate_into(south, north, &mut integrals);
        integrals
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{Noise, integrate_rectangle};
    use crate::{Expansion, Transform};
    use test_data::tensors;

    fn grids() -> Vec<CellGrid> {
        let lat_long = |height, width| CellGrid::lat_long(LatLong { width, height });
        vec![
            CellGrid::equal_area(1, 1),
            CellGrid::equal_area(8, 16),
            CellGrid::equal_area(5, 7),
            lat_long(6, 12),
            lat_long(7, 67),
        ]
    }

    #[test]
    fn masses_are_sums_of_integrals_over_rectangles() {
        for grid in grids() {
            for top in [0, 1, 9] {
                let degree = Degree::new(top).unwrap();
                let f = Noise::new(top as u64).expansion(top);
                let cells = CellTransform::new(grid.clone(), degree);
                let (masses, means) = (cells.masses(f.coefficients()), cells.means(f.coefficients()));
                let mut rows = vec![0.0; degree.rows()];
                for (index, (mass, mean)) in masses.iter().zip(&means).enumerate() {
                    let (row, column) = (index / grid.columns(), index % grid.columns());
                    let width = TAU / grid.columns() as f64;
                    let phi0 = match grid.falling {
                        true => PI - (column + 1) as f64 * width,
                        false => column as f64 * width,
                    };
                    integrate_rectangle(&cells.zones, grid.edges(row), [phi0, phi0 + width], &mut rows);
                    for channel in 0..3 {
                        let expected: f64 =
                            f.coefficients().iter().zip(&rows).map(|(a, b)| a[channel] * b).sum();
                        assert!((mass[channel] - expected).abs() < 1e-13, "{grid:?} {top} {row} {column}");
                        let area = grid.area(row);
                        assert!((mean[channel] * area - expected).abs() < 1e-13);
                    }
                }
            }
        }
    }

    #[test]
    fn projection_is_the_adjoint_of_masses() {
        let mut noise = Noise::new(77);
        for grid in grids() {
            for top in [0, 3, 40] {
                let cells = CellTransform::new(grid.clone(), Degree::new(top).unwrap());
                let f = noise.expansion(top);
                let texels: Vec<[f64; 3]> = (0..grid.rows() * grid.columns()).map(|_| noise.rgb()).collect();
                let product = |a: &[[f64; 3]], b: &[[f64; 3]]| -> f64 {
                    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
                };
                let left = product(&cells.masses(f.coefficients()), &texels);
                let right = product(f.coefficients(), &cells.project(&texels));
                assert!((left - right).abs() < 1e-12, "{grid:?} {top}: {left} {right}");
            }
        }
    }

    #[test]
    fn masses_agree_with_the_reference() {
        let Some(file) = tensors("masses_agree_with_the_reference", "sampling/masses.safetensors") else {
            return;
        };
        for (name, top) in [("cosine", 8), ("phong", 12), ("probe", 19)] {
            let coefficients: Vec<[f64; 1]> =
                file[&format!("{name}.coefficients")].iter().map(|&value| [value]).collect();
            let cells = CellTransform::new(CellGrid::equal_area(8, 16), Degree::new(top).unwrap());
            let masses = cells.masses(&coefficients);
            let expected = &file[&format!("{name}.signed")];
            for (index, (mass, expected)) in masses.iter().zip(expected).enumerate() {
                assert!((mass[0] - expected).abs() < 1e-11, "{name}, cell {index}: {mass:?} {expected}");
            }
        }
    }

    /// Texels of an expansion's means differ from the expansion by what the finite texels blur; their exact
    /// projection tends to it, and the constant is exact on every grid.
    #[test]
    fn projected_means_tend_to_the_expansion() {
        let f = Noise::new(3).expansion(6);
        let error = |height: usize| {
            let cells = CellTransform::new(CellGrid::lat_long(LatLong::with_rows(height)), f.degree());
            let projected = cells.project(&cells.means(f.coefficients()));
            assert!((projected[0][0] - f.coefficients()[0][0]).abs() < 1e-13);
            crate::testkit::relative_error(&projected, f.coefficients())
        };
        let (coarse, fine) = (error(32), error(128));
        assert!(fine < 3e-3 && (coarse / fine - 16.0).abs() < 1.0, "{coarse} {fine}");
        // Fejér's rule reads the texels as samples: as good for smooth light, another value for rough light.
        let grid = LatLong::with_rows(16);
        let mut noise = Noise::new(9);
        let rough: Vec<[f64; 3]> = (0..grid.len()).map(|_| noise.rgb()).collect();
        let cells = CellTransform::new(CellGrid::lat_long(grid), f.degree());
        let samples: Expansion = Transform::new(grid, f.degree()).unwrap().analyse(&rough);
        assert!(crate::testkit::relative_error(&cells.project(&rough), samples.coefficients()) > 1e-3);
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let mut noise = Noise::new(1);
        let grid = CellGrid::lat_long(LatLong::with_rows(37));
        let f = noise.expansion(11);
        let texels: Vec<[f64; 3]> = (0..37 * 74).map(|_| noise.rgb()).collect();
        let cells = CellTransform::new(grid, f.degree());
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (cells.project(&texels), cells.masses(f.coefficients())))
        };
        assert_eq!(run(1), run(3));
    }
}
