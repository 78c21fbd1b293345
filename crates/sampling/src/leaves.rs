//! The leaves of one function: their masses, the values at their corners, and which of them are flat.
//!
//! A leaf in which f has one sign has its integral as mass; any other is flat, and its mass is its area
//! times a bound of f ([`crate::leaf_masses`]). With max(0, integral) instead, points with f > 0 would be
//! missed or weigh up to 10^4 times the mean; with the largest of 3 x 3 values, some would weigh 8 times
//! the mean, where f is positive only between them.

use sh::f64x4::SimdLevel;

use crate::cell_distribution::{LEAST_MASS, MassRows};
use crate::f32x8::F32x8;
use crate::leaf_masses::LeafMasses;
use crate::synthesis::{ColumnPlaces, Fourier, Rows, WriteLanes, for_each_group};
use crate::tables::{RowTable, Tables};

/// Which function of f is the density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Density {
    /// max(f, 0): what is sampled of a light or a lobe.
    #[default]
    Positive,
    /// |f|, whose samples have the sign of f: what estimates an integral of a signed f without bias.
    Absolute,
}

/// How leaves are made of f.
#[derive(Clone, Copy)]
pub(crate) struct LeafOptions {
    /// Which function of f is the density.
    pub(crate) density: Density,
    /// The share of the density that becomes uniform.
    pub(crate) uniform_share: f32,
    /// Whether the masses themselves are kept; otherwise, their running sums along each row.
    pub(crate) keep_masses: bool,
}

/// Values on the leaves, and the memory in which they are made.
#[derive(Clone, Default)]
pub(crate) struct Leaves {
    /// f at the corners: one more row and one more column than leaves, row by row from the north pole.
    pub(crate) corners: Vec<f32>,
    /// One bit for each leaf, row by row: whether it is flat. Empty if none is.
    pub(crate) flat: Vec<u32>,
    /// The density that a uniform share adds, in units of f.
    pub(crate) floor: f32,
    /// Whether leaves must be free of zeros between the corners too.
    is_strict: bool,
    packed: Vec<[f32; 2]>,
    fourier: Vec<Fourier>,
    columns: Vec<F32x8>,
}

impl Leaves {
    pub(crate) fn new(tables: &Tables, is_strict: bool) -> Self {
        let grid = tables.grid();
        let orders = tables.degree().get() + 1;
        Self {
            corners: vec![0.0; (grid.rows() + 1) * (grid.columns() + 1)],
            is_strict,
            packed: Vec::with_capacity(orders * (orders + 1) / 2),
            fourier: vec![[F32x8::ZERO; 2]; grid.rows() / 8 * orders],
            columns: vec![F32x8::ZERO; 2 * grid.columns()],
            ..Self::default()
        }
    }

    /// Makes the leaves of a function; `output` receives the masses or their running sums.
    pub(crate) fn update(
        &mut self,
        level: SimdLevel,
        tables: &Tables,
        coefficients: &[f32],
        options: LeafOptions,
        output: &mut MassRows<'_>,
    ) {
        let LeafOptions { density, uniform_share: share, keep_masses } = options;
        let columns = tables.grid().columns();
        self.pack(tables.degree().get(), coefficients);
        let least = self.synthesise_corners(level, tables, coefficients);
        self.flat.clear();
        self.floor = 0.0;
        self.run_rows(level, tables, &tables.row_masses);
        let has_one_sign = least > 0.0 && !self.is_strict && share == 0.0;
        if has_one_sign && self.synthesise_masses(level, tables, !keep_masses, output) {
            return;
        }
        self.synthesise_masses(level, tables, false, output);
        self.classify(level, tables, density, output);
        let MassRows { values: sums, stride } = output;
        let stride = *stride;
        if share > 0.0 {
            let total: f64 =
                sums.chunks(stride).flat_map(|row| &row[..columns]).map(|&mass| f64::from(mass)).sum();
            let share = f64::from(share);
            self.floor = (share / (1.0 - share) * total / (4.0 * std::f64::consts::PI)) as f32;
        }
        let added = self.floor * tables.grid().area() as f32;
        for row in sums.chunks_mut(stride) {
            let mut sum = 0.0;
            for mass in &mut row[..columns] {
                *mass += added;
                if !keep_masses {
                    sum += *mass;
                    *mass = sum;
                }
            }
        }
    }

