//! What the leaves of all functions of one degree share: integrals and values of the harmonics, in single
//! precision.
//!
//! A function on the grid is a sum over rows first, then columns: for each row r and order m, A_rm = sum
//! over l of f_lm T_lm(r), B_rm with f_l,-m; then sum over m of A_rm C_m(c) + B_rm S_m(c). With integrals in
//! both tables this is the leaf's mass, with values of P_lm, cos and sin at edges or middles it is f at the
//! leaf's corners and between them. All tables are made in double precision and rounded once.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use sh::{Basis, CellGrid, Degree, Parallel, ZoneIntegrals};

use crate::LeafGrid;
use crate::f32x8::{F32x8, LANES};

/// Tables for the samplers of one degree; built once, shared by all of them.
///
/// They hold 3 rows (degree + 1)^2 bytes: 80 kB for degree 19, 200 MB for degree 255.
pub struct Tables {
    degree: Degree,
    grid: LeafGrid,
    /// The integrals over rows of leaves.
    pub(crate) row_masses: RowTable,
    /// The values on the parallels between rows; the poles are [`Tables::poles`].
    pub(crate) row_edges: RowTable,
    /// The values half-way in z.
    pub(crate) row_middles: RowTable,
    /// P_l0 at the north pole.
    pub(crate) poles: Vec<f32>,
    pub(crate) column_masses: ColumnTable,
    pub(crate) column_edges: ColumnTable,
    pub(crate) column_middles: ColumnTable,
}

impl Tables {
    /// The tables of a degree.
    pub fn new(degree: Degree) -> Arc<Self> {
        let grid = LeafGrid::for_degree(degree);
        let (rows, columns) = (grid.rows(), grid.columns());
        let cells = CellGrid::equal_area(rows, columns);
        let zones = ZoneIntegrals::new(degree);
        let basis = Basis::new(degree);
        let parallel = |z: Parallel, values: &mut [f64]| basis.legendre_into(z.z(), z.sine(), values);
        let top = degree.get();
        let row_masses = RowTable::new(degree, grid, |row, values| {
            let [south, north] = cells.edges(row);
            zones.evaluate_into(south, north, values);
        });
        let row_edges = RowTable::new(degree, grid, |row, values| parallel(cells.edges(row)[0], values));
        let row_middles = RowTable::new(degree, grid, |row, values| {
            parallel(Parallel::from_pole(false, (2 * row + 1) as f64 / rows as f64), values);
        });
        let mut pole = vec![0.0; (top + 1) * (top + 2) / 2];
        parallel(Parallel::from_z(1.0), &mut pole);
        // Reduced before it is rounded: half columns, modulo the circle.
        let angle =
            |m: usize, half_columns: usize| PI * (m * half_columns % (2 * columns)) as f64 / columns as f64;
        let mass =
            |m: usize| if m == 0 { TAU / columns as f64 } else { 2.0 * math::sin(angle(m, 1)) / m as f64 };
        Arc::new(Self {
            degree,
            grid,
            row_masses,
            row_edges,
            row_middles,
            poles: pole[..=top].iter().map(|&p| p as f32).collect(),
            column_masses: ColumnTable::new(top, columns / 4, |m, j| (mass(m), angle(m, 2 * j + 1))),
            column_edges: ColumnTable::new(top, columns / 4 + 1, |m, j| (1.0, angle(m, 2 * j))),
            column_middles: ColumnTable::new(top, columns / 4, |m, j| (1.0, angle(m, 2 * j + 1))),
        })
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The leaves.
    pub fn grid(&self) -> LeafGrid {
        self.grid
    }
}

/// Functions of the northern rows, in groups of eight: the southern ones mirror them, with the sign of odd l
/// - m.
pub(crate) struct RowTable {
    pub(crate) groups: usize,
    /// The values by m, then group, then l = m ..= degree.
    pub(crate) values: Vec<F32x8>,
}

impl RowTable {
    /// Makes a table; `f` writes the values of a northern row for every m and l = m ..= degree.
    fn new(degree: Degree, grid: LeafGrid, mut f: impl FnMut(usize, &mut [f64])) -> Self {
        let top = degree.get();
        let pairs = (top + 1) * (top + 2) / 2;
        let groups = grid.rows() / 2 / LANES;
        let mut values = vec![F32x8::ZERO; groups * pairs];
        let mut row_values = vec![0.0; pairs];
        for row in 0..groups * LANES {
            f(row, &mut row_values);
            let (mut start, group) = (0, row / LANES);
            for m in 0..=top {
                let length = top + 1 - m;
                for (value, to) in
                    row_values[start..][..length].iter().zip(&mut values[start * groups + group * length..])
                {
                    to.0[row % LANES] = *value as f32;
                }
                start += length;
            }
        }
        Self { groups, values }
    }
}

/// Columns of the first quadrant, four in a tile; the other quadrants mirror them.
pub(crate) struct ColumnTable {
    pub(crate) columns: usize,
    /// The tiles, then m: the factors of A_m in four columns, then those of B_m.
    pub(crate) tiles: Vec<[f32; 2 * TILE]>,
}

/// The number of columns in a tile.
pub(crate) const TILE: usize = 4;

impl ColumnTable {
    /// Makes a table; `f` is the scale and the angle of (m, column).
    fn new(top: usize, columns: usize, f: impl Fn(usize, usize) -> (f64, f64)) -> Self {
        let tile = |tile: usize| {
            let f = &f;
            (0..=top).map(move |m| {
                std::array::from_fn(|k| {
                    let (scale, angle) = f(m, tile * TILE + k % TILE);
                    (scale * if k < TILE { math::cos(angle) } else { math::sin(angle) }) as f32
                })
            })
        };
        Self { columns, tiles: (0..columns.div_ceil(TILE)).flat_map(tile).collect() }
    }
}
