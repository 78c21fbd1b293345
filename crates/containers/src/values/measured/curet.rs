//! `.curet`: the 205 measurements of one sample of the Columbia-Utrecht database (CURET), fitted as its
//! authors do.
//!
//! The database publishes one table of 205 pairs of directions for all samples, and in `rbrdf.dat`,
//! `gbrdf.dat` and `bbrdf.dat` one line of 205 values a sample. This format joins what belongs to one sample:
//! the first line is `degrees` or `radians`; then 205 lines, in any order, of theta_v, phi_v (view), theta_i,
//! phi_i (light), r, g, b, separated by white space; `#` starts a comment. Values are the BRDF in 1/sr, taken
//! for linear Rec. 709.
//!
//! 205 measurements are too few for a sharp highlight, and the surfaces are rough: they are fitted with the
//! 55 reciprocal, isotropic products of Zernike polynomials up to order 8 ([`brdf::zernike`]), cut at 0.

use brdf::Material;
use brdf::scattered::{SHAPE, Sample};

use super::scattered::{MaterialAndNotes, direction};
use super::text;
use crate::error::Error;

/// The measurements of a sample.
const COUNT: usize = 205;

/// The order of the polynomials.
const ORDER: usize = 8;

pub(super) fn read(bytes: &[u8]) -> Result<MaterialAndNotes, Error> {
    let samples = parse(bytes)?;
    let fit = brdf::zernike::fit(&samples, ORDER).map_err(|error| Error::damaged(error.to_string()))?;
    let measured = fit.table(SHAPE).map_err(|error| Error::damaged(error.to_string()))?;
    let notes = vec![format!(
        "{COUNT} measurements were fitted with Zernike polynomials of order {ORDER}; the RMS miss is {:.1} percent of the RMS value",
        100.0 * fit.miss()
    )];
    Ok((Material::Measured(measured), notes))
}

/// The measurements; those of the beginning of a file, too.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Sample>, Error> {
    let mut lines = text::lines(bytes)?;
    let units = "the unit of the angles, \"degrees\" or \"radians\"";
    let (line, unit) =
        lines.next().ok_or_else(|| Error::truncated(format!("no line holds anything; expected {units}")))?;
    let degrees = match unit {
        "degrees" => true,
        "radians" => false,
        other => {
            return Err(Error::damaged(format!("line {line}: {other:?} stands first; expected {units}")));
        }
    };
    let mut samples = Vec::new();
    for (line, row) in lines {
        let words: Vec<&str> = row.split_whitespace().collect();
        let &[theta_v, phi_v, theta_i, phi_i, r, g, b] = words.as_slice() else {
            let found = words.len();
            return Err(Error::damaged(format!(
                "line {line}: {found} values; expected 7 (theta_v phi_v theta_i phi_i r g b)"
            )));
        };
        if samples.len() == COUNT {
            return Err(Error::damaged(format!(
                "line {line}: more than {COUNT} measurements; expected {COUNT}"
            )));
        }
        let [theta_v, theta_i] = [
            text::theta(line, theta_v, "theta_v", degrees)?,
            text::theta(line, theta_i, "theta_i", degrees)?,
        ];
        let [phi_v, phi_i] =
            [text::azimuth(line, phi_v, "phi_v", degrees)?, text::azimuth(line, phi_i, "phi_i", degrees)?];
        samples.push(Sample {
            incident: direction(theta_i, phi_i),
            outgoing: direction(theta_v, phi_v),
            value: [text::value(line, r, "r")?, text::value(line, g, "g")?, text::value(line, b, "b")?],
        });
    }
    if samples.len() < COUNT {
        return Err(Error::truncated(format!("{} measurements; expected {COUNT}", samples.len())));
    }
    Ok(samples)
}
