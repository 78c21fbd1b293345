//! The degrees: given ones, or the least that meet a tolerance (paper 1, Appendix C).
//!
//! F and P are raised, the one that still holds more energy in its upper half first, until the coefficients hold enough. Then
//! P is lowered as far as that stays so, then F.

use sh::{Degree, Tolerance};

use super::slice::{NotFinite, Source};
use super::tabulation::{Table, tabulate};
use super::{MOST_COEFFICIENTS, ProjectionError};

/// Where the search begins: enough for most materials, so that one table is made.
const FIRST: (usize, usize) = (32, 4);

/// Sum over q of both signs and over channels of |rho_lpq|^2, shape [F+1, P+1].
pub(super) fn energies(rho: &[[f64; 3]], p: usize) -> Vec<f64> {
    rho.chunks_exact(p + 1)
        .map(|row| {
            let square = |rgb: &[f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
            square(&row[0]) + 2.0 * row[1..].iter().map(square).sum::<f64>()
        })
        .collect()
}

/// A table that meets a tolerance, and the least degrees that do.
pub(super) fn least(
    source: Source<'_>,
    tolerance: Tolerance,
) -> Result<(Table, usize, usize), ProjectionError> {
    let (mut f, mut p) = FIRST;
    loop {
        let table = tabulate(source, f, p).map_err(not_finite)?;
        let energy = energies(&table.rho, p);
        let held = |f: usize, side: usize| -> f64 {
            energy.chunks_exact(p + 1).take(f + 1).flat_map(|row| &row[..side]).sum()
        };
        let enough = (1.0 - tolerance.get()) * table.total;
        if held(f, p + 1) >= enough {
            let least_p = (0..p).find(|&p| held(f, p + 1) >= enough).unwrap_or(p);
            let least_f = (0..f).find(|&f| held(f, least_p + 1) >= enough).unwrap_or(f);
            return Ok((table, least_f, least_p));
        }
        let (upper_f, upper_p) = (held(f, p + 1) - held(f / 2, p + 1), held(f, p + 1) - held(f, p / 2 + 1));
        let captured = held(f, p + 1) / table.total;
        let (before_f, before_p) = (f, p);
        if upper_f >= upper_p / 4.0 {
            f = (2 * f).min(Degree::MAX.get());
        }
        if upper_p >= upper_f / 4.0 {
            p = (2 * p).min(Degree::MAX.get());
        }
        if (f, p) == (before_f, before_p) || (f + 1) * (p + 1) * (p + 1) > MOST_COEFFICIENTS {
            return Err(ProjectionError::TooSharp {
                f: before_f,
                p: before_p,
                captured,
                tolerance: tolerance.get(),
            });
        }
    }
}

pub(super) fn not_finite(at: NotFinite) -> ProjectionError {
    ProjectionError::NotFinite {
        theta_i: at.theta_i.to_degrees(),
        theta_o: at.theta_o.to_degrees(),
        phi: at.phi.to_degrees(),
    }
}
