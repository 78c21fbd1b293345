//! What a format's module gives, and how scattered measurements become a table.

use brdf::Material;
use brdf::scattered::{
    ANISOTROPIC_SHAPE, FEWEST, SHAPE, Sample, ScatteredError, interpolate, interpolate_anisotropic,
};
use sphere::Direction;

use crate::error::Error;

/// A material that a format's module reads from bytes, and notes.
pub(super) type MaterialAndNotes = (Material, Vec<String>);

/// A table out of scattered samples, with a note of how well they are met; `anisotropic` if they depend on
/// the tangent.
pub(super) fn interpolated(
    samples: &[Sample],
    anisotropic: bool,
    mut notes: Vec<String>,
) -> Result<MaterialAndNotes, Error> {
    if samples.len() < FEWEST {
        let message = format!("{} measurements; expected {FEWEST} or more", samples.len());
        return Err(Error::truncated(message));
    }
    let damaged = |error: ScatteredError| Error::damaged(error.to_string());
    let (material, held_out) = if anisotropic {
        let table = interpolate_anisotropic(samples, ANISOTROPIC_SHAPE).map_err(damaged)?;
        (Material::MeasuredAnisotropic(table.measured), table.held_out)
    } else {
        let table = interpolate(samples, SHAPE).map_err(damaged)?;
        (Material::Measured(table.measured), table.held_out)
    };
    notes.push(format!(
        "{} scattered measurements were interpolated; a trial that left out a fifth of them missed these by {:.1} percent (median)",
        samples.len(),
        100.0 * held_out
    ));
    Ok((material, notes))
}

/// A direction of a measurement; the angle from the normal may be a hair past the horizon by rounding.
pub(super) fn direction(theta: f64, phi: f64) -> Direction {
    Direction::from_angles(theta.min(std::f64::consts::FRAC_PI_2 - 1e-9), phi)
}