    /// f_lm and f_l,-m, column after column of m.
    fn pack(&mut self, top: usize, coefficients: &[f32]) {
        self.packed.clear();
        for m in 0..=top {
            self.packed.extend((m..=top).map(|l| {
                let middle = l * l + l;
                [coefficients[middle + m], if m > 0 { coefficients[middle - m] } else { 0.0 }]
            }));
        }
    }

    fn run_rows(&mut self, level: SimdLevel, tables: &Tables, table: &RowTable) {
        let orders = tables.degree().get() + 1;
        level.run(Rows { table, packed: &self.packed, orders, output: &mut self.fourier });
    }

    /// The integral of f over each leaf; if `add_up`, running sums along each row. Returns whether all
    /// integrals are large enough to be masses.
    fn synthesise_masses(
        &mut self,
        level: SimdLevel,
        tables: &Tables,
        add_up: bool,
        output: &mut MassRows<'_>,
    ) -> bool {
        let rows = tables.grid().rows();
        let mut are_masses = true;
        for_each_group(
            level,
            ColumnPlaces { table: &tables.column_masses, at_edges: false },
            &self.fourier,
            tables.row_masses.groups,
            &mut self.columns,
            |is_south, first, values| {
                if add_up {
                    are_masses &= level.run(RunningColumns { values });
                }
                let row = |lane: usize| if is_south { rows - 1 - first - lane } else { first + lane };
                let starts = std::array::from_fn(|lane| row(lane) * output.stride);
                level.run_lanes(WriteLanes { columns: values, starts, output: output.values });
            },
        );
        are_masses
    }

    /// f at the corners; returns the least value.
    fn synthesise_corners(&mut self, level: SimdLevel, tables: &Tables, coefficients: &[f32]) -> f32 {
        let (rows, columns) = (tables.grid().rows(), tables.grid().columns());
        self.run_rows(level, tables, &tables.row_edges);
        let corners = &mut self.corners;
        let least = for_each_group(
            level,
            ColumnPlaces { table: &tables.column_edges, at_edges: true },
            &self.fourier,
            tables.row_edges.groups,
            &mut self.columns,
            |is_south, first, values| {
                let row = |lane: usize| if is_south { rows - 1 - first - lane } else { first + lane + 1 };
                let starts = std::array::from_fn(|lane| row(lane) * (columns + 1));
                level.run_lanes(WriteLanes { columns: values, starts, output: corners });
            },
        );
        let (mut north, mut south) = (0.0, 0.0);
        for (l, p) in tables.poles.iter().enumerate() {
            let value = p * coefficients[l * l + l];
            north += value;
            south += if l % 2 == 0 { value } else { -value };
        }
        corners[..columns].fill(north);
        corners[rows * (columns + 1)..][..columns].fill(south);
        for row in corners.chunks_exact_mut(columns + 1) {
            row[columns] = row[0];
        }
        least.min(north).min(south)
    }

    /// f at points between the corners: rows at `row_table`, columns at `places`, row by row, with as many
    /// rows and columns as corners have where they are at edges. The poles are left out.
    fn between(
        &mut self,
        level: SimdLevel,
        tables: &Tables,
        row_table: &RowTable,
        places: ColumnPlaces<'_>,
    ) -> Vec<f32> {
        let (rows, columns) = (tables.grid().rows(), tables.grid().columns());
        let is_edge = std::ptr::eq(row_table, &tables.row_edges);
        let stride = columns + usize::from(places.at_edges);
        let mut values = vec![0.0; (rows + usize::from(is_edge)) * stride];
        self.run_rows(level, tables, row_table);
        for_each_group(
            level,
            places,
            &self.fourier,
            row_table.groups,
            &mut self.columns,
            |is_south, first, columns_of_group| {
                let row = |lane: usize| match is_south {
                    false => first + lane + usize::from(is_edge),
                    true => rows - 1 - first - lane,
                };
                let starts = std::array::from_fn(|lane| row(lane) * stride);
                level.run_lanes(WriteLanes { columns: columns_of_group, starts, output: &mut values });
            },
        );
        if places.at_edges {
            values.chunks_exact_mut(stride).for_each(|row| row[columns] = row[0]);
        }
        values
    }

