//! Quadrature over colatitude: weights w_j with sum over j of w_j f(theta_j) = integral of f sin(theta).
//!
//! The interpolatory rules write f as a cosine series and use
//! integral over [0, pi] of cos(k theta) sin(theta) = 2 / (1 - k^2) for even k, 0 for odd k.
//!
//! - Fejér's first rule: theta_j = pi (j + 1/2) / n, the pixel-centred rows of a lat-long image; exact for
//!   polynomials in cos(theta) up to degree n - 1 (Waldvogel 2006, eq. 3.5).
//! - Clenshaw-Curtis: theta_j = pi j / n, j = 0 ..= n; exact up to degree n.
//! - Gauss-Legendre: theta_j at the zeros of P_n(cos(theta)); exact up to degree 2 n - 1.

use std::f64::consts::PI;

/// The weights of Fejér's first rule for `rows` pixel-centred rows, theta_j = pi (j + 1/2) / rows.
///
/// w_j = 2/n (1 - 2 sum over k = 1 ..= n/2 of cos(2 k theta_j) / (4 k^2 - 1)); all are positive and they sum
/// to 2. O(rows^2) with one table of cosines; accurate to a few 1e-16 of the largest weight.
///
/// # Example: one row integrates a constant
/// ```
/// assert_eq!(sh::quadrature::fejer(1), [2.0]);
/// ```
pub fn fejer(rows: usize) -> Vec<f64> {
    let period = 2 * rows;
    let cosine = cosines(period);
    let mut weights = vec![0.0; rows];
    for j in 0..rows.div_ceil(2) {
        // 2 k theta_j = 2 pi k (2 j + 1) / (2 n); small terms first.
        let mut sum = 0.0;
        for k in (1..=rows / 2).rev() {
            sum += cosine[k * (2 * j + 1) % period] / (4.0 * (k * k) as f64 - 1.0);
        }
        let weight = 2.0 / rows as f64 * (1.0 - 2.0 * sum);
        weights[j] = weight;
        weights[rows - 1 - j] = weight;
    }
    weights
}

/// The weights of the Clenshaw-Curtis rule for theta_j = pi j / `intervals`, j = 0 ..= `intervals`.
///
/// `intervals` is even and positive. The poles are nodes. They sum to 2.
pub(crate) fn clenshaw_curtis(intervals: usize) -> Vec<f64> {
    debug_assert!(intervals > 0 && intervals.is_multiple_of(2));
    let half = intervals / 2;
    let cosine = cosines(intervals);
    let mut weights = vec![0.0; intervals + 1];
    for j in 0..=half {
        // w_j = c_j / n (1 - sum over k = 1 ..= n/2 of b_k cos(2 k theta_j) / (4 k^2 - 1)), with c = 1 at the
        // poles and 2 elsewhere, b = 1 for k = n/2 and 2 elsewhere.
        let mut sum = 0.0;
        for k in (1..=half).rev() {
            let b = if k == half { 1.0 } else { 2.0 };
            sum += b * cosine[k * j % intervals] / (4.0 * (k * k) as f64 - 1.0);
        }
        let c = if j == 0 { 1.0 } else { 2.0 };
        let weight = c / intervals as f64 * (1.0 - sum);
        weights[j] = weight;
        weights[intervals - j] = weight;
    }
    weights
}

