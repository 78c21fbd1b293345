//! A function given by spherical harmonics on the pieces: integrals over each, and values at and between
//! corners.
//!
//! As for leaves, a row r and an order m have A_rm = sum over l of f_lm T_lm(r), B_rm with f_l,-m, and a
//! piece the sum over m of A_rm C_m(c) + B_rm S_m(c). Rows and columns may be anywhere, so nothing is
//! mirrored, and all of it is double precision: masses are exact to 1e-11 times the largest coefficient,
//! which the tests compare with reference values.

use std::f64::consts::TAU;

use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Basis, Degree, Parallel, ZoneIntegrals};

use crate::cell_distribution::LEAST_MASS;
use crate::leaf_masses::LeafMasses;
use crate::leaves::Density;
use crate::pieces::{PieceColumn, PieceRow, Pieces};

/// The places at which rows and columns are taken.
#[derive(Clone, Copy, PartialEq)]
enum At {
    /// The values at the edges: one more than pieces.
    Edges,
    /// The values half-way in z or phi.
    Middles,
}

/// The tables of rows and columns of pieces for all functions of one degree.
pub(crate) struct PieceTables {
    basis: Basis,
    zones: ZoneIntegrals,
    /// The factors of A_m, then of B_m, by m and column.
    masses: Vec<f64>,
    edges: Vec<f64>,
    middles: Vec<f64>,
}

impl PieceTables {
    pub(crate) fn new(pieces: &Pieces, degree: Degree) -> Self {
        let columns = &pieces.columns;
        let table = |count: usize, f: &dyn Fn(usize, usize) -> (f64, f64)| {
            let mut table = vec![0.0; 2 * (degree.get() + 1) * count];
            for m in 0..=degree.get() {
                for j in 0..count {
                    // `turn` is reduced before it is rounded.
                    let (scale, turn) = f(m, j);
                    let (sine, cosine) = math::sin_cos((turn - turn.round()) * TAU);
                    table[2 * m * count + j] = scale * cosine;
                    table[(2 * m + 1) * count + j] = scale * sine;
                }
            }
            table
        };
        let middle = |column: &PieceColumn| 0.5 * (column.start + column.end);
        let mass = |m: usize, column: &PieceColumn| match m {
            0 => column.width(),
            _ => 2.0 * math::sin(0.5 * m as f64 * column.width()) / m as f64,
        };
        let edge = |j: usize| columns.get(j).map_or(1.0, |column| column.start);
        Self {
            basis: Basis::new(degree),
            zones: ZoneIntegrals::new(degree),
            masses: table(columns.len(), &|m, j| (mass(m, &columns[j]), m as f64 * middle(&columns[j]))),
            edges: table(columns.len() + 1, &|m, j| (1.0, m as f64 * edge(j))),
            middles: table(columns.len(), &|m, j| (1.0, m as f64 * middle(&columns[j]))),
        }
    }
}

/// The integral of f over each piece, row by row.
pub(crate) fn integrals(tables: &PieceTables, pieces: &Pieces, coefficients: &[f64]) -> Vec<f64> {
    let row = |row: usize, values: &mut [f64]| {
        let PieceRow { is_south, near, far, .. } = pieces.rows[row];
        let [a, b] = [near, far].map(|distance| Parallel::from_pole(is_south, distance));
        let [south, north] = if is_south { [a, b] } else { [b, a] };
        tables.zones.evaluate_into(south, north, values);
    };
    let mut integrals = vec![0.0; pieces.rows.len() * pieces.columns.len()];
    synthesise(coefficients, &tables.masses, row, &mut integrals, |sum| sum);
    integrals
}

/// f at rows and columns.
fn values(tables: &PieceTables, pieces: &Pieces, coefficients: &[f64], [down, right]: [At; 2]) -> Vec<f32> {
    let rows = &pieces.rows;
    let count = |at: At, pieces: usize| if at == At::Edges { pieces + 1 } else { pieces };
    let row = |row: usize, values: &mut [f64]| {
        let parallel = match (down, rows.get(row)) {
            (At::Middles, Some(row)) => Parallel::from_pole(row.is_south, 0.5 * (row.near + row.far)),
            (_, Some(row)) => {
                Parallel::from_pole(row.is_south, if row.is_south { row.far } else { row.near })
            }
            (_, None) => Parallel::from_z(-1.0),
        };
        tables.basis.legendre_into(parallel.z(), parallel.sine(), values);
    };
    let table = if right == At::Edges { &tables.edges } else { &tables.middles };
    let mut values = vec![0.0; count(down, rows.len()) * count(right, pieces.columns.len())];
    synthesise(coefficients, table, row, &mut values, |sum| sum as f32);
    values
}

