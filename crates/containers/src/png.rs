//! PNG: 8 and 16 bits, grey, RGB, palette, with or without alpha; taken for sRGB (IEC 61966-2-1).

use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, Compression, Decoder, DecodingError, Encoder, EncodingError, Transformations,
};
use envmap::Image;

use crate::error::{Error, ErrorKind};
use crate::image::Decoded;
use crate::recipe::{self, KEY};
use crate::{Format, limits};

/// Deflate gains at most 1032 to 1, and a bit of the file becomes at most a byte here.
const RATIO: usize = 1032 * 8;

pub(crate) fn read(bytes: &[u8]) -> Result<Decoded, Error> {
    let mut decoder = Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(Transformations::EXPAND);
    let header = decoder.read_header_info().map_err(describe)?;
    let (width, height) = (header.width as usize, header.height as usize);
    let count = limits::pixels(width, height)?;
    let mut reader = decoder.read_info().map_err(describe)?;
    let size = reader
        .output_buffer_size()
        .ok_or_else(|| Error::new(ErrorKind::TooLarge, "the pixels do not fit into memory"))?;
    limits::plausible(size, bytes.len(), RATIO)?;
    let recipe = recipe_of(reader.info());
    let gamma = reader.info().gama_chunk.map(|gamma| gamma.into_value());
    let declared_srgb = reader.info().srgb.is_some();

    let mut samples = vec![0; size];
    let frame = reader.next_frame(&mut samples).map_err(describe)?;
    let channels = frame.color_type.samples();
    let colours = if channels >= 3 { [0, 1, 2] } else { [0, 0, 0] };
    let has_alpha = channels % 2 == 0;
    let mut pixels = Vec::with_capacity(count);
    let opaque = if frame.bit_depth == BitDepth::Sixteen {
        let sample = |pixel: &[u8], c: usize| u16::from_be_bytes([pixel[2 * c], pixel[2 * c + 1]]);
        let linear = |code: u16| srgb_to_linear(f64::from(code) / 65535.0) as f32;
        let whole = || samples.chunks_exact(2 * channels);
        pixels.extend(whole().map(|pixel| colours.map(|c| linear(sample(pixel, c)))));
        whole().all(|pixel| sample(pixel, channels - 1) == u16::MAX)
    } else {
        let table = srgb_to_linear_8();
        let whole = || samples.chunks_exact(channels);
        pixels.extend(whole().map(|pixel| colours.map(|c| table[usize::from(pixel[c])])));
        whole().all(|pixel| pixel[channels - 1] == u8::MAX)
    };
    let image = Image::new(width, height, pixels)
        .ok_or_else(|| Error::damaged("the pixels do not fill the declared size"))?;
    let mut decoded = Decoded::new(Format::Png, image);
    decoded.recipe = recipe;
    if has_alpha && !opaque {
        decoded.warnings.push("the alpha channel was ignored".into());
    }
    if let Some(gamma) = gamma.filter(|gamma| !declared_srgb && (gamma - 1.0 / 2.2).abs() > 0.01) {
        decoded.warnings.push(format!("the gAMA chunk ({gamma}) was ignored: the image was taken for sRGB"));
    }
    Ok(decoded)
}

/// Writes 8-bit RGB, `codes` being sRGB already, row by row from the top; `recipe` goes into an iTXt chunk.
///
/// # Errors
/// Where the number of codes is not `width` x `height`, or the recipe holds control characters.
pub fn write_png(
    width: usize,
    height: usize,
    codes: &[[u8; 3]],
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    write(width, height, &[codes], None, recipe)
}

/// Writes an animated PNG (PNG specification, third edition, section 4.9) that is shown again and again; what does not know
/// of animations shows its first frame. Each frame is as in [`write_png`] and is shown for some milliseconds.
///
/// # Errors
/// As [`write_png`], and where there is no frame.
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
    let count = count.ok_or_else(|| unwritable(format!("{} frames are no picture", frames.len())))?;
    recipe::check(recipe).map_err(|error| error.within("PNG"))?;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, columns, rows);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    // A third larger than the default, in a fifteenth of the time: a contact sheet would spend most of it here.
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
pub(crate) fn read_recipe(bytes: &[u8]) -> Option<String> {
    let reader = Decoder::new(Cursor::new(bytes)).read_info().ok()?;
    recipe_of(reader.info())
}

fn recipe_of(info: &::png::Info<'_>) -> Option<String> {
    let chunk = info.utf8_text.iter().find(|chunk| chunk.keyword == KEY)?;
    // A compressed text is not one that we wrote.
    if chunk.compressed { None } else { chunk.get_text().ok() }
}

/// The linear value of an sRGB value, both in [0, 1].
fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// The linear value of each 8-bit sRGB code.
pub(crate) fn srgb_to_linear_8() -> [f32; 256] {
    std::array::from_fn(|code| srgb_to_linear(code as f64 / 255.0) as f32)
}

fn describe(error: DecodingError) -> Error {
    match error {
        DecodingError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::truncated("the file ends before its data does")
        }
        DecodingError::LimitsExceeded => {
            Error::new(ErrorKind::TooLarge, "the decoder's limit of memory is exceeded")
        }
        other => Error::damaged(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(
            read(&bytes).unwrap().image,
            read(&write_png(3, 2, &frames[0], None).unwrap()).unwrap().image
        );
    }

    #[test]
    fn an_animation_has_frames_of_one_size() {
        let fault = |frames: &[Vec<[u8; 3]>]| write_apng(2, 2, frames, 1, None).unwrap_err().to_string();
        assert_eq!(fault(&[]), "PNG: 0 frames are no picture");
        assert_eq!(fault(&[vec![[0; 3]; 4], vec![[0; 3]; 3]]), "PNG: 3 colours given for 2 x 2 pixels");
    }
}
