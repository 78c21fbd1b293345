//! PNG: reading by the `image` crate, and writing, also of animations.
//!
//! Exif is in the chunk eXIf, XMP in an iTXt `XML:com.adobe.xmp` or in ImageMagick's raw profile.

use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};

use ::image::Limits;
use ::image::codecs::png::PngDecoder;
use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, EncodingError};

use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::raster::{DEFLATE_RATIO, Opened, Raster, WORKSPACE};
use super::{cicp, raster};
use crate::error::{Error, ErrorKind};
use crate::format::Format;
use crate::metadata::{Metadata, array, block};
use crate::recipe::KEY;
use crate::{png_text, recipe};

pub(crate) const CODEC: Codec = Codec {
    name: "PNG",
    endings: &["png"],
    known_by: KnownBy::Signature(|bytes| bytes.starts_with(b"\x89PNG\r\n\x1a\n")),
    high_dynamic_range: false,
    declares_high_dynamic_range: |start| {
        let encoding = code_points(start).and_then(|points| cicp::encoding(points).ok());
        encoding.is_some_and(|(_, bright)| bright)
    },
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let (_, size) = open(&mut file, length)?;
        Ok(HeaderFacts { size, metadata: metadata(&mut file), ..HeaderFacts::default() })
    },
    recipe: read_recipe,
};

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    let mut decoded = raster(bytes)?.decode(Format::Png, wanted)?;
    complete(&mut decoded, bytes);
    Ok(decoded)
}

pub(crate) fn raster(bytes: &[u8]) -> Result<Raster, Error> {
    let raster = Raster::decoded_by(open(Cursor::new(bytes), bytes.len())?, bytes.len())?;
    let metadata = metadata(&mut Cursor::new(bytes));
    Ok(Raster { metadata, code_points: code_points(bytes), ..raster })
}

fn open<F: BufRead + Seek>(file: F, length: usize) -> Result<Opened<PngDecoder<F>>, Error> {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some((length + WORKSPACE) as u64);
    raster::opened(PngDecoder::with_limits(file, limits), length, DEFLATE_RATIO)
}

/// Reads the metadata; what is damaged says nothing.
fn metadata(file: &mut (impl Read + Seek)) -> Metadata {
    let mut found = Metadata::default();
    // The walk ends with the file: what it has found until then counts.
    let _ = chunks(file, |name, bytes| match name {
        b"eXIf" => found.take_exif(bytes),
        b"iTXt" | b"zTXt" | b"tEXt" => found.take_xmp(png_text::xmp(name, bytes).as_deref()),
        _ => {}
    });
    found
}

/// Visits the chunks whose content is not long, to the end of the file.
fn chunks(file: &mut (impl Read + Seek), mut visit: impl FnMut(&[u8; 4], &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(8)).ok()?;
    loop {
        let [a, b, c, d, name @ ..]: [u8; 8] = array(file)?;
        let length = u32::from_be_bytes([a, b, c, d]);
        let wanted = [b"eXIf", b"iTXt", b"zTXt", b"tEXt"].contains(&&name);
        block(file, length as usize, 4, wanted, |bytes| visit(&name, bytes))?;
    }
}

/// Adds what a PNG says beside its pixels: its recipe, and a gamma that is ignored.
fn complete(decoded: &mut Decoded, bytes: &[u8]) {
    let Ok(reader) = Decoder::new(Cursor::new(bytes)).read_info() else { return };
    let info = reader.info();
    decoded.recipe = recipe_of(info);
    let gamma = info.gama_chunk.map(|gamma| gamma.into_value());
    let superseded =
        info.srgb.is_some() || decoded.profile.is_some() || info.coding_independent_code_points.is_some();
    if let Some(gamma) = gamma.filter(|gamma| !superseded && (gamma - 1.0 / 2.2).abs() > 0.01) {
        decoded.warnings.push(format!("the gAMA chunk ({gamma}) was ignored: the image was taken for sRGB"));
    }
}

/// Primaries, transfer, matrix and full range of the chunk cICP.
fn code_points(bytes: &[u8]) -> Option<[u8; 4]> {
    let reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    let found = reader.info().coding_independent_code_points?;
    let full = u8::from(found.is_video_full_range_image);
    Some([found.color_primaries, found.transfer_function, found.matrix_coefficients, full])
}

/// Writes 8-bit RGB, `codes` being sRGB already, row by row from the top; `recipe` goes into an iTXt chunk.
///
/// # Errors
/// If the number of codes is not `width` x `height`, or the recipe holds control characters.
pub fn write_png(
    width: usize,
    height: usize,
    codes: &[[u8; 3]],
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    write(width, height, &[codes], None, recipe)
}