/// Sums rows first, then columns; `row` writes T_lm of a row, column after column of m.
fn synthesise<T: Send + Sync>(
    coefficients: &[f64],
    table: &[f64],
    row: impl Fn(usize, &mut [f64]) + Sync,
    output: &mut [T],
    convert: impl Fn(f64) -> T + Sync,
) {
    let orders = coefficients.len().isqrt();
    let columns = table.len() / (2 * orders);
    output.par_chunks_mut(columns).enumerate().for_each(|(index, output)| {
        let mut harmonics = vec![0.0; orders * (orders + 1) / 2];
        row(index, &mut harmonics);
        let mut harmonics = harmonics.iter();
        let mut sums = vec![0.0; columns];
        for (m, factors) in table.chunks_exact(2 * columns).enumerate() {
            let (mut a, mut b) = (0.0, 0.0);
            for (l, t) in (m..orders).zip(harmonics.by_ref()) {
                a += t * coefficients[l * l + l + m];
                b += t * coefficients[l * l + l - m];
            }
            let (cosines, sines) = factors.split_at(columns);
            // The sines of m = 0 are 0.
            for ((sum, cosine), sine) in sums.iter_mut().zip(cosines).zip(sines) {
                *sum += a * cosine + b * sine;
            }
        }
        output.iter_mut().zip(&sums).for_each(|(output, sum)| *output = convert(*sum));
    });
}

fn row_of(values: &[f32], row: usize, columns: usize) -> &[f32] {
    &values[row * columns..][..columns]
}

/// Masses of the pieces and the density at their corners.
pub(crate) struct PieceMasses {
    /// The masses of the pieces, row by row.
    pub(crate) masses: Vec<f32>,
    /// The absolute value of f and the floor at the corners: one more row and column than pieces.
    pub(crate) corners: Vec<f32>,
    /// Whether a piece is flat, row by row.
    pub(crate) flat: Vec<bool>,
}

