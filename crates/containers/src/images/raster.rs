//! Pictures of integers or floats in rows: what their decoders give becomes linear Rec. 709.
//!
//! PNG, TGA and WebP are decoded by the `image` crate. JPEG is not: `image` fills what a damaged file lacks
//! with grey, without an error. Nor is TIFF, of which `image` reads only a few kinds.

use std::io::ErrorKind as IoErrorKind;

use ::image::{ImageDecoder, ImageError, ImageResult, Limits};
use envmap::Image;
use rayon::prelude::*;

use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::gain_map::GainMap;
use super::icc::Encoding;
use super::orientation::{upright, upright_size};
use super::{cicp, gpano, icc};
use crate::error::{Error, ErrorKind};
use crate::format::Format;
use crate::limits;
use crate::metadata::Metadata;

/// Memory that a decoder may use beside its result and the file, in bytes.
pub(crate) const WORKSPACE: usize = 16 << 20;

/// A picture as its decoder gives it.
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// 1 (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGB and alpha).
    pub(crate) channels: usize,
    /// Bytes of a sample: 1 or 2 for integers, 4 for floats and for integers that are stored as f32 from 0
    /// to 1.
    pub(crate) depth: usize,
    /// Whether the file holds floats, which are linear and may exceed 1.
    pub(crate) floats: bool,
    /// The samples, native endian, channel by channel within a pixel and row by row from the top.
    pub(crate) samples: Vec<u8>,
    pub(crate) profile: Option<Vec<u8>>,
    /// PNG's cICP, which replaces a profile, as one in the profile itself does.
    pub(crate) code_points: Option<[u8; 4]>,
    pub(crate) gain_map: Option<GainMap>,
    /// The other metadata of the file that concern its pixels.
    pub(crate) metadata: Metadata,
}

/// Deflate gains at most 1032 to 1, and a bit of the file becomes at most a byte here.
pub(crate) const DEFLATE_RATIO: usize = 1032 * 8;

/// A decoder that has read the header of a file, and the size that this declares.
pub(crate) type Opened<D> = (D, [usize; 2]);

/// Checks what a decoder of the `image` crate has read of the header of a file of `length` bytes, each of
/// which can hold at most `ratio` bytes of samples.
pub(crate) fn opened<D: ImageDecoder>(
    decoder: ImageResult<D>,
    length: usize,
    ratio: usize,
) -> Result<Opened<D>, Error> {
    let decoder = decoder.map_err(describe)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    limits::pixels(width, height)?;
    let size = usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX);
    limits::plausible(size, length, ratio)?;
    Ok((decoder, [width, height]))
}

impl Raster {
    /// The samples that a decoder of the `image` crate gives of a file of `length` bytes, without metadata.
    pub(crate) fn decoded_by<D: ImageDecoder>(
        (mut decoder, [width, height]): Opened<D>,
        length: usize,
    ) -> Result<Self, Error> {
        let total = decoder.total_bytes();
        let size = usize::try_from(total)
            .map_err(|_| Error::new(ErrorKind::TooLarge, "the pixels do not fit into memory"))?;
        let profile = decoder.icc_profile().map_err(describe)?;
        let mut allowed = Limits::no_limits();
        allowed.max_alloc = Some(2 * total + (length + WORKSPACE) as u64);
        decoder.set_limits(allowed).map_err(describe)?;
        let colour = decoder.color_type();
        let channels = usize::from(colour.channel_count());
        let depth = usize::from(colour.bytes_per_pixel()) / channels;
        let mut samples = vec![0; size];
        decoder.read_image(&mut samples).map_err(describe)?;
        Ok(Self {
            width,
            height,
            channels,
            depth,
            floats: false,
            samples,
            profile,
            code_points: None,
            gain_map: None,
            metadata: Metadata::default(),
        })
    }

