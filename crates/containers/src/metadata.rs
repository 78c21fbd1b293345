//! What a picture's file says about its pixels beside them: which way up they lie, and XMP. The module of
//! each format knows where that is.

use std::io::{Read, Seek};

use ::image::metadata::Orientation;

/// Exif and XMP that are longer are not read.
const MAX_METADATA_BYTES: usize = 4 << 20;

/// The prefix of Exif in a JPEG, which the writers of other formats sometimes put before it too.
pub(crate) const EXIF: &[u8] = b"Exif\0\0";

/// The metadata of a file that concern its pixels.
#[derive(Clone, Debug)]
pub(crate) struct Metadata {
    /// How the pixels are turned upright.
    pub(crate) orientation: Orientation,
    pub(crate) xmp: Option<String>,
}

impl Default for Metadata {
    fn default() -> Self {
        Self { orientation: Orientation::NoTransforms, xmp: None }
    }
}

impl Metadata {
    /// Takes the orientation of Exif, which may begin with the prefix that it has in a JPEG.
    pub(crate) fn take_exif(&mut self, bytes: &[u8]) {
        let exif = bytes.strip_prefix(EXIF).unwrap_or(bytes);
        self.orientation = Orientation::from_exif_chunk(exif).unwrap_or(self.orientation);
    }

    /// Takes XMP, unless some was found before.
    pub(crate) fn take_xmp(&mut self, bytes: Option<&[u8]>) {
        let text = bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        self.xmp = self.xmp.take().or(text);
    }
}

/// Reads a block of this length if it is wanted and not too long, and goes on to what follows its `padding`.
pub(crate) fn block(
    file: &mut (impl Read + Seek),
    length: usize,
    padding: usize,
    wanted: bool,
    visit: impl FnOnce(&[u8]),
) -> Option<()> {
    let mut rest = length + padding;
    if wanted && length <= MAX_METADATA_BYTES {
        let mut bytes = Vec::new();
        file.by_ref().take(length as u64).read_to_end(&mut bytes).ok()?;
        if bytes.len() < length {
            return None;
        }
        visit(&bytes);
        rest = padding;
    }
    file.seek_relative(i64::try_from(rest).ok()?).ok()
}

/// Reads the next bytes of a file; `None` if it ends before.
pub(crate) fn array<const N: usize>(file: &mut impl Read) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes).ok()?;
    Some(bytes)
}
