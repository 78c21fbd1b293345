//! The degrees: given ones, or the least that meet a tolerance [RH02, app. C].
//!
//! A few outgoing directions give an estimate of F. A table is made with that F and P = 4; as long as it does
//! not hold enough, F or P is doubled, whichever holds more of the energy in its upper half. Then P is
//! lowered as far as the tolerance allows, then F.

use std::f64::consts::PI;

use rayon::prelude::*;
use sh::{Degree, Tolerance};

use super::error::ProjectionError;
use super::legendre::Legendre;
use super::slice::{Fineness, Slice, Source, slice};
use super::tabulation::{ACCURACY, AllowedDifference, Table, coarse, energies, tabulate};

/// The F and P that the search begins with.
const FIRST: (usize, usize) = (16, 4);

/// The most entries (F+1)(P+1)^2 of a table that the search makes: [119, 32], [452, 16] or [2047, 7]. Larger
/// ones make no usable map, and the search would take seconds.
const MOST_SEARCHED: usize = 1 << 17;

/// The highest P of the search.
const MOST_P: usize = 32;

/// Degrees that miss a tolerance are accepted if they hold at least this share of the energy.
const LEAST_CAPTURED: f64 = 0.5;

/// Outgoing directions at which the sharpness of a material is measured.
const PROBES: [f64; 3] = [0.3, 1.2, 2.2];

/// A table that meets a tolerance, and the least degrees that do. If no table of the search does, the last
/// one, provided that it holds half of the energy, and the least degrees that lose no more than the tolerance
/// of what it holds.
pub(super) fn least(
    source: Source<'_>,
    tolerance: Tolerance,
) -> Result<(Table, usize, usize), ProjectionError> {
    let scale = coarse(source)?;
    let (mut f, mut p) = (likely(source, tolerance, scale)?, FIRST.1);
    loop {
        let table =
            tabulate(source, f, p, AllowedDifference { scale, accuracy: ACCURACY.min(tolerance.get()) })?;
        let energy = energies(&table.rho, p);
        let held = |f: usize, side: usize| -> f64 {
            energy.chunks_exact(p + 1).take(f + 1).flat_map(|row| &row[..side]).sum()
        };
        let enough = (1.0 - tolerance.get()) * table.total;
        let least = |enough: f64| {
            let least_p = (0..p).find(|&p| held(f, p + 1) >= enough).unwrap_or(p);
            (least_p, (0..f).find(|&f| held(f, least_p + 1) >= enough).unwrap_or(f))
        };
        if held(f, p + 1) >= enough {
            let (least_p, least_f) = least(enough);
            // A higher F might allow P to be lowered further.
            let higher = (f + f / 2).min(Degree::MAX.get());
            if least_f > f - f / 16 && higher > f && (higher + 1) * (p + 1) * (p + 1) <= MOST_SEARCHED {
                f = higher;
                continue;
            }
            return Ok((table, least_f, least_p));
        }
        let (upper_f, upper_p) = (held(f, p + 1) - held(f / 2, p + 1), held(f, p + 1) - held(f, p / 2 + 1));
        let captured = held(f, p + 1) / table.total;
        let (before_f, before_p) = (f, p);
        let (least_p, least_f) = least((1.0 - tolerance.get()) * held(f, p + 1));
        // As rho_hat is not negative, no l holds more than 2 l + 1 times the energy of l = 0: even all of
        // them may be too little.
        let most = 2.0 * held(0, p + 1) * Degree::MAX.rows() as f64;
        if upper_f >= upper_p / 4.0 {
            f = (2 * f).min(Degree::MAX.get());
        }
        if upper_p >= upper_f / 4.0 {
            p = (2 * p).min(MOST_P);
        }
        if (f, p) == (before_f, before_p) || most < enough || (f + 1) * (p + 1) * (p + 1) > MOST_SEARCHED {
            if captured >= LEAST_CAPTURED {
                return Ok((table, least_f, least_p));
            }
            return Err(ProjectionError::TooSharp {
                f: before_f,
                p: before_p,
                captured,
                tolerance: tolerance.get(),
            });
        }
    }
}

/// A degree F that probably meets a tolerance with some room, from the energy at a few outgoing directions.
fn likely(source: Source<'_>, tolerance: Tolerance, scale: f64) -> Result<usize, ProjectionError> {
    let (mut f, orders) = FIRST;
    // The mean energy of a slice.
    let mean = (scale / (4.0 * PI)).max(f64::MIN_POSITIVE);
    let fineness = Fineness { error: 1e-3 * mean, negligible: 1e-10 * mean };
    loop {
        // The energy of each l, and the whole energy, summed over the three.
        let (mut energy, mut total) = (vec![0.0; f + 1], 0.0);
        let legendre = Legendre::new(f, orders);
        let slices: Vec<Slice> = PROBES
            .into_par_iter()
            .map(|theta_o| {
                source.stop.check()?;
                Ok(slice(source, theta_o, &legendre, (f, orders), fineness)?)
            })
            .collect::<Result<_, ProjectionError>>()?;
        for slice in slices {
            total += slice.energy;
            for (sum, part) in energy.iter_mut().zip(energies(&slice.moments, orders)) {
                *sum += part;
            }
        }
        let held: f64 = energy.iter().sum();
        let upper: f64 = energy[f / 2 + 1..].iter().sum();
        let hopeless = energy[0] * Degree::MAX.rows() as f64 <= 0.5 * total;
        if hopeless && total > 0.0 {
            return Ok(FIRST.0);
        }
        if upper <= 0.5 * tolerance.get() * total || f == Degree::MAX.get() {
            let mut sum = 0.0;
            let enough = (1.0 - 0.7 * tolerance.get()) * held;
            let least = energy.iter().position(|part| {
                sum += part;
                sum >= enough
            });
            return Ok((least.unwrap_or(f) * 5 / 4 + 4).min(Degree::MAX.get()));
        }
        f *= 2;
    }
}