/// The nodes (colatitudes from the north pole down) and weights of the Gauss-Legendre rule of `rows` rows.
///
/// Newton's method in theta; P_n comes from differences d_k = P_(k+1) - P_k in t = 1 - cos(theta), so that
/// nothing cancels near the pole: (k + 1) d_k = k d_(k-1) - (2 k + 1) t P_k. The weight is 2 /
/// (dP_n/dtheta)^2. Nodes and weights are accurate to 1e-15; the southern half mirrors the northern exactly.
pub fn gauss_legendre(rows: usize) -> (Vec<f64>, Vec<f64>) {
    let n = rows as f64;
    let mut theta = vec![0.0; rows];
    let mut weights = vec![0.0; rows];
    for j in 0..rows.div_ceil(2) {
        let middle = 2 * j + 1 == rows;
        // Tricomi's estimate, good to O(n^-4) away from the pole and enough for Newton near it.
        let guess = PI * (4.0 * j as f64 + 3.0) / (4.0 * n + 2.0);
        let mut node = if middle { PI / 2.0 } else { guess + 1.0 / (8.0 * n * n * math::tan(guess)) };
        for _ in 0..if middle { 0 } else { 10 } {
            let (value, slope) = legendre_and_slope(rows, node);
            let step = value / slope;
            node -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        let (_, slope) = legendre_and_slope(rows, node);
        let weight = 2.0 / (slope * slope);
        (theta[j], weights[j]) = (node, weight);
        (theta[rows - 1 - j], weights[rows - 1 - j]) = (PI - node, weight);
    }
    (theta, weights)
}

/// P_n(cos(theta)) and its derivative by theta, n >= 1.
fn legendre_and_slope(n: usize, theta: f64) -> (f64, f64) {
    let sine = math::sin(theta / 2.0);
    let t = 2.0 * sine * sine;
    let (mut p, mut d) = (1.0, 0.0);
    for k in 0..n {
        d = (k as f64 * d - (2 * k + 1) as f64 * t * p) / (k + 1) as f64;
        p += d;
    }
    // sin(theta) dP_n/dtheta = n (cos(theta) P_n - P_(n-1)) = n (d - t P_n).
    (p, n as f64 * (d - t * p) / math::sin(theta))
}

/// cos(2 pi k / period) for k in 0 .. period.
fn cosines(period: usize) -> Vec<f64> {
    let whole = period as f64;
    (0..period)
        .map(|k| {
            // Reduced to the first octave, so that the table has the symmetries of the cosine exactly.
            let k = k.min(period - k);
            let (k, sign) =
                if 4 * k > period { (period as f64 / 2.0 - k as f64, -1.0) } else { (k as f64, 1.0) };
            if 8.0 * k > whole {
                sign * math::sin(2.0 * PI * (whole / 4.0 - k) / whole)
            } else {
                sign * math::cos(2.0 * PI * k / whole)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNTS: [usize; 12] = [1, 2, 3, 4, 5, 8, 17, 64, 255, 256, 512, 2050];

    /// integral of cos(k theta) sin(theta) over [0, pi].
    fn cosine_integral(k: usize) -> f64 {
        if k % 2 == 1 { 0.0 } else { 2.0 / (1.0 - (k * k) as f64) }
    }

    fn integrate(theta: &[f64], weights: &[f64], f: impl Fn(f64) -> f64) -> f64 {
        theta.iter().zip(weights).map(|(&theta, &weight)| weight * f(theta)).sum()
    }

    fn degrees(limit: usize) -> impl Iterator<Item = usize> {
        (0..limit).filter(move |&k| k < 20 || k + 20 > limit || k % 37 == 0)
    }

    /// Weights sum to 2 and angles k theta round at k eps, so a sum errs by no more than 2 k eps plus some
    /// roundings of the sum itself.
    fn tolerance(k: usize) -> f64 {
        1e-15 * (4.0 + k as f64)
    }

    #[test]
    fn fejer_is_exact_below_the_number_of_rows() {
        for rows in COUNTS {
            let theta: Vec<f64> = (0..rows).map(|j| PI * (j as f64 + 0.5) / rows as f64).collect();
            let weights = fejer(rows);
            assert!(weights.iter().all(|&weight| weight > 0.0));
            for k in degrees(rows) {
                let sum = integrate(&theta, &weights, |theta| (k as f64 * theta).cos());
                assert!(
                    (sum - cosine_integral(k)).abs() < tolerance(k),
                    "{rows} rows, cos({k} theta): {sum}"
                );
            }
        }
    }

    #[test]
    fn fejer_differs_from_sine_weights() {
        let sum: f64 = (0..8).map(|j| PI / 8.0 * (PI * (j as f64 + 0.5) / 8.0).sin()).sum();
        assert!((sum - 2.0).abs() > 1e-3);
        assert!((fejer(8).iter().sum::<f64>() - 2.0).abs() < 1e-15);
    }

    #[test]
    fn clenshaw_curtis_is_exact_to_the_number_of_intervals() {
        for intervals in [2, 4, 10, 64, 512, 4100] {
            let theta: Vec<f64> = (0..=intervals).map(|j| PI * j as f64 / intervals as f64).collect();
            let weights = clenshaw_curtis(intervals);
            for k in degrees(intervals + 1) {
                let sum = integrate(&theta, &weights, |theta| (k as f64 * theta).cos());
                assert!(
                    (sum - cosine_integral(k)).abs() < tolerance(k),
                    "{intervals}, cos({k} theta): {sum}"
                );
            }
        }
    }

    #[test]
    fn gauss_legendre_is_exact_to_twice_the_number_of_rows() {
        for rows in COUNTS {
            let (theta, weights) = gauss_legendre(rows);
            assert!(theta.is_sorted(), "{rows} rows");
            for k in degrees(2 * rows) {
                let sum = integrate(&theta, &weights, |theta| (k as f64 * theta).cos());
                assert!(
                    (sum - cosine_integral(k)).abs() < tolerance(k),
                    "{rows} rows, cos({k} theta): {sum}"
                );
            }
        }
    }

    #[test]
    fn gauss_legendre_of_five_rows_has_the_closed_form() {
        // x = sqrt(5 - 2 sqrt(10/7)) / 3 and sqrt(5 + 2 sqrt(10/7)) / 3, w = (322 +- 13 sqrt(70)) / 900.
        let (theta, weights) = gauss_legendre(5);
        let root = 2.0 * (10.0f64 / 7.0).sqrt();
        let expected = [
            ((5.0 + root).sqrt() / 3.0, (322.0 - 13.0 * 70.0f64.sqrt()) / 900.0),
            ((5.0 - root).sqrt() / 3.0, (322.0 + 13.0 * 70.0f64.sqrt()) / 900.0),
            (0.0, 128.0 / 225.0),
        ];
        for (j, (x, weight)) in expected.into_iter().enumerate() {
            assert!((theta[j].cos() - x).abs() < 1e-15 && (weights[j] - weight).abs() < 1e-15);
            assert!((theta[4 - j].cos() + x).abs() < 1e-15 && (weights[4 - j] - weight).abs() < 1e-15);
        }
    }

    #[test]
    fn gauss_legendre_integrates_an_exponential() {
        // integral of exp(x) over [-1, 1].
        let (theta, weights) = gauss_legendre(12);
        let sum = integrate(&theta, &weights, |theta| theta.cos().exp());
        assert!((sum - 2.0 * 1f64.sinh()).abs() < 2e-15);
    }
}
