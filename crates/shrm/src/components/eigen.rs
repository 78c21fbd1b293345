//! Eigenvectors of small symmetric matrices, by Jacobi's rotations.

/// The eigenvalues and unit eigenvectors of a symmetric matrix of `n` rows, the largest eigenvalue first. The
/// greatest entry of each vector is positive.
///
/// Accurate to a few units of rounding of the greatest eigenvalue.
pub(super) fn eigenvectors(n: usize, mut a: Vec<f64>) -> Vec<(f64, Vec<f64>)> {
    let mut vectors = vec![0.0; n * n];
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    // Convergence is quadratic: matrices of 16 rows take 6 to 8 sweeps.
    for _ in 0..40 {
        let outside = |i: usize, j: usize| if i == j { 0.0 } else { a[i * n + j] * a[i * n + j] };
        let rest: f64 = (0..n * n).map(|index| outside(index / n, index % n)).sum();
        let whole: f64 = a.iter().map(|value| value * value).sum();
        if rest <= 1e-32 * whole {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let off = a[p * n + q];
                if off == 0.0 {
                    continue;
                }
                let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * off);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = (t * t + 1.0).sqrt().recip();
                let s = t * c;
                for k in 0..n {
                    let (x, y) = (a[k * n + p], a[k * n + q]);
                    (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..n {
                    let (x, y) = (a[p * n + k], a[q * n + k]);
                    (a[p * n + k], a[q * n + k]) = (c * x - s * y, s * x + c * y);
                    let (x, y) = (vectors[p * n + k], vectors[q * n + k]);
                    (vectors[p * n + k], vectors[q * n + k]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    let mut found: Vec<(f64, Vec<f64>)> =
        vectors.chunks_exact(n.max(1)).enumerate().map(|(i, row)| (a[i * n + i], row.to_vec())).collect();
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    for (_, vector) in &mut found {
        let greatest = vector.iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { *x } else { most });
        if greatest < 0.0 {
            vector.iter_mut().for_each(|value| *value = -*value);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vectors_are_orthonormal_and_make_the_matrix() {
        for n in [1, 2, 5, 16] {
            let entry = |i: usize, j: usize| ((i * j + i + j) as f64).sin() + if i == j { 2.0 } else { 0.0 };
            let matrix: Vec<f64> = (0..n * n).map(|index| entry(index / n, index % n)).collect();
            let found = eigenvectors(n, matrix.clone());
            assert!(found.windows(2).all(|pair| pair[0].0 >= pair[1].0));
            for i in 0..n {
                for j in 0..n {
                    let sum: f64 = found.iter().map(|(value, v)| value * v[i] * v[j]).sum();
                    assert!((sum - matrix[i * n + j]).abs() < 1e-13, "{n}: {sum}");
                    let product: f64 = (0..n).map(|k| found[i].1[k] * found[j].1[k]).sum();
                    assert!((product - f64::from(i == j)).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn a_black_matrix_has_no_greatest_direction() {
        assert!(eigenvectors(3, vec![0.0; 9]).iter().all(|(value, _)| *value == 0.0));
    }
}
