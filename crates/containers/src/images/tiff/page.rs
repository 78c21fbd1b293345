//! Which page of a TIFF is the picture, and whether its kind is read.

use std::collections::HashSet;
use std::io::{Read, Seek};

use super::directory;
use super::directory::{Directory, Numbers};
use crate::error::Error;
use crate::limits;

/// Pages that are looked at: more than any picture has, and few enough for a damaged file.
const MOST_PAGES: usize = 1024;

/// How samples become colour (tag 262).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Photometric {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    Palette,
    Cmyk,
    /// Luminance and chroma of a JPEG.
    YCbCr,
}

/// The type of a sample (tag 339).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleFormat {
    Unsigned,
    Float,
}

/// Compressions that are unpacked here and not by the `tiff` crate, which does not know them or, of LZW,
/// stops within a tile whose last columns are past the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Lzw,
    Zstandard,
    Lzma,
    WebP,
}

/// A page whose kind is read.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) directory: Directory,
    pub(super) width: usize,
    pub(super) height: usize,
    /// Samples of a pixel, and bits of each.
    pub(super) samples: usize,
    pub(super) bits: usize,
    pub(super) format: SampleFormat,
    pub(super) photometric: Photometric,
    /// Whether each sample has a plane of its own.
    pub(super) planar: bool,
    /// Whether the first sample beyond the colour is alpha.
    pub(super) alpha: bool,
    pub(super) packing: Option<Packing>,
    /// The size of a tile, or of a strip.
    pub(super) chunk: [usize; 2],
    /// Warnings of which pages there are, if that is not plain.
    pub(super) warnings: Vec<String>,
}

impl Page {
    /// The page that is the picture.
    pub(super) fn find(file: &mut (impl Read + Seek), length: usize) -> Result<Self, Error> {
        let (directory, warnings) = choose(file, length)?;
        let number = |file: &mut _, tag| directory.number(file, tag);
        let side =
            |file: &mut _, tag| number(file, tag).map(|side| usize::try_from(side).unwrap_or(usize::MAX));
        let [Some(width), Some(height)] = [directory::WIDTH, directory::HEIGHT].map(|tag| side(file, tag))
        else {
            return Err(Error::damaged("the page has no size"));
        };
        limits::pixels(width, height)?;
        let samples = number(file, directory::SAMPLES_PER_PIXEL).unwrap_or(1) as usize;
        let bits = same(&directory.numbers(file, directory::BITS_PER_SAMPLE), "bits", 1)?;
        let format = same(&directory.numbers(file, directory::SAMPLE_FORMAT), "formats of samples", 1)?;
        let compression = number(file, directory::COMPRESSION).unwrap_or(1);
        let packing = packing(compression)?;
        let photometric = photometric(number(file, directory::PHOTOMETRIC), compression)?;
        let format = match (format, bits) {
            (1 | 4, 1 | 2 | 4 | 8 | 16 | 32 | 64) => SampleFormat::Unsigned,
            (3, 16 | 32 | 64) => SampleFormat::Float,
            (1 | 4, bits) => return Err(unsupported(format!("integers of {bits} bits"))),
            (3, bits) => return Err(unsupported(format!("floats of {bits} bits"))),
            (2, bits) => return Err(unsupported(format!("signed integers of {bits} bits"))),
            (5 | 6, _) => return Err(unsupported("complex numbers".into())),
            (other, _) => return Err(unsupported(format!("samples of format {other}"))),
        };
        let planar = number(file, directory::PLANAR_CONFIGURATION) == Some(2) && samples > 1;
        let chunk = match directory.has(directory::TILE_OFFSETS) {
            true => [directory::TILE_WIDTH, directory::TILE_LENGTH].map(|tag| side(file, tag).unwrap_or(0)),
            false => [width, side(file, directory::ROWS_PER_STRIP).unwrap_or(height).min(height)],
        };
        let extra = directory.numbers(file, directory::EXTRA_SAMPLES);
        let page = Self {
            width,
            height,
            samples,
            bits: bits as usize,
            format,
            photometric,
            planar,
            alpha: matches!(extra.first(), Some(1 | 2)) || (extra.is_empty() && samples == 4),
            packing,
            chunk,
            warnings,
            directory,
        };
        let colours = page.colours();
        if samples < colours {
            return Err(Error::damaged(format!("a pixel has {samples} samples; expected {colours}")));
        }
        if page.bits < 8 && page.photometric != Photometric::Palette && colours > 1 {
            return Err(unsupported(format!("{photometric:?} of {bits} bits")));
        }
        if photometric == Photometric::Palette && (page.bits > 8 || format == SampleFormat::Float) {
            return Err(unsupported(format!("a palette with codes of {bits} bits")));
        }
        let inks = matches!(photometric, Photometric::Cmyk | Photometric::YCbCr);
        if inks && (![8, 16].contains(&page.bits) || format == SampleFormat::Float) {
            return Err(unsupported(format!("{photometric:?} of {bits} bits")));
        }
        Ok(page)
    }

