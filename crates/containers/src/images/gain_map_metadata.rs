//! Where a JPEG keeps a gain map, and the two forms of its numbers.
//!
//! The map is a JPEG of its own that follows the picture in the file. Multi-Picture Format and the directory
//! of Google's `Container` say where; as it is found by its own metadata, neither is needed.
//!
//! | metadata | in the map | in the picture |
//! | --- | --- | --- |
//! | ISO 21496-1, annex C | APP2: version, flags, fractions | APP2: version |
//! | XMP of Adobe's Gain Map 1.0, Ultra HDR | `hdrgm:Version`, `hdrgm:GainMapMax` and others | `hdrgm:Version`, and in Ultra HDR an item `GainMap` |
//!
//! ISO 21496-1 counts if a map has both.

use std::ops::Range;

use super::gain_map::{Gain, Parameters};
use super::jpeg_segments::Segments;
use super::xmp::{properties, property};
use crate::error::Error;

const XMP: &[u8] = b"http://ns.adobe.com/xap/1.0/\0";
const ISO_21496_1: &[u8] = b"urn:iso:std:iso:ts:21496:-1\0";
const HDRGM: &str = "http://ns.adobe.com/hdr-gain-map/1.0/";
const APPLE: &str = "http://ns.apple.com/HDRGainMap/1.0/";
const CONTAINER: &str = "http://ns.google.com/photos/1.0/container/";
/// The index of Multi-Picture Format.
const INDEX: &[u8] = b"MPF\0";

/// The minimum version and the writer's, which the picture has too.
const VERSIONS: usize = 4;
/// JPEGs that are looked at behind the picture.
const MOST_PICTURES: usize = 32;
const START: &[u8] = &[0xff, 0xd8, 0xff];

/// Whether a gain map follows a picture in its file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Found {
    /// Nothing that concerns gain maps follows the picture.
    Nothing,
    /// A gain map, and where its JPEG lies in the file.
    GainMap(Parameters, Range<usize>),
    /// No gain map that is read, although the file speaks of one: a warning.
    Lost(&'static str),
}

/// Looks for the gain map of the picture that is the first JPEG in a file.
///
/// # Errors
/// If there is one and it is truncated or damaged, or of a later version.
pub(crate) fn find(bytes: &[u8], picture: &Segments) -> Result<Found, Error> {
    let Some(behind) = picture.end else { return Ok(Found::Nothing) };
    let mut at = behind;
    let (mut apple, mut is_cut) = (false, false);
    for _ in 0..MOST_PICTURES {
        let next = bytes[at..].windows(START.len()).position(|window| window == START);
        let Some(next) = next else { break };
        let start = at + next;
        let map = Segments::of(bytes, start);
        if let Some(parameters) = parameters(bytes, &map)? {
            let end = map.end.ok_or_else(|| {
                Error::truncated(
                    "the file ends before the end-of-image marker of its gain map: it was not copied whole",
                )
            })?;
            return Ok(Found::GainMap(parameters, start..end));
        }
        apple |= xmp(bytes, &map)
            .is_some_and(|text| property(&text, APPLE, "HDRGainMap", "HDRGainMapVersion").is_some());
        is_cut |= map.end.is_none();
        at = map.end.unwrap_or(start + START.len());
    }
    if !is_declared(bytes, picture) {
        let lost = "its gain map is of Apple's own kind, which is not read; export the picture with one of \
                    ISO 21496-1";
        return Ok(if apple { Found::Lost(lost) } else { Found::Nothing });
    }
    let has_index = picture.of_application(bytes, 2, INDEX).next().is_some();
    let has_directory = xmp(bytes, picture).is_some_and(|text| is_in_directory(&text));
    if bytes[behind..].iter().all(|byte| matches!(byte, 0 | b'\r' | b'\n')) {
        let missing = "it declares a gain map that is not in the file: a program has removed it, and with it all \
                       light brighter than white";
        return match has_index || has_directory {
            true => Err(Error::truncated(
                "the file ends before the gain map that its directory names: it was not copied whole, or a \
                 program has removed the map; without its metadata (XMP and MPF) the picture is read in SDR",
            )),
            false => Ok(Found::Lost(missing)),
        };
    }
    let what = "the picture declares a gain map, but no JPEG behind it has the metadata of one; the file is \
                damaged or was not copied whole";
    Err(if is_cut { Error::truncated(what) } else { Error::damaged(what) })
}

