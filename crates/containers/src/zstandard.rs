//! Zstandard, which KTX2, TIFF and OpenEXR compress with.

use std::io::Read;

use ruzstd::decoding::StreamingDecoder;

use crate::error::Error;

/// Exactly `expected` bytes; memory grows only as they come.
pub(crate) fn decompress(stored: &[u8], expected: usize) -> Result<Vec<u8>, Error> {
    let damaged = |error: &dyn std::fmt::Display| Error::damaged(format!("Zstandard: {error}"));
    let mut rest = stored;
    let mut bytes = Vec::new();
    let decoder = StreamingDecoder::new(&mut rest).map_err(|error| damaged(&error))?;
    // One more byte than wanted tells that there are too many.
    let most = u64::try_from(expected).unwrap_or(u64::MAX).saturating_add(1);
    decoder.take(most).read_to_end(&mut bytes).map_err(|error| damaged(&error))?;
    if bytes.len() == expected {
        return Ok(bytes);
    }
    let found = if bytes.len() > expected { "more".to_owned() } else { bytes.len().to_string() };
    Err(Error::damaged(format!("expected {expected} bytes, Zstandard gives {found}")))
}