    /// How many samples make the colour.
    pub(super) fn colours(&self) -> usize {
        match self.photometric {
            Photometric::WhiteIsZero | Photometric::BlackIsZero | Photometric::Palette => 1,
            Photometric::Rgb | Photometric::YCbCr => 3,
            Photometric::Cmyk => 4,
        }
    }

    pub(super) fn is_float(&self) -> bool {
        self.format == SampleFormat::Float
    }

    /// Bytes of a row of so many pixels as they are stored: of all samples, or of one plane.
    pub(super) fn row_bytes(&self, width: usize) -> usize {
        let samples = if self.planar { 1 } else { self.samples };
        width.saturating_mul(samples).saturating_mul(self.bits).div_ceil(8)
    }

    /// Bytes of the page, or of one of its planes.
    pub(super) fn decoded_size(&self) -> usize {
        self.row_bytes(self.width).saturating_mul(self.height)
    }

    /// The colours of a palette (tag 320): red of all codes, then green, then blue, in 16 bits.
    pub(super) fn palette(&self, file: &mut (impl Read + Seek)) -> Option<Vec<u16>> {
        let wanted = self.photometric == Photometric::Palette;
        let colours = wanted.then(|| self.directory.numbers(file, directory::COLOR_MAP))?;
        Some(colours.into_iter().map(|value| value as u16).collect())
    }
}

/// The directory of the picture, and a warning if there were several to choose from.
fn choose(file: &mut (impl Read + Seek), length: usize) -> Result<(Directory, Vec<String>), Error> {
    let truncated = || Error::truncated("the file ends before its directory or a value in it");
    let numbers = Numbers::of(file).ok_or_else(truncated)?;
    let first = numbers.offset(file, numbers.word).ok_or_else(truncated)?;
    let mut pages: Vec<(usize, bool, Directory)> = Vec::new();
    // Sub-directories hold thumbnails of the page, or the page that the thumbnail is of.
    let mut ahead = vec![first];
    let mut seen = HashSet::from([0]);
    while let Some(at) = ahead.pop().filter(|_| pages.len() < MOST_PAGES) {
        if !seen.insert(at) {
            continue;
        }
        let Some(page) = Directory::read(file, numbers, at, length) else {
            // The other pages are whole.
            if pages.is_empty() {
                return Err(truncated());
            }
            continue;
        };
        ahead.push(page.next);
        let mut below = page.numbers(file, directory::SUB_DIRECTORIES);
        below.truncate(MOST_PAGES.saturating_sub(ahead.len()));
        ahead.extend(below.into_iter().rev().filter_map(|at| usize::try_from(at).ok()));
        let [width, height] = [directory::WIDTH, directory::HEIGHT].map(|tag| page.number(file, tag));
        let pixels = width.unwrap_or(0).saturating_mul(height.unwrap_or(0));
        let kind = page.number(file, directory::SUBFILE_TYPE).unwrap_or(0);
        let reduced = kind & 0b101 != 0 || page.number(file, directory::OLD_SUBFILE_TYPE) == Some(2);
        pages.push((usize::try_from(pixels).unwrap_or(usize::MAX), reduced, page));
    }
    let full = pages.iter().filter(|(_, reduced, _)| !reduced).count();
    let candidates = pages.iter().enumerate().filter(|(_, (_, reduced, _))| full == 0 || !reduced);
    // `max_by_key` gives the last of equals.
    let chosen = candidates.rev().max_by_key(|(_, (pixels, ..))| *pixels).map_or(0, |(index, _)| index);
    let warnings = match full {
        0 | 1 => Vec::new(),
        _ => vec![format!(
            "the file has {full} pages; the {} one was read",
            if chosen == 0 { "first" } else { "largest" }
        )],
    };
    if pages.is_empty() {
        return Err(truncated());
    }
    Ok((pages.swap_remove(chosen).2, warnings))
}