/// Whether a picture says that it has a gain map. A map that was taken out of its file is a picture that says
/// so of itself.
fn is_declared(bytes: &[u8], picture: &Segments) -> bool {
    let mut iso = picture.of_application(bytes, 2, ISO_21496_1);
    let text = xmp(bytes, picture).unwrap_or_default();
    let has = |name| hdrgm(&text, name).is_some();
    iso.any(|content| content.len() <= VERSIONS)
        || (has("Version") && !has("GainMapMax"))
        || is_in_directory(&text)
}

/// Whether the directory of Google's `Container` has a gain map.
fn is_in_directory(xmp: &str) -> bool {
    let written = ["\"GainMap\"", "'GainMap'", ">GainMap<"];
    xmp.contains(CONTAINER) && written.iter().any(|name| xmp.contains(name))
}

fn hdrgm(xmp: &str, name: &str) -> Option<Vec<String>> {
    properties(xmp, HDRGM, "hdrgm", name)
}

/// Whether the picture at the beginning of a file, of which these are the first bytes, says that it has a
/// gain map.
pub(crate) fn is_declared_in(beginning: &[u8]) -> bool {
    is_declared(beginning, &Segments::of(beginning, 0))
}

/// The parameters of a JPEG that is a gain map; `None` if it is not.
fn parameters(bytes: &[u8], map: &Segments) -> Result<Option<Parameters>, Error> {
    let mut iso = map.of_application(bytes, 2, ISO_21496_1);
    let found = match iso.find(|content| content.len() > VERSIONS) {
        Some(content) => Some(of_iso(content)?),
        None => xmp(bytes, map).map(|text| of_xmp(&text)).transpose()?.flatten(),
    };
    found.map(Parameters::checked).transpose()
}

/// The XMP of a JPEG: the packet that concerns gain maps, or else its first.
fn xmp(bytes: &[u8], jpeg: &Segments) -> Option<String> {
    let mut packets = jpeg.of_application(bytes, 1, XMP).map(String::from_utf8_lossy);
    let first = packets.next()?;
    let is_meant = |packet: &str| packet.contains(HDRGM);
    let meant = if is_meant(&first) { None } else { packets.find(|packet| is_meant(packet)) };
    Some(meant.unwrap_or(first).into_owned())
}

/// ISO 21496-1, annex C.2. Two flags are of a draft that libultrahdr writes: 4, the base is the rendition in
/// HDR, and 8, all fractions have one denominator.
fn of_iso(content: &[u8]) -> Result<Parameters, Error> {
    let short = || Error::truncated("the metadata of ISO 21496-1 ends before its last fraction");
    let mut words = content.get(VERSIONS + 1..).ok_or_else(short)?.chunks_exact(4);
    let mut word = || match words.next() {
        Some(&[a, b, c, d]) => Ok(u32::from_be_bytes([a, b, c, d])),
        _ => Err(short()),
    };
    let minimum = u16::from_be_bytes([content[0], content[1]]);
    if minimum != 0 {
        return Err(Error::unsupported(format!(
            "the gain map needs version {minimum} of ISO 21496-1; version 0 is read"
        )));
    }
    let flags = content[VERSIONS];
    let common = if flags & 8 == 0 { None } else { Some(word()?) };
    let over = |numerator: f64, denominator: u32| match denominator {
        0 => Err(Error::damaged("a fraction of the gain map's metadata is over 0: the gain map is damaged")),
        denominator => Ok(numerator / f64::from(denominator)),
    };
    let mut fraction = |is_signed: bool| {
        let bits = word()?;
        // The same 32 bits, read with a sign.
        let numerator = if is_signed { f64::from(bits.cast_signed()) } else { f64::from(bits) };
        let denominator = match common {
            Some(denominator) => denominator,
            None => word()?,
        };
        over(numerator, denominator)
    };
    let [base_headroom, alternate_headroom] = [fraction(false)?, fraction(false)?];
    let mut gain = || -> Result<Gain, Error> {
        Ok(Gain {
            min: fraction(true)?,
            max: fraction(true)?,
            gamma: fraction(false)?,
            base_offset: fraction(true)?,
            alternate_offset: fraction(true)?,
        })
    };
    let red = gain()?;
    Ok(Parameters {
        source: "ISO 21496-1",
        gains: if flags & 0x80 == 0 { [red; 3] } else { [red, gain()?, gain()?] },
        base_is_hdr: flags & 4 != 0 || base_headroom > alternate_headroom,
        in_base_primaries: flags & 0x40 != 0,
    })
}

