//! PFM, read only: portable float maps (P. Debevec; Netpbm's `pfm`).
//!
//! The header is three words of text: `PF` for RGB or `Pf` for grey, the columns and rows, and a number whose
//! sign says the order of the bytes, negative for little endian. Floats follow, the bottom row first. The
//! size of the number is a unit that programs disagree about; it is ignored.

use std::io::{Read, Seek};

use envmap::Image;

use super::chromaticity;
use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use crate::error::Error;
use crate::file_part::beginning;
use crate::format::Format;
use crate::limits;

const MAX_HEADER: usize = 1 << 12;

pub(crate) const CODEC: Codec = Codec {
    name: "PFM",
    endings: &["pfm"],
    known_by: KnownBy::Signature(
        |bytes| matches!(bytes, [b'P', b'F' | b'f', next, ..] if next.is_ascii_whitespace()),
    ),
    high_dynamic_range: true,
    declares_high_dynamic_range: |_| false,
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let size = header(&mut file, length)?;
        Ok(HeaderFacts { size, ..HeaderFacts::default() })
    },
    recipe: |_| None,
};

struct PfmHeader {
    width: usize,
    height: usize,
    channels: usize,
    scale: f64,
    /// The length of the header, after which the floats begin.
    length: usize,
}

impl PfmHeader {
    fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let mut at = 0;
        let mut words = [""; 4];
        for word in &mut words {
            *word = next_word(bytes, &mut at)?;
        }
        let [magic, width, height, scale] = words;
        let number = |word: &str| word.parse::<usize>().ok();
        let scale_of =
            |word: &str| word.parse::<f64>().ok().filter(|scale| scale.is_finite() && *scale != 0.0);
        let (Some(width), Some(height), Some(scale)) = (number(width), number(height), scale_of(scale))
        else {
            return Err(Error::damaged(format!(
                "the header is `{width} {height} {scale}`; expected columns, rows and a scale that is not 0"
            )));
        };
        limits::pixels(width, height)?;
        let channels = if magic == "PF" { 3 } else { 1 };
        // One white space ends the header, or the end of a line of Windows; a row of floats that begins with
        // a line feed is one byte longer than the file.
        let end = if bytes.get(at..at + 2) == Some(b"\r\n")
            && bytes.len() >= at + 2 + 4 * channels * width * height
        {
            2
        } else {
            1
        };
        Ok(Self { width, height, channels, scale, length: at + end })
    }
}

/// The next word of the header; a line that begins with # is a comment.
fn next_word<'a>(bytes: &'a [u8], at: &mut usize) -> Result<&'a str, Error> {
    let truncated = || Error::truncated("the file ends within its header");
    loop {
        let rest = bytes.get(*at..MAX_HEADER.min(bytes.len())).ok_or_else(truncated)?;
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace()).ok_or_else(truncated)?;
        let rest = &rest[start..];
        let is_end = |byte: &u8| if rest[0] == b'#' { *byte == b'\n' } else { byte.is_ascii_whitespace() };
        let length = rest.iter().position(is_end).ok_or_else(truncated)?;
        *at += start + length;
        if rest[0] != b'#' {
            return str::from_utf8(&rest[..length]).map_err(|_| Error::damaged("the header is not text"));
        }
    }
}

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    let PfmHeader { width, height, channels, scale, length } = PfmHeader::parse(bytes)?;
    let row = 4 * channels * width;
    let floats = bytes.get(length..).unwrap_or_default();
    let expected = row * height;
    let Some(samples) = floats.get(..expected) else {
        return Err(Error::truncated(format!("expected {expected} bytes of pixels, found {}", floats.len())));
    };
    let float = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if scale < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let pixel = |bytes: &[u8]| match channels {
        3 => [float(bytes), float(&bytes[4..]), float(&bytes[8..])],
        _ => [float(bytes); 3],
    };
    let rows = samples.chunks_exact(row).rev();
    let pixels = rows.flat_map(|row| row.chunks_exact(4 * channels).map(pixel)).collect();
    let image = Image::new(width, height, pixels)
        .ok_or_else(|| Error::damaged("the pixels do not fill the declared size"))?;
    let mut decoded = Decoded::new(Format::Pfm, image);
    if scale.abs() != 1.0 {
        let scale = scale.abs();
        decoded
            .warnings
            .push(format!("the scale {scale} was ignored; use `exposure` if it is meant to count"));
    }
    if floats.len() > expected {
        decoded.warnings.push(format!("{} bytes after the last row were ignored", floats.len() - expected));
    }
    if let Some(matrix) =
        wanted.filter(|_| channels == 3).and_then(|space| space.chromaticities().to_rec_709())
    {
        {
            let outside = chromaticity::apply(matrix, decoded.image.pixels_mut());
            outside.report(&mut decoded.warnings, &mut decoded.notes);
        };
    }
    Ok(decoded)
}

