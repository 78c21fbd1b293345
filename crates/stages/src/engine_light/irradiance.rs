//! Irradiance by few coefficients, without ringing.

use std::f64::consts::PI;

use engine::Reporter;
use sh::{Expansion, Penalty, non_negative};

/// The highest degree that a window is sought for: probes of few coefficients.
pub(crate) const MOST_WINDOWED: usize = 8;

/// Returns the series with the least window under which the irradiance is nowhere negative.
pub(crate) fn windowed(series: Expansion, reporter: &Reporter) -> Expansion {
    let mut irradiance = series.clone();
    for l in 0..=series.degree().get() {
        let factor = cosine(l);
        for row in &mut irradiance.coefficients_mut()[l * l..(l + 1) * (l + 1)] {
            *row = row.map(|value| value * factor);
        }
    }
    match non_negative(&irradiance) {
        Ok(found) if found.penalty > Penalty::ZERO => {
            reporter.note(format!(
                "window laplacian with lambda {:.3e}: the least irradiance is {:.4} instead of {:.4}",
                found.penalty.get(),
                found.after.value,
                found.before.value
            ));
            sh::Window::Laplacian(found.penalty).apply(&series)
        }
        // Without a positive mean no window helps, and nothing is changed.
        _ => series,
    }
}

/// The factor A_l of the clamped cosine: pi, 2 pi / 3, pi / 4, 0, -pi / 24 ... (Ramamoorthi and Hanrahan
/// 2001).
fn cosine(l: usize) -> f64 {
    match l {
        0 => PI,
        1 => 2.0 * PI / 3.0,
        l if l % 2 == 1 => 0.0,
        l => {
            // l! / (2^l (l/2)!^2), factor by factor.
            let central: f64 = (1..=l / 2).map(|k| (2 * k - 1) as f64 / (2 * k) as f64).product();
            let sign = if l % 4 == 2 { 1.0 } else { -1.0 };
            2.0 * PI * sign * central / ((l + 2) * (l - 1)) as f64
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of the cosine over the upper half times P_l, by the midpoint rule.
    #[test]
    fn the_cosine_has_its_factors() {
        for l in 0..=MOST_WINDOWED {
            let steps = 20_000;
            let mut row = vec![0.0; l + 1];
            let mut sum = 0.0;
            for step in 0..steps {
                let x = (f64::from(step) + 0.5) / f64::from(steps);
                sh::zonal_into(x, &mut row);
                sum += 2.0 * PI * x * row[l] / f64::from(steps);
            }
            assert!(
                (sum * sh::lambda(l) - cosine(l)).abs() < 1e-6,
                "{l}: {} {}",
                sum * sh::lambda(l),
                cosine(l)
            );
        }
    }
}
