//! The real spherical harmonics themselves, evaluated at a direction.
//!
//! Y_l0 = P_l0(z), Y_l,m = sqrt(2) P_lm(z) cos(m phi) and Y_l,-m = sqrt(2) P_lm(z) sin(m phi) for m > 0, with
//! P_lm the orthonormal associated Legendre functions without the Condon-Shortley phase. Each column m starts
//! from P_mm = sqrt((2m+1)!! / (4 pi (2m)!!)) sin^m(theta) and climbs in l (Press et al., Numerical Recipes
//! 3, eq. 6.7.9), a direction in which the recurrence is stable:
//!
//! P_lm = a_lm (z P_l-1,m - P_l-2,m / a_l-1,m),  a_lm = sqrt((4 l^2 - 1) / (l^2 - m^2)).
//!
//! P_mm underflows near the poles. A column matters to degree F only if it leaves the region l sin(theta) <
//! m, where it grows, before l = F. With s = sin(theta) and m = F s the start is about s^(F s), at least
//! e^(-F / e) = 1e-327 for F = 2048: just past what f64 holds. So each column is carried times 2^600, which
//! leaves the large end far from overflow (no value passes 30), and what still underflows never matters.

use std::f64::consts::{PI, SQRT_2};

use sphere::Direction;

use crate::{Degree, Expansion};

const LIFT: f64 = f64::from_bits((1023 + 600) << 52);
const LOWER: f64 = f64::from_bits((1023 - 600) << 52);

/// The real spherical harmonics up to a degree, with the constants of their recurrence.
///
/// Build one to evaluate at many directions. Errors, relative to sqrt((2l+1) / (4 pi)), are some l units of
/// rounding, and l^2 of them within some 1/l of a pole, where rounding z amounts to a small rotation: 1e-10
/// at [`Degree::MAX`]. The tests compare with closed forms and check the addition theorem.
///
/// # Example: the three harmonics of degree 1 are 0.488603 times y, z and x
/// ```
/// let basis = sh::Basis::new(sh::Degree::new(1)?);
/// let mut rows = [0.0; 4];
/// basis.evaluate_into(sphere::Direction::Y, &mut rows);
/// assert!((rows[1] - 0.488603).abs() < 1e-6 && rows[2].abs() < 1e-16 && rows[3].abs() < 1e-16);
/// # Ok::<(), sh::DegreeTooHigh>(())
/// ```
#[derive(Clone, Debug)]
pub struct Basis {
    degree: Degree,
    /// a_lm and a_lm / a_l-1,m for l = m+1 ..= degree, column after column of m; the second is 0 at l = m+1.
    climb: Vec<[f64; 2]>,
    /// P_mm / sin^m(theta), times sqrt(2) for m > 0.
    start: Vec<f64>,
}

impl Basis {
    /// The harmonics of degree 0 to `degree`.
    pub fn new(degree: Degree) -> Self {
        let top = degree.get();
        let mut climb = Vec::with_capacity(top * (top + 1) / 2);
        for m in 0..=top {
            let mut below = f64::INFINITY;
            for l in m + 1..=top {
                let a = (((2 * l - 1) * (2 * l + 1)) as f64 / ((l - m) * (l + m)) as f64).sqrt();
                climb.push([a, a / below]);
                below = a;
            }
        }
        let mut start = vec![0.5 / PI.sqrt()];
        let mut value = start[0] * SQRT_2;
        for m in 1..=top {
            value *= ((2 * m + 1) as f64 / (2 * m) as f64).sqrt();
            start.push(value);
        }
        Self { degree, climb, start }
    }

    /// The highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Y_lm(w) of every row l*l + l + m, into `rows`.
    ///
    /// # Panics
    /// If `rows` does not have (degree + 1)^2 elements.
    pub fn evaluate_into(&self, direction: Direction, rows: &mut [f64]) {
        assert_eq!(rows.len(), self.degree.rows(), "one element for each row");
        self.visit(direction, |l, m, cosine, sine| {
            let middle = l * l + l;
            rows[middle + m] = cosine;
            if m > 0 {
                rows[middle - m] = sine;
            }
        });
    }

