//! Least squares: normal equations and Cholesky's decomposition.

/// A sum of J^T J and J^T r over rows: the lower triangle of a symmetric matrix, and a vector.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub(crate) size: usize,
    /// Rows of the lower triangle, each `size` wide.
    pub(crate) matrix: Vec<f64>,
    pub(crate) vector: Vec<f64>,
}

impl Normal {
    pub(crate) fn new(size: usize) -> Self {
        Self { size, matrix: vec![0.0; size * size], vector: vec![0.0; size] }
    }

    /// Adds the row of one residual.
    pub(crate) fn add(&mut self, row: &[f64], residual: f64) {
        for (i, a) in row.iter().enumerate() {
            if *a == 0.0 {
                continue;
            }
            let line = &mut self.matrix[i * self.size..][..=i];
            line.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
            self.vector[i] += a * residual;
        }
    }

    /// The step p of Levenberg and Marquardt: (J^T J + `damping` diag(J^T J)) p = -J^T r. `None` if the matrix
    /// is not positive.
    pub(crate) fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let size = self.size;
        let mut l = self.matrix.clone();
        let largest = (0..size).map(|i| l[i * size + i]).fold(0.0, f64::max);
        for i in 0..size {
            l[i * size + i] = l[i * size + i] * (1.0 + damping) + 1e-9 * largest;
        }
        for i in 0..size {
            let (above, line) = l.split_at_mut(i * size);
            for j in 0..i {
                let other = &above[j * size..];
                let dot: f64 = line[..j].iter().zip(&other[..j]).map(|(a, b)| a * b).sum();
                line[j] = (line[j] - dot) / other[j];
            }
            let rest = line[i] - line[..i].iter().map(|a| a * a).sum::<f64>();
            if rest.is_nan() || rest <= 0.0 {
                return None;
            }
            line[i] = rest.sqrt();
        }
        let mut x: Vec<f64> = self.vector.iter().map(|value| -value).collect();
        for i in 0..size {
            let dot: f64 = (0..i).map(|j| l[i * size + j] * x[j]).sum();
            x[i] = (x[i] - dot) / l[i * size + i];
        }
        for i in (0..size).rev() {
            let dot: f64 = (i + 1..size).map(|j| l[j * size + i] * x[j]).sum();
            x[i] = (x[i] - dot) / l[i * size + i];
        }
        Some(x)
    }
}
