//! Measured BRDFs: four formats, and a table ([`brdf::Measured`], or [`brdf::MeasuredAnisotropic`] if it
//! depends on the tangent).
//!
//! | ending | format | module text |
//! | --- | --- | --- |
//! | `.binary` | the MERL database: a dense table of half and difference angles | `merl` |
//! | `.brdf` | Cornell's and pbrt's irregular text: a spectrum per pair of directions | `cornell` |
//! | `.curet` | one sample of the CURET database, 205 measurements, in a layout of the project | `curet` |
//! | `.csv` | a plain table of angles or directions and colours, isotropic or not | `table` |
//!
//! The files that CURET publishes have several samples together: [`read_curet`] reads one of them.
//!
//! These files carry no signature: their ending says what they are, or the caller does. Angles of light and
//! view are from the normal; values are the BRDF in 1/sr, without the cosine. What a header claims is
//! compared with the length of the file before anything of that size is made.

mod cornell;
mod curet;
mod merl;
mod scattered;
mod spectrum;
mod table;
mod text;

use std::io::{Read, Seek};

use brdf::Material;

pub(crate) use text::{lines, number};

use crate::error::{Error, ErrorKind};
use crate::file_part::{beginning, length};
use crate::format::refuse_non_files;

pub use curet::CURET_FILES;

/// How a measured BRDF is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MeasuredFormat {
    /// The MERL database.
    Merl,
    /// Cornell's and pbrt's irregular text.
    Cornell,
    /// A sample of the CURET database.
    Curet,
    /// A plain table.
    Table,
}

impl MeasuredFormat {
    /// Every format.
    pub const ALL: [Self; 4] = [Self::Merl, Self::Cornell, Self::Curet, Self::Table];

    /// The format's name, as a material file may say it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Merl => "merl",
            Self::Cornell => "cornell",
            Self::Curet => "curet",
            Self::Table => "table",
        }
    }

    /// The ending of the format's files, without the dot.
    pub const fn ending(self) -> &'static str {
        match self {
            Self::Merl => "binary",
            Self::Cornell => "brdf",
            Self::Curet => "curet",
            Self::Table => "csv",
        }
    }

    /// The format that a file's name ends in, in capitals or not.
    pub fn of_name(file_name: &str) -> Option<Self> {
        let (_, ending) = file_name.rsplit_once('.')?;
        Self::ALL.into_iter().find(|format| ending.eq_ignore_ascii_case(format.ending()))
    }
}

/// A measured BRDF and what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The table: a [`Material::Measured`] or a [`Material::MeasuredAnisotropic`].
    pub material: Material,
    /// The format that the file was read as.
    pub format: MeasuredFormat,
    /// Notes for the user: values that were missing, out of gamut or fitted, in sentences.
    pub notes: Vec<String>,
}

/// The measured BRDF of a file. Its name gives the format if `format` does not.
///
/// # Errors
/// If the format is unknown, or the bytes are damaged or truncated: the error names line or byte, what was
/// found and what was expected.
///
/// # Example: a table of a grey matte surface
/// ```
/// let mut csv = String::from("theta_i,theta_o,phi,r,g,b\n");
/// for (theta_i, theta_o) in (0..80).map(|i| (i % 9 * 10, i / 9 * 10)) {
///     csv += &format!("{theta_i},{theta_o},{},0.1,0.1,0.1\n", theta_i + theta_o);
/// }
/// let chalk = containers::measured::read("chalk.csv", csv.as_bytes(), None)?;
/// let value = chalk.rho_hat(sphere::Direction::Z, sphere::Direction::from_angles(1.0, 0.0));
/// assert!((value[0] - 0.1).abs() < 1e-4);
/// # Ok::<(), containers::Error>(())
/// ```
pub fn read(file_name: &str, bytes: &[u8], format: Option<MeasuredFormat>) -> Result<Material, Error> {
    read_with_notes(file_name, bytes, format).map(|reading| reading.material)
}

/// The measured BRDF of a sample of the CURET database, by its number from 1 to 61, and what a user should
/// know about it. `files` are the contents of the published files, in the order of [`CURET_FILES`].
///
/// # Errors
/// If a file is damaged or truncated, or there is no such sample.
pub fn read_curet(files: [&[u8]; 4], sample: usize) -> Result<Reading, Error> {
    let format = MeasuredFormat::Curet;
    let (material, notes) =
        curet::read_published(files, sample).map_err(|error| error.within(format.name()))?;
    Ok(Reading { material, format, notes })
}

/// Checks what [`read_curet`] would read, without fitting it.
///
/// # Errors
/// For what [`read_curet`] refuses.
pub fn check_curet(files: [&[u8]; 4], sample: usize) -> Result<(), Error> {
    curet::parse_published(files, sample)
        .map(drop)
        .map_err(|error| error.within(MeasuredFormat::Curet.name()))
}

/// Checks the beginning of a file, and its length if its header declares that, without making a table of it.
///
/// # Errors
/// For what [`read`] refuses, if the header shows it.
pub fn check(
    file_name: &str,
    file: &mut (impl Read + Seek),
    format: Option<MeasuredFormat>,
) -> Result<(), Error> {
    let length = length(file)?;
    let bytes = beginning(file, CHECKED)?;
    refuse_non_files(&bytes)?;
    let format = format_of(file_name, format)?;
    // What is checked of a longer text may end within a line.
    let is_cut = bytes.len() < length && format != MeasuredFormat::Merl;
    let end = if is_cut { bytes.iter().rposition(|byte| *byte == b'\n').unwrap_or(0) } else { bytes.len() };
    let text = &bytes[..end];
    let checked = match format {
        MeasuredFormat::Merl => merl::declared(&bytes, length).map(drop),
        MeasuredFormat::Cornell => cornell::check(text),
        MeasuredFormat::Curet => curet::parse(text).map(drop),
        MeasuredFormat::Table => table::check(text),
    };
    match checked {
        Err(error) if is_cut && error.kind() == ErrorKind::Truncated => Ok(()),
        checked => checked.map_err(|error| error.within(format.name())),
    }
}

/// As many bytes of a file are checked.
const CHECKED: u64 = 1 << 16;

fn format_of(file_name: &str, format: Option<MeasuredFormat>) -> Result<MeasuredFormat, Error> {
    format.or_else(|| MeasuredFormat::of_name(file_name)).ok_or_else(|| {
        let endings =
            MeasuredFormat::ALL.map(|format| format!(".{} ({})", format.ending(), format.name())).join(", ");
        let message =
            format!("the ending of {file_name:?} is not that of a measured BRDF; expected {endings}");
        Error::new(ErrorKind::UnknownFormat, message)
    })
}

/// Reads a measured BRDF as [`read`] does, and says what a user should know about the file.
///
/// # Errors
/// The errors of [`read`].
pub fn read_with_notes(
    file_name: &str,
    bytes: &[u8],
    format: Option<MeasuredFormat>,
) -> Result<Reading, Error> {
    refuse_non_files(bytes)?;
    let format = format_of(file_name, format)?;
    let read = match format {
        MeasuredFormat::Merl => merl::read(bytes),
        MeasuredFormat::Cornell => cornell::read(bytes),
        MeasuredFormat::Curet => curet::read(bytes),
        MeasuredFormat::Table => table::read(bytes),
    };
    let (material, notes) = read.map_err(|error| error.within(format.name()))?;
    Ok(Reading { material, format, notes })
}
