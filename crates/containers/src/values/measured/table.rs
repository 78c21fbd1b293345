//! `.csv`: a plain table, made by hand or by another program.
//!
//! The first line says what the columns are; each other line is one measurement: where the light and the view
//! are, then the BRDF in 1/sr, linear Rec. 709.
//!
//! | first line | directions |
//! | --- | --- |
//! | `theta_i,theta_o,phi,r,g,b` | an isotropic surface: the angles of light and view from the normal, and the azimuth between them (0: on the same side, 180: the mirror's) |
//! | `theta_i,phi_i,theta_o,phi_o,r,g,b` | an anisotropic one: the azimuths are from the tangent, counterclockwise as seen from above |
//! | `x_i,y_i,z_i,x_o,y_o,z_o,r,g,b` | the same as vectors of any length, x the tangent and z the normal |
//!
//! Angles are in degrees. Order and spacing of the lines do not matter, nor does it whether they form a grid
//! or are scattered; `#` starts a comment. The BRDF is taken to be reciprocal, so that half of a symmetric
//! table is enough.

use brdf::scattered::Sample;
use sphere::{DVec3, Direction};

use super::scattered::{MaterialAndNotes, direction, interpolated};
use super::text;
use crate::error::Error;

/// The meaning of the columns before the colour.
#[derive(Clone, Copy, PartialEq)]
enum Columns {
    Isotropic,
    Angles,
    Vectors,
}

impl Columns {
    const ALL: [Self; 3] = [Self::Isotropic, Self::Angles, Self::Vectors];

    const fn header(self) -> &'static str {
        match self {
            Self::Isotropic => "theta_i,theta_o,phi,r,g,b",
            Self::Angles => "theta_i,phi_i,theta_o,phi_o,r,g,b",
            Self::Vectors => "x_i,y_i,z_i,x_o,y_o,z_o,r,g,b",
        }
    }

    /// The directions of light and view of a line.
    fn directions(self, line: usize, words: &[&str]) -> Result<[Direction; 2], Error> {
        let theta = |word: &str, what: &str| text::theta(line, word, what, true);
        let phi = |word: &str, what: &str| text::azimuth(line, word, what, true);
        match (self, words) {
            (Self::Isotropic, &[theta_i, theta_o, between, ..]) => Ok([
                direction(theta(theta_i, "theta_i")?, 0.0),
                direction(theta(theta_o, "theta_o")?, phi(between, "phi")?),
            ]),
            (Self::Angles, &[theta_i, phi_i, theta_o, phi_o, ..]) => Ok([
                direction(theta(theta_i, "theta_i")?, phi(phi_i, "phi_i")?),
                direction(theta(theta_o, "theta_o")?, phi(phi_o, "phi_o")?),
            ]),
            (_, &[x_i, y_i, z_i, x_o, y_o, z_o, ..]) => {
                Ok([vector(line, [x_i, y_i, z_i], "i")?, vector(line, [x_o, y_o, z_o], "o")?])
            }
            _ => Err(Error::damaged(format!("line {line}: no directions"))),
        }
    }
}

/// A vector of any length that does not point below the horizon.
fn vector(line: usize, words: [&str; 3], whose: &str) -> Result<Direction, Error> {
    let mut axes = [0.0f64; 3];
    for ((axis, word), name) in axes.iter_mut().zip(words).zip(["x", "y", "z"]) {
        let what = format!("{name}_{whose}");
        *axis = text::number(line, word, &what)?;
        if !axis.is_finite() {
            return Err(Error::damaged(format!("line {line}: {what} is {word}; expected a finite number")));
        }
    }
    let found = Direction::new(DVec3::from_array(axes)).filter(|found| found.vector().z >= -1e-4);
    let found = found.ok_or_else(|| {
        let [x, y, z] = words;
        Error::damaged(format!(
            "line {line}: the direction ({x}, {y}, {z}) is not above the surface; expected a vector with z of 0 or more"
        ))
    })?;
    Ok(direction(found.theta(), found.phi()))
}

/// Checks the lines of a table, or of the beginning of one.
pub(super) fn check(bytes: &[u8]) -> Result<(), Error> {
    parse(bytes).map(drop)
}

pub(super) fn read(bytes: &[u8]) -> Result<MaterialAndNotes, Error> {
    let (columns, samples) = parse(bytes)?;
    interpolated(&samples, columns != Columns::Isotropic, Vec::new())
}

fn parse(bytes: &[u8]) -> Result<(Columns, Vec<Sample>), Error> {
    let mut lines = text::lines(bytes)?;
    let expected = || {
        let headers = Columns::ALL.map(|columns| format!("{:?}", columns.header())).join(" or ");
        format!("the header {headers}")
    };
    let (line, header) = lines
        .next()
        .ok_or_else(|| Error::truncated(format!("no line holds anything; expected {}", expected())))?;
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let columns =
        Columns::ALL.into_iter().find(|columns| columns.header().split(',').eq(names.iter().copied()));
    let columns = columns.ok_or_else(|| {
        Error::damaged(format!("line {line}: {header:?} stands first; expected {}", expected()))
    })?;
    let mut samples = Vec::new();
    for (line, row) in lines {
        let words: Vec<&str> = row.split(',').map(str::trim).collect();
        let &[.., r, g, b] = words.as_slice() else { return Err(wrong_count(line, &words, &names)) };
        if words.len() != names.len() {
            return Err(wrong_count(line, &words, &names));
        }
        let [incident, outgoing] = columns.directions(line, &words)?;
        let value = [text::value(line, r, "r")?, text::value(line, g, "g")?, text::value(line, b, "b")?];
        samples.push(Sample { incident, outgoing, value });
    }
    Ok((columns, samples))
}

fn wrong_count(line: usize, words: &[&str], names: &[&str]) -> Error {
    let (found, expected) = (words.len(), names.len());
    Error::damaged(format!("line {line}: {found} values; expected {expected} ({})", names.join(",")))
}
