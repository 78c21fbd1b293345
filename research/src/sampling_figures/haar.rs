//! Haar wavelets of values on a grid whose sides are powers of two.
//!
//! Each step turns 2 x 2 values into their sum and three differences (the non-standard decomposition); a grid
//! that is wider than high, or higher than wide, ends in steps along that side alone. With the factor 1/2
//! for 2 x 2 values and 1/sqrt(2) for two, the steps are orthonormal.

/// The coefficients of a grid of values in orthonormal Haar wavelets.
///
/// Sums of squares are kept, so that dropping a coefficient changes the values by just that much in least
/// squares: over the sphere too, if the cells have equal areas.
#[derive(Clone, Debug)]
pub(super) struct Haar<const N: usize> {
    rows: usize,
    columns: usize,
    coefficients: Vec<[f64; N]>,
}

impl<const N: usize> Haar<N> {
    /// The wavelet coefficients of values given row by row, on a grid whose sides are powers of two.
    pub(super) fn of(rows: usize, columns: usize, values: &[[f64; N]]) -> Self {
        assert!(rows.is_power_of_two() && columns.is_power_of_two() && values.len() == rows * columns);
        let mut coefficients = values.to_vec();
        for block in blocks(rows, columns) {
            step(&mut coefficients, columns, block, |fine, coarse| (fine, coarse));
        }
        Self { rows, columns, coefficients }
    }

    /// The values, row by row.
    pub(super) fn values(&self) -> Vec<[f64; N]> {
        let mut values = self.coefficients.clone();
        for block in blocks(self.rows, self.columns).into_iter().rev() {
            step(&mut values, self.columns, block, |fine, coarse| (coarse, fine));
        }
        values
    }

    /// Drops all but the `count` coefficients of the largest sums of squares over the channels; of equal ones
    /// the earlier stay.
    pub(super) fn keep_largest(&mut self, count: usize) {
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

    #[test]
    fn wavelets_return_the_values_and_keep_the_sum_of_squares() {
        for (rows, columns) in [(1, 1), (1, 2), (4, 1), (4, 8), (16, 32), (8, 2)] {
            let values: Vec<[f64; 1]> = (0..rows * columns).map(|i| [(7.0 * i as f64).sin()]).collect();
            let haar = Haar::of(rows, columns, &values);
            let squares = |values: &[[f64; 1]]| values.iter().flatten().map(|v| v * v).sum::<f64>();
            assert!((squares(&values) - squares(&haar.coefficients)).abs() < 1e-12);
            for (a, b) in haar.values().iter().flatten().zip(values.iter().flatten()) {
                assert!((a - b).abs() < 1e-14, "{rows} x {columns}");
            }
            // Dropping coefficients costs their squares.
            let mut few = haar.clone();
            few.keep_largest(rows * columns / 3);
            let dropped = squares(&haar.coefficients) - squares(&few.coefficients);
            let changed: Vec<[f64; 1]> =
                few.values().iter().zip(&values).map(|(a, b)| [a[0] - b[0]]).collect();
            assert!((squares(&changed) - dropped).abs() < 1e-12);
        }
    }
}
