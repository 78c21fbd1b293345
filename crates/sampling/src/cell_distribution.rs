//! A piecewise constant distribution on a grid: the row first, by the masses of rows, then the column in its
//! row.
//!
//! Running sums of masses stand in blocks of 16 with the ends of the blocks beside them, and a cell is found
//! by counting the entries that are not above u, eight by an instruction. Whatever is drawn is told from the
//! same sums: a cell's probability is the difference of two of them, as rounded. Cells without mass are
//! never drawn.

use sh::f64x4::Lanes;

use crate::f32x8::LANES;

/// Entries in a block.
const BLOCK: usize = 2 * LANES;

/// Less than this share of the largest coefficient is no mass: it would leave the range of a float.
pub(crate) const LEAST_MASS: f32 = 1e-30;

/// The largest float below 1.
pub(crate) const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Points whose steps run side by side.
pub(crate) const ABREAST: usize = 64;

/// Cells that were drawn, and their probabilities.
pub(crate) struct Drawn {
    pub(crate) rows: [u32; ABREAST],
    pub(crate) columns: [u32; ABREAST],
    /// The remainders of the two uniforms, in [0, 1).
    pub(crate) rest: [[f32; ABREAST]; 2],
    pub(crate) probabilities: [f32; ABREAST],
}

impl Drawn {
    pub(crate) fn new() -> Self {
        let zeros = [0.0; ABREAST];
        Self { rows: [0; ABREAST], columns: [0; ABREAST], rest: [zeros; 2], probabilities: zeros }
    }
}

/// Masses, or their running sums along each row.
pub(crate) struct MassRows<'a> {
    /// The rows from the north; past the columns of each there may be others.
    pub(crate) values: &'a mut [f32],
    /// The number of values from one row to the next.
    pub(crate) stride: usize,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct CellDistribution {
    columns: usize,
    rows: RunningSums,
    /// Running sums of every row.
    sums: Vec<f32>,
    /// The ends of the blocks of running sums.
    ends: Vec<f32>,
}

impl CellDistribution {
    /// Room for a grid, all of whose masses are zero.
    pub(crate) fn new(rows: usize, columns: usize) -> Self {
        Self {
            columns,
            rows: RunningSums::new(rows),
            sums: vec![f32::INFINITY; rows * stride(columns)],
            ends: vec![f32::INFINITY; rows * ends_stride(columns)],
        }
    }

    /// The running sums of all rows, to be filled by the caller, and the distance from one row to the next.
    pub(crate) fn sums_mut(&mut self) -> MassRows<'_> {
        MassRows { values: &mut self.sums, stride: stride(self.columns) }
    }

    /// Takes the running sums of all rows as they are now; returns the sum of all masses.
    pub(crate) fn update(&mut self) -> f32 {
        let (columns, stride) = (self.columns, stride(self.columns));
        let mut total = 0.0;
        let ends = self.ends.chunks_exact_mut(ends_stride(columns));
        let rows = self.sums.chunks_exact(stride).zip(ends);
        for ((sums, ends), row_sum) in rows.zip(&mut self.rows.sums) {
            for (end, block) in ends.iter_mut().zip(sums.chunks_exact(BLOCK)) {
                *end = block[BLOCK - 1];
            }
            total += sums[columns - 1];
            *row_sum = total;
        }
        self.rows.update();
        total
    }

    /// The cells of pairs of uniforms below 1, [`ABREAST`] at most.
    #[inline(always)]
    pub(crate) fn draw<L: Lanes>(&self, lanes: L, points: &[[f32; 2]], drawn: &mut Drawn) {
        let points = &points[..points.len().min(ABREAST)];
        let mut found = [[[0.0f32; 4]; ABREAST]; 2];
        // All rows first: more searches are under way at a time than of rows and columns in turn.
        for (i, point) in points.iter().enumerate() {
            let (row, interval) = search(lanes, &self.rows.sums, &self.rows.ends, self.rows.count, point[0]);
            (drawn.rows[i], found[0][i]) = (row as u32, interval);
        }
        for (i, point) in points.iter().enumerate() {
            let (sums, ends) = self.row(drawn.rows[i] as usize);
            let (column, interval) = search(lanes, sums, ends, self.columns, point[1]);
            (drawn.columns[i], found[1][i]) = (column as u32, interval);
        }
        let mut shares = [[0.0f32; ABREAST]; 2];
        for axis in 0..2 {
            for i in 0..ABREAST {
                let [v, lower, upper, total] = found[axis][i];
                let width = upper - lower;
                drawn.rest[axis][i] = ((v - lower) / width).clamp(0.0, BELOW_ONE);
                shares[axis][i] = width / total;
            }
        }
        for i in 0..ABREAST {
            drawn.probabilities[i] = shares[0][i] * shares[1][i];
        }
    }

    pub(crate) fn probability(&self, row: usize, column: usize) -> f32 {
        let (_, row_probability) = interval(&self.rows.sums, self.rows.count, row);
        let (_, probability) = interval(self.row(row).0, self.columns, column);
        if row_probability > 0.0 { row_probability * probability } else { 0.0 }
    }

    /// The uniforms that lead to a place in a cell.
    pub(crate) fn invert(&self, row: usize, column: usize, rest: [f32; 2]) -> [f32; 2] {
        let invert = |(lower, share): (f32, f32), rest: f32| (lower + share * rest).clamp(0.0, BELOW_ONE);
        let u = invert(interval(&self.rows.sums, self.rows.count, row), rest[0]);
        [u, invert(interval(self.row(row).0, self.columns, column), rest[1])]
    }

    #[inline(always)]
    fn row(&self, row: usize) -> (&[f32], &[f32]) {
        let stride = stride(self.columns);
        let ends = ends_stride(self.columns);
        (&self.sums[row * stride..][..stride], &self.ends[row * ends..][..ends])
    }
}

