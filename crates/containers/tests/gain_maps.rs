//! JPEG with a gain map: Ultra HDR, Adobe's and ISO 21496-1. The pictures and maps were made by other
//! programs (`data/README.md`); the tests put them together and know their codes.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // as in any test

use std::fmt::Write as _;

use containers::{Decoded, ErrorKind, ReadOptions, read_image};

/// 32 x 16 pixels, grey, in 8 flat blocks.
const BASE: &[u8] = include_bytes!("data/pillow-gain-base.jpg");
const CODES: [[u8; 4]; 2] = [[64, 128, 192, 255], [32, 96, 160, 224]];
/// 16 x 8 pixels, one channel: 0 on the left, 255 on the right.
const GREY: &[u8] = include_bytes!("data/pillow-gain-grey.jpg");
/// 32 x 16 pixels, RGB, in 4 flat columns.
const RGB: &[u8] = include_bytes!("data/pillow-gain-rgb.jpg");
const COLUMNS: [[u8; 3]; 4] = [[0, 128, 255], [255, 0, 128], [128, 255, 0], [200, 100, 50]];

const ISO: &[u8] = b"urn:iso:std:iso:ts:21496:-1\0";
/// Version 0, as the picture has it too.
const VERSIONS: [u8; 4] = [0; 4];

