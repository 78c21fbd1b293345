//! The segments of a JPEG (ITU-T T.81, annex B), and where it ends: other JPEGs may follow it in its file.

use std::ops::Range;

const END_OF_IMAGE: u8 = 0xd9;

/// A JPEG within a file.
pub(crate) struct Segments {
    /// The second byte of each marker with a length, and where its content lies in the file.
    found: Vec<(u8, Range<usize>)>,
    /// The byte behind the end-of-image marker; `None` if the file ends before it.
    pub(crate) end: Option<usize>,
}

impl Segments {
    /// Walks the JPEG that begins at `start`. What is no marker between two segments is coded data: there,
    /// 255 is followed by 0 or a restart marker.
    pub(crate) fn of(bytes: &[u8], start: usize) -> Self {
        let mut found = Vec::new();
        let mut at = start;
        let end = loop {
            let Some((marker, behind)) = next_marker(bytes, at) else { break None };
            at = behind;
            match marker {
                0 | 0x01 | 0xd0..=0xd8 => continue,
                END_OF_IMAGE => break Some(at),
                _ => {}
            }
            let Some(&[high, low]) = bytes.get(at..at + 2) else { break None };
            let length = usize::from(u16::from_be_bytes([high, low]));
            let content = at + 2..at + length.max(2);
            if content.end > bytes.len() {
                break None;
            }
            at = content.end;
            found.push((marker, content));
        };
        Self { found, end }
    }

    /// The contents of an application's segments (APP0 is 0) that begin with `signature`, without it.
    pub(crate) fn of_application<'a>(
        &'a self,
        bytes: &'a [u8],
        number: u8,
        signature: &'a [u8],
    ) -> impl Iterator<Item = &'a [u8]> {
        let of_number = self.found.iter().filter(move |(marker, _)| *marker == 0xe0 + number);
        of_number.filter_map(move |(_, content)| bytes.get(content.clone())?.strip_prefix(signature))
    }
}

/// The second byte of the next marker, and the place behind it. Bytes of 255 may stand before it.
fn next_marker(bytes: &[u8], from: usize) -> Option<(u8, usize)> {
    let mut at = from + bytes.get(from..)?.iter().position(|&byte| byte == 0xff)?;
    while *bytes.get(at)? == 0xff {
        at += 1;
    }
    Some((bytes[at], at + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jpeg_ends_at_its_own_marker() {
        // A thumbnail with an end of its own lies within APP1; coded data holds a stuffed 255 and a restart.
        let one = [
            0xff, 0xd8, 0xff, 0xe1, 0, 6, 0xff, 0xd8, 0xff, 0xd9, 0xff, 0xff, 0xda, 0, 2, 7, 0xff, 0, 0xff,
            0xd0, 9, 0xff, 0xd9,
        ];
        let two = [&one[..], &one[..]].concat();
        let first = Segments::of(&two, 0);
        assert_eq!(first.end, Some(one.len()));
        assert_eq!(Segments::of(&two, one.len()).end, Some(two.len()));
        let found: Vec<_> = first.of_application(&two, 1, &[0xff, 0xd8]).collect();
        assert_eq!(found, [&[0xff, 0xd9]]);
        for length in 0..one.len() {
            assert_eq!(Segments::of(&one[..length], 0).end, None, "{length}");
        }
    }
}
