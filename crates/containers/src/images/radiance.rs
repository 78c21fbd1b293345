//! Radiance pictures: RGBE and XYZE (G. Ward, "Real pixels", Graphics Gems II; Radiance's `filefmts`).
//!
//! A pixel (m_r, m_g, m_b, e) stands for m / 256 * 2^(e - 128) in each channel, black if e = 0. OpenImageIO,
//! OpenCV, stb_image, FreeImage, ImageMagick and Babylon.js read it so. Mantissas are rounded to the nearest
//! when a picture is written, so that what these programs read is neither darker nor brighter. Two kinds of
//! program differ: Radiance itself adds half a step, (m + 0.5) / 256, since it cuts mantissas off when it
//! writes, and three.js and Godot divide by 255, so that every Radiance picture is 0.4 % brighter there.
//!
//! The header is a line `#?...`, fields `NAME=value` in any number and an empty line; then the resolution,
//! `-Y 512 +X 1024` or one of seven other orders of scanning. Fields that matter:
//!
//! - `FORMAT`: `32-bit_rle_rgbe` or `32-bit_rle_xyze`; absent means RGBE.
//! - `EXPOSURE`, `COLORCORR`: what the pixels were multiplied by. Each may occur several times; all multiply.
//! - `PRIMARIES`: x y of red, green, blue and white; absent means Rec. 709 (not Radiance's own primaries,
//!   which differ in green and white: nearly every file in use comes from other tools).
//! - Lines `#SPECULA=`, comments to all other programs, are the parts of the recipe. No line of the header is
//!   longer than 100 bytes: three.js up to r183 and all that comes from B. Walter's `rgbe.c` read lines of
//!   at most 127, FreeImage of at most 255, and refuse the picture if there is a longer one.
//!
//! XYZE is CIE XYZ with an equal-energy white, and keeps its photometric unit.

mod input;
mod scanlines;

use std::io::{Read, Seek};

use envmap::{CodedRows, Image};
use rayon::prelude::*;
use sh::Stop;

use super::block_writer::{BlockWriter, Patch};
use super::chromaticity::Chromaticities;
use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::{Decoded, Encoded};
use super::outside_gamut::OutsideGamut;
use super::panorama::Panorama;
use super::{chromaticity, radiance_view};
use crate::error::{Error, ErrorKind};
use crate::file_part::beginning;
use crate::format::Format;
use crate::{limits, recipe};
use input::{Input, MAX_HEADER};
use scanlines::{read_scanline, write_scanline};

pub(crate) const CODEC: Codec = Codec {
    name: "Radiance",
    endings: &["hdr", "pic", "rgbe"],
    known_by: KnownBy::Signature(|bytes| bytes.starts_with(b"#?")),
    high_dynamic_range: true,
    declares_high_dynamic_range: |_| false,
    has_layers: false,
    read: |bytes, options, stop| read(bytes, options.colour_space, stop),
    header: |mut file, _, _| {
        let (size, panorama) = header(&mut file)?;
        Ok(HeaderFacts { size, blocks: size[1], panorama, ..HeaderFacts::default() })
    },
    recipe: read_recipe,
};

fn read(bytes: &[u8], wanted: Option<ColourSpace>, stop: Stop<'_>) -> Result<Decoded, Error> {
    let (header, rest) = RadianceHeader::parse(bytes)?;
    let mut input = Input(rest);
    let scan = Scan::parse(input.line()?)?;
    limits::pixels(scan.width, scan.height)?;
    let declared = header.chromaticities.map(|declared| ("the header", declared));
    let (mut about_colours, mut notes) = (Vec::new(), Vec::new());
    let matrix = ColourSpace::chosen(wanted, declared, &mut about_colours).map(Chromaticities::to_rec_709);
    let finish = |pixels: &mut [[f32; 3]]| match matrix {
        Some(Some(matrix)) => chromaticity::apply(matrix, pixels),
        _ => OutsideGamut::default(),
    };
    let (image, outside) = read_pixels(&mut input, &scan, header.divisor, finish, stop)?;
    match matrix {
        None => {}
        Some(Some(_)) => outside.report(&mut about_colours, &mut notes),
        Some(None) => about_colours.push("PRIMARIES span no colour space and were ignored".into()),
    }
    let mut decoded = Decoded::new(Format::Radiance, image);
    (decoded.warnings, decoded.recipe) = (header.warnings, header.recipe);
    decoded.warnings.append(&mut about_colours);
    decoded.notes = notes;
    let size = [scan.width, scan.height];
    decoded.panorama = header.view.and_then(|view| radiance_view::of_view(&view, size));
    if !input.0.is_empty() {
        decoded.warnings.push(format!("{} bytes after the last scanline were ignored", input.0.len()));
    }
    Ok(decoded)
}

