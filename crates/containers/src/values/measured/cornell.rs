//! `.brdf`: irregular spectral measurements as text, of Cornell's Program of Computer Graphics, as pbrt reads
//! them.
//!
//! Numbers are separated by white space, and `#` starts a comment: the count n of wavelengths, the n
//! wavelengths in nanometres, rising, then for each measurement theta_i, phi_i, theta_o, phi_o in radians and
//! the BRDF in 1/sr at each wavelength. The file does not say how many measurements there are. Spectra become
//! linear Rec. 709 as `spectrum` says; what lies out of that gamut is cut at 0.

use brdf::scattered::Sample;

use super::scattered::{MaterialAndNotes, direction, interpolated};
use super::spectrum::Observer;
use super::text;
use crate::error::Error;

/// The most wavelengths that are read.
const MOST_WAVELENGTHS: usize = 1024;

/// Checks the wavelengths.
pub(super) fn check(bytes: &[u8]) -> Result<(), Error> {
    wavelengths(&mut words(bytes)?).map(drop)
}

/// The words of the file, each with its line.
fn words(bytes: &[u8]) -> Result<impl Iterator<Item = (usize, &str)>, Error> {
    Ok(text::lines(bytes)?.flat_map(|(line, held)| held.split_whitespace().map(move |word| (line, word))))
}

/// The number of wavelengths, the spectrum's observer and the line of the number.
fn wavelengths<'a>(
    words: &mut impl Iterator<Item = (usize, &'a str)>,
) -> Result<(usize, Observer, usize), Error> {
    let (line, word) =
        words.next().ok_or_else(|| Error::truncated("the file ends before the count of wavelengths"))?;
    let count: usize = text::number(line, word, "the count of wavelengths")?;
    if !(1..=MOST_WAVELENGTHS).contains(&count) {
        return Err(Error::damaged(format!(
            "line {line}: {count} wavelengths; expected 1 to {MOST_WAVELENGTHS}"
        )));
    }
    let mut wavelengths = Vec::new();
    while wavelengths.len() < count {
        let (line, word) = words.next().ok_or_else(|| {
            let found = wavelengths.len();
            Error::truncated(format!("the file ends after {found} wavelengths; its count says {count}"))
        })?;
        let wavelength: f64 = text::number(line, word, "a wavelength")?;
        let rises = wavelengths.last().is_none_or(|before| wavelength > *before);
        if !(100.0..=10_000.0).contains(&wavelength) || !rises {
            return Err(Error::damaged(format!(
                "line {line}: wavelength {word}; expected {count} rising wavelengths in nanometres, 100 to 10000"
            )));
        }
        wavelengths.push(wavelength);
    }
    let observer = Observer::new(&wavelengths).ok_or_else(|| {
        let (first, last) = (wavelengths[0], wavelengths[count - 1]);
        Error::unsupported(format!(
            "the wavelengths run from {first} to {last} nm; expected them to span 450 to 630 nm at least"
        ))
    })?;
    Ok((count, observer, line))
}

pub(super) fn read(bytes: &[u8]) -> Result<MaterialAndNotes, Error> {
    let mut words = words(bytes)?;
    let (count, observer, line) = wavelengths(&mut words)?;

    let mut samples = Vec::new();
    let (mut row, mut last_line) = (Vec::with_capacity(4 + count), line);
    let mut angles = [0.0; 4];
    let (mut cut, mut deepest) = (0usize, 0.0f64);
    for (line, word) in words {
        last_line = line;
        match row.len() {
            place @ (0 | 2) => {
                angles[place] = text::theta(line, word, ["theta_i", "", "theta_o"][place], false)?
            }
            place @ (1 | 3) => angles[place] = text::azimuth(line, word, "phi", false)?,
            _ => {}
        }
        row.push(if row.len() < 4 { 0.0 } else { text::value(line, word, "the BRDF")? });
        if row.len() == 4 + count {
            let colour = observer.rec_709(&row[4..]);
            let least = colour.into_iter().fold(0.0, f64::min);
            if least < 0.0 {
                cut += 1;
                deepest = deepest.max(-least / colour.into_iter().fold(0.0, f64::max).max(1e-30));
            }
            samples.push(Sample {
                incident: direction(angles[0], angles[1]),
                outgoing: direction(angles[2], angles[3]),
                value: colour.map(|channel| channel.max(0.0)),
            });
            row.clear();
        }
    }
    if !row.is_empty() {
        return Err(Error::truncated(format!(
            "line {last_line}: the last measurement has {} of {} values (4 angles and {count} wavelengths)",
            row.len(),
            4 + count
        )));
    }
    let mut notes = Vec::new();
    if cut > 0 {
        notes.push(format!(
            "{cut} of {} measurements lie out of the gamut of Rec. 709; their negative channels, down to {:.2} of the greatest, became 0",
            samples.len(),
            -deepest
        ));
    }
    interpolated(&samples, false, notes)
}