    /// f(w), RGB, of an expansion whose degree is at most this basis' degree.
    ///
    /// # Panics
    /// If the expansion's degree is higher.
    pub fn evaluate(&self, expansion: &Expansion, direction: Direction) -> [f64; 3] {
        assert!(expansion.degree() <= self.degree, "the basis reaches the expansion's degree");
        let (rows, top) = (expansion.coefficients(), expansion.degree().get());
        let mut sum = [0.0; 3];
        self.visit(direction, |l, m, cosine, sine| {
            if l <= top {
                let middle = l * l + l;
                let (right, left) = (rows[middle + m], rows[middle - m]);
                for channel in 0..3 {
                    sum[channel] += cosine * right[channel] + sine * left[channel];
                }
            }
        });
        sum
    }

    /// The theta part of the harmonics: P_lm of every m >= 0 and l = m ..= degree, column after column of m,
    /// at z = cos(theta) and sin(theta); the sqrt(2) of m > 0 is included.
    ///
    /// Near a pole sin(theta) holds more than z does, so both are asked for.
    ///
    /// # Panics
    /// If `values` does not have (degree + 1) (degree + 2) / 2 elements.
    pub fn legendre_into(&self, z: f64, sin_theta: f64, values: &mut [f64]) {
        let top = self.degree.get();
        assert_eq!(values.len(), (top + 1) * (top + 2) / 2, "one element for each l and m >= 0");
        let mut values = values.iter_mut();
        self.visit_legendre(z, sin_theta, |_, _, p| {
            if let Some(value) = values.next() {
                *value = p;
            }
        });
    }

    /// Calls `f(l, m, P_lm)` column after column of m.
    #[inline]
    fn visit_legendre(&self, z: f64, sin_theta: f64, mut f: impl FnMut(usize, usize, f64)) {
        let mut power = LIFT;
        let mut climb = self.climb.iter();
        for m in 0..=self.degree.get() {
            let mut below = 0.0;
            let mut value = self.start[m] * power;
            f(m, m, value * LOWER);
            for l in m + 1..=self.degree.get() {
                let [a, b] = climb.next().copied().unwrap_or_default();
                (below, value) = (value, a * z * value - b * below);
                f(l, m, value * LOWER);
            }
            power *= sin_theta;
        }
    }

    /// Calls `f(l, m, Y_lm, Y_l,-m)` for every l and m >= 0; the last is 0 for m = 0.
    #[inline]
    fn visit(&self, direction: Direction, mut f: impl FnMut(usize, usize, f64, f64)) {
        let v = direction.vector();
        let (z, sin_theta) = (v.z, math::hypot(v.x, v.y));
        let (cos_phi, sin_phi) =
            if sin_theta > 0.0 { (v.x / sin_theta, v.y / sin_theta) } else { (1.0, 0.0) };
        let (mut cosine, mut sine, mut column) = (1.0, 0.0, 0);
        self.visit_legendre(z, sin_theta, |l, m, p| {
            if m > column {
                column = m;
                (cosine, sine) = (cosine * cos_phi - sine * sin_phi, sine * cos_phi + cosine * sin_phi);
            }
            f(l, m, p * cosine, p * sine);
        });
    }

    /// c_m = P_mm / sin^m(theta), times sqrt(2) for m > 0.
    pub(crate) fn sectoral(&self, m: usize) -> f64 {
        self.start[m]
    }
}

/// Y_l0 at the angle whose cosine is given, for l = 0 to `values.len() - 1`: sqrt((2l+1) / (4 pi))
/// P_l(cosine).
///
/// A function of the angle to an axis is a sum of these; its coefficients are called zonal.
pub fn zonal_into(cosine: f64, values: &mut [f64]) {
    let (mut below, mut value) = (0.0, 1.0);
    for (l, out) in values.iter_mut().enumerate() {
        *out = ((2 * l + 1) as f64 / (4.0 * PI)).sqrt() * value;
        let (l, next) = (l as f64, l as f64 + 1.0);
        (below, value) = (value, ((2.0 * l + 1.0) * cosine * value - l * below) / next);
    }
}

/// Lambda_l = sqrt(4 pi / (2 l + 1)), the factor of a zonal coefficient in a convolution.
pub fn lambda(l: usize) -> f64 {
    (4.0 * PI / (2 * l + 1) as f64).sqrt()
}

