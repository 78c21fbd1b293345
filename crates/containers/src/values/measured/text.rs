//! Numbers in text, each with the line that it stands on.

use std::f64::consts::FRAC_PI_2;
use std::str::{FromStr, from_utf8};

use crate::error::Error;

/// How far past 90 degrees an angle may lie that was rounded to four digits, in radians.
const ROUNDING: f64 = 1e-4;

/// The lines that hold something, numbered from 1; what follows a `#` is a comment.
pub(crate) fn lines(bytes: &[u8]) -> Result<impl Iterator<Item = (usize, &str)>, Error> {
    let text = from_utf8(bytes).map_err(|error| {
        Error::damaged(format!("byte {} is not text; expected UTF-8", error.valid_up_to()))
    })?;
    // Spreadsheets put a byte order mark first.
    Ok(text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty()))
}

/// The number that `word` is, whose meaning is `what`.
pub(crate) fn number<T: FromStr>(line: usize, word: &str, what: &str) -> Result<T, Error> {
    word.parse()
        .map_err(|_| Error::damaged(format!("line {line}: {word:?} is not a number; expected {what}")))
}

/// An angle from the normal, in radians; `degrees` says that the file's are not.
pub(super) fn theta(line: usize, word: &str, what: &str, degrees: bool) -> Result<f64, Error> {
    let angle = azimuth(line, word, what, degrees)?;
    if (0.0..=FRAC_PI_2 + ROUNDING).contains(&angle) {
        return Ok(angle.min(FRAC_PI_2));
    }
    let range = if degrees { "0 to 90 degrees" } else { "0 to pi/2 radians" };
    Err(Error::damaged(format!("line {line}: {what} is {word}; expected {range} from the normal")))
}

/// An angle around the normal, in radians.
pub(super) fn azimuth(line: usize, word: &str, what: &str, degrees: bool) -> Result<f64, Error> {
    let angle: f64 = number(line, word, what)?;
    if !angle.is_finite() {
        return Err(Error::damaged(format!("line {line}: {what} is {word}; expected an angle")));
    }
    Ok(if degrees { angle.to_radians() } else { angle })
}

/// A value of a BRDF.
pub(super) fn value(line: usize, word: &str, what: &str) -> Result<f64, Error> {
    let value: f64 = number(line, word, what)?;
    // The greatest that a table of f32 can hold, with room for the interpolation between such.
    if (0.0..=1e30).contains(&value) {
        return Ok(value);
    }
    Err(Error::damaged(format!("line {line}: {what} is {word}; expected a finite number, 0 or more")))
}