/// The size of the picture.
fn header(file: &mut (impl Read + Seek), length: usize) -> Result<[usize; 2], Error> {
    let header = PfmHeader::parse(&beginning(file, MAX_HEADER as u64)?)?;
    limits::plausible(4 * header.channels * header.width * header.height, length, 1)?;
    Ok([header.width, header.height])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::decoded::ReadOptions;
    use crate::images::read_image::read_image;

    fn file(header: &str, floats: &[f32], bytes: fn(f32) -> [u8; 4]) -> Vec<u8> {
        [header.as_bytes(), &floats.iter().flat_map(|value| bytes(*value)).collect::<Vec<u8>>()].concat()
    }

    #[test]
    fn both_orders_of_bytes_and_both_kinds_are_read_bottom_up() {
        let floats: Vec<f32> = (0..6).map(|value| value as f32).collect();
        for (sign, bytes) in [("-1.0", f32::to_le_bytes as fn(f32) -> [u8; 4]), ("1", f32::to_be_bytes)] {
            let colour = file(&format!("PF\n1 2\n{sign}\n"), &floats, bytes);
            let decoded = read_image(&colour, &ReadOptions::default()).unwrap();
            assert_eq!(decoded.image.pixels(), [[3.0, 4.0, 5.0], [0.0, 1.0, 2.0]]);
            assert!(
                decoded.format == Format::Pfm && decoded.high_dynamic_range && decoded.warnings.is_empty()
            );
            let grey = file(&format!("Pf\n# by hand\n3 2 {sign}\n"), &floats, bytes);
            let decoded = read_image(&grey, &ReadOptions::default()).unwrap();
            let expected = [3.0, 4.0, 5.0, 0.0, 1.0, 2.0].map(|value| [value; 3]);
            assert_eq!(decoded.image.pixels(), expected);
        }
    }

    /// The second file's floats begin with a line feed: 0x...0a.
    #[test]
    fn a_header_may_have_the_line_ends_of_windows() {
        for first in [1.0, f32::from_le_bytes([10, 0, 0, 63])] {
            for end in ["\n", "\r\n", "\r"] {
                let bytes = file(&format!("PF{end}1 1{end}-1{end}"), &[first, 2.0, 3.0], f32::to_le_bytes);
                let decoded = read(&bytes, None).unwrap();
                assert_eq!(decoded.image.pixels(), [[first, 2.0, 3.0]], "{end:?}");
                assert!(decoded.warnings.is_empty(), "{:?}", decoded.warnings);
            }
        }
    }

    #[test]
    fn damage_is_an_error() {
        let whole = file("PF\n2 1\n-2.5\n", &[1.0; 6], f32::to_le_bytes);
        assert!(read(&whole, None).unwrap().warnings[0].contains("the scale 2.5 was ignored"));
        for cut in 3..whole.len() {
            assert!(read(&whole[..cut], None).is_err(), "{cut}");
        }
        for header in ["PF\n0 1\n-1\n", "PF\n2 x\n-1\n", "PF\n2 1\n0\n", "PF\n99999999 99999999\n-1\n"] {
            assert!(read(header.as_bytes(), None).is_err(), "{header}");
        }
    }
}
