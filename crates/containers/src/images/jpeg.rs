//! JPEG, read only: 8 bits, and in HDR with a gain map.
//!
//! `zune-jpeg` decodes it directly, not through `image`: that has no strict mode, and fills what a damaged
//! file lacks with grey. Exif is in a segment APP1 `Exif`, XMP in an APP1 of Adobe's namespace.

use std::io::{Cursor, Read, Seek, SeekFrom};

use zune_core::bytestream::{ZByteReaderTrait, ZCursor};
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;

use super::codec::{Codec, HeaderFacts, KnownBy};
use super::colour_space::ColourSpace;
use super::decoded::Decoded;
use super::gain_map::GainMap;
use super::gain_map_metadata;
use super::gain_map_metadata::Found;
use super::jpeg_segments::Segments;
use super::raster::Raster;
use crate::error::Error;
use crate::format::Format;
use crate::limits;
use crate::metadata::{EXIF, Metadata, array, block};

/// A block of 64 pixels takes at least one bit, so that a byte holds at most 512 pixels of 3 bytes.
const RATIO: usize = 512 * 3;

const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";

pub(crate) const CODEC: Codec = Codec {
    name: "JPEG",
    endings: &["jpg", "jpeg"],
    known_by: KnownBy::Signature(|bytes| bytes.starts_with(b"\xff\xd8\xff")),
    high_dynamic_range: false,
    declares_high_dynamic_range: gain_map_metadata::is_declared_in,
    has_layers: false,
    read: |bytes, options, _| read(bytes, options.colour_space),
    header: |mut file, length, _| {
        let (_, size) = open(&mut file, length)?;
        Ok(HeaderFacts { size, metadata: metadata(&mut file), ..HeaderFacts::default() })
    },
    recipe: |_| None,
};

fn read(bytes: &[u8], wanted: Option<ColourSpace>) -> Result<Decoded, Error> {
    let picture = Segments::of(bytes, 0);
    let mut raster = raster_of(bytes, picture.end)?;
    let within = |error: Error| error.within("gain map");
    let mut lost = None;
    match gain_map_metadata::find(bytes, &picture).map_err(within)? {
        Found::Nothing => {}
        Found::Lost(why) => lost = Some(why),
        Found::GainMap(parameters, place) => {
            let length = place.len();
            let map = raster_of(&bytes[place], Some(length)).map_err(within)?;
            let Raster { width, height, samples, profile, .. } = map;
            raster.gain_map = Some(GainMap { parameters, width, height, samples, profile });
        }
    }
    let mut decoded = raster.decode(Format::Jpeg, wanted)?;
    decoded.warnings.extend(lost.map(str::to_owned));
    Ok(decoded)
}

/// A decoder that has read the header, and the size that this declares.
fn open<T: ZByteReaderTrait>(file: T, length: usize) -> Result<(JpegDecoder<T>, [usize; 2]), Error> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(file, options);
    decoder.decode_headers().map_err(describe)?;
    let info = decoder.info().ok_or_else(|| Error::damaged("the header holds no size"))?;
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    limits::plausible(limits::pixels(width, height)? * 3, length, RATIO)?;
    Ok((decoder, [width, height]))
}

/// The samples of a JPEG, without its gain map.
pub(crate) fn raster(bytes: &[u8]) -> Result<Raster, Error> {
    raster_of(bytes, Segments::of(bytes, 0).end)
}

/// The samples of the JPEG that ends at this byte of its file; `None` if the file ends before.
fn raster_of(bytes: &[u8], end: Option<usize>) -> Result<Raster, Error> {
    let picture = &bytes[..end.unwrap_or(bytes.len())];
    let (mut decoder, [width, height]) = open(ZCursor::new(picture), bytes.len())?;
    // Even in strict mode the decoder fills what is missing with grey, or reports damage of some other kind.
    if end.is_none() {
        return Err(Error::truncated("the file ends before its end-of-image marker"));
    }
    let samples = decoder.decode().map_err(describe)?;
    let profile = decoder.icc_profile();
    let metadata = metadata(&mut Cursor::new(bytes));
    Ok(Raster {
        width,
        height,
        channels: 3,
        depth: 1,
        floats: false,
        samples,
        profile,
        code_points: None,
        gain_map: None,
        metadata,
    })
}

/// Reads the metadata; what is damaged says nothing.
fn metadata(file: &mut (impl Read + Seek)) -> Metadata {
    let mut found = Metadata::default();
    // The walk ends with the pixels: what it has found until then counts.
    let _ = segments(file, |marker, bytes| {
        if marker == 0xe1 && bytes.starts_with(EXIF) {
            found.take_exif(bytes);
        } else if marker == 0xe1 {
            found.take_xmp(bytes.strip_prefix(XMP));
        }
    });
    found
}

/// Visits the segments that stand before the pixels, each with its marker's second byte.
fn segments(file: &mut (impl Read + Seek), mut visit: impl FnMut(u8, &[u8])) -> Option<()> {
    file.seek(SeekFrom::Start(2)).ok()?;
    loop {
        let [mut start, mut marker]: [u8; 2] = array(file)?;
        // Bytes of 255 may fill the space before a marker.
        while start == 0xff && marker == 0xff {
            [start, marker] = [marker, array::<1>(file)?[0]];
        }
        if start != 0xff || marker == 0xda {
            return None;
        }
        if marker == 0x01 || (0xd0..=0xd8).contains(&marker) {
            continue;
        }
        let length = usize::from(u16::from_be_bytes(array(file)?)).checked_sub(2)?;
        let wanted = (0xe0..=0xef).contains(&marker);
        block(file, length, 0, wanted, |bytes| visit(marker, bytes))?;
    }
}

fn describe(error: DecodeErrors) -> Error {
    match error {
        DecodeErrors::ExhaustedData => Error::truncated("the file ends before its data does"),
        DecodeErrors::IoErrors(_) => Error::truncated("the file ends before its data does"),
        DecodeErrors::Unsupported(scheme) => Error::unsupported(format!("not read: {scheme:?}")),
        other => Error::damaged(format!("{other:?}")),
    }
}
