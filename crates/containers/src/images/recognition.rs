//! The format of bytes, by their content.

use super::codec::KnownBy;
use crate::error::{Error, ErrorKind};
use crate::format::{Format, refuse_non_files};

impl Format {
    /// The format's usual name.
    pub const fn name(self) -> &'static str {
        self.codec().name
    }

    /// The format whose files usually have this ending, without its dot and in lower case.
    pub fn of_ending(ending: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|format| format.codec().endings.contains(&ending))
    }

    /// Whether every file of the format can hold light above its white. Of other formats, some files can:
    /// [`crate::images::image_header::declares_high_dynamic_range`].
    pub const fn is_high_dynamic_range(self) -> bool {
        self.codec().high_dynamic_range
    }

    /// The format whose signature the bytes begin with; TGA has none, and is known by a header that makes
    /// sense.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        let with = |known: fn(&KnownBy, &[u8]) -> bool| {
            Self::ALL.iter().copied().find(|format| known(&format.codec().known_by, bytes))
        };
        with(|known_by, bytes| matches!(known_by, KnownBy::Signature(begins) if begins(bytes)))
            .or_else(|| with(|known_by, bytes| matches!(known_by, KnownBy::Header(begins) if begins(bytes))))
    }
}

/// The format of an image, or why it has none.
pub(crate) fn identify(bytes: &[u8]) -> Result<Format, Error> {
    refuse_non_files(bytes)?;
    Format::sniff(bytes).ok_or_else(|| {
        let first = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
        let names: Vec<_> = Format::ALL.iter().map(|format| format.name()).collect();
        let (last, others) = names.split_last().unwrap_or((&"", &[]));
        Error::new(
            ErrorKind::UnknownFormat,
            format!("not an {} or {last} file: it begins with the bytes {first}", others.join(", ")),
        )
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn unknown_bytes_are_answered_with_every_format() {
        assert_eq!(
            identify(b"GIF89a").unwrap_err().to_string(),
            "not an OpenEXR, Radiance, PNG, JPEG, TIFF, TGA, WebP or PFM file: it begins with the bytes \
             47 49 46 38 39 61"
        );
    }

    #[test]
    fn an_ending_belongs_to_one_format() {
        let mut endings = BTreeSet::new();
        for format in Format::ALL {
            assert!(!format.codec().endings.is_empty(), "{format:?}");
            for ending in format.codec().endings {
                assert!(endings.insert(*ending), "{ending} is of two formats");
                assert_eq!(
                    (Format::of_ending(ending), ending.to_lowercase()),
                    (Some(*format), (*ending).into())
                );
            }
        }
        assert_eq!(Format::of_ending("bmp"), None);
    }
}