    /// The picture in linear Rec. 709: by its ICC profile; without one, floats are linear and integers are
    /// sRGB. PNG's cICP goes before its profile, and PQ or HLG in a profile before its curves. The primaries
    /// are the wanted ones, if there are any.
    pub(crate) fn decode(self, format: Format, wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
        let Self { width, height, channels, depth, floats, samples, profile, metadata, .. } = self;
        let in_profile = || profile.as_deref().filter(|_| !floats).and_then(icc::code_points_in_hdr);
        let code_points = self.code_points.or_else(in_profile);
        let mut warnings = Vec::new();
        let grey = channels < 3;
        let by_profile = profile.as_deref().map(|profile| Encoding::of_profile(profile, grey, floats));
        let by_profile = by_profile.transpose();
        let (encoding, ignored) = match by_profile {
            Ok(encoding) => (encoding, None),
            Err(why) => (None, Some(why)),
        };
        let taken_for = if floats { "linear Rec. 709" } else { "sRGB" };
        if let Some(why) = ignored {
            warnings.push(format!("the ICC profile was ignored: {why}; the image was taken for {taken_for}"));
        }
        let declared = code_points.map(cicp::encoding).transpose().unwrap_or_else(|why| {
            warnings.push(format!("its cICP was ignored: {why}"));
            None
        });
        let mut bright = declared.as_ref().is_some_and(|(_, bright)| *bright);
        let by_code_points = declared.map(|(mut encoding, _)| {
            encoding.profile =
                code_points.map(|[primaries, transfer, ..]| format!("cICP {primaries}/{transfer}"));
            encoding
        });
        let encoding = by_code_points.or(encoding);
        let encoding = encoding.unwrap_or_else(|| if floats { Encoding::linear() } else { Encoding::srgb() });
        let mut encoding = match wanted {
            Some(space) => encoding.with_primaries(space, &mut warnings),
            None => encoding,
        };

        let levels = if depth == 4 { 0 } else { 1_usize << (8 * depth) };
        let tables = encoding.curves.each_ref().map(|curve| {
            (0..levels).map(|code| curve(code as f64 / (levels - 1) as f64) as f32).collect::<Vec<f32>>()
        });
        let linear = |channel: usize, sample: &[u8]| match *sample {
            [code] => tables[channel][usize::from(code)],
            [a, b] => tables[channel][usize::from(u16::from_ne_bytes([a, b]))],
            [a, b, c, d] => encoding.curves[channel](f32::from_ne_bytes([a, b, c, d]).into()) as f32,
            _ => 0.0,
        };
        let pixels = samples.par_chunks_exact(channels * depth);
        let mut pixels: Vec<[f32; 3]> = pixels
            .map(|pixel| {
                let sample = |channel: usize| &pixel[channel * depth..][..depth];
                [0, 1, 2].map(|channel| linear(channel, sample(if grey { 0 } else { channel })))
            })
            .collect();
        let (mut notes, description) = (Vec::new(), self.gain_map.as_ref().map(GainMap::description));
        match self.gain_map {
            Some(map) if !map.parameters.base_is_hdr => {
                bright = true;
                prepare_for(&map, &mut encoding, &mut pixels, &mut warnings)?;
                map.apply(&mut pixels, width);
            }
            Some(_) => notes.push(
                "the picture itself is the rendition in HDR: its gain map, which leads to SDR, was not applied"
                    .into(),
            ),
            None => {}
        }
        let outside = encoding.convert_primaries(&mut pixels).map_err(Error::damaged)?;

        if channels.is_multiple_of(2) {
            let opaque = |alpha: &[u8]| match *alpha {
                [a, b, c, d] => f32::from_ne_bytes([a, b, c, d]) >= 1.0,
                _ => alpha.iter().all(|&byte| byte == u8::MAX),
            };
            let alphas = samples.chunks_exact(channels * depth).map(|pixel| &pixel[(channels - 1) * depth..]);
            if !alphas.into_iter().all(opaque) {
                warnings.push("the alpha channel was ignored".into());
            }
        }
        if !floats {
            let outside = pixels.iter().filter(|pixel| pixel.iter().any(|&value| value < 0.0)).count();
            if outside > 0 {
                pixels.iter_mut().flatten().for_each(|value| *value = value.max(0.0));
                warnings.push(format!("{outside} pixels are more saturated than Rec. 709 can hold; their negative values became 0"));
            }
        }
        let [columns, rows] = upright_size([width, height], metadata.orientation);
        let pixels = upright(pixels, [width, height], metadata.orientation);
        let image = Image::new(columns, rows, pixels)
            .ok_or_else(|| Error::damaged("the pixels do not fill the declared size"))?;
        let mut decoded = Decoded::new(format, image);
        decoded.high_dynamic_range = floats || bright;
        decoded.profile = encoding.profile;
        decoded.gain_map = description;
        decoded.warnings = warnings;
        decoded.notes = notes;
        decoded.panorama = metadata.xmp.and_then(|xmp| gpano::of_xmp(&xmp, [columns, rows]));
        outside.report(&mut decoded.warnings, &mut decoded.notes);
        Ok(decoded)
    }
}

/// Converts linear pixels to the primaries for which the formula of a gain map holds.
fn prepare_for(
    map: &GainMap,
    encoding: &mut Encoding,
    pixels: &mut [[f32; 3]],
    warnings: &mut Vec<String>,
) -> Result<(), Error> {
    let Some(from) = encoding.matrix() else {
        encoding.convert_primaries(pixels).map_err(Error::damaged)?;
        let profile = encoding.profile.take();
        *encoding = Encoding::linear();
        encoding.profile = profile;
        warnings.push("the ICC profile is made of tables: the gain map was applied in Rec. 709".into());
        return Ok(());
    };
    let profile = map.profile.as_deref().filter(|_| !map.parameters.in_base_primaries);
    let Some(profile) = profile else { return Ok(()) };
    let by_code_points = icc::code_points_in_hdr(profile).and_then(|points| cicp::encoding(points).ok());
    let alternate = match by_code_points {
        Some((encoding, _)) => Ok(encoding),
        None => Encoding::of_profile(profile, false, false),
    };
    match alternate.map(|encoding| encoding.matrix()) {
        Ok(Some(to)) => encoding.change_primaries([from, to], pixels),
        Ok(None) => warnings.push(
            "the ICC profile of the gain map was ignored, as it is made of tables: the map was applied in the \
             picture's primaries"
                .into(),
        ),
        Err(why) => warnings.push(format!(
            "the ICC profile of the gain map was ignored: {why}; the map was applied in the picture's primaries"
        )),
    }
    Ok(())
}

fn describe(error: ImageError) -> Error {
    match error {
        ImageError::IoError(error) if error.kind() == IoErrorKind::UnexpectedEof => {
            Error::truncated("the file ends before its data does")
        }
        ImageError::Limits(_) => Error::new(ErrorKind::TooLarge, "the decoder's limit of memory is exceeded"),
        ImageError::Unsupported(error) => Error::unsupported(format!("not read: {error}")),
        other => Error::damaged(other.to_string()),
    }
}
