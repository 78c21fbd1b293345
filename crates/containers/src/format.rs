//! The formats of pictures, and what is no file of any format.

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