/// 8-bit RGBA as it is given, row by row from the top, without a colour space: data, not a picture.
///
/// # Errors
/// If the number of codes is not `width` x `height`.
pub(crate) fn write_rgba(width: usize, height: usize, codes: &[[u8; 4]]) -> Result<Vec<u8>, Error> {
    let unwritable = |message: String| Error::new(ErrorKind::Unwritable, message).within("PNG");
    if width * height != codes.len() {
        return Err(unwritable(format!("{} colours given for {width} x {height} pixels", codes.len())));
    }
    let mut bytes = Vec::new();
    // At most MAX_PIXELS, which the caller has checked.
    let mut encoder = Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(ColorType::Rgba);
    encoder.set_depth(BitDepth::Eight);
    let written = |encoder: Encoder<'_, &mut Vec<u8>>| -> Result<(), EncodingError> {
        let mut writer = encoder.write_header()?;
        writer.write_image_data(codes.as_flattened())?;
        writer.finish()
    };
    written(encoder).map_err(|error| unwritable(error.to_string()))?;
    Ok(bytes)
}

/// Writes an animated PNG (PNG specification, third edition, section 4.9) that repeats; a program without
/// animations shows its first frame. Each frame is as in [`write_png`] and is shown for some milliseconds.
///
/// # Errors
/// The errors of [`write_png`], and an error if there is no frame.
pub fn write_apng(
    width: usize,
    height: usize,
    frames: &[Vec<[u8; 3]>],
    milliseconds: u16,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let frames: Vec<_> = frames.iter().map(Vec::as_slice).collect();
    write(width, height, &frames, Some(milliseconds), recipe)
}

fn write(
    width: usize,
    height: usize,
    frames: &[&[[u8; 3]]],
    milliseconds: Option<u16>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let unwritable = |message: String| Error::new(ErrorKind::Unwritable, message).within("PNG");
    let side = |length: usize| u32::try_from(length).ok().filter(|&side| side > 0 && side <= i32::MAX as u32);
    let (Some(columns), Some(rows)) = (side(width), side(height)) else {
        return Err(unwritable(format!("a PNG cannot be {width} x {height} pixels")));
    };
    if let Some(wrong) = frames.iter().find(|codes| width.checked_mul(height) != Some(codes.len())) {
        return Err(unwritable(format!("{} colours given for {width} x {height} pixels", wrong.len())));
    }
    let count = u32::try_from(frames.len()).ok().filter(|&count| count > 0);
    let count =
        count.ok_or_else(|| unwritable(format!("a PNG needs at least 1 frame, not {}", frames.len())))?;
    recipe::check(recipe).map_err(|error| error.within("PNG"))?;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, columns, rows);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    // A third larger than the default, in a fifteenth of the time: a contact sheet would spend most of it
    // here.
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    let written = |mut encoder: Encoder<'_, &mut Vec<u8>>| -> Result<(), EncodingError> {
        if let Some(milliseconds) = milliseconds {
            encoder.set_animated(count, 0)?;
            encoder.set_frame_delay(milliseconds, 1000)?;
        }
        if let Some(recipe) = recipe {
            encoder.add_itxt_chunk(KEY.to_owned(), recipe.to_owned())?;
        }
        let mut writer = encoder.write_header()?;
        for codes in frames {
            writer.write_image_data(codes.as_flattened())?;
        }
        writer.finish()
    };
    written(encoder).map_err(|error| unwritable(error.to_string()))?;
    Ok(bytes)
}

/// The recipe in a PNG's text, which stands before its pixels.
fn read_recipe(bytes: &[u8]) -> Option<String> {
    let reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    recipe_of(reader.info())
}

fn recipe_of(info: &::png::Info<'_>) -> Option<String> {
    let chunk = info.utf8_text.iter().find(|chunk| chunk.keyword == KEY)?;
    // A compressed text is not one that we wrote.
    if chunk.compressed { None } else { chunk.get_text().ok() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> envmap::Image {
        crate::images::read_image::read_image(bytes, &crate::images::decoded::ReadOptions::default())
            .unwrap()
            .image
    }

    #[test]
    fn every_frame_of_an_animation_comes_back() {
        let frames: Vec<Vec<[u8; 3]>> = (0..3).map(|frame| vec![[40 * frame, 7, 200]; 6]).collect();
        let bytes = write_apng(3, 2, &frames, 125, Some("{}")).unwrap();
        let mut reader = Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
        let control = reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        let mut found = vec![0; reader.output_buffer_size().unwrap()];
        for expected in &frames {
            reader.next_frame(&mut found).unwrap();
            assert_eq!(found, expected.as_flattened());
            let frame = reader.info().frame_control().unwrap();
            assert_eq!((frame.delay_num, frame.delay_den), (125, 1000));
        }
        assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
        // The first frame is the picture for all that know of no animation.
        assert_eq!(read(&bytes), read(&write_png(3, 2, &frames[0], None).unwrap()));
    }

    #[test]
    fn an_animation_has_frames_of_one_size() {
        let error_of = |frames: &[Vec<[u8; 3]>]| write_apng(2, 2, frames, 1, None).unwrap_err().to_string();
        assert_eq!(error_of(&[]), "PNG: a PNG needs at least 1 frame, not 0");
        assert_eq!(error_of(&[vec![[0; 3]; 4], vec![[0; 3]; 3]]), "PNG: 3 colours given for 2 x 2 pixels");
    }
}
