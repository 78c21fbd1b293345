//! Which format bytes are in, by their content.

use crate::error::{Error, ErrorKind};

/// A picture format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// OpenEXR.
    OpenExr,
    /// Radiance RGBE or XYZE.
    Radiance,
    /// PNG.
    Png,
    /// JPEG.
    Jpeg,
}

impl Format {
    /// The format's usual name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OpenExr => "OpenEXR",
            Self::Radiance => "Radiance",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
        }
    }

    /// Whether the format can hold values above its white.
    pub const fn high_dynamic_range(self) -> bool {
        matches!(self, Self::OpenExr | Self::Radiance)
    }

    /// The format whose signature the bytes begin with.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::OpenExr),
            [b'#', b'?', ..] => Some(Self::Radiance),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            _ => None,
        }
    }
}

/// Refuses what is no file at all: no bytes, or a Git LFS pointer.
pub(crate) fn refuse_non_files(bytes: &[u8]) -> Result<(), Error> {
    if bytes.is_empty() {
        return Err(Error::new(ErrorKind::Empty, "the file is empty"));
    }
    if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        return Err(Error::new(
            ErrorKind::GitLfsPointer,
            "this is a Git LFS pointer, not the file itself; run `git lfs pull`",
        ));
    }
    Ok(())
}

/// The format of an image, or why it has none.
pub(crate) fn identify(bytes: &[u8]) -> Result<Format, Error> {
    refuse_non_files(bytes)?;
    Format::sniff(bytes).ok_or_else(|| {
        let first = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
        Error::new(
            ErrorKind::UnknownFormat,
            format!("not an OpenEXR, Radiance, PNG or JPEG file: it begins with the bytes {first}"),
        )
    })
}
