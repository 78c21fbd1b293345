//! GPano of photo spheres in PNG, JPEG, WebP and TIFF: found in each, beside an orientation, and with damage.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // as in any test

use std::io::Cursor;

use containers::{ReadOptions, Shows, read_image, read_image_header};
use image::{ExtendedColorType, ImageEncoder as _};
use tiff::encoder::{TiffEncoder, colortype};
use tiff::tags::Tag;

/// The numbers of a crop of 8 x 8 out of 32 x 16, at column 8 and row 4: 90 x 90 degrees.
const NUMBERS: [(&str, &str); 7] = [
    ("ProjectionType", "equirectangular"),
    ("FullPanoWidthPixels", "32"),
    ("FullPanoHeightPixels", "16"),
    ("CroppedAreaImageWidthPixels", "8"),
    ("CroppedAreaImageHeightPixels", "8"),
    ("CroppedAreaLeftPixels", "8"),
    ("CroppedAreaTopPixels", "4"),
];

const WORDS: &str = "90 x 90 degrees of a lat-long panorama, from -45 to 45 degrees of elevation";

fn xmp(elements: bool) -> String {
    let properties = NUMBERS.map(|(name, value)| match elements {
        true => format!("<GPano:{name}>{value}</GPano:{name}>\n"),
        false => format!(" GPano:{name}=\"{value}\""),
    });
    let properties = properties.concat();
    let (attributes, inside) =
        if elements { (String::new(), properties) } else { (properties, String::new()) };
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description \
         xmlns:GPano=\"http://ns.google.com/photos/1.0/panorama/\"{attributes}>{inside}</rdf:Description>\
         </rdf:RDF></x:xmpmeta>"
    )
}

/// A segment APP1 of a JPEG.
fn segment(bytes: &[u8]) -> Vec<u8> {
    [&[0xff, 0xe1][..], &(bytes.len() as u16 + 2).to_be_bytes(), bytes].concat()
}

/// 8 x 8 pixels with XMP, and with Exif of this orientation.
fn jpeg(xmp: &str, orientation: u8) -> Vec<u8> {
    let plain = include_bytes!("data/gradient.jpg");
    let exif =
        [b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(), &[orientation], &[0; 6]];
    let xmp = [b"http://ns.adobe.com/xap/1.0/\0", xmp.as_bytes()].concat();
    [&plain[..2], &segment(&exif.concat()), &segment(&xmp), &plain[2..]].concat()
}

/// 8 x 8 pixels with XMP in an iTXt chunk behind them, plain or compressed.
fn png(xmp: &str, compressed: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 8, 8);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[128; 192]).unwrap();
    let mut text = png::text_metadata::ITXtChunk::new("XML:com.adobe.xmp", xmp);
    text.language_tag = "x-default".into();
    text.compressed = compressed;
    writer.write_text_chunk(&text).unwrap();
    drop(writer);
    bytes
}

/// XMP as ImageMagick writes it, in lines of 72 digits.
fn raw_png(xmp: &str) -> Vec<u8> {
    let digits: String = xmp.bytes().map(|byte| format!("{byte:02x}")).collect();
    let lines: Vec<_> = digits.as_bytes().chunks(72).map(|line| std::str::from_utf8(line).unwrap()).collect();
    let text = format!("\nxmp\n{:8}\n{}\n", xmp.len(), lines.join("\n"));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 8, 8);
    encoder.set_color(png::ColorType::Rgb);
    encoder.add_ztxt_chunk("Raw profile type xmp".into(), text).unwrap();
    encoder.write_header().unwrap().write_image_data(&[128; 192]).unwrap();
    bytes
}

fn tiff(xmp: &str) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    let mut page = encoder.new_image::<colortype::RGB8>(8, 8).unwrap();
    page.encoder().write_tag(Tag::Unknown(700), xmp.as_bytes()).unwrap();
    page.write_data(&[128; 192]).unwrap();
    bytes.into_inner()
}

fn webp(xmp: &str) -> Vec<u8> {
    let mut simple = Vec::new();
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut simple);
    encoder.write_image(&[128; 192], 8, 8, ExtendedColorType::Rgb8).unwrap();
    let pixels = &simple[12..];
    // VP8X with the flag of XMP and the size less 1.
    let chunk = |name: &[u8; 4], content: &[u8]| {
        let padding = vec![0; content.len() % 2];
        [name, &(content.len() as u32).to_le_bytes()[..], content, &padding].concat()
    };
    let content = [
        b"WEBP".to_vec(),
        chunk(b"VP8X", &[4, 0, 0, 0, 7, 0, 0, 7, 0, 0]),
        pixels.to_vec(),
        chunk(b"XMP ", xmp.as_bytes()),
    ];
    let content = content.concat();
    [b"RIFF", &(content.len() as u32).to_le_bytes()[..], &content].concat()
}

fn shows(bytes: &[u8]) -> Option<Shows> {
    let read = read_image(bytes, &ReadOptions::default()).unwrap().panorama;
    let header = read_image_header(&mut Cursor::new(bytes), &ReadOptions::default()).unwrap().panorama;
    assert_eq!(read, header);
    read.map(|panorama| panorama.shows)
}

#[test]
fn gpano_is_found_in_each_format_as_attributes_and_as_elements() {
    for elements in [false, true] {
        let xmp = xmp(elements);
        for (format, bytes) in [
            ("JPEG", jpeg(&xmp, 1)),
            ("PNG", png(&xmp, false)),
            ("PNG, compressed", png(&xmp, true)),
            ("PNG of ImageMagick", raw_png(&xmp)),
            ("TIFF", tiff(&xmp)),
            ("WebP", webp(&xmp)),
        ] {
            match shows(&bytes) {
                Some(Shows::Part(_, words)) => assert_eq!(words, WORDS, "{format}"),
                other => panic!("{format}: {other:?}"),
            }
        }
    }
}

/// The numbers are those of the upright picture: 8 x 8 either way, so that a crop of 8 x 4 contradicts it.
#[test]
fn the_crop_is_that_of_the_upright_picture() {
    for orientation in 1..=8 {
        assert!(
            matches!(shows(&jpeg(&xmp(false), orientation)), Some(Shows::Part(_, words)) if words == WORDS)
        );
    }
    let other = xmp(false).replace("HeightPixels=\"8\"", "HeightPixels=\"4\"");
    assert!(
        matches!(shows(&jpeg(&other, 1)), Some(Shows::Unclear(why)) if why.contains("another shape, 8 x 8"))
    );
}

#[test]
fn other_xmp_says_nothing_of_a_sphere() {
    let none = xmp(false).replace("http://ns.google.com/photos/1.0/panorama/", "http://example.com/");
    // By the prefix alone, if no name space is declared: a part of a damaged packet.
    assert!(shows(&jpeg(&none.replace("xmlns:GPano", "xmlns:other"), 1)).is_some());
    assert_eq!(shows(&jpeg("<x:xmpmeta/>", 1)), None);
    assert_eq!(shows(&jpeg("", 1)), None);
}

/// Each byte of the packet damaged in turn: the picture is read, and what is said of it is no panic.
#[test]
fn damaged_xmp_is_read_or_said() {
    let xmp = xmp(true);
    for at in 0..xmp.len() {
        let mut damaged = xmp.clone().into_bytes();
        damaged[at] ^= 0x15;
        let text = String::from_utf8_lossy(&damaged).into_owned();
        shows(&jpeg(&text, 1));
        shows(&jpeg(&xmp[..at], 1));
    }
}