    /// Turns integrals into masses.
    fn classify(&mut self, level: SimdLevel, tables: &Tables, density: Density, output: &mut MassRows<'_>) {
        let (rows, columns) = (tables.grid().rows(), tables.grid().columns());
        let middles = ColumnPlaces { table: &tables.column_middles, at_edges: false };
        let at_edges = ColumnPlaces { table: &tables.column_edges, at_edges: true };
        let centres = self.between(level, tables, &tables.row_middles, middles);
        let sides = self.between(level, tables, &tables.row_middles, at_edges);
        let mut edges = self.between(level, tables, &tables.row_edges, middles);
        let corners = |row: usize| &self.corners[row * (columns + 1)..][..columns + 1];
        edges[..columns].copy_from_slice(&corners(0)[..columns]);
        edges[rows * columns..].copy_from_slice(&corners(rows)[..columns]);
        let areas = vec![tables.grid().area() as f32; columns];
        let mut flat = vec![false; columns];
        // Whole words: a row has 32 columns or more, a power of two.
        for (row, masses) in output.values.chunks_exact_mut(output.stride).enumerate() {
            level.run(LeafMasses {
                corners: [corners(row), corners(row + 1)],
                edges: [&edges[row * columns..][..columns], &edges[(row + 1) * columns..][..columns]],
                sides: &sides[row * (columns + 1)..][..columns + 1],
                centres: &centres[row * columns..][..columns],
                areas: &areas,
                is_absolute: density == Density::Absolute,
                is_strict: self.is_strict,
                masses: &mut masses[..columns],
                flat: &mut flat,
            });
            let word =
                |flat: &[bool]| flat.iter().rev().fold(0u32, |word, &is_flat| word << 1 | u32::from(is_flat));
            self.flat.extend(flat.chunks_exact(32).map(word));
        }
    }
}

/// Running sums along the columns; returns whether every mass is large enough.
struct RunningColumns<'a> {
    values: &'a mut [F32x8],
}

impl pulp::WithSimd for RunningColumns<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> bool {
        use crate::f32x8::{load, store};
        let mut sum = simd.splat_f32s(0.0);
        let mut least = simd.splat_f32s(f32::INFINITY);
        for value in self.values {
            let mass = load(simd, value);
            least = simd.min_f32s(least, mass);
            sum = simd.add_f32s(sum, mass);
            store(simd, sum, value);
        }
        simd.reduce_min_f32s(least) > LEAST_MASS
    }
}

impl Leaves {
    #[inline(always)]
    pub(crate) fn is_flat(&self, row: usize, column: usize, columns: usize) -> bool {
        let leaf = row * columns + column;
        !self.flat.is_empty() && self.flat[leaf / 32] >> (leaf % 32) & 1 == 1
    }

    /// The sign of f in a leaf that is not flat.
    #[inline(always)]
    pub(crate) fn sign(&self, row: usize, column: usize, columns: usize) -> f32 {
        if self.corners[row * (columns + 1) + column] < 0.0 { -1.0 } else { 1.0 }
    }

    /// The density at the corners of a leaf: north-west, north-east, south-west, south-east. All are equal if
    /// the leaf is flat.
    #[inline(always)]
    pub(crate) fn corners(&self, row: usize, column: usize, columns: usize) -> [f32; 4] {
        if self.is_flat(row, column, columns) {
            return [1.0; 4];
        }
        let north = &self.corners[row * (columns + 1) + column..][..2];
        let south = &self.corners[(row + 1) * (columns + 1) + column..][..2];
        [north[0], north[1], south[0], south[1]].map(|value| value.abs() + self.floor)
    }
}