impl Expansion {
    /// f(w), RGB. To evaluate at many directions, keep a [`Basis`].
    ///
    /// # Example: a constant function has the value Y_00 times its coefficient
    /// ```
    /// let f = sh::Expansion::from_coefficients(sh::Degree::new(0)?, vec![[1.0, 2.0, 3.0]]).unwrap();
    /// let rgb = f.evaluate(sphere::Direction::X);
    /// assert!((rgb[1] - 2.0 * 0.282095).abs() < 1e-6);
    /// # Ok::<(), sh::DegreeTooHigh>(())
    /// ```
    pub fn evaluate(&self, direction: Direction) -> [f64; 3] {
        Basis::new(self.degree()).evaluate(self, direction)
    }

    /// The function sum of u_l Y_l0(angle to `axis`), by the addition theorem: f_lm = Lambda_l u_l
    /// Y_lm(axis).
    pub fn zonal(axis: Direction, degree: Degree, u: impl Fn(usize) -> [f64; 3]) -> Self {
        let mut values = vec![0.0; degree.rows()];
        Basis::new(degree).evaluate_into(axis, &mut values);
        let mut rows = Vec::with_capacity(degree.rows());
        for l in 0..=degree.get() {
            let scale = u(l).map(|u| u * lambda(l));
            rows.extend(values[l * l..(l + 1) * (l + 1)].iter().map(|y| scale.map(|s| s * y)));
        }
        Self::from_coefficients(degree, rows).unwrap_or_else(|| Self::zero(degree))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> Vec<Direction> {
        let mut all = vec![Direction::X, Direction::Y, Direction::Z, Direction::from_angles(PI, 0.0)];
        for i in 0..40 {
            let i = f64::from(i);
            all.push(Direction::from_angles((i * 0.618).fract() * PI, i * 2.4));
        }
        all.extend([1e-3, 1e-8, 1e-160].map(|theta| Direction::from_angles(theta, 0.7)));
        all
    }

    #[test]
    fn degree_one_rows_are_y_z_x() {
        let basis = Basis::new(Degree::new(1).unwrap());
        for (direction, row) in [(Direction::Y, 1), (Direction::Z, 2), (Direction::X, 3)] {
            let mut rows = [0.0; 4];
            basis.evaluate_into(direction, &mut rows);
            for l1 in 1..4 {
                let expected = if l1 == row { 0.488603 } else { 0.0 };
                assert!((rows[l1] - expected).abs() < 5e-7, "row {l1} at {direction:?}: {}", rows[l1]);
            }
        }
    }

    #[test]
    fn harmonics_to_degree_3_are_their_closed_forms() {
        let basis = Basis::new(Degree::new(3).unwrap());
        for direction in directions() {
            let (x, y, z) = direction.vector().into();
            let k = |n: f64, d: f64| (n / (d * PI)).sqrt();
            let expected = [
                k(1.0, 4.0),
                k(3.0, 4.0) * y,
                k(3.0, 4.0) * z,
                k(3.0, 4.0) * x,
                k(15.0, 4.0) * x * y,
                k(15.0, 4.0) * y * z,
                k(5.0, 16.0) * (3.0 * z * z - 1.0),
                k(15.0, 4.0) * x * z,
                k(15.0, 16.0) * (x * x - y * y),
                k(35.0, 32.0) * y * (3.0 * x * x - y * y),
                k(105.0, 4.0) * x * y * z,
                k(21.0, 32.0) * y * (5.0 * z * z - 1.0),
                k(7.0, 16.0) * z * (5.0 * z * z - 3.0),
                k(21.0, 32.0) * x * (5.0 * z * z - 1.0),
                k(105.0, 16.0) * z * (x * x - y * y),
                k(35.0, 32.0) * x * (x * x - 3.0 * y * y),
            ];
            let mut rows = [0.0; 16];
            basis.evaluate_into(direction, &mut rows);
            for (row, (value, expected)) in rows.iter().zip(expected).enumerate() {
                assert!((value - expected).abs() < 4e-15, "row {row} at {direction:?}: {value} {expected}");
            }
        }
    }

    /// Sum over m of Y_lm(v) Y_lm(w) = Y_l0(angle) / Lambda_l, whose largest value is (2l+1)/(4 pi). Each
    /// harmonic carries up to l rounding errors, so the sum stays within l 2^-53 of that, times a small
    /// constant.
    #[test]
    fn the_addition_theorem_holds_to_degree_2048() {
        let basis = Basis::new(Degree::MAX);
        let mut first = vec![0.0; Degree::MAX.rows()];
        let mut second = first.clone();
        let mut zonal = vec![0.0; Degree::MAX.get() + 1];
        // theta = 0.37656 has sine 1/e, where P_mm is smallest among those that matter.
        for (v, w) in [
            (Direction::from_angles(0.37656, 0.3), Direction::from_angles(0.37656, 0.30001)),
            (Direction::from_angles(1.1, -2.0), Direction::from_angles(1.1, -2.0)),
            (Direction::from_angles(0.02, 1.0), Direction::from_angles(2.9, 2.0)),
            (Direction::from_angles(0.9, 1.0), Direction::Z),
        ] {
            basis.evaluate_into(v, &mut first);
            basis.evaluate_into(w, &mut second);
            let chord = (v.vector() - w.vector()).length();
            zonal_into(1.0 - chord * chord / 2.0, &mut zonal);
            for l in 0..=Degree::MAX.get() {
                let rows = l * l..(l + 1) * (l + 1);
                let sum: f64 = first[rows.clone()].iter().zip(&second[rows]).map(|(a, b)| a * b).sum();
                let size = (2 * l + 1) as f64 / (4.0 * PI);
                let error = (sum - zonal[l] / lambda(l)) / size;
                assert!(error.abs() < 1e-14 + 1e-14 * l as f64, "l {l}: {error:e} at {v:?}");
            }
        }
    }

    /// P_l by differences d_l = P_l+1 - P_l in t = 1 - cos(theta), which cancel nothing near a pole. Rounding
    /// of z and of the constants turns theta by 2^-53 / theta, theta about 1/l, where P_l falls by l: l^2
    /// 2^-53 in all.
    #[test]
    fn harmonics_lose_no_more_than_l_squared_roundings_next_to_the_poles() {
        let basis = Basis::new(Degree::MAX);
        let mut rows = vec![0.0; Degree::MAX.rows()];
        for theta in [1e-5, 1e-4, 5e-4, 1e-3, 5e-3, 0.02, 0.1] {
            let sine = (theta / 2.0_f64).sin();
            let t = 2.0 * sine * sine;
            for south in [false, true] {
                let north = Direction::from_angles(theta, 0.0).vector();
                let z = if south { -north.z } else { north.z };
                basis.evaluate_into(Direction::from_unit([north.x, north.y, z].into()), &mut rows);
                let (mut p, mut d) = (1.0, 0.0);
                for l in 0..=Degree::MAX.get() {
                    let sign = if south && l % 2 == 1 { -1.0 } else { 1.0 };
                    let error = sign * rows[l * l + l] * lambda(l) - p;
                    assert!(
                        error.abs() < 1e-14 + 1.2e-16 * (l * l) as f64,
                        "l {l}: {error:e} at {theta}, south: {south}"
                    );
                    d = (l as f64 * d - (2 * l + 1) as f64 * t * p) / (l + 1) as f64;
                    p += d;
                }
            }
        }
    }

    #[test]
    fn a_zonal_expansion_is_a_function_of_the_angle_to_its_axis() {
        let degree = Degree::new(20).unwrap();
        let axis = Direction::from_angles(0.8, 2.0);
        let u = |l: usize| [1.0, 0.5_f64.powi(l as i32), (l % 3) as f64];
        let f = Expansion::zonal(axis, degree, u);
        let mut values = [0.0; 21];
        for direction in directions() {
            zonal_into(axis.dot(direction), &mut values);
            let found = f.evaluate(direction);
            for channel in 0..3 {
                let expected: f64 = (0..=20).map(|l| u(l)[channel] * values[l]).sum();
                assert!((found[channel] - expected).abs() < 1e-12);
            }
        }
    }
}
