//! Slow, obvious forms that tests compare with, and what tests share.

use crate::{Degree, Expansion, Parallel, ZoneIntegrals};

/// P_lm(cos(theta)) for l = m ..= degree of the orthonormal real harmonics (sqrt(2) of m > 0 included), by
/// the textbook recurrence in x with the logarithm of a common scale beside it.
pub(crate) fn legendre(m: usize, degree: usize, theta: f64) -> Vec<f64> {
    let (sine, x) = theta.sin_cos();
    // x P = P - t P, so that the rounding of x near the pole does not turn theta.
    let t = 2.0 * (theta / 2.0).sin().powi(2);
    let times_x = |p: f64| if t < 0.5 { p - t * p } else { x * p };
    let mut log_scale = 0.5 * (if m == 0 { 0.5f64 } else { 1.0 } / std::f64::consts::TAU).ln();
    for k in 1..=m {
        log_scale += 0.5 * ((2 * k + 1) as f64 / (2 * k) as f64).ln() + sine.ln();
    }
    let (mut earlier, mut now) = (0.0, 1.0f64);
    let mut values = Vec::new();
    for l in m..=degree {
        values.push(now * log_scale.exp());
        let (l1, m) = ((l + 1) as f64, m as f64);
        let epsilon = |l: f64| ((l * l - m * m) / (4.0 * l * l - 1.0)).max(0.0).sqrt();
        let next =
            (times_x(now) - if l as f64 > m { epsilon(l1 - 1.0) * earlier } else { 0.0 }) / epsilon(l1);
        (earlier, now) = (now, next);
        if now.abs() > 1e100 {
            (earlier, now) = (earlier * 1e-100, now * 1e-100);
            log_scale += 100.0 * std::f64::consts::LN_10;
        }
    }
    values
}

/// Y_lm of all rows up to `degree` at one direction.
pub(crate) fn harmonics(degree: usize, theta: f64, phi: f64) -> Vec<f64> {
    let mut rows = vec![0.0; (degree + 1) * (degree + 1)];
    for m in 0..=degree {
        let (sine, cosine) = (m as f64 * phi).sin_cos();
        for (l, p) in (m..).zip(legendre(m, degree, theta)) {
            rows[l * l + l - m] = p * sine;
            rows[l * l + l + m] = p * cosine;
        }
    }
    rows
}

/// Repeatable numbers in [-1, 1).
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(crate) fn rgb(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.next())
    }

    pub(crate) fn expansion(&mut self, degree: usize) -> Expansion {
        let degree = Degree::new(degree).unwrap();
        let rows = (0..degree.rows()).map(|_| self.rgb()).collect();
        Expansion::from_coefficients(degree, rows).unwrap()
    }
}

/// The largest coefficient.
pub(crate) fn largest(rows: &[[f64; 3]]) -> f64 {
    rows.iter().flatten().fold(0.0, |max, value| value.abs().max(max))
}

/// The largest difference, relative to the largest value of `expected`.
pub(crate) fn relative_error(actual: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    assert_eq!(actual.len(), expected.len());
    let differences = actual.iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
    let worst =
        differences.fold(0.0, |max: f64, value| if value.is_nan() { f64::NAN } else { value.max(max) });
    worst / largest(expected)
}

/// The integral of Y_lm dOmega over the rectangle between two parallels and two meridians, for each row l*l +
/// l + m: absolute error below 1e-13 up to degree 256.
pub(crate) fn integrate_rectangle(
    zones: &ZoneIntegrals,
    [south, north]: [Parallel; 2],
    [phi0, phi1]: [f64; 2],
    rows: &mut [f64],
) {
    let top = zones.degree().get();
    assert_eq!(rows.len(), zones.degree().rows(), "one element for each row");
    let mut integrals = vec![0.0; (top + 1) * (top + 2) / 2];
    zones.evaluate_into(south, north, &mut integrals);
    let mut integrals = integrals.into_iter();
    for m in 0..=top {
        let [cosine, sine] = azimuth(m, phi0, phi1);
        for (l, integral) in (m..=top).zip(integrals.by_ref()) {
            rows[l * l + l - m] = integral * sine;
            rows[l * l + l + m] = integral * cosine;
        }
    }
}

/// The integrals of cos(m phi) and sin(m phi) over an interval: \[phi1 - phi0, 0\] for m = 0.
///
/// \[sin m phi\] / m = cos(m c) 2 sin(m w / 2) / m with the centre c and the width w, in which nothing
/// cancels.
fn azimuth(m: usize, phi0: f64, phi1: f64) -> [f64; 2] {
    let width = phi1 - phi0;
    if m == 0 {
        return [width, 0.0];
    }
    let m = m as f64;
    let (sine, cosine) = math::sin_cos(m * (0.5 * (phi0 + phi1)));
    let length = 2.0 * math::sin(0.5 * m * width) / m;
    [cosine * length, sine * length]
}