/// Pixels that are decoded side by side, about.
const BATCH: usize = 1 << 21;

/// The picture, whose rows `finish` changes a few at a time.
fn read_pixels(
    input: &mut Input<'_>,
    scan: &Scan,
    divisor: [f64; 3],
    finish: impl Fn(&mut [[f32; 3]]) -> OutsideGamut + Sync,
    stop: Stop<'_>,
) -> Result<(Image, OutsideGamut), Error> {
    let units: Vec<f64> = (0..=255).map(|e| math::powi(2.0_f64, e - 128 - 8)).collect();
    let value = |[r, g, b, e]: [u8; 4]| {
        let unit = if e == 0 { 0.0 } else { units[usize::from(e)] };
        let rgb = [r, g, b].map(|mantissa| f64::from(mantissa) * unit);
        [0, 1, 2].map(|c| (rgb[c] / divisor[c]) as f32)
    };
    let damaged = || Error::damaged("the pixels do not fill the declared size");
    let (width, height, length) = (scan.width, scan.height, scan.line_length());
    let mut writer = BlockWriter::new(width, height, [0, 0, width as i64, height as i64]);
    let at_once = BATCH.div_ceil(length.max(1)).next_multiple_of(CodedRows::HEIGHT);
    // A picture that was scanned by columns is complete only at the end.
    let mut columns = Vec::new();
    for first in (0..scan.line_count()).step_by(at_once) {
        let mut lines = Vec::new();
        for index in first..(first + at_once).min(scan.line_count()) {
            stop.check().map_err(Error::stopped)?;
            let mut line = vec![[0; 4]; length];
            read_scanline(input, &mut line).map_err(|error| error.within(format!("scanline {index}")))?;
            lines.push(line);
        }
        if !scan.rows {
            columns.append(&mut lines);
            continue;
        }
        let patch = |(index, mut line): (usize, Vec<[u8; 4]>)| {
            let row = first + index;
            let row = if scan.upward { height - 1 - row } else { row };
            if scan.leftward {
                line.reverse();
            }
            Patch { corner: [0, row as i64], width, pixels: line.into_iter().map(value).collect() }
        };
        writer.write(&lines.into_par_iter().enumerate().map(patch).collect::<Vec<_>>(), &finish);
    }
    if scan.rows {
        return writer.into_image(&finish).ok_or_else(damaged);
    }
    let mut pixels = vec![[0.0; 3]; width * height];
    for (index, line) in columns.iter().enumerate() {
        line.iter().enumerate().for_each(|(at, rgbe)| pixels[scan.target(index, at)] = value(*rgbe));
    }
    let outside = finish(&mut pixels);
    Ok((Image::new(width, height, pixels).ok_or_else(damaged)?, outside))
}

/// The size of the picture, and what of the sphere it shows.
fn header(file: &mut (impl Read + Seek)) -> Result<([usize; 2], Option<Panorama>), Error> {
    /// The longest header in bytes, with the line of the resolution.
    const LONGEST_HEADER: u64 = MAX_HEADER as u64 + 4096;
    // Nearly all headers are short.
    let short = size_of(&beginning(file, 1 << 14)?);
    match short {
        Err(error) if error.kind() == ErrorKind::Truncated => size_of(&beginning(file, LONGEST_HEADER)?),
        short => short,
    }
}

