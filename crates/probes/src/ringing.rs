//! The least window under which the irradiance of nine rows is nowhere negative.
//!
//! Irradiance of degree 2 is c + b n + n A n in the normal n. Its least value over the sphere is the largest
//! of c + m - b (A - m)^-1 b / 4 over all m up to the least eigenvalue of A (the dual of the trust-region
//! problem; Moré and Sorensen, "Computing a trust region step", 1983), a concave function of m. The window is
//! the Laplacian's, 1 / (1 + lambda l^2 (l + 1)^2) (Sloan, "Stupid spherical harmonics (SH) tricks", 2008).

use std::f64::consts::PI;

/// The steps of each search: the last one is below 1e-9 of the first.
const STEPS: usize = 40;

/// The factor lambda of the least window that makes irradiance 0 or more toward all normals in red, green and
/// blue, from nine rows of radiance; 0 if it is so without one.
///
/// Accuracy: 1e-6 of the window's factors. If no window does it, because a mean is negative, the factors of
/// the higher rows are 0: lambda is infinite.
pub fn least_window(rows: &[[f32; 3]; 9]) -> f64 {
    let forms = [0, 1, 2].map(|channel| Form::of(&rows.map(|row| f64::from(row[channel]))));
    let is_enough = |lambda: f64| forms.iter().all(|form| form.windowed(lambda).is_non_negative());
    if is_enough(0.0) {
        return 0.0;
    }
    if forms.iter().any(|form| form.constant < 0.0) {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, 1e-3);
    while !is_enough(high) {
        if high > 1e9 {
            return f64::INFINITY;
        }
        (low, high) = (high, 4.0 * high);
    }
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        (low, high) = if is_enough(middle) { (low, middle) } else { (middle, high) };
    }
    high
}

/// The factor of a window at a degree.
pub fn window_factor(lambda: f64, l: usize) -> f64 {
    let square = (l * (l + 1)) as f64 * (l * (l + 1)) as f64;
    if l == 0 { 1.0 } else { 1.0 / (1.0 + lambda * square) }
}

/// c + b n + n A n, with A by its eigenvalues and b along its axes.
#[derive(Clone, Copy, Debug)]
struct Form {
    constant: f64,
    along: [f64; 3],
    eigenvalues: [f64; 3],
}

impl Form {
    /// The irradiance of nine rows.
    fn of(rows: &[f64; 9]) -> Self {
        let y0 = 0.5 / PI.sqrt();
        let y1 = (3.0 / (4.0 * PI)).sqrt();
        let y2 = (15.0 / (4.0 * PI)).sqrt();
        let [first, second, third] = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let b = [3, 1, 2].map(|row| second * y1 * rows[row]);
        // Y_20 = sqrt(5 / 16 pi) (3 z^2 - 1), which is sqrt(5 / 16 pi) (2 z^2 - x^2 - y^2) on the sphere.
        let (y20, y22) = ((5.0 / (16.0 * PI)).sqrt() * rows[6], 0.5 * y2 * rows[8]);
        let [xy, yz, xz] = [4, 5, 7].map(|row| 0.5 * third * y2 * rows[row]);
        let (xx, yy, zz) = (third * (y22 - y20), third * (-y22 - y20), third * 2.0 * y20);
        let (eigenvalues, axes) = eigen([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
        let along = [0, 1, 2].map(|k| (0..3).map(|axis| axes[axis][k] * b[axis]).sum());
        Self { constant: first * y0 * rows[0], along, eigenvalues }
    }

    fn windowed(&self, lambda: f64) -> Self {
        let [one, two] = [1, 2].map(|l| window_factor(lambda, l));
        Self {
            constant: self.constant,
            along: self.along.map(|b| one * b),
            eigenvalues: self.eigenvalues.map(|a| two * a),
        }
    }

    /// Whether no value is below 0 but for rounding.
    fn is_non_negative(&self) -> bool {
        let least = self.eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
        let slope = self.along.iter().map(|b| b * b).sum::<f64>().sqrt();
        let allowed = -1e-9 * self.constant.abs();
        if self.constant - slope + least >= allowed {
            return true;
        }
        self.minimum() >= allowed
    }

    /// The least value over the sphere.
    fn minimum(&self) -> f64 {
        let least = self.eigenvalues.iter().copied().fold(f64::INFINITY, f64::min);
        let slope = self.along.iter().map(|b| b * b).sum::<f64>().sqrt();
        let value = |m: f64| {
            let part = |(b, a): (&f64, &f64)| if *b == 0.0 { 0.0 } else { b * b / (4.0 * (a - m)) };
            self.constant + m - self.along.iter().zip(&self.eigenvalues).map(part).sum::<f64>()
        };
        // The largest value is where the point of least value has length 1: |b| / 2 or less below the least
        // eigenvalue. The function is concave: thirds of the interval enclose its top.
        let (mut low, mut high) = (least - 0.5 * slope - f64::MIN_POSITIVE, least);
        for _ in 0..2 * STEPS {
            let (one, two) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if value(one) < value(two) { low = one } else { high = two }
        }
        let top = value(0.5 * (low + high));
        if top.is_finite() { top } else { value(low) }
    }
}

/// The eigenvalues of a symmetric matrix and its axes as columns, by Jacobi's rotations.
fn eigen(matrix: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let (mut a, mut axes) = (matrix, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let t = if theta == 0.0 { 1.0 } else { t };
            let cosine = 1.0 / (t * t + 1.0).sqrt();
            let sine = t * cosine;
            for row in &mut a {
                (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (cosine * a[p][k] - sine * a[q][k], sine * a[p][k] + cosine * a[q][k]);
            }
            for row in &mut axes {
                (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], axes)
}

#[cfg(test)]
mod tests {
    use sh::{Degree, Expansion};

    use super::*;

    fn irradiance(rows: &[[f32; 3]; 9], lambda: f64) -> Expansion {
        let factors = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let row = |k: usize| {
            let l = usize::from(k > 0) + usize::from(k > 3);
            rows[k].map(|x| f64::from(x) * factors[l] * window_factor(lambda, l))
        };
        Expansion::from_coefficients(Degree::new(2).unwrap(), (0..9).map(row).collect()).unwrap()
    }

    /// Next to the search for the least value on a grid.
    #[test]
    fn the_least_window_leaves_nothing_negative() {
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let mut windowed = 0;
        for round in 0..200 {
            let size = [0.3, 1.0, 3.0][round % 3];
            let rows: [[f32; 3]; 9] =
                std::array::from_fn(|row| [0; 3].map(|_| if row == 0 { 1.0 } else { size * next() }));
            let lambda = least_window(&rows);
            let least = sh::minimum(&irradiance(&rows, lambda)).value;
            assert!(least > -1e-6, "{round}: {lambda} {least}");
            if lambda > 0.0 {
                windowed += 1;
                assert!(sh::minimum(&irradiance(&rows, 0.999 * lambda)).value < 0.0, "{round}: {lambda}");
            } else {
                assert!(least > -1e-9);
            }
        }
        assert!((50..180).contains(&windowed), "{windowed}");
        let black = [[0.0; 3]; 9];
        assert_eq!(least_window(&black), 0.0);
        let mut negative = black;
        negative[0] = [1.0, -1.0, 1.0];
        assert_eq!((least_window(&negative), window_factor(f64::INFINITY, 1)), (f64::INFINITY, 0.0));
    }
}
