//! Weighted least squares for a few unknowns.

/// Cholesky's factor of a positive matrix, from which the solutions for its first unknowns alone follow, too.
pub(super) struct Factor {
    n: usize,
    /// The lower triangle, [n, n].
    rows: Vec<f64>,
    /// The solution of the lower triangle with the right side.
    forward: Vec<f64>,
}

impl Factor {
    /// Factorises the matrix [n, n], of which the lower triangle is read, for a right side. A little is added
    /// to the diagonal, so that unknowns that the views do not determine stay small.
    pub(super) fn new(n: usize, matrix: &[f64], right: &[f64]) -> Self {
        const RIDGE: f64 = 1e-7;
        let mut rows = matrix.to_vec();
        let mut forward = right.to_vec();
        for i in 0..n {
            let (done, rest) = rows.split_at_mut(i * n);
            let row = &mut rest[..n];
            row[i] *= 1.0 + RIDGE;
            for j in 0..=i {
                let other = if j < i { &done[j * n..j * n + n] } else { &[][..] };
                let sum: f64 = if j < i {
                    (0..j).map(|k| row[k] * other[k]).sum()
                } else {
                    (0..j).map(|k| row[k] * row[k]).sum()
                };
                if j < i {
                    row[j] = if other[j] > 0.0 { (row[j] - sum) / other[j] } else { 0.0 };
                } else {
                    // Less than a part of the diagonal's own rounding is nothing.
                    let left = row[i] - sum;
                    row[i] = if left > 1e-13 * row[i] { left.sqrt() } else { 0.0 };
                }
            }
            let sum: f64 = (0..i).map(|k| row[k] * forward[k]).sum();
            forward[i] = if row[i] > 0.0 { (forward[i] - sum) / row[i] } else { 0.0 };
        }
        Self { n, rows, forward }
    }

    /// The solution for the first unknowns, as many as `solution` has: the others are 0.
    pub(super) fn solve_into(&self, solution: &mut [f64]) {
        let count = solution.len();
        for i in (0..count).rev() {
            let sum: f64 = (i + 1..count).map(|k| self.rows[k * self.n + i] * solution[k]).sum();
            let diagonal = self.rows[i * self.n + i];
            solution[i] = if diagonal > 0.0 { (self.forward[i] - sum) / diagonal } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leading_unknowns_are_those_of_the_smaller_problem() {
        let n = 6;
        let column = |i: usize, v: usize| ((i * 7 + v * 3 + i * v) as f64).sin();
        let mut matrix = vec![0.0; n * n];
        let mut right = vec![0.0; n];
        for v in 0..20 {
            for i in 0..n {
                (0..n).for_each(|j| matrix[i * n + j] += column(i, v) * column(j, v));
                right[i] += column(i, v) * (v as f64).cos();
            }
        }
        let factor = Factor::new(n, &matrix, &right);
        for count in 1..=n {
            let mut x = vec![0.0; count];
            factor.solve_into(&mut x);
            for i in 0..count {
                let sum: f64 = (0..count).map(|j| matrix[i * n + j] * x[j]).sum();
                assert!((sum - right[i]).abs() < 1e-5, "{count}: {sum} {}", right[i]);
            }
        }
    }

    #[test]
    fn unknowns_that_nothing_determines_are_zero() {
        let factor = Factor::new(2, &[1.0, 1.0, 1.0, 1.0], &[2.0, 2.0]);
        let mut x = [0.0; 2];
        factor.solve_into(&mut x);
        assert!((x[0] + x[1] - 2.0).abs() < 1e-5);
        let mut x = [1.0; 2];
        Factor::new(2, &[0.0; 4], &[0.0; 2]).solve_into(&mut x);
        assert_eq!(x, [0.0; 2]);
    }
}
