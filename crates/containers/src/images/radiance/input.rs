//! The bytes of a Radiance picture, from its first to its last.

use crate::error::Error;

pub(super) const MAX_HEADER: usize = 1 << 20;

/// The bytes not yet read.
pub(super) struct Input<'a>(pub(super) &'a [u8]);

impl<'a> Input<'a> {
    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], Error> {
        let (taken, rest) = self
            .0
            .split_at_checked(count)
            .ok_or_else(|| Error::truncated("the file ends before its data does"))?;
        self.0 = rest;
        Ok(taken)
    }

    pub(super) fn pixel(&mut self) -> Result<[u8; 4], Error> {
        let taken = self.take(4)?;
        Ok([taken[0], taken[1], taken[2], taken[3]])
    }

    /// The next line, without its end.
    pub(super) fn line(&mut self) -> Result<&'a [u8], Error> {
        let end = self
            .0
            .iter()
            .take(MAX_HEADER)
            .position(|&byte| byte == b'\n')
            .ok_or_else(|| Error::truncated("the file ends within its header"))?;
        let line = &self.0[..end];
        self.0 = &self.0[end + 1..];
        Ok(line.strip_suffix(b"\r").unwrap_or(line))
    }
}
