//! What a format's module gives, and how scattered measurements become a table.

use brdf::Measured;
use brdf::scattered::{FEWEST, SHAPE, Sample, interpolate};
use sphere::Direction;

use crate::error::Error;

/// What a format's module makes of bytes.
pub(super) type Found = (Measured, Vec<String>);

/// A table out of scattered samples, with a note of how well they are met.
pub(super) fn interpolated(samples: &[Sample], mut notes: Vec<String>) -> Result<Found, Error> {
    if samples.len() < FEWEST {
        let message = format!("{} measurements; expected {FEWEST} or more", samples.len());
        return Err(Error::truncated(message));
    }
    let table = interpolate(samples, SHAPE).map_err(|error| Error::damaged(error.to_string()))?;
    notes.push(format!(
        "{} scattered measurements were interpolated; a trial that left out a fifth of them missed these by {:.1} percent (median)",
        samples.len(),
        100.0 * table.held_out
    ));
    Ok((table.measured, notes))
}

/// A direction of a measurement; the angle from the normal may be a hair past the horizon by rounding.
pub(super) fn direction(theta: f64, phi: f64) -> Direction {
    Direction::from_angles(theta.min(std::f64::consts::FRAC_PI_2 - 1e-9), phi)
}