fn size_of(bytes: &[u8]) -> Result<([usize; 2], Option<Panorama>), Error> {
    let (header, rest) = RadianceHeader::parse(bytes)?;
    let scan = Scan::parse(Input(rest).line()?)?;
    limits::pixels(scan.width, scan.height)?;
    let size = [scan.width, scan.height];
    Ok((size, header.view.and_then(|view| radiance_view::of_view(&view, size))))
}

/// The recipe in a picture's header.
fn read_recipe(bytes: &[u8]) -> Option<String> {
    RadianceHeader::parse(bytes).ok()?.0.recipe
}

/// Writes RGBE in the new run lengths (flat if the width forbids them), top row first.
///
/// Mantissas are rounded to the nearest: a value comes back within 1/256 of its pixel's largest channel, and
/// within 2^-136 of a darker one than 2^-128. `recipe` goes into comment lines of the header.
///
/// Negative values become 0 and are counted; values past 1.69e38 become that number.
///
/// # Errors
/// If a value is NaN, or the recipe holds control characters.
pub fn write_rgbe(image: &Image, recipe: Option<&str>) -> Result<Encoded, Error> {
    recipe::check(recipe).map_err(|error| error.within(CODEC.name))?;
    let (width, height) = (image.width(), image.height());
    let recipe: String =
        recipe_parts(recipe.unwrap_or_default()).map(|part| format!("{PART}{part}\n")).collect();
    // Some programs expect the empty line right after FORMAT.
    let mut bytes =
        format!("#?RADIANCE\n{recipe}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    let mut negative = 0;
    let mut line = Vec::with_capacity(width);
    let mut scratch = Vec::new();
    let blocks = (0..CodedRows::count(height)).map(|block| CodedRows::rows(height, block));
    for rows in blocks {
        let pixels = image.rows(rows.clone(), &mut scratch);
        for (row, pixels) in rows.zip(pixels.chunks_exact(width)) {
            line.clear();
            for (column, pixel) in pixels.iter().enumerate() {
                if pixel.iter().any(|value| value.is_nan()) {
                    return Err(Error::new(
                        ErrorKind::Unwritable,
                        format!("pixel ({column}, {row}) is NaN, which RGBE cannot hold"),
                    )
                    .within(CODEC.name));
                }
                negative += pixel.iter().filter(|value| **value < 0.0).count();
                line.push(encode(*pixel));
            }
            write_scanline(&line, &mut bytes);
        }
    }
    Ok(Encoded { bytes, negative })
}

/// 255 / 256 * 2^127: the largest mantissa of the largest exponent.
const MAX_RGBE: f64 = 255.0 / 256.0 * f64::from_bits((1023 + 127) << 52);

/// The pixel of an RGB value that is not NaN.
fn encode(rgb: [f32; 3]) -> [u8; 4] {
    let rgb = rgb.map(|value| f64::from(value).clamp(0.0, MAX_RGBE));
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    // largest = f 2^exponent with f in [0.5, 1): an f32 is a normal f64, whose exponent bits say so.
    let least = ((largest.to_bits() >> 52) as i32 - 1022).max(1 - 128);
    let mantissas = |exponent: i32| {
        let scale = math::powi(2.0_f64, 8 - exponent);
        rgb.map(|value| (value * scale).round())
    };
    // The largest mantissa may round up to 256, which takes the next exponent.
    let exponent = if mantissas(least).contains(&256.0) { least + 1 } else { least };
    match mantissas(exponent).map(|mantissa| mantissa as u8) {
        [0, 0, 0] => [0; 4],
        [r, g, b] => [r, g, b, (exponent + 128) as u8],
    }
}

/// The parts of a recipe, each of which fits a line of the header.
fn recipe_parts(mut recipe: &str) -> impl Iterator<Item = &str> {
    /// The longest line in bytes, with its end of line.
    const LONGEST_LINE: usize = 100;
    std::iter::from_fn(move || {
        let (part, rest) = recipe.split_at(recipe.floor_char_boundary(LONGEST_LINE - PART.len() - 1));
        recipe = rest;
        (!part.is_empty()).then_some(part)
    })
}

struct RadianceHeader {
    divisor: [f64; 3],
    chromaticities: Option<Chromaticities>,
    recipe: Option<String>,
    /// The values of VIEW, one after the other.
    view: Option<String>,
    warnings: Vec<String>,
}

/// The beginning of a line with a part of the recipe.
const PART: &str = "#SPECULA=";

impl RadianceHeader {
    /// The header, and what follows it.
    fn parse(bytes: &[u8]) -> Result<(Self, &[u8]), Error> {
        let mut header =
            Self { divisor: [1.0; 3], chromaticities: None, recipe: None, view: None, warnings: Vec::new() };
        let mut input = Input(bytes);
        let mut first = true;
        loop {
            if bytes.len() - input.0.len() > MAX_HEADER {
                return Err(Error::damaged("the header does not end"));
            }
            let line = input.line()?;
            if line.is_empty() {
                return Ok((header, input.0));
            }
            if !std::mem::take(&mut first) {
                header.field(&String::from_utf8_lossy(line))?;
            }
        }
    }

    fn field(&mut self, line: &str) -> Result<(), Error> {
        if let Some(part) = line.strip_prefix(PART) {
            self.recipe.get_or_insert_default().push_str(part);
            return Ok(());
        }
        // Commands are indented by a tab; comments begin with #. Neither holds a field.
        let Some((name, value)) = line.split_once('=') else { return Ok(()) };
        if line.starts_with(['#', '\t', ' ']) {
            return Ok(());
        }
        let numbers: Option<Vec<f64>> = value.split_whitespace().map(|word| word.parse().ok()).collect();
        let positive = |value: &f64| value.is_finite() && *value > 0.0;
        match name.trim() {
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => {}
                "32-bit_rle_xyze" => self.chromaticities = Some(Chromaticities::XYZ),
                other => return Err(Error::unsupported(format!("FORMAT={other} is not a picture's"))),
            },
            "EXPOSURE" => match numbers.as_deref() {
                Some([exposure]) if positive(exposure) => {
                    self.divisor = self.divisor.map(|divisor| divisor * exposure);
                }
                _ => self.ignore(line, "an exposure must be a positive number"),
            },
            "COLORCORR" => match numbers.as_deref() {
                Some(&[r, g, b]) if [r, g, b].iter().all(positive) => {
                    let [x, y, z] = self.divisor;
                    self.divisor = [x * r, y * g, z * b];
                }
                _ => self.ignore(line, "a colour correction must be three positive numbers"),
            },
            "PRIMARIES" => match numbers.as_deref() {
                // Some programs write this for "not set".
                Some(zeros) if zeros.iter().all(|&value| value == 0.0) => {}
                Some(&[rx, ry, gx, gy, bx, by, wx, wy]) if self.chromaticities.is_none() => {
                    self.chromaticities = Some(Chromaticities([[rx, ry], [gx, gy], [bx, by], [wx, wy]]));
                }
                Some([_, _, _, _, _, _, _, _]) => {}
                _ => self.ignore(line, "primaries must be eight numbers"),
            },
            "GAMMA" if !matches!(numbers.as_deref(), Some([1.0])) => {
                self.ignore(line, "the pixels of a Radiance picture are linear");
            }
            "PIXASPECT" if !matches!(numbers.as_deref(), Some([1.0])) => {
                self.ignore(line, "pixels are taken as square");
            }
            "VIEW" => {
                let view = self.view.get_or_insert_default();
                view.push_str(value);
                view.push(' ');
            }
            // Files of older revisions have the whole recipe in one line.
            "SPECULA" => self.recipe = Some(value.to_owned()),
            _ => {}
        }
        Ok(())
    }

    fn ignore(&mut self, line: &str, why: &str) {
        let shown: String = line.chars().take(80).collect();
        self.warnings.push(format!("{shown} was ignored: {why}"));
    }
}

