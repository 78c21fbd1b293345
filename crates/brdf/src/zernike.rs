//! A smooth BRDF as products of Zernike polynomials (Koenderink and van Doorn, "Phenomenological description
//! of bidirectional surface reflection", 1998), for coarse measurements of rough surfaces.
//!
//! rho = sqrt(2) sin(theta / 2) maps the hemisphere onto the unit disc and preserves areas, so that
//! K_n^m(theta, phi) = sqrt((n + 1) / 2 pi) R_n^m(rho) e^(i m phi), with Zernike's radial polynomials R, are
//! orthogonal on it. Of their products, only these are isotropic, symmetric and reciprocal:
//!
//! (K_n^m(theta_i) K_n'^m(theta_o) + K_n'^m(theta_i) K_n^m(theta_o)) cos(m (phi_i - phi_o)), m <= n <= n', n
//! and n' even with m.
//!
//! There are 5 up to order 2 and 55 up to order 8. Their factors are least squares with a small penalty on
//! fine terms, a thousandth of the mean square of a term times ((n^2 + n'^2) / 2 N^2)^2: with 205 samples for
//! 55 factors, the samples alone do not determine the fit in gaps and toward grazing. Negative values are set
//! to 0.
//!
//! Order 8 meets matte surfaces and cloth to 2 %, also between the samples, but no highlight: the manual of
//! the kind `import-material` has the errors.

use std::f64::consts::{FRAC_PI_2, PI};

use sphere::Direction;

use crate::scattered::{Sample, ScatteredError};
use crate::{Measured, MeasuredError, from_half_difference};

/// The highest order that is fitted.
pub const MOST_ORDER: usize = 12;

/// A fit of order N to samples of a BRDF.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    terms: Vec<ZernikeTerm>,
    factors: Vec<[f64; 3]>,
    miss: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ZernikeTerm {
    n: usize,
    other: usize,
    m: usize,
}

/// The least-squares factors of all terms up to `order` (limited to [`MOST_ORDER`]).
///
/// # Errors
/// If there are fewer samples than terms, or a sample is impossible.
pub fn fit(samples: &[Sample], order: usize) -> Result<Fit, ScatteredError> {
    let order = order.min(MOST_ORDER);
    let terms = terms(order);
    if samples.len() < terms.len() {
        return Err(ScatteredError::TooFew { found: samples.len() });
    }
    let good = |sample: &Sample| sample.value.iter().all(|value| value.is_finite() && *value >= 0.0);
    if let Some(sample) = samples.iter().position(|sample| !good(sample)) {
        return Err(ScatteredError::Sample { sample });
    }
    let n = terms.len();
    let mut matrix = vec![vec![0.0; n]; n];
    let mut right = vec![[0.0; 3]; n];
    let mut row = vec![0.0; n];
    for sample in samples {
        evaluate(&terms, sample.incident, sample.outgoing, &mut row);
        for i in 0..n {
            for j in 0..=i {
                matrix[i][j] += row[i] * row[j];
            }
            for channel in 0..3 {
                right[i][channel] += row[i] * sample.value[channel];
            }
        }
    }
    let mean = (0..n).map(|i| matrix[i][i]).sum::<f64>() / n as f64;
    for (i, term) in terms.iter().enumerate() {
        let fineness = (term.n * term.n + term.other * term.other) as f64 / (2 * order * order).max(1) as f64;
        matrix[i][i] += 1e-3 * mean * fineness * fineness + 1e-12 * mean + 1e-300;
    }
    let factors = cholesky(matrix, right);
    let mut fit = Fit { terms, factors, miss: 0.0 };
    let (mut missed, mut square) = (0.0, 0.0);
    for sample in samples {
        let found = fit.value(sample.incident, sample.outgoing);
        for channel in 0..3 {
            missed += math::powi(found[channel] - sample.value[channel], 2);
            square += math::powi(sample.value[channel], 2);
        }
    }
    fit.miss = if square > 0.0 { (missed / square).sqrt() } else { 0.0 };
    Ok(fit)
}

impl Fit {
    /// The BRDF in 1/sr, 0 or more; below the horizon it is the value at the horizon.
    pub fn value(&self, incident: Direction, outgoing: Direction) -> [f64; 3] {
        let mut row = vec![0.0; self.terms.len()];
        evaluate(&self.terms, incident, outgoing, &mut row);
        let sum =
            |channel: usize| row.iter().zip(&self.factors).map(|(term, factor)| term * factor[channel]).sum();
        [0, 1, 2].map(|channel| f64::max(0.0, sum(channel)))
    }

