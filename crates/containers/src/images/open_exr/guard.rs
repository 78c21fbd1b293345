//! Calls of the `exr` crate that cannot panic, and its texts.

use std::panic::{AssertUnwindSafe, catch_unwind};

use exr::error::Error as ExrError;
use exr::meta::attribute::{Text, TextBytes};

use crate::error::Error;
use crate::recipe::KEY;

/// Runs a part of the `exr` crate.
///
/// Damaged files make it panic: it adds and indexes with a file's numbers unchecked (B44's unpacking does,
/// seen in the tests of damage). All sizes are checked before, so that no panic is one of memory; this turns
/// the others into an error. The panic's own message still goes to the process' panic hook.
pub(super) fn guarded<T>(work: impl FnOnce() -> exr::error::Result<T>) -> Result<T, Error> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => result.map_err(describe),
        Err(_) => Err(Error::damaged("the header and the data contradict each other")),
    }
}

fn describe(error: ExrError) -> Error {
    match error {
        ExrError::Invalid(message) if message.contains("reference to missing bytes") => {
            Error::truncated("the file ends before its data does")
        }
        ExrError::Invalid(message) => Error::damaged(message.into_owned()),
        ExrError::NotSupported(message) => Error::unsupported(message.into_owned()),
        ExrError::Io(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::truncated("the file ends before its data does")
        }
        other => Error::damaged(other.to_string()),
    }
}

/// A text of UTF-8 bytes: the crate's own conversion refuses what is not Latin-1, the format does not.
pub(super) fn text(value: &str) -> Text {
    Text::from_bytes_unchecked(TextBytes::from_slice(value.as_bytes()))
}

pub(super) fn recipe_key() -> Text {
    text(KEY)
}