/// IEC 61966-2-1.
fn linear(code: u8) -> f64 {
    let srgb = f64::from(code) / 255.0;
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// A JPEG with segments of an application behind its start.
fn with(jpeg: &[u8], segments: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = jpeg[..2].to_vec();
    for (number, content) in segments {
        bytes.extend([0xff, 0xe0 + number]);
        bytes.extend(u16::try_from(content.len() + 2).unwrap().to_be_bytes());
        bytes.extend(content);
    }
    bytes.extend(&jpeg[2..]);
    bytes
}

fn xmp(attributes: &str, elements: &str) -> (u8, Vec<u8>) {
    let text = format!(
        r#"<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description xmlns:hdrgm="http://ns.adobe.com/hdr-gain-map/1.0/" {attributes}>{elements}</rdf:Description></rdf:RDF></x:xmpmeta>"#
    );
    (1, [b"http://ns.adobe.com/xap/1.0/\0", text.as_bytes()].concat())
}

fn iso(content: &[u8]) -> (u8, Vec<u8>) {
    (2, [ISO, content].concat())
}

/// The directory of Ultra HDR for a map of this length.
fn container(length: usize) -> (u8, Vec<u8>) {
    let item = |semantic: &str, length: usize| {
        format!(
            r#"<rdf:li rdf:parseType="Resource"><Container:Item Item:Semantic="{semantic}" Item:Mime="image/jpeg" Item:Length="{length}"/></rdf:li>"#
        )
    };
    xmp(
        r#"xmlns:Container="http://ns.google.com/photos/1.0/container/" xmlns:Item="http://ns.google.com/photos/1.0/container/item/" hdrgm:Version="1.0""#,
        &format!(
            "<Container:Directory><rdf:Seq>{}{}</rdf:Seq></Container:Directory>",
            item("Primary", 0),
            item("GainMap", length)
        ),
    )
}

/// CIPA DC-007: an index of two pictures, of which the second lies at this offset from the index's `MM`.
fn multi_picture(length: usize, offset: usize) -> (u8, Vec<u8>) {
    let mut content = b"MPF\0MM\0*\0\0\0\x08\0\x01\xb0\x02\0\x07\0\0\0\x20\0\0\0\x1a\0\0\0\0".to_vec();
    for (size, offset) in [(0, 0), (length, offset)] {
        content.extend([0; 4]);
        content.extend(u32::try_from(size).unwrap().to_be_bytes());
        content.extend(u32::try_from(offset).unwrap().to_be_bytes());
        content.extend([0; 4]);
    }
    (2, content)
}

/// A file of Ultra HDR: the map's XMP in attributes, the picture with a directory.
fn ultra_hdr(map: &[u8], attributes: &str) -> Vec<u8> {
    let map = with(map, &[xmp(&format!("hdrgm:Version=\"1.0\" {attributes}"), "")]);
    [with(BASE, &[container(map.len())]), map].concat()
}

fn read(bytes: &[u8]) -> Decoded {
    read_image(bytes, &ReadOptions::default()).unwrap()
}

fn error(bytes: &[u8]) -> (ErrorKind, String) {
    let error = read_image(bytes, &ReadOptions::default()).unwrap_err();
    (error.kind(), error.to_string())
}

/// Compares every pixel; the expected one is given by its place and the base's linear value.
fn compare(decoded: &Decoded, expected: impl Fn(usize, usize, f64) -> [f64; 3]) {
    assert_eq!((decoded.image.width(), decoded.image.height()), (32, 16));
    assert!(decoded.high_dynamic_range && decoded.warnings.is_empty(), "{:?}", decoded.warnings);
    for (i, pixel) in decoded.image.pixels().iter().enumerate() {
        let (x, y) = (i % 32, i / 32);
        let expected = expected(x, y, linear(CODES[y / 8][x / 8]));
        for (found, expected) in pixel.iter().zip(expected) {
            // f32 has 24 bits.
            assert!((f64::from(*found) - expected).abs() <= 2e-7 * expected.max(1.0), "{x}, {y}: {pixel:?}");
        }
    }
}

/// The code of the grey map, interpolated between the centres of its pixels 7 and 8.
fn grey_code(x: usize) -> f64 {
    ((x as f64 + 0.5) / 2.0 - 0.5 - 7.0).clamp(0.0, 1.0)
}

#[test]
fn ultra_hdr_is_read_in_hdr_with_a_smaller_grey_map() {
    let bytes = ultra_hdr(
        GREY,
        "hdrgm:GainMapMin=\"-1\" hdrgm:GainMapMax='4' hdrgm:Gamma=\"2\" hdrgm:OffsetSDR=\"0.03125\" \
         hdrgm:OffsetHDR=\"0.0078125\" hdrgm:HDRCapacityMin=\"0\" hdrgm:HDRCapacityMax=\"4\" \
         hdrgm:BaseRenditionIsHDR=\"False\"",
    );
    let decoded = read(&bytes);
    compare(&decoded, |x, _, base| {
        let stops = -1.0 + 5.0 * grey_code(x).sqrt();
        [((base + 0.03125) * stops.exp2() - 0.0078125).max(0.0); 3]
    });
    let description = decoded.gain_map.unwrap();
    assert_eq!(description, "XMP hdrgm (Adobe, Ultra HDR), 16 x 8, grey, from -1.00 to 4.00 stops");
    // What Ultra HDR and Adobe define for what is absent: 0, 1, 1/64.
    let short = read(&ultra_hdr(GREY, "hdrgm:GainMapMax=\"3\" hdrgm:HDRCapacityMax=\"3\""));
    compare(&short, |x, _, base| [(base + 1.0 / 64.0) * (3.0 * grey_code(x)).exp2() - 1.0 / 64.0; 3]);
}

/// As Camera Raw and gainmap-js write it: lists in RDF, found through Multi-Picture Format.
#[test]
fn adobe_s_map_of_three_channels_is_read_in_hdr() {
    let list = |name: &str, values: [f64; 3]| {
        let items = values.map(|value| format!("<rdf:li>{value}</rdf:li>")).concat();
        format!("<hdrgm:{name}>\n <rdf:Seq>{items}</rdf:Seq></hdrgm:{name}>")
    };
    let (min, max, gamma) = ([-0.5, 0.0, 0.25], [2.0, 3.5, 5.0], [1.0, 0.75, 1.5]);
    let (sdr, hdr) = ([0.015625, 0.03125, 0.0], [0.015625, 0.0, 0.0625]);
    let lists = [
        list("GainMapMin", min),
        list("GainMapMax", max),
        list("Gamma", gamma),
        list("OffsetSDR", sdr),
        list("OffsetHDR", hdr),
        "<hdrgm:HDRCapacityMin>0</hdrgm:HDRCapacityMin><hdrgm:HDRCapacityMax>5</hdrgm:HDRCapacityMax>".into(),
    ];
    let map = with(RGB, &[xmp("hdrgm:Version=\"1.0\"", &lists.concat())]);
    let directory = |offset| [xmp("hdrgm:Version=\"1.0\"", ""), multi_picture(map.len(), offset)];
    let picture = with(BASE, &directory(0));
    let index = picture.windows(4).position(|four| four == b"MPF\0").unwrap() + 4;
    let bytes = [with(BASE, &directory(picture.len() - index)), map.clone()].concat();
    let decoded = read(&bytes);
    let expected = |x: usize, _: usize, base: f64| {
        [0, 1, 2].map(|channel| {
            let code = f64::from(COLUMNS[x / 8][channel]) / 255.0;
            let stops = min[channel] + (max[channel] - min[channel]) * code.powf(1.0 / gamma[channel]);
            ((base + sdr[channel]) * stops.exp2() - hdr[channel]).max(0.0)
        })
    };
    compare(&decoded, expected);
    // gainmap-js 3.7.3, given the same numbers, writes their means as XMP and themselves as ISO 21496-1.
    compare(&read(include_bytes!("data/gainmap-js.jpg")), expected);
    assert!(decoded.gain_map.unwrap().ends_with("32 x 16, RGB, from -0.50 to 5.00 stops"));
    // A preview between the picture and its map, with the XMP of the picture.
    let preview = with(GREY, &[xmp("hdrgm:Version=\"1.0\"", "")]);
    let three = read(&[picture, vec![0; 100], preview, map].concat());
    assert_eq!(three.image, decoded.image);
}

/// Annex C.2 of ISO 21496-1, by hand.
fn fractions(flags: u8, headrooms: [u32; 2], gains: &[[i32; 5]]) -> Vec<u8> {
    let mut content = [&VERSIONS[..], &[flags]].concat();
    for headroom in headrooms {
        content.extend(headroom.to_be_bytes());
        content.extend(1_u32.to_be_bytes());
    }
    for numerator in gains.iter().flatten() {
        content.extend(numerator.to_be_bytes());
        content.extend(64_u32.to_be_bytes());
    }
    content
}

fn iso_file(map: &[u8], content: &[u8]) -> Vec<u8> {
    [with(BASE, &[iso(&VERSIONS)]), with(map, &[iso(content)])].concat()
}

#[test]
fn iso_21496_1_is_read_in_hdr() {
    // Minimum, maximum, gamma and offsets over 64.
    let grey = [-32, 192, 64, 1, 2];
    let decoded = read(&iso_file(GREY, &fractions(0x40, [0, 3], &[grey])));
    compare(&decoded, |x, _, base| {
        let stops: f64 = -0.5 + 3.5 * grey_code(x);
        [((base + 1.0 / 64.0) * stops.exp2() - 2.0 / 64.0).max(0.0); 3]
    });
    assert!(decoded.gain_map.unwrap().starts_with("ISO 21496-1, 16 x 8, grey"));
    let gains = [[-32, 192, 64, 1, 2], [0, 128, 32, -1, 0], [16, 256, 128, 0, 4]];
    let decoded = read(&iso_file(RGB, &fractions(0xc0, [0, 4], &gains)));
    compare(&decoded, |x, _, base| {
        [0, 1, 2].map(|channel| {
            let [min, max, gamma, before, behind] =
                gains[channel].map(|numerator| f64::from(numerator) / 64.0);
            let code = f64::from(COLUMNS[x / 8][channel]) / 255.0;
            let stops = min + (max - min) * code.powf(1.0 / gamma);
            ((base + before) * stops.exp2() - behind).max(0.0)
        })
    });
    // libultrahdr's one denominator for all fractions.
    let mut common = [&VERSIONS[..], &[0x48]].concat();
    for word in [64, 0, 192, -32, 192, 64, 1, 2] {
        common.extend(i32::to_be_bytes(word));
    }
    let decoded = read(&iso_file(GREY, &common));
    assert_eq!(decoded.image, read(&iso_file(GREY, &fractions(0x40, [0, 3], &[grey]))).image);
    // ISO 21496-1 counts before XMP.
    let both = with(GREY, &[xmp("hdrgm:Version=\"1.0\" hdrgm:GainMapMax=\"9\"", ""), iso(&common)]);
    assert_eq!(read(&[BASE, &both].concat()).image, decoded.image);
}

/// What libultrahdr 1.4.0 makes of its own files, as half floats in the alternate rendition's primaries,
/// which are brought to Rec. 709 by the published matrices. All pictures are in Display P3. The formula holds
/// in P3; in Rec. 2020, as the map's ICC profile says; in P3 again, with a map of half the size.
#[test]
fn libultrahdr_reads_its_files_alike() {
    let places = [(24, 16), (48, 16), (4, 4), (60, 28)];
    for (name, bytes, expected) in [
        (
            "p3",
            &include_bytes!("data/libultrahdr-p3.jpg")[..],
            [
                [8.838, 3.8096, 1.7096],
                [-0.73, 6.1705, -0.1439],
                [0.2076, 0.3502, 0.2408],
                [0.7939, 0.6455, 0.2129],
            ],
        ),
        (
            "2100",
            include_bytes!("data/libultrahdr-2100.jpg"),
            [
                [10.4233, 3.555, 1.6396],
                [-2.7484, 6.7902, -0.2779],
                [0.1723, 0.3625, 0.2357],
                [0.8448, 0.6292, 0.1944],
            ],
        ),
        (
            "half",
            include_bytes!("data/libultrahdr-half.jpg"),
            [
                [8.0547, 3.9902, 1.9824],
                [0.5176, 5.9297, 0.3037],
                [0.2372, 0.3435, 0.2457],
                [0.7495, 0.6411, 0.2396],
            ],
        ),
    ] {
        let decoded = read(bytes);
        assert!(decoded.high_dynamic_range && decoded.gain_map.is_some(), "{name}");
        assert!(
            !decoded.warnings.iter().any(|warning| warning.contains("no high")),
            "{:?}",
            decoded.warnings
        );
        for ((x, y), expected) in places.into_iter().zip(expected) {
            let grey = 0.2126 * expected[0] + 0.7152 * expected[1] + 0.0722 * expected[2];
            let least = expected.into_iter().fold(0.0, f64::min);
            // What lies outside of Rec. 709 moves toward its grey.
            let inside = expected.map(|value| grey + grey / (grey - least) * (value - grey));
            let found = decoded.image.pixels()[y * 64 + x].map(f64::from);
            let far = found.iter().zip(inside).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // It does not round the picture's RGB to codes, and weights the codes of a smaller map by their
            // distance: half a code of the picture is 0.5 % to 1 % of the light, half a code of a map of 5.6
            // stops 0.8 %.
            assert!(far < 1.8e-2 * grey.max(inside[0]), "{name} {x}, {y}: {found:?}, {inside:?}");
        }
    }
}

/// Display P3 in the picture: the formula holds for its values, and Rec. 709 comes afterwards.
#[test]
fn the_formula_holds_in_the_picture_s_primaries() {
    let picture = include_bytes!("data/pillow-p3.jpg");
    let sdr = read(picture);
    // One stop more everywhere, without offsets, is a factor in any primaries.
    let attributes =
        "hdrgm:GainMapMin=\"1\" hdrgm:GainMapMax=\"1\" hdrgm:OffsetSDR=\"0\" hdrgm:OffsetHDR=\"0\"";
    let map = with(GREY, &[xmp(&format!("hdrgm:Version=\"1.0\" {attributes}"), "")]);
    let hdr = read(&[&picture[..], &map].concat());
    assert_eq!(hdr.profile.as_deref(), Some("Display P3"));
    for (one, two) in sdr.image.pixels().iter().zip(hdr.image.pixels()) {
        assert!(one.iter().zip(two).all(|(a, b)| (2.0 * a - b).abs() < 1e-5), "{one:?} {two:?}");
    }
    // An offset is not: with 0.5 beneath and 0 stops, it is 0.5 of P3's white, which is Rec. 709's.
    let attributes =
        "hdrgm:GainMapMin=\"0\" hdrgm:GainMapMax=\"0\" hdrgm:OffsetSDR=\"0.5\" hdrgm:OffsetHDR=\"0\"";
    let map = with(GREY, &[xmp(&format!("hdrgm:Version=\"1.0\" {attributes}"), "")]);
    let raised = read(&[&picture[..], &map].concat());
    let first = |decoded: &Decoded| decoded.image.pixels()[27];
    for (one, two) in first(&sdr).iter().zip(first(&raised)) {
        assert!((one + 0.5 - two).abs() < 1e-3, "{one} {two}");
    }
}

#[test]
fn exif_turns_the_rendition_in_hdr() {
    let exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x03\0\0\0\0\0\0".to_vec();
    let map = with(GREY, &[xmp("hdrgm:Version=\"1.0\" hdrgm:GainMapMax=\"3\"", "")]);
    let plain = read(&[with(BASE, &[]), map.clone()].concat());
    let turned = read(&[with(BASE, &[(1, exif)]), map].concat());
    let reversed: Vec<_> = plain.image.pixels().iter().rev().copied().collect();
    assert_eq!(turned.image.pixels(), reversed);
}

#[test]
fn a_base_in_hdr_is_the_picture() {
    let sdr = read(BASE);
    let by_xmp = ultra_hdr(GREY, "hdrgm:GainMapMax=\"3\" hdrgm:BaseRenditionIsHDR=\"True\"");
    let by_iso = iso_file(GREY, &fractions(0x40, [3, 0], &[[0, 192, 64, 1, 1]]));
    for bytes in [by_xmp, by_iso] {
        let decoded = read(&bytes);
        assert_eq!(decoded.image, sdr.image);
        assert!(decoded.notes[0].starts_with("the picture itself is the rendition in HDR"), "{decoded:?}");
        // Its sRGB holds nothing brighter than white.
        assert!(decoded.warnings[0].contains("no high dynamic range"), "{:?}", decoded.warnings);
        assert!(decoded.gain_map.is_some());
    }
}

#[test]
fn a_second_picture_that_is_no_gain_map_is_left_out() {
    let sdr = read(BASE);
    let stereo = [with(BASE, &[multi_picture(RGB.len(), BASE.len())]), RGB.to_vec()].concat();
    // A map that was taken out of its file, and a file with a thumbnail in Exif.
    let alone = with(BASE, &[xmp("hdrgm:Version=\"1.0\" hdrgm:GainMapMax=\"3\"", "")]);
    let thumbnail = with(BASE, &[(1, [b"Exif\0\0", GREY].concat())]);
    let video = [BASE, b"\0\0\0\x18ftypmp42\xff\xd8\xff\xe1\xff"].concat();
    for bytes in [stereo, alone, thumbnail, video] {
        let decoded = read(&bytes);
        assert_eq!((&decoded.image, &decoded.gain_map), (&sdr.image, &None));
        assert_eq!(decoded.warnings, sdr.warnings);
    }
    let apple = with(
        GREY,
        &[xmp(
            "xmlns:HDRGainMap=\"http://ns.apple.com/HDRGainMap/1.0/\" HDRGainMap:HDRGainMapVersion=\"65536\"",
            "",
        )],
    );
    let decoded = read(&[BASE, &apple].concat());
    assert!(decoded.warnings[0].contains("of Apple's own kind"), "{:?}", decoded.warnings);
}

#[test]
fn a_map_that_was_removed_is_reported() {
    for picture in [with(BASE, &[xmp("hdrgm:Version=\"1.0\"", "")]), with(BASE, &[iso(&VERSIONS)])] {
        for tail in [&b""[..], b"\0\0", b"\r\n"] {
            let decoded = read(&[&picture[..], tail].concat());
            assert_eq!(decoded.warnings.len(), 2);
            let words = "declares a gain map that is not in the file";
            assert!(decoded.warnings[0].contains(words), "{:?}", decoded.warnings);
        }
    }
}

/// A directory says that more bytes follow.
#[test]
fn a_map_that_a_directory_names_must_be_there() {
    let index = [iso(&VERSIONS), multi_picture(400, 1000)];
    for picture in [with(BASE, &[container(400)]), with(BASE, &index)] {
        let (kind, message) = error(&picture);
        assert_eq!(kind, ErrorKind::Truncated);
        assert!(message.contains("before the gain map that its directory names"), "{message}");
    }
}

#[test]
fn a_damaged_map_is_an_error() {
    let grey = "hdrgm:GainMapMin=\"0\" hdrgm:GainMapMax=\"3\"";
    for (attributes, words) in [
        ("hdrgm:GainMapMin=\"4\" hdrgm:GainMapMax=\"3\"", "GainMapMin is 4 and GainMapMax 3"),
        ("hdrgm:GainMapMin=\"0\"", "hdrgm:GainMapMax is absent"),
        ("hdrgm:GainMapMax=\"nan\"", "GainMapMax is NaN"),
        ("hdrgm:GainMapMax=\"1e999\"", "GainMapMax is inf"),
        ("hdrgm:GainMapMax=\"much\"", "hdrgm:GainMapMax is \"much\", expected one number or three"),
        (&format!("{grey} hdrgm:Gamma=\"0\""), "its gamma is 0"),
        (&format!("{grey} hdrgm:Gamma=\"-2\""), "its gamma is -2"),
        (&format!("{grey} hdrgm:OffsetHDR=\"inf\""), "the offset of the alternate rendition is inf"),
        (&format!("{grey} hdrgm:HDRCapacityMax=\"nan\""), "hdrgm:HDRCapacityMax NaN"),
        (&format!("{grey} hdrgm:HDRCapacityMin=\"3\" hdrgm:HDRCapacityMax=\"2\""), "HDRCapacityMin is 3"),
        (&format!("{grey} hdrgm:BaseRenditionIsHDR=\"maybe\""), "expected True or False"),
    ] {
        let (kind, message) = error(&ultra_hdr(GREY, attributes));
        assert_eq!(kind, ErrorKind::Damaged, "{message}");
        assert!(message.starts_with("JPEG: gain map: ") && message.contains(words), "{message}");
    }
    for (content, kind, words) in [
        (fractions(0x40, [0, 3], &[[0, 192, 0, 1, 1]]), ErrorKind::Damaged, "its gamma is 0"),
        (fractions(0x40, [0, 3], &[[64, 0, 64, 1, 1]]), ErrorKind::Damaged, "GainMapMin is 1"),
        (
            fractions(0xc0, [0, 3], &[[0, 192, 64, 1, 1]]),
            ErrorKind::Truncated,
            "ends before its last fraction",
        ),
        (vec![0, 1, 0, 1, 0x40], ErrorKind::Unsupported, "needs version 1 of ISO 21496-1"),
    ] {
        let (found, message) = error(&iso_file(GREY, &content));
        assert_eq!(found, kind, "{message}");
        assert!(message.starts_with("JPEG: gain map: ") && message.contains(words), "{message}");
    }
    let mut over_zero = fractions(0x40, [0, 3], &[[0, 192, 64, 1, 1]]);
    over_zero[9..13].fill(0);
    assert!(error(&iso_file(GREY, &over_zero)).1.contains("over 0"));
}

/// Cut anywhere behind the picture, a file is not read as the picture in SDR.
#[test]
fn a_map_that_is_cut_is_an_error() {
    let files = [
        ultra_hdr(GREY, "hdrgm:GainMapMax=\"3\""),
        iso_file(RGB, &fractions(0x40, [0, 3], &[[0, 192, 64, 1, 1]])),
    ];
    for whole in files {
        let start = (1..whole.len()).rfind(|&at| whole[at..].starts_with(&[0xff, 0xd8, 0xff])).unwrap();
        let mut kinds = String::new();
        for length in start + 1..whole.len() {
            let (kind, message) = error(&whole[..length]);
            assert!(message.starts_with("JPEG: gain map: "), "{length}: {message}");
            write!(kinds, "{kind:?} ").unwrap();
        }
        assert!(kinds.ends_with("Truncated "), "{kinds}");
    }
}

/// The picture within is cut where its own data ends, although its map has an end of its own.
#[test]
fn the_end_of_the_map_is_not_that_of_the_picture() {
    let whole = ultra_hdr(GREY, "hdrgm:GainMapMax=\"3\"");
    let start = (1..whole.len()).rfind(|&at| whole[at..].starts_with(&[0xff, 0xd8, 0xff])).unwrap();
    // Some of the coded data is gone.
    let shorter = [&whole[..start - 40], &whole[start - 2..]].concat();
    assert!(read_image(&shorter, &ReadOptions::default()).is_err());
}
