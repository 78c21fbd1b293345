//! TIFF (TIFF 6.0, and BigTIFF): what is checked before `image` decodes a file, and grey floats, which it
//! does not read.

use std::io::{BufRead, Cursor, Read, Seek};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};

use crate::decoded::Decoded;
use crate::error::{Error, ErrorKind};
use crate::file_part::{bytes_at, rewind};
use crate::raster::{self, Raster};
use crate::{Format, limits};

pub(crate) fn read(bytes: &[u8]) -> Result<Decoded, Error> {
    check_directory(&mut Cursor::new(bytes), bytes.len())?;
    match raster::read(bytes, Format::Tiff) {
        Err(error) if error.kind() == ErrorKind::Unsupported => grey_floats(bytes)?.decode(Format::Tiff),
        read => read,
    }
}

/// The size of the first picture.
pub(crate) fn header(file: &mut (impl BufRead + Seek), length: usize) -> Result<[usize; 2], Error> {
    check_directory(file, length)?;
    rewind(file)?;
    let mut decoder = Decoder::new(file).map_err(describe)?;
    let (width, height) = decoder.dimensions().map_err(describe)?;
    limits::pixels(width as usize, height as usize)?;
    Ok([width as usize, height as usize])
}

/// Checks that the values of the first directory are in the file: `tiff` makes room for as many as an entry
/// declares, and `image` ignores an ICC profile that it cannot read.
fn check_directory(file: &mut (impl Read + Seek), length: usize) -> Result<(), Error> {
    has_whole_directory(file, length)
        .ok_or_else(|| Error::truncated("the file ends before its directory or a value in it"))
}

fn has_whole_directory(file: &mut (impl Read + Seek), length: usize) -> Option<()> {
    let little = bytes_at(file, 0, 1)?[0] == b'I';
    let mut number = |at: usize, size: usize| -> Option<usize> {
        let bytes = bytes_at(file, at, size)?;
        let bytes = bytes[..size].iter();
        let digits = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        let number = if little { bytes.rev().fold(0, digits) } else { bytes.fold(0, digits) };
        usize::try_from(number).ok()
    };
    // Sizes of an offset or count, and of the number of entries.
    let (word, entries) = if number(2, 2)? == 43 { (8, 8) } else { (4, 2) };
    let directory = number(word, word)?;
    let first = directory.checked_add(entries)?;
    for entry in 0..number(directory, entries)? {
        let entry = first.checked_add(entry.checked_mul(4 + 2 * word)?)?;
        let size = match number(entry + 2, 2)? {
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16 | 17 | 18 => 8,
            _ => 1,
        };
        let size = number(entry + 4, word)?.checked_mul(size)?;
        let at = if size <= word { entry + 4 + word } else { number(entry + 4 + word, word)? };
        if at.checked_add(size)? > length {
            return None;
        }
    }
    Some(())
}

fn grey_floats(bytes: &[u8]) -> Result<Raster, Error> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(describe)?;
    let (width, height) = decoder.dimensions().map_err(describe)?;
    let (width, height) = (width as usize, height as usize);
    let size = 4 * limits::pixels(width, height)?;
    limits::plausible(size, bytes.len(), raster::DEFLATE_RATIO)?;
    let colour = decoder.colortype().map_err(describe)?;
    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
    let mut allowed = Limits::default();
    allowed.decoding_buffer_size = size;
    allowed.intermediate_buffer_size = size + bytes.len() + raster::WORKSPACE;
    let mut decoder = decoder.with_limits(allowed);
    let values =
        if colour == ColorType::Gray(32) { Some(decoder.read_image().map_err(describe)?) } else { None };
    let Some(DecodingResult::F32(values)) = values else {
        return Err(Error::unsupported(format!(
            "{colour:?} is not read; expected grey or RGB in 8 or 16-bit integers or 32-bit floats"
        )));
    };
    let samples = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
    Ok(Raster { width, height, channels: 1, depth: 4, samples, profile })
}

fn describe(error: TiffError) -> Error {
    match error {
        TiffError::LimitsExceeded => {
            Error::new(ErrorKind::TooLarge, "the decoder's limit of memory is exceeded")
        }
        TiffError::UnsupportedError(error) => Error::unsupported(format!("not read: {error}")),
        other => Error::damaged(other.to_string()),
    }
}
