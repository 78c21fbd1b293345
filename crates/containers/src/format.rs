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
    /// TIFF, BigTIFF too.
    Tiff,
    /// Truevision TGA.
    Tga,
    /// WebP.
    WebP,
    /// PFM, a portable float map.
    Pfm,
}

impl Format {
    /// The format's usual name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OpenExr => "OpenEXR",
            Self::Radiance => "Radiance",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Tiff => "TIFF",
            Self::Tga => "TGA",
            Self::WebP => "WebP",
            Self::Pfm => "PFM",
        }
    }

    /// The format whose signature the bytes begin with; TGA has none, and is known by a header that makes
    /// sense.
    pub fn sniff(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Self::OpenExr),
            [b'#', b'?', ..] => Some(Self::Radiance),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Self::WebP),
            [b'P', b'F' | b'f', next, ..] if next.is_ascii_whitespace() => Some(Self::Pfm),
            _ => is_tga(bytes).then_some(Self::Tga),
        }
    }
}

/// Whether the bytes begin with a header of TGA (Truevision TGA File Format Specification, version 2.0): the
/// fields have only a few values that go together.
fn is_tga(bytes: &[u8]) -> bool {
    let Some(
        &[
            _,
            palette,
            kind,
            _,
            _,
            length_low,
            length_high,
            entry,
            _,
            _,
            _,
            _,
            w0,
            w1,
            h0,
            h1,
            depth,
            descriptor,
        ],
    ) = bytes.first_chunk()
    else {
        return false;
    };
    let has_palette =
        palette == 1 && [length_low, length_high] != [0; 2] && [15, 16, 24, 32].contains(&entry);
    let known = match kind {
        1 | 9 => has_palette && [8, 16].contains(&depth),
        2 | 10 => (palette == 0 || has_palette) && [15, 16, 24, 32].contains(&depth),
        3 | 11 => palette == 0 && [8, 16].contains(&depth),
        _ => false,
    };
    let alpha_bits = descriptor & 15;
    known && descriptor < 64 && [0, 1, 8].contains(&alpha_bits) && [w0, w1] != [0; 2] && [h0, h1] != [0; 2]
}

/// Refuses what is not a file of its own: no bytes, or a Git LFS pointer.
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
            format!("not an OpenEXR, Radiance, PNG, JPEG, TIFF, TGA, WebP or PFM file: it begins with the bytes {first}"),
        )
    })
}
