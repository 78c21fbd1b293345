//! How large a picture a header may declare.

use crate::error::{Error, ErrorKind};

/// The largest picture that is read: 16384 x 8192 pixels, 1.5 GiB once decoded.
pub const MAX_PIXELS: usize = 16384 * 8192;

/// Bytes of pixels that any file may declare, however short it is.
const SLACK: usize = 1 << 16;

/// Checks a declared size against [`MAX_PIXELS`]; gives the number of pixels.
pub(crate) fn pixels(width: usize, height: usize) -> Result<usize, Error> {
    if width == 0 || height == 0 {
        return Err(Error::damaged(format!("the image is declared as {width} x {height} pixels")));
    }
    width.checked_mul(height).filter(|&pixels| pixels <= MAX_PIXELS).ok_or_else(|| {
        Error::new(
            ErrorKind::TooLarge,
            format!(
                "the image is declared as {width} x {height} pixels; at most {MAX_PIXELS} pixels are read"
            ),
        )
    })
}

/// Checks that `len` bytes of a file can hold `declared` bytes of pixels, `ratio` being the most that the
/// format's compression can gain.
pub(crate) fn plausible(declared: usize, len: usize, ratio: usize) -> Result<(), Error> {
    if declared <= len.saturating_mul(ratio).saturating_add(SLACK) {
        return Ok(());
    }
    Err(Error::truncated(format!(
        "the header declares {declared} bytes of pixels, more than a file of {len} bytes can hold; the file is truncated or damaged"
    )))
}