/// How scanlines lie on the picture.
struct Scan {
    width: usize,
    height: usize,
    /// Whether a scanline runs along a row.
    rows: bool,
    /// Whether the first scanned row is the bottom one.
    upward: bool,
    /// Whether the first scanned column is the right one.
    leftward: bool,
}

impl Scan {
    fn parse(line: &[u8]) -> Result<Self, Error> {
        let line = String::from_utf8_lossy(line);
        let error = || {
            let shown: String = line.chars().take(40).collect();
            Error::damaged(format!("`{shown}` is not a resolution; expected one such as `-Y 512 +X 1024`"))
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[first, first_length, second, second_length] = words.as_slice() else { return Err(error()) };
        let length = |word: &str| word.parse::<usize>().map_err(|_| error());
        let (first_length, second_length) = (length(first_length)?, length(second_length)?);
        let ((y, height), (x, width), rows) = match (first, second) {
            ("-Y" | "+Y", "-X" | "+X") => ((first, first_length), (second, second_length), true),
            ("-X" | "+X", "-Y" | "+Y") => ((second, second_length), (first, first_length), false),
            _ => return Err(error()),
        };
        Ok(Self { width, height, rows, upward: y == "+Y", leftward: x == "-X" })
    }

    fn line_length(&self) -> usize {
        if self.rows { self.width } else { self.height }
    }

    fn line_count(&self) -> usize {
        if self.rows { self.height } else { self.width }
    }

    /// The index of a scanned pixel in rows from the top.
    fn target(&self, line: usize, position: usize) -> usize {
        let (row, column) = if self.rows { (line, position) } else { (position, line) };
        let row = if self.upward { self.height - 1 - row } else { row };
        let column = if self.leftward { self.width - 1 - column } else { column };
        row * self.width + column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Decoded, Error> {
        super::read(bytes, None, Stop::NEVER)
    }

    fn picture(header: &str, resolution: &str, data: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n{header}\n{resolution}\n").as_bytes(), data].concat()
    }

    fn pixels(bytes: &[u8]) -> Vec<[f32; 3]> {
        read(bytes).unwrap().image.pixels().to_vec()
    }

    /// One pixel of each value along a line, flat; e = 136 makes the unit 1.
    fn flat(mantissas: &[u8]) -> Vec<u8> {
        mantissas.iter().flat_map(|&m| [m, m, m, 136]).collect()
    }

    #[test]
    fn rgbe_is_the_mantissa_times_a_power_of_two() {
        let data = [0, 128, 255, 136, 128, 0, 0, 129, 9, 9, 9, 0, 255, 255, 255, 255];
        let decoded = pixels(&picture("", "-Y 1 +X 4", &data));
        assert_eq!(decoded[0], [0.0, 128.0, 255.0]);
        assert_eq!(decoded[1], [1.0, 0.0, 0.0]);
        assert_eq!(decoded[2], [0.0; 3], "an exponent of 0 is black");
        assert!(decoded[3][0].is_finite());
    }

    #[test]
    fn all_eight_orientations_give_the_same_picture() {
        // The picture, rows from the top: 11 12 13 / 14 15 16 (1 1 1 would be a repetition).
        let expected: Vec<_> = (11..=16).map(|m| [m as f32; 3]).collect();
        for (resolution, scanned) in [
            ("-Y 2 +X 3", [11, 12, 13, 14, 15, 16]),
            ("-Y 2 -X 3", [13, 12, 11, 16, 15, 14]),
            ("+Y 2 +X 3", [14, 15, 16, 11, 12, 13]),
            ("+Y 2 -X 3", [16, 15, 14, 13, 12, 11]),
            ("+X 3 -Y 2", [11, 14, 12, 15, 13, 16]),
            ("-X 3 -Y 2", [13, 16, 12, 15, 11, 14]),
            ("+X 3 +Y 2", [14, 11, 15, 12, 16, 13]),
            ("-X 3 +Y 2", [16, 13, 15, 12, 14, 11]),
        ] {
            let decoded = read(&picture("", resolution, &flat(&scanned))).unwrap().image;
            assert_eq!((decoded.width(), decoded.height()), (3, 2), "{resolution}");
            assert_eq!(decoded.pixels(), expected, "{resolution}");
        }
    }

    #[test]
    fn old_run_lengths_shift_by_eight_bits_when_they_follow_each_other() {
        // One pixel, 3 + 1 * 256 repetitions, another pixel.
        let data = [flat(&[7]), vec![1, 1, 1, 3, 1, 1, 1, 1], flat(&[9])].concat();
        let decoded = pixels(&picture("", "-Y 1 +X 261", &data));
        assert!(decoded[..260].iter().all(|pixel| pixel[0] == 7.0));
        assert_eq!(decoded[260], [9.0; 3]);
    }

    #[test]
    fn exposures_and_corrections_multiply_and_are_divided_out() {
        let header = "EXPOSURE=2\nEXPOSURE= 4.0\nCOLORCORR=1 2 4\n";
        assert_eq!(pixels(&picture(header, "-Y 1 +X 1", &flat(&[64]))), [[8.0, 4.0, 2.0]]);
    }

    #[test]
    fn traps_of_real_files_are_ignored_aloud() {
        for header in ["EXPOSURE=0\n", "EXPOSURE=nan\n", "GAMMA=2.2\n"] {
            let decoded = read(&picture(header, "-Y 1 +X 1", &flat(&[5]))).unwrap();
            assert_eq!(decoded.image.pixels(), [[5.0; 3]]);
            assert_eq!(decoded.warnings.len(), 1, "{:?}", decoded.warnings);
            assert!(decoded.warnings[0].starts_with(header.trim_end()));
        }
        for header in [
            "",
            "GAMMA=1\n",
            "PRIMARIES=0 0 0 0 0 0 0 0\n",
            "# EXPOSURE=3\n",
            "\tpfilt -e 2 EXPOSURE=3\n",
            "FORMAT=32-bit_rle_rgbe\n",
        ] {
            let decoded = read(&picture(header, "-Y 1 +X 1", &flat(&[5]))).unwrap();
            assert_eq!(
                (decoded.image.pixels(), decoded.warnings.len()),
                ([[5.0; 3]].as_slice(), 0),
                "{header}"
            );
        }
        assert_eq!(pixels(b"#?RGBE\n\n-Y 1 +X 1\n\x05\x05\x05\x88\x01")[0], [5.0; 3]);
    }

    /// Grey is grey in both: Radiance's white, and that of XYZE, is adapted.
    #[test]
    fn xyze_and_primaries_are_converted() {
        let near =
            |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * b.abs().max(1.0));
        let radiance = "PRIMARIES=0.64 0.33 0.29 0.60 0.15 0.06 0.333333 0.333333\n";
        for header in ["FORMAT=32-bit_rle_xyze\n", radiance] {
            assert!(near(pixels(&picture(header, "-Y 1 +X 1", &flat(&[100])))[0], [100.0; 3]), "{header}");
        }
        // This green lies outside Rec. 709, and red becomes 0.
        let green = read(&picture(radiance, "-Y 1 +X 1", &[0, 100, 0, 136])).unwrap();
        let [pixel] = green.image.pixels() else { panic!("{green:?}") };
        assert!(pixel[0] == 0.0 && pixel[1] > 90.0 && green.warnings.len() == 1, "{green:?}");
    }

    #[test]
    fn what_is_written_comes_back_within_the_mantissa() {
        let value =
            |i: usize| (i as f32 * 0.37).sin().abs().powi(9) * 1e3 + if i % 7 < 4 { 0.0 } else { 1e-4 };
        for width in [1, 7, 8, 131, 600] {
            let pixels: Vec<_> = (0..3 * width).map(|i| [value(i), value(i / 9), 3.0]).collect();
            let image = Image::new(width, 3, pixels).unwrap();
            let encoded = write_rgbe(&image, Some("{\"kind\":\"x\"}")).unwrap();
            let decoded = read(&encoded.bytes).unwrap();
            assert_eq!(decoded.recipe.as_deref(), Some("{\"kind\":\"x\"}"));
            assert_eq!((encoded.negative, decoded.warnings.len()), (0, 0));
            for (a, b) in decoded.image.pixels().iter().zip(image.pixels()) {
                // A unit of the mantissa is at most 1/128 of the largest channel, and rounding is half of it.
                let largest = b.iter().fold(0.0_f32, |a, b| a.max(*b));
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= largest / 256.0), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn writing_is_the_inverse_of_reading_and_counts_negative_values() {
        for e in [1, 2, 100, 128, 200, 255] {
            for m in [128, 200, 255] {
                let rgb = [m, 3, 0].map(|m| (f64::from(m) * 2.0_f64.powi(i32::from(e) - 136)) as f32);
                assert_eq!(encode(rgb), [m, 3, 0, e], "{rgb:?}");
            }
        }
        assert_eq!(encode([1.0, 0.0, 0.0]), [128, 0, 0, 129]);
        // 255.5 / 256 rounds up to 1, which takes the next exponent.
        assert_eq!(encode([255.5 / 256.0, 0.25, 1.0 / 256.0]), [128, 32, 1, 129]);
        let image = Image::new(4, 1, vec![[-1.0, 0.0, 2.0], [f32::INFINITY, 0.0, 0.0], [1e-45; 3], [0.0; 3]]);
        let encoded = write_rgbe(&image.unwrap(), None).unwrap();
        assert_eq!(encoded.negative, 1);
        let decoded = pixels(&encoded.bytes);
        assert!(decoded[0] == [0.0, 0.0, 2.0] && decoded[1][0] > 1.6e38 && decoded[2] == [0.0; 3]);
        let nan = Image::new(1, 1, vec![[f32::NAN; 3]]).unwrap();
        assert_eq!(write_rgbe(&nan, None).unwrap_err().kind(), ErrorKind::Unwritable);
    }

    /// The mean over many values is that of the values, in readers that multiply the mantissa.
    #[test]
    fn what_is_written_is_neither_darker_nor_brighter() {
        let value = |i: usize| (1.0 + (i as f32 * 0.618).fract() * 3.0) * 0.37;
        let pixels: Vec<_> =
            (0..128 * 64).map(|i| [value(i), 0.7 * value(i + 1), 0.4 * value(i + 2)]).collect();
        let image = Image::new(128, 64, pixels).unwrap();
        let found = read(&write_rgbe(&image, None).unwrap().bytes).unwrap().image;
        for channel in 0..3 {
            let sum =
                |image: &Image| image.pixels().iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>();
            let ratio = sum(&found) / sum(&image);
            // 8192 roundings of at most 1/256 of the pixel's largest channel, by chance.
            assert!((ratio - 1.0).abs() < 1e-3, "channel {channel}: {ratio}");
        }
    }

    #[test]
    fn no_header_line_is_longer_than_old_readers_allow() {
        let text = "grün und größer, \u{1f307} ".repeat(90);
        for length in (0..text.len()).filter(|length| text.is_char_boundary(*length)) {
            let recipe = &text[..length];
            let bytes = write_rgbe(&Image::new(1, 1, vec![[1.0; 3]]).unwrap(), Some(recipe)).unwrap().bytes;
            let end = bytes.windows(2).position(|pair| pair == b"\n\n").unwrap();
            assert!(bytes[..end].split(|byte| *byte == b'\n').all(|line| line.len() < 100), "{length}");
            assert_eq!(read_recipe(&bytes).unwrap_or_default(), recipe);
        }
    }

    #[test]
    fn the_recipe_of_an_older_version_is_one_line() {
        let recipe = format!("{{\"kind\":\"x\",\"note\":\"a = b{}\"}}", " and more".repeat(40));
        let bytes = picture(&format!("SPECULA={recipe}\nFORMAT=32-bit_rle_rgbe\n"), "-Y 1 +X 1", &flat(&[5]));
        assert_eq!(read(&bytes).unwrap().recipe, Some(recipe));
    }

    #[test]
    fn runs_longer_than_their_line_are_damage() {
        for data in [
            &[2, 2, 0, 8, 200, 1][..],
            &[2, 2, 0, 9, 1],
            &[2, 2, 0, 8, 0],
            &[1, 1, 1, 2],
            &[9, 9, 9, 9, 1, 1, 1, 99],
        ] {
            let error = read(&picture("", "-Y 1 +X 8", data)).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Damaged, "{error}");
        }
    }
}
