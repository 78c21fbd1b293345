//! Mips and Haar wavelets of values on a grid whose sides are powers of two.
//!
//! Each step turns 2 x 2 values into their sum and three differences (the non-standard decomposition); a grid
//! that is wider than high, or higher than wide, ends in steps along that side alone. With the factor 1/2
//! for 2 x 2 values and 1/sqrt(2) for two, the steps are orthonormal.

/// A grid whose sides are not both powers of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a grid of {rows} x {columns} cells: mips and wavelets need powers of two")]
pub struct NotPowersOfTwo {
    /// Rows of the grid.
    pub rows: usize,
    /// Columns of the grid.
    pub columns: usize,
}

fn check(rows: usize, columns: usize, len: usize) -> Result<(), NotPowersOfTwo> {
    assert_eq!(len, rows * columns, "one value for each cell");
    if rows.is_power_of_two() && columns.is_power_of_two() {
        Ok(())
    } else {
        Err(NotPowersOfTwo { rows, columns })
    }
}

/// The sums of 2 x 2 cells, of 2 x 2 of these and so on, until one side has a single cell; the cells
/// themselves come first. Row by row, `N` channels.
///
/// # Errors
/// If a side is not a power of two.
///
/// # Panics
/// If `masses` does not have `rows` x `columns` elements.
///
/// # Example: two columns for each row leave two halves of the sphere
/// ```
/// let levels = sh::mips(2, 4, &[[1.0], [2.0], [3.0], [4.0], [5.0], [6.0], [7.0], [8.0]])?;
/// assert_eq!(levels[1], [[14.0], [22.0]]);
/// # Ok::<(), sh::NotPowersOfTwo>(())
/// ```
pub fn mips<const N: usize>(
    rows: usize,
    columns: usize,
    masses: &[[f64; N]],
) -> Result<Vec<Vec<[f64; N]>>, NotPowersOfTwo> {
    check(rows, columns, masses.len())?;
    let mut levels = vec![masses.to_vec()];
    let (mut rows, mut columns) = (rows, columns);
    while let Some(fine) = levels.last().filter(|_| rows > 1 && columns > 1) {
        let coarse = fine.chunks_exact(2 * columns).flat_map(|pair| {
            let (upper, lower) = pair.split_at(columns);
            let cells = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            cells.map(|(a, b)| std::array::from_fn(|n| (a[0][n] + a[1][n]) + (b[0][n] + b[1][n])))
        });
        levels.push(coarse.collect());
        (rows, columns) = (rows / 2, columns / 2);
    }
    Ok(levels)
}

/// The coefficients of a grid of values in orthonormal Haar wavelets.
///
/// Sums of squares are kept, so that dropping a coefficient changes the values by just that much in least
/// squares: over the sphere too, if the cells have equal areas.
#[derive(Clone, Debug, PartialEq)]
pub struct Haar<const N: usize> {
    rows: usize,
    columns: usize,
    coefficients: Vec<[f64; N]>,
}

impl<const N: usize> Haar<N> {
    /// The wavelet coefficients of values given row by row.
    ///
    /// # Errors
    /// If a side is not a power of two.
    ///
    /// # Panics
    /// If `values` does not have `rows` x `columns` elements.
    ///
    /// # Example: of a constant, one coefficient is left
    /// ```
    /// let haar = sh::Haar::of(2, 4, &[[1.0]; 8])?;
    /// assert!((haar.coefficients()[0][0] - 8f64.sqrt()).abs() < 1e-15);
    /// assert!(haar.coefficients()[1..].iter().all(|value| value[0] == 0.0));
    /// # Ok::<(), sh::NotPowersOfTwo>(())
    /// ```
    pub fn of(rows: usize, columns: usize, values: &[[f64; N]]) -> Result<Self, NotPowersOfTwo> {
        check(rows, columns, values.len())?;
        let mut coefficients = values.to_vec();
        for block in blocks(rows, columns) {
            step(&mut coefficients, columns, block, |fine, coarse| (fine, coarse));
        }
        Ok(Self { rows, columns, coefficients })
    }

    /// The values, row by row.
    pub fn values(&self) -> Vec<[f64; N]> {
        let mut values = self.coefficients.clone();
        for block in blocks(self.rows, self.columns).into_iter().rev() {
            step(&mut values, self.columns, block, |fine, coarse| (coarse, fine));
        }
        values
    }

    /// The coefficients in a grid as large as that of the values: the sum over the whole grid first, then, of
    /// each level, differences along the row, along the column and both, in the other three quadrants.
    pub fn coefficients(&self) -> &[[f64; N]] {
        &self.coefficients
    }