/// The one value of a tag that has a value for each sample.
fn same(values: &[u64], what: &str, default: u64) -> Result<u64, Error> {
    let first = values.first().copied().unwrap_or(default);
    match values.iter().all(|value| *value == first) {
        true => Ok(first),
        false => Err(unsupported(format!("samples of different {what} ({values:?})"))),
    }
}

fn unsupported(what: String) -> Error {
    Error::unsupported(format!(
        "{what} are not read; save the image as integers of 8 or 16 bits or as floats of 16 or 32"
    ))
}

/// The packing that is undone here, or why a compression is not read.
fn packing(compression: u64) -> Result<Option<Packing>, Error> {
    let name = match compression {
        1 | 4 | 7 | 8 | 32773 | 32946 => return Ok(None),
        5 => return Ok(Some(Packing::Lzw)),
        34925 => return Ok(Some(Packing::Lzma)),
        50000 => return Ok(Some(Packing::Zstandard)),
        50001 => return Ok(Some(Packing::WebP)),
        2 | 3 => "CCITT fax (groups 1 to 3)".to_owned(),
        6 => "JPEG in its old style".to_owned(),
        33003 | 33005 | 34712 => "JPEG 2000".to_owned(),
        34676 => "SGI LogLuv or LogL".to_owned(),
        34677 => "SGI LogLuv of 24 bits".to_owned(),
        34887 => "LERC".to_owned(),
        50002 | 52546 => "JPEG XL".to_owned(),
        other => format!("number {other}"),
    };
    Err(Error::unsupported(format!(
        "the compression {name} is not read; save the image without compression or with LZW, Deflate or Zstandard"
    )))
}

fn photometric(number: Option<u64>, compression: u64) -> Result<Photometric, Error> {
    let name = match number {
        Some(0) => return Ok(Photometric::WhiteIsZero),
        Some(1) => return Ok(Photometric::BlackIsZero),
        Some(2) => return Ok(Photometric::Rgb),
        Some(3) => return Ok(Photometric::Palette),
        Some(5) => return Ok(Photometric::Cmyk),
        Some(6) if compression == 7 => return Ok(Photometric::YCbCr),
        Some(4) => "a transparency mask".to_owned(),
        Some(6) => "YCbCr without JPEG".to_owned(),
        Some(8..=10) => "CIE L*a*b*".to_owned(),
        Some(32803) => "a camera's raw mosaic".to_owned(),
        Some(34892) => "a camera's raw colours".to_owned(),
        Some(32844) => "SGI LogL".to_owned(),
        Some(32845) => "SGI LogLuv".to_owned(),
        Some(other) => format!("photometric interpretation {other}"),
        None => "no photometric interpretation".to_owned(),
    };
    Err(Error::unsupported(format!("the colours are {name}, which is not read; save the image as RGB")))
}
