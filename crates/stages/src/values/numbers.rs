//! How the numbers of a file are stored, in kinds whose files may hold floats of 16 or 32 bits.

use containers::Precision;
use engine::{Choice, Failure, Reporter, parameters};

use super::choices::{MapsFormat, Overflow, PrecisionName};
use super::overflow::{Content, Excess, LARGEST_HALF, note_floats};

parameters! {
    /// The parameters `precision` and `overflow` of exports.
    #[derive(Copy)]
    pub(crate) struct Numbers {
        /// Whether OpenEXR, KTX2 and DDS files hold 16-bit or 32-bit numbers. A half holds 3 digits, up to
        /// 65504. With "auto" all files of an item hold halves, or, if a value exceeds that, 32-bit floats,
        /// which a note says.
        precision: PrecisionName = PrecisionName::Auto,
        /// What happens to values past 65504, of either sign, if the files are to be of halves: with
        /// precision "half" they become +-65504, with a warning that says which share of each channel is
        /// lost; with "error" here the item fails, also if precision is "auto".
        overflow: Overflow = Overflow::Clamp,
    }
}

/// The container of files that are exported.
pub(crate) trait FileFormat: Choice {
    /// Whether its files may hold floats of 16 or 32 bits, so that a precision can be chosen.
    fn has_precision(self) -> bool;
}

impl FileFormat for MapsFormat {
    fn has_precision(self) -> bool {
        true
    }
}

impl Numbers {
    /// The errors of parameters that files of this format do not use.
    pub(crate) fn check<F: FileFormat>(self, format: F) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        let holds_halves = format.has_precision() && self.precision != PrecisionName::Float;
        if self.overflow != Overflow::Clamp && !holds_halves {
            errors.push(("overflow", "only files of half floats use it".into()));
        }
        if self.precision != PrecisionName::Auto && !format.has_precision() {
            let formats = F::words().into_iter().map(|(.., format)| format);
            let formats =
                F::expected_among(&formats.filter(|other| other.has_precision()).collect::<Vec<_>>());
            errors.push(("precision", format!("only format = {formats} uses it")));
        }
        errors
    }

    /// The precision of files that hold these texels, all of one item. Notes that they became 32-bit, or
    /// warns of what halves lose. A format that has no precision gets values as they are.
    ///
    /// # Errors
    /// If a value does not fit a half and `overflow` says that the item fails.
    pub(crate) fn precision(
        self,
        format: impl FileFormat,
        texels: &[[f32; 3]],
        content: Content,
        reporter: &Reporter,
    ) -> Result<Precision, Failure> {
        if self.precision == PrecisionName::Float || !format.has_precision() {
            return Ok(Precision::Float);
        }
        let excess = Excess::of(texels, content, LARGEST_HALF);
        if excess.count == 0 {
            return Ok(Precision::Half);
        }
        if self.overflow == Overflow::Error {
            return Err(Failure::new(format!("{} values exceed 65504, the largest half", excess.count))
                .help("precision = \"float\" keeps them"));
        }
        if self.precision == PrecisionName::Auto {
            note_floats(&excess, reporter);
            return Ok(Precision::Float);
        }
        let text = excess.text(content);
        reporter.warn(format!(
            "{text}; half floats end at 65504, and 32-bit floats keep it: leave out `precision`, or choose \"float\""
        ));
        Ok(Precision::Half)
    }
}