    /// Drops all but the `count` coefficients of the largest sums of squares over the channels; of equal ones
    /// the earlier stay.
    pub fn keep_largest(&mut self, count: usize) {
        let mut order: Vec<usize> = (0..self.coefficients.len()).collect();
        let energy = |&index: &usize| self.coefficients[index].iter().map(|value| value * value).sum::<f64>();
        order.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
        for &index in order.iter().skip(count) {
            self.coefficients[index] = [0.0; N];
        }
    }
}

/// The blocks (height, width) that hold the sums before each step, largest first.
fn blocks(rows: usize, columns: usize) -> Vec<(usize, usize)> {
    let halves = |&(rows, columns): &(usize, usize)| Some((rows.div_ceil(2), columns.div_ceil(2)));
    std::iter::successors(Some((rows, columns)), halves).take_while(|&block| block != (1, 1)).collect()
}

/// One step in place, forward or back: its matrix is its own inverse, and `order` says whether fine values or
/// coarse ones are read.
fn step<const N: usize>(
    values: &mut [[f64; N]],
    stride: usize,
    (height, width): (usize, usize),
    order: impl Fn([Option<usize>; 4], [Option<usize>; 4]) -> ([Option<usize>; 4], [Option<usize>; 4]),
) {
    let before: Vec<[f64; N]> = values[..height * stride].to_vec();
    let scale = if height > 1 && width > 1 { 0.5 } else { 0.5f64.sqrt() };
    for i in 0..height.div_ceil(2) {
        for j in 0..width.div_ceil(2) {
            let cell =
                |row: usize, column: usize| (row < height && column < width).then_some(row * stride + column);
            let fine = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(y, x)| cell(2 * i + y, 2 * j + x));
            let (down, right) = (height.div_ceil(2), width.div_ceil(2));
            let coarse = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(y, x)| cell(i + y * down, j + x * right));
            let (from, to) = order(fine, coarse);
            let [a, b, c, d] = from.map(|index| index.map_or([0.0; N], |index| before[index]));
            let sums: [[f64; N]; 4] = [
                std::array::from_fn(|n| scale * ((a[n] + b[n]) + (c[n] + d[n]))),
                std::array::from_fn(|n| scale * ((a[n] - b[n]) + (c[n] - d[n]))),
                std::array::from_fn(|n| scale * ((a[n] + b[n]) - (c[n] + d[n]))),
                std::array::from_fn(|n| scale * ((a[n] - b[n]) - (c[n] - d[n]))),
            ];
            for (index, sum) in to.into_iter().zip(sums) {
                if let Some(index) = index {
                    values[index] = sum;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::Noise;

    #[test]
    fn wavelets_return_the_values_and_keep_the_sum_of_squares() {
        let mut noise = Noise::new(5);
        for (rows, columns) in [(1, 1), (1, 2), (4, 1), (4, 8), (16, 32), (8, 2)] {
            let values: Vec<[f64; 3]> = (0..rows * columns).map(|_| noise.rgb()).collect();
            let haar = Haar::of(rows, columns, &values).unwrap();
            let squares = |values: &[[f64; 3]]| values.iter().flatten().map(|v| v * v).sum::<f64>();
            assert!((squares(&values) / squares(haar.coefficients()) - 1.0).abs() < 1e-13);
            for (a, b) in haar.values().iter().flatten().zip(values.iter().flatten()) {
                assert!((a - b).abs() < 1e-14, "{rows} x {columns}");
            }
            // Dropping coefficients costs their squares.
            let mut few = haar.clone();
            few.keep_largest(rows * columns / 3);
            let dropped = squares(haar.coefficients()) - squares(few.coefficients());
            let changed: Vec<[f64; 3]> = (few.values().iter().zip(&values))
                .map(|(a, b)| std::array::from_fn(|n| a[n] - b[n]))
                .collect();
            assert!((squares(&changed) - dropped).abs() < 1e-12);
        }
        assert_eq!(Haar::of(3, 4, &[[0.0]; 12]), Err(NotPowersOfTwo { rows: 3, columns: 4 }));
    }

    #[test]
    fn mips_end_with_the_sum_of_all_cells() {
        let values: Vec<[f64; 1]> = (0..128).map(|k| [f64::from(k)]).collect();
        let levels = mips(8, 16, &values).unwrap();
        assert_eq!(levels.iter().map(Vec::len).collect::<Vec<_>>(), [128, 32, 8, 2]);
        assert_eq!(levels[3][0][0] + levels[3][1][0], 127.0 * 64.0);
        assert_eq!(levels[1][0][0], 0.0 + 1.0 + 16.0 + 17.0);
        assert_eq!(mips(1, 1, &[[2.0]]).unwrap(), [[[2.0]]]);
        assert!(mips(6, 12, &[[0.0]; 72]).is_err());
    }
}