/// Adobe's Gain Map 1.0. A property that is absent has the default of the specification. A packet with no
/// more than the version is a picture's.
fn of_xmp(xmp: &str) -> Result<Option<Parameters>, Error> {
    let names = ["GainMapMax", "GainMapMin", "Gamma", "OffsetSDR", "OffsetHDR", "HDRCapacityMax"];
    if names.iter().all(|name| hdrgm(xmp, name).is_none()) {
        return Ok(None);
    }
    let wrong = |name: &str, found: String, expected: &str| {
        Error::damaged(format!("hdrgm:{name} is {found}, expected {expected}: the gain map is damaged"))
    };
    let numbers = |name: &str, default: Option<f64>| -> Result<[f64; 3], Error> {
        let values = hdrgm(xmp, name);
        let Some(values) = values else {
            return default
                .map(|value| [value; 3])
                .ok_or_else(|| wrong(name, "absent".into(), "a number of stops"));
        };
        let numbers: Option<Vec<f64>> = values.iter().map(|value| value.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[grey]) => Ok([grey; 3]),
            Some(&[red, green, blue]) => Ok([red, green, blue]),
            _ => Err(wrong(name, format!("{:?}", values.join(", ")), "one number or three")),
        }
    };
    let flag = property(xmp, HDRGM, "hdrgm", "BaseRenditionIsHDR").unwrap_or_else(|| "False".into());
    let base_is_hdr = match flag.to_ascii_lowercase().as_str() {
        "true" | "1" => true,
        "false" | "0" => false,
        _ => return Err(wrong("BaseRenditionIsHDR", format!("{flag:?}"), "True or False")),
    };
    let (min, max) = (numbers("GainMapMin", Some(0.0))?, numbers("GainMapMax", None)?);
    let gamma = numbers("Gamma", Some(1.0))?;
    let sdr = numbers("OffsetSDR", Some(1.0 / 64.0))?;
    let hdr = numbers("OffsetHDR", Some(1.0 / 64.0))?;
    let [[least, ..], [most, ..]] =
        [numbers("HDRCapacityMin", Some(0.0))?, numbers("HDRCapacityMax", Some(f64::MAX))?];
    // They serve the weight for a display, and only show damage here.
    if !(least.is_finite() && most.is_finite() && least <= most) {
        let found = format!("{least} and hdrgm:HDRCapacityMax {most}");
        return Err(wrong("HDRCapacityMin", found, "at most as much"));
    }
    let gain = |channel: usize| Gain {
        min: min[channel],
        max: max[channel],
        gamma: gamma[channel],
        base_offset: if base_is_hdr { hdr[channel] } else { sdr[channel] },
        alternate_offset: if base_is_hdr { sdr[channel] } else { hdr[channel] },
    };
    Ok(Some(Parameters {
        source: "XMP hdrgm (Adobe, Ultra HDR)",
        gains: [0, 1, 2].map(gain),
        base_is_hdr,
        in_base_primaries: true,
    }))
}
