//! Nonlinear least squares by Levenberg and Marquardt.

/// The sums J^T J and J^T r over the rows of residuals: a symmetric matrix, of which the lower triangle is
/// kept, and a vector.
#[derive(Clone, Debug)]
pub(super) struct Normal {
    pub(super) size: usize,
    /// Rows of `size` values.
    pub(super) matrix: Vec<f64>,
    pub(super) vector: Vec<f64>,
}

impl Normal {
    pub(super) fn new(size: usize) -> Self {
        Self { size, matrix: vec![0.0; size * size], vector: vec![0.0; size] }
    }

    /// Adds a residual and its derivatives.
    pub(super) fn add(&mut self, row: &[f64], residual: f64) {
        for (i, a) in row.iter().enumerate() {
            let line = &mut self.matrix[i * self.size..][..=i];
            line.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
            self.vector[i] += a * residual;
        }
    }

    /// Adds a residual that depends on one parameter alone.
    pub(super) fn add_one(&mut self, index: usize, derivative: f64, residual: f64) {
        self.matrix[index * self.size + index] += derivative * derivative;
        self.vector[index] += derivative * residual;
    }

    /// Solves (J^T J + damping diag(J^T J)) step = -J^T r by Cholesky's decomposition. `None` if the matrix
    /// is not positive.
    pub(super) fn step(&self, damping: f64) -> Option<Vec<f64>> {
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
        let mut step: Vec<f64> = self.vector.iter().map(|value| -value).collect();
        for i in 0..size {
            let dot: f64 = (0..i).map(|j| l[i * size + j] * step[j]).sum();
            step[i] = (step[i] - dot) / l[i * size + i];
        }
        for i in (0..size).rev() {
            let dot: f64 = (i + 1..size).map(|j| l[j * size + i] * step[j]).sum();
            step[i] = (step[i] - dot) / l[i * size + i];
        }
        Some(step)
    }
}

/// The most steps.
const STEPS: usize = 40;

/// A step that gains less than this share of the cost is the last.
const GAIN: f64 = 2e-4;

/// Parameters near a start at which a cost is least. `evaluate` returns the cost and adds to the normal
/// equations if they are given; `bound` moves parameters to where they may be.
pub(super) fn minimise(
    start: Vec<f64>,
    evaluate: impl Fn(&[f64], Option<&mut Normal>) -> f64,
    bound: impl Fn(&mut [f64]),
) -> Vec<f64> {
    let mut best = start;
    let mut damping = 1e-2;
    for _ in 0..STEPS {
        let mut normal = Normal::new(best.len());
        let cost = evaluate(&best, Some(&mut normal));
        let mut better = None;
        while damping < 1e5 {
            if let Some(step) = normal.step(damping) {
                let mut trial: Vec<f64> = best.iter().zip(&step).map(|(value, step)| value + step).collect();
                bound(&mut trial);
                let trial_cost = evaluate(&trial, None);
                if trial_cost < cost {
                    better = Some((trial, trial_cost));
                    break;
                }
            }
            damping *= 5.0;
        }
        let Some((trial, trial_cost)) = better else { break };
        best = trial;
        damping = (damping * 0.2).max(1e-7);
        if cost - trial_cost < GAIN * cost {
            break;
        }
    }
    best
}
