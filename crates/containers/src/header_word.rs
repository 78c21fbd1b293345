//! Numbers of binary headers.

/// The little-endian u32 at a byte offset; `None` if the bytes end before.
pub(crate) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

/// A size that a header declares; on a machine of 16 bits, the largest one if it does not fit.
pub(crate) fn size(value: u32) -> usize {
    usize::try_from(value).unwrap_or(usize::MAX)
}