    /// The RMS of the fit's error at the samples, as a share of their RMS.
    pub fn miss(&self) -> f64 {
        self.miss
    }

    /// The fit as a table.
    ///
    /// # Errors
    /// If the shape is impossible.
    pub fn table(&self, shape: [usize; 3]) -> Result<Measured, MeasuredError> {
        let [_, n_d, n_phi] = shape;
        let mut values = vec![[0.0; 3]; Measured::entries(shape)?];
        for (row, values) in values.chunks_exact_mut(n_phi).enumerate() {
            for k in 0..=n_phi / 2 {
                let [incident, outgoing] =
                    from_half_difference(Measured::node(shape, [row / n_d, row % n_d, k]));
                let value = self.value(incident, outgoing).map(|value| value as f32);
                values[k] = value;
                if k > 0 {
                    values[n_phi - k] = value;
                }
            }
        }
        Measured::new(shape, values)
    }
}

fn terms(order: usize) -> Vec<ZernikeTerm> {
    let mut terms = Vec::new();
    for m in 0..=order {
        for n in (m..=order).step_by(2) {
            for other in (n..=order).step_by(2) {
                terms.push(ZernikeTerm { n, other, m });
            }
        }
    }
    terms
}

/// The value of each term.
fn evaluate(terms: &[ZernikeTerm], incident: Direction, outgoing: Direction, row: &mut [f64]) {
    let [light, view] = [incident, outgoing].map(|direction| radial(direction.theta().min(FRAC_PI_2)));
    let azimuth = incident.phi() - outgoing.phi();
    for (value, term) in row.iter_mut().zip(terms) {
        let ZernikeTerm { n, other, m } = *term;
        let product = light[n][m] * view[other][m] + light[other][m] * view[n][m];
        *value = product * math::cos(m as f64 * azimuth);
    }
}

/// K_n^m(theta) without its azimuth, by n and m, for m <= n, n - m even; by the recurrence of Kintner:
/// R_m^m = rho^m, R_(m+2)^m = rho^m ((m + 2) rho^2 - m - 1), and from there upward in steps of 2.
fn radial(theta: f64) -> [[f64; MOST_ORDER + 1]; MOST_ORDER + 1] {
    let rho = std::f64::consts::SQRT_2 * math::sin(theta / 2.0);
    let square = rho * rho;
    let mut r = [[0.0; MOST_ORDER + 1]; MOST_ORDER + 1];
    for m in 0..=MOST_ORDER {
        r[m][m] = math::powi(rho, m as i32);
        if m + 2 <= MOST_ORDER {
            r[m + 2][m] = r[m][m] * ((m + 2) as f64 * square - (m + 1) as f64);
        }
        for n in (m + 4..=MOST_ORDER).step_by(2) {
            let (x, y) = (n as f64, m as f64);
            let k_1 = (x + y) * (x - y) * (x - 2.0) / 2.0;
            let k_2 = 2.0 * x * (x - 1.0) * (x - 2.0);
            let k_3 = -y * y * (x - 1.0) - x * (x - 1.0) * (x - 2.0);
            let k_4 = -x * (x + y - 2.0) * (x - y - 2.0) / 2.0;
            r[n][m] = ((k_2 * square + k_3) * r[n - 2][m] + k_4 * r[n - 4][m]) / k_1;
        }
    }
    for n in 0..=MOST_ORDER {
        for value in &mut r[n] {
            *value *= ((n + 1) as f64 / (2.0 * PI)).sqrt();
        }
    }
    r
}