/// Running sums of one row of cells, padded with infinity.
#[derive(Clone, Debug, Default)]
struct RunningSums {
    count: usize,
    sums: Vec<f32>,
    ends: Vec<f32>,
}

impl RunningSums {
    fn new(count: usize) -> Self {
        let padded = stride(count);
        Self { count, sums: vec![f32::INFINITY; padded], ends: vec![f32::INFINITY; ends_stride(count)] }
    }

    fn update(&mut self) {
        for (end, block) in self.ends.iter_mut().zip(self.sums.chunks_exact(BLOCK)) {
            *end = block[BLOCK - 1];
        }
    }
}

/// The length of a row of running sums, in whole blocks.
fn stride(count: usize) -> usize {
    count.next_multiple_of(BLOCK)
}

/// The length of a row of block ends, in whole vectors.
fn ends_stride(count: usize) -> usize {
    count.div_ceil(BLOCK).next_multiple_of(LANES)
}

/// Finds the cell of a uniform below 1; returns the uniform times the total, where the cell begins and ends,
/// and the total.
#[inline(always)]
fn search<L: Lanes>(lanes: L, sums: &[f32], ends: &[f32], count: usize, u: f32) -> (usize, [f32; 4]) {
    let total = sums[count - 1];
    // Below the total: u is at least half a unit of rounding below 1.
    let v = u * total;
    let mut block = 0;
    for ends in ends.as_chunks::<LANES>().0 {
        block += lanes.count_up_to(ends, v);
    }
    let start = block.min(sums.len() / BLOCK - 1) * BLOCK;
    let mut index = start;
    for entries in sums[start..][..BLOCK].as_chunks::<LANES>().0 {
        index += lanes.count_up_to(entries, v);
    }
    let index = index.min(count - 1);
    let lower = if index > 0 { sums[index - 1] } else { 0.0 };
    (index, [v, lower, sums[index], total])
}

/// Where a cell begins and how long it is, as shares of all.
fn interval(sums: &[f32], count: usize, index: usize) -> (f32, f32) {
    let total = sums[count - 1];
    let lower = if index > 0 { sums[index - 1] } else { 0.0 };
    if total > 0.0 { (lower / total, (sums[index] - lower) / total) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rows: usize, columns: usize, masses: &[f32]) -> CellDistribution {
        let mut cells = CellDistribution::new(rows, columns);
        let MassRows { values: sums, stride } = cells.sums_mut();
        for (row, masses) in masses.chunks_exact(columns).enumerate() {
            let mut sum = 0.0;
            for (column, mass) in masses.iter().enumerate() {
                sum += mass;
                sums[row * stride + column] = sum;
            }
        }
        cells.update();
        cells
    }

    #[test]
    fn cells_without_mass_are_never_drawn() {
        let masses = [0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
        let cells = of(3, 4, &masses);
        let mut drawn = Drawn::new();
        for i in 0..64 {
            for j in 0..64 {
                let end = |k: i32| if k == 63 { BELOW_ONE } else { k as f32 / 63.0 };
                let u = [end(i), end(j)];
                cells.draw(pulp::Scalar256b, &[u], &mut drawn);
                let (row, column) = (drawn.rows[0] as usize, drawn.columns[0] as usize);
                let mass = masses[row * 4 + column];
                assert!(mass > 0.0, "{u:?}: {row} {column}");
                assert!((drawn.probabilities[0] - mass / 3.0).abs() < 1e-7);
                assert_eq!(drawn.probabilities[0], cells.probability(row, column));
                let back = cells.invert(row, column, drawn.rest.map(|rest| rest[0]));
                assert!((0..2).all(|k| (back[k] - u[k]).abs() < 1e-6), "{u:?} {back:?}");
            }
        }
        assert_eq!(cells.probability(0, 0) + cells.probability(2, 3) + cells.probability(1, 2), 0.0);
    }
}
