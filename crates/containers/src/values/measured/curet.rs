//! The 205 measurements of one sample of the Columbia-Utrecht database (CURET), fitted as its authors do.
//!
//! The database publishes one table of 205 pairs of directions for all samples, `table.txt`: a line for each
//! pair has its number, theta_v, phi_v (view), theta_i and phi_i (light) in radians. `rbrdf.dat`, `gbrdf.dat`
//! and `bbrdf.dat` have a line for each of the 61 samples: its number and 205 values, the BRDF in 1/sr in
//! red, green and blue, in the order of the table. [`read_published`] reads one sample of these four files.
//! What the calibration left below zero counts as 0.
//!
//! A `.curet` file, the project's own layout, joins what belongs to one sample: the first line is `degrees`
//! or `radians`; then 205 lines, in any order, of theta_v, phi_v, theta_i, phi_i, r, g, b, separated by white
//! space; `#` starts a comment.
//!
//! Values are taken for linear Rec. 709. 205 measurements are too few for a sharp highlight, and the surfaces
//! are rough: they are fitted with the 55 reciprocal, isotropic products of Zernike polynomials up to order 8
//! ([`brdf::zernike`]), cut at 0.

use brdf::Material;
use brdf::scattered::{SHAPE, Sample};

use super::scattered::{MaterialAndNotes, direction};
use super::text;
use crate::error::Error;
use crate::format::refuse_non_files;

/// The files that the CURET database publishes: the directions of its measurements, and the values of all
/// samples in red, green and blue.
pub const CURET_FILES: [&str; 4] = ["table.txt", "rbrdf.dat", "gbrdf.dat", "bbrdf.dat"];

/// The measurements of a sample.
const COUNT: usize = 205;

/// The order of the polynomials.
const ORDER: usize = 8;

pub(super) fn read(bytes: &[u8]) -> Result<MaterialAndNotes, Error> {
    fitted(&parse(bytes)?, Vec::new())
}

/// The material of a sample's number in the bytes of the published files, in the order of [`CURET_FILES`].
pub(super) fn read_published(files: [&[u8]; 4], sample: usize) -> Result<MaterialAndNotes, Error> {
    let (samples, below) = parse_published(files, sample)?;
    let note = format!("{below} of {} values are below zero and count as 0", 3 * COUNT);
    fitted(&samples, if below > 0 { vec![note] } else { Vec::new() })
}

fn fitted(samples: &[Sample], mut notes: Vec<String>) -> Result<MaterialAndNotes, Error> {
    let fit = brdf::zernike::fit(samples, ORDER).map_err(|error| Error::damaged(error.to_string()))?;
    let measured = fit.table(SHAPE).map_err(|error| Error::damaged(error.to_string()))?;
    notes.push(format!(
        "{COUNT} measurements were fitted with Zernike polynomials of order {ORDER}; the RMS miss is {:.1} percent of the RMS value",
        100.0 * fit.miss()
    ));
    Ok((Material::Measured(measured), notes))
}

/// The measurements of a sample in the published files, and the number of values below zero.
pub(super) fn parse_published(files: [&[u8]; 4], sample: usize) -> Result<(Vec<Sample>, usize), Error> {
    for (name, bytes) in CURET_FILES.into_iter().zip(files) {
        refuse_non_files(bytes).map_err(|error| error.within(name))?;
    }
    let [table, colours @ ..] = files;
    let mut samples = directions(table).map_err(|error| error.within(CURET_FILES[0]))?;
    let mut below = 0;
    for (channel, (name, bytes)) in CURET_FILES[1..].iter().zip(colours).enumerate() {
        let values = values_of(bytes, sample).map_err(|error| error.within(*name))?;
        for (sample, value) in samples.iter_mut().zip(values) {
            below += usize::from(value < 0.0);
            sample.value[channel] = value.max(0.0);
        }
    }
    Ok((samples, below))
}

/// The directions of `table.txt`, with black for values.
fn directions(bytes: &[u8]) -> Result<Vec<Sample>, Error> {
    let mut samples = Vec::new();
    for (line, row) in text::lines(bytes)? {
        let words: Vec<&str> = row.split_whitespace().collect();
        let &[number, theta_v, phi_v, theta_i, phi_i] = words.as_slice() else {
            let found = words.len();
            return Err(Error::damaged(format!(
                "line {line}: {found} values; expected 5 (number theta_v phi_v theta_i phi_i)"
            )));
        };
        let expected = samples.len() + 1;
        if number != expected.to_string() || expected > COUNT {
            return Err(Error::damaged(format!(
                "line {line}: its number is {number}; expected the numbers 1 to {COUNT} in their order"
            )));
        }
        let [theta_v, theta_i] =
            [text::theta(line, theta_v, "theta_v", false)?, text::theta(line, theta_i, "theta_i", false)?];
        let [phi_v, phi_i] =
            [text::azimuth(line, phi_v, "phi_v", false)?, text::azimuth(line, phi_i, "phi_i", false)?];
        samples.push(Sample {
            incident: direction(theta_i, phi_i),
            outgoing: direction(theta_v, phi_v),
            value: [0.0; 3],
        });
    }
    if samples.len() < COUNT {
        return Err(Error::truncated(format!("{} pairs of directions; expected {COUNT}", samples.len())));
    }
    Ok(samples)
}

/// The values of a sample in one of the files of a colour.
fn values_of(bytes: &[u8], sample: usize) -> Result<Vec<f64>, Error> {
    let mut last = None;
    for (line, row) in text::lines(bytes)? {
        let mut words = row.split_whitespace();
        let number: usize = text::number(line, words.next().unwrap_or_default(), "the number of a sample")?;
        if number != sample {
            last = last.max(Some(number));
            continue;
        }
        let values = words.map(|word| {
            let value: f64 = text::number(line, word, "a value of the BRDF")?;
            // The greatest that a table of f32 can hold, with room for the interpolation between such.
            if value.abs() <= 1e30 {
                return Ok(value);
            }
            Err(Error::damaged(format!("line {line}: a value is {word}; expected a finite number")))
        });
        let values = values.collect::<Result<Vec<f64>, Error>>()?;
        if values.len() != COUNT {
            let found = values.len();
            return Err(Error::damaged(format!(
                "line {line}: sample {sample} has {found} values; expected {COUNT}"
            )));
        }
        return Ok(values);
    }
    let most = last.map_or("the file has none".to_owned(), |last| format!("the last is {last}"));
    Err(Error::damaged(format!("there is no sample {sample}; {most}")))
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