/// The solution of a symmetric positive definite system, of which the lower half is given.
fn cholesky(mut matrix: Vec<Vec<f64>>, mut right: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let n = matrix.len();
    for i in 0..n {
        for j in 0..=i {
            let sum = matrix[i][j] - (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum::<f64>();
            matrix[i][j] = if i == j { sum.max(f64::MIN_POSITIVE).sqrt() } else { sum / matrix[j][j] };
        }
        for channel in 0..3 {
            let sum: f64 = (0..i).map(|k| matrix[i][k] * right[k][channel]).sum();
            right[i][channel] = (right[i][channel] - sum) / matrix[i][i];
        }
    }
    for i in (0..n).rev() {
        for channel in 0..3 {
            let sum: f64 = (i + 1..n).map(|k| matrix[k][i] * right[k][channel]).sum();
            right[i][channel] = (right[i][channel] - sum) / matrix[i][i];
        }
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_5_terms_of_order_2_and_55_of_order_8() {
        assert_eq!([2, 8].map(|order| terms(order).len()), [5, 55]);
    }

    /// Gauss' rule would be exact; 4000 midpoints in theta leave an error of about (100 / 4000)^2 / 24 <
    /// 1e-4.
    #[test]
    fn the_functions_are_orthonormal_on_the_hemisphere() {
        let count = 4000;
        let mut products = vec![0.0; 13 * 13 * 13];
        for step in 0..count {
            let theta = (step as f64 + 0.5) / count as f64 * FRAC_PI_2;
            let r = radial(theta);
            let area = theta.sin() * FRAC_PI_2 / count as f64 * 2.0 * PI;
            for m in 0..=MOST_ORDER {
                for n in (m..=MOST_ORDER).step_by(2) {
                    for other in (m..=MOST_ORDER).step_by(2) {
                        products[(m * 13 + n) * 13 + other] += r[n][m] * r[other][m] * area;
                    }
                }
            }
        }
        for m in 0..=MOST_ORDER {
            for n in (m..=MOST_ORDER).step_by(2) {
                for other in (m..=MOST_ORDER).step_by(2) {
                    let expected = if n == other { 1.0 } else { 0.0 };
                    let found = products[(m * 13 + n) * 13 + other];
                    assert!((found - expected).abs() < 1e-3, "m {m}, n {n}, {other}: {found}");
                }
            }
        }
    }

    fn samples(count: u32, f: impl Fn(Direction, Direction) -> [f64; 3]) -> Vec<Sample> {
        (0..count)
            .map(|i| {
                let at = |seed: f64| {
                    let i = f64::from(i) + seed;
                    Direction::from_angles(1.5 * (i * 0.754_877).fract().sqrt(), i * 2.399_963 * seed)
                };
                let (incident, outgoing) = (at(1.0), at(1.7));
                Sample { incident, outgoing, value: f(incident, outgoing) }
            })
            .collect()
    }

    /// The penalty costs at most its own size, 1e-3 of a term.
    #[test]
    fn a_function_of_the_span_comes_back() {
        let f = |incident: Direction, outgoing: Direction| {
            let (light, view) = (incident.vector(), outgoing.vector());
            let square = |z: f64| 1.0 - z; // rho^2
            let along = light.x * view.x + light.y * view.y;
            let scale = ((1.0 + light.z) * (1.0 + view.z)).sqrt();
            [0.3, 0.2 + 0.1 * square(light.z) * square(view.z), 0.3 - 0.05 * along / scale]
        };
        let fit = fit(&samples(205, f), 8).unwrap();
        assert!(fit.miss() < 1e-3, "{}", fit.miss());
        let table = fit.table([45, 45, 36]).unwrap();
        for sample in samples(300, f).iter().skip(205) {
            let found = fit.value(sample.incident, sample.outgoing);
            let tabulated = table.brdf(sample.incident, sample.outgoing);
            for channel in 0..3 {
                assert!((found[channel] - sample.value[channel]).abs() < 1e-3, "{found:?} {sample:?}");
                assert!((tabulated[channel] - found[channel]).abs() < 2e-3, "{tabulated:?} {found:?}");
            }
        }
    }

    #[test]
    fn a_highlight_leaves_nothing_negative() {
        let f = |incident: Direction, outgoing: Direction| {
            let half = (incident.vector() + outgoing.vector()).normalize().z;
            [half.powi(200) * 5.0; 3]
        };
        let fit = fit(&samples(205, f), 8).unwrap();
        let table = fit.table([30, 30, 12]).unwrap();
        assert!(table.values().iter().flatten().all(|value| *value >= 0.0));
        assert!(fit.miss() > 0.1, "no polynomial of order 8 is a sharp highlight");
    }

    /// Pairs of directions as CURET has them: the camera stands at seven places, 22.5 degrees apart, in a
    /// plane with the lamp, and the sample is turned; neither is seen from more than 84.4 degrees.
    fn turned_samples(f: impl Fn(Direction, Direction) -> [f64; 3]) -> Vec<Sample> {
        let lamp = sphere::DVec3::X;
        let turned = (0..120).flat_map(|turn| {
            let normal = sphere::spiral(turn, 120).vector();
            (1..8).map(move |place| {
                let (sine, cosine) = (f64::from(place) * PI / 8.0).sin_cos();
                (normal, sphere::DVec3::new(cosine, sine, 0.0))
            })
        });
        let seen = turned.filter(|(normal, camera)| {
            normal.z >= 0.0 && normal.dot(lamp).min(normal.dot(*camera)) > 84.4_f64.to_radians().cos()
        });
        let samples: Vec<Sample> = seen
            .map(|(normal, camera)| {
                let (x, y) = normal.any_orthonormal_pair();
                let at = |w: sphere::DVec3| {
                    Direction::normalised(sphere::DVec3::new(x.dot(w), y.dot(w), normal.dot(w)))
                };
                let (incident, outgoing) = (at(lamp), at(camera));
                Sample { incident, outgoing, value: f(incident, outgoing) }
            })
            .collect();
        (0..205).map(|i| samples[i * samples.len() / 205]).collect()
    }

    /// The errors in the manual of `import-material`: RMS at the measurements, and at directions up to 80
    /// degrees from the normal in which nothing was measured, as shares of the RMS there; and the latter of
    /// the layered fit that a `.csv` gets.
    #[test]
    fn order_8_has_the_errors_that_the_manual_states() {
        use crate::{Material, OrenNayar, Standard, StandardParameters};
        let standard = |roughness: f64, sheen: f64| {
            let parameters = StandardParameters {
                base_color: [0.3; 3],
                roughness,
                sheen: [sheen; 3],
                sheen_roughness: 0.5,
                ..Default::default()
            };
            Material::Standard(Standard::new(parameters).unwrap())
        };
        for (material, stated) in [
            (Material::OrenNayar(OrenNayar::new([0.3; 3], 30.0).unwrap()), [0.004, 0.020, 0.041]),
            (standard(1.0, 0.5), [0.001, 0.009, 0.031]),
            (standard(0.7, 0.0), [0.005, 0.096, 0.028]),
            (standard(0.5, 0.0), [0.062, 0.51, 0.021]),
            (standard(0.3, 0.0), [0.30, 1.0, 0.147]),
        ] {
            let f = |incident: Direction, outgoing: Direction| {
                material.rho_hat(incident, outgoing).map(|value| value / incident.vector().z)
            };
            let measured = turned_samples(f);
            assert_eq!(measured.len(), 205);
            let fit = fit(&measured, 8).unwrap();
            let elsewhere = |of: &dyn Fn(Direction, Direction) -> [f64; 3]| {
                let (mut missed, mut square) = (0.0, 0.0);
                let at = |share: f64, phi: f64| {
                    let rim = math::cos(80_f64.to_radians());
                    Direction::from_angles(math::acos(1.0 - share.fract() * (1.0 - rim)), phi)
                };
                for i in 0..4000 {
                    let i = f64::from(i);
                    let (light, view) = (at(i * 0.754_877, 0.3), at(i * 0.569_840, i * 2.399_963));
                    let (found, expected) = (of(light, view)[0], f(light, view)[0]);
                    missed += math::powi(found - expected, 2);
                    square += expected * expected;
                }
                (missed / square).sqrt()
            };
            let layered = crate::scattered::interpolate(&measured, [45, 45, 36]).unwrap().measured;
            let found = [
                fit.miss(),
                elsewhere(&|light, view| fit.value(light, view)),
                elsewhere(&|light, view| layered.brdf(light, view)),
            ];
            for (found, stated) in found.into_iter().zip(stated) {
                assert!(
                    (found - stated).abs() < 0.05 * stated + 5e-4,
                    "{found}, but the manual has {stated}"
                );
            }
        }
    }

    #[test]
    fn too_few_samples_are_an_error() {
        assert_eq!(fit(&samples(54, |_, _| [1.0; 3]), 8), Err(ScatteredError::TooFew { found: 54 }));
        assert!(fit(&samples(100, |_, _| [f64::NAN; 3]), 8).is_err());
    }
}