impl PieceMasses {
    /// The density of f on the pieces, with a uniform share.
    pub(crate) fn new(
        tables: &PieceTables,
        pieces: &Pieces,
        coefficients: &[f64],
        density: Density,
        share: f32,
    ) -> Self {
        let (rows, columns) = (pieces.rows.len(), pieces.columns.len());
        let at = |down, right| values(tables, pieces, coefficients, [down, right]);
        let mut corners = at(At::Edges, At::Edges);
        let (edges, sides) = (at(At::Edges, At::Middles), at(At::Middles, At::Edges));
        let centres = at(At::Middles, At::Middles);
        let integrals = integrals(tables, pieces, coefficients);
        let mut masses: Vec<f32> = integrals.iter().map(|&mass| mass as f32).collect();
        let mut flat = vec![false; rows * columns];
        let level = SimdLevel::detect();
        let outputs = masses.par_chunks_mut(columns).zip(flat.par_chunks_mut(columns));
        outputs.enumerate().for_each(|(row, (masses, flat))| {
            let height = pieces.rows[row].height();
            let areas: Vec<f32> =
                pieces.columns.iter().map(|column| (height * column.width()) as f32).collect();
            level.run(LeafMasses {
                corners: [row_of(&corners, row, columns + 1), row_of(&corners, row + 1, columns + 1)],
                edges: [row_of(&edges, row, columns), row_of(&edges, row + 1, columns)],
                sides: row_of(&sides, row, columns + 1),
                centres: row_of(&centres, row, columns),
                areas: &areas,
                is_absolute: density == Density::Absolute,
                is_strict: false,
                masses,
                flat,
            });
        });
        let total: f64 = masses.iter().map(|&mass| f64::from(mass)).sum();
        let share = f64::from(share);
        let floor = share / (1.0 - share) * total / (2.0 * TAU);
        if floor > 0.0 {
            for (row, masses) in pieces.rows.iter().zip(masses.chunks_exact_mut(columns)) {
                for (column, mass) in pieces.columns.iter().zip(masses) {
                    *mass += (floor * row.height() * column.width()) as f32;
                }
            }
        }
        corners.iter_mut().for_each(|value| *value = value.abs() + floor as f32);
        masses.iter_mut().filter(|mass| **mass <= LEAST_MASS).for_each(|mass| *mass = 0.0);
        Self { masses, corners, flat }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sh::{CellGrid, CellTransform, Expansion, rotate};
    use sphere::{DVec3, LatLong, Rotation};
    use test_data::{reference, tensors};

    use crate::LeafGrid;

    /// Products with an environment of 16 x 32 patches, by rising phi from 0: in lat-long patches as the
    /// pieces of the texels have them, in patches of equal area from the integrals over cells.
    #[test]
    fn products_agree_with_the_reference() {
        let test = "products_agree_with_the_reference";
        let (Some(file), Some(about)) =
            (tensors(test, "sampling/product.safetensors"), reference(test, "sampling/sampling.json"))
        else {
            return;
        };
        let degree = Degree::new(12).unwrap();
        let environment = &file["environment"];
        let largest = environment.iter().fold(0.0, |a: f64, b| a.max(*b));
        for (name, grid) in [
            ("lat_long", LatLong { width: 32, height: 16 }),
            ("equal_area", LatLong { width: 32, height: 16 }),
        ] {
            let world = &file[&format!("{name}.world")];
            let angles = &about["product"]["rotations_yaw_pitch_roll_degrees"][name];
            let [yaw, pitch, roll] = [0, 1, 2].map(|i| angles[i].as_f64().unwrap().to_radians());
            let rotation = Rotation::from_yaw_pitch_roll(yaw, pitch, roll);
            let matrix = &file[&format!("{name}.rotation")];
            for (row, expected) in matrix.chunks_exact(3).enumerate() {
                let found = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (rotation.matrix() * axis)[row]);
                assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?} {expected:?}");
            }
            let local = file["local"].iter().map(|&value| [value; 3]).collect();
            let turned = rotate(&Expansion::from_coefficients(degree, local).unwrap(), rotation);
            for (found, expected) in turned.coefficients().iter().zip(world) {
                assert!((found[0] - expected).abs() < 1e-12);
            }
            let f: Vec<f64> = turned.coefficients().iter().map(|rgb| rgb[0]).collect();
            let masses: Vec<f64> = if name == "lat_long" {
                let pieces = Pieces::new(grid, LeafGrid::for_degree(degree));
                let integrals = integrals(&PieceTables::new(&pieces, degree), &pieces, &f);
                let mut masses = vec![0.0; 512];
                let rows = pieces.rows.iter().zip(integrals.chunks_exact(pieces.columns.len()));
                for (row, integrals) in rows {
                    for (column, integral) in pieces.columns.iter().zip(integrals) {
                        // Texels are counted by falling phi from pi.
                        let patch = row.texel * 32 + (15 + 32 - column.texel) % 32;
                        masses[patch] += environment[patch] * integral;
                    }
                }
                masses
            } else {
                let cells = CellTransform::new(CellGrid::equal_area(16, 32), degree);
                let f: Vec<[f64; 1]> = f.iter().map(|&value| [value]).collect();
                cells.masses(&f).iter().zip(environment).map(|(mass, e)| mass[0] * e).collect()
            };
            let (signed, positive) = (&file[&format!("{name}.signed")], &file[&format!("{name}.positive")]);
            let (mut compared, mut worst) = (0, 0.0f64);
            for patch in 0..512 {
                // The oracle is exact to 1e-12 times the environment.
                assert!((masses[patch] - signed[patch]).abs() < 1e-11 * largest, "{name} {patch}");
                if (signed[patch] - positive[patch]).abs() < 1e-12 * environment[patch] {
                    compared += 1;
                    worst =
                        worst.max((masses[patch] - positive[patch]).abs() / environment[patch].max(1e-300));
                }
            }
            test_data::say(&format!(
                "{name}: {compared} patches of one sign, worst {worst:e} times the environment"
            ));
            assert!(compared > 50 && worst < 1e-11, "{name}: {worst:e}");
        }
    }
}
