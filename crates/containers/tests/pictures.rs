//! PNG and JPEG, and what all formats have in common.

#![allow(clippy::unwrap_used)] // as in any test

use containers::{Decoded, ErrorKind, Format, ReadOptions, read_image, read_recipe, write_png, write_rgbe};
use envmap::Image;

fn read(bytes: &[u8]) -> Decoded {
    read_image(bytes, &ReadOptions::default()).unwrap()
}

/// IEC 61966-2-1.
fn linear(srgb: f64) -> f32 {
    (if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }) as f32
}

fn png(color: png::ColorType, depth: png::BitDepth, size: (u32, u32), data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

#[test]
fn png_is_decoded_from_srgb_and_said_to_be_no_hdr() {
    use png::{BitDepth::*, ColorType::*};
    let grey = |code: f64| [linear(code); 3];
    for (bytes, expected, warnings) in [
        (png(Grayscale, Eight, (2, 1), &[0, 255]), vec![grey(0.0), grey(1.0)], 1),
        (png(Grayscale, One, (2, 1), &[0x40]), vec![grey(0.0), grey(1.0)], 1),
        (
            png(Rgb, Eight, (1, 1), &[10, 128, 255]),
            vec![[linear(10.0 / 255.0), linear(128.0 / 255.0), 1.0]],
            1,
        ),
        (
            png(Rgb, Sixteen, (1, 1), &[0x12, 0x34, 0xff, 0xff, 0, 0]),
            vec![[linear(f64::from(0x1234) / 65535.0), 1.0, 0.0]],
            1,
        ),
        (png(Rgba, Eight, (1, 1), &[255, 0, 0, 255]), vec![[1.0, 0.0, 0.0]], 1),
        (png(Rgba, Eight, (1, 1), &[255, 0, 0, 254]), vec![[1.0, 0.0, 0.0]], 2),
        (png(GrayscaleAlpha, Sixteen, (1, 1), &[255, 255, 1, 0]), vec![grey(1.0)], 2),
        (
            include_bytes!("data/grey-16.png").to_vec(),
            vec![grey(0.0), grey(f64::from(0x8000) / 65535.0), grey(1.0)],
            1,
        ),
    ] {
        let decoded = read(&bytes);
        assert_eq!(decoded.image.pixels(), expected);
        assert_eq!((decoded.format, decoded.high_dynamic_range), (Format::Png, false));
        assert_eq!(decoded.warnings.len(), warnings, "{:?}", decoded.warnings);
        assert!(decoded.warnings.iter().any(|warning| warning.contains("no high dynamic range")));
    }
    let palette = read(include_bytes!("data/palette.png"));
    assert_eq!((palette.image.width(), palette.image.height()), (8, 8));
}

#[test]
fn jpeg_is_decoded_from_srgb_and_said_to_be_no_hdr() {
    // R = 32 x, G = 32 y, B = 128 before compression, 8 x 8.
    for (bytes, tolerance) in [
        (&include_bytes!("data/gradient.jpg")[..], 6.0),
        (include_bytes!("data/gradient-progressive.jpg"), 40.0),
    ] {
        let decoded = read(bytes);
        assert_eq!((decoded.format, decoded.high_dynamic_range), (Format::Jpeg, false));
        assert_eq!(decoded.warnings.len(), 1);
        for (i, pixel) in decoded.image.pixels().iter().enumerate() {
            let codes = [32 * (i % 8), 32 * (i / 8), 128].map(|code| code as f64);
            for (value, code) in pixel.iter().zip(codes) {
                // Quality 95 (90 with halved chroma) keeps codes within the tolerance.
                let range = linear((code - tolerance).max(0.0) / 255.0)
                    ..=linear((code + tolerance).min(255.0) / 255.0);
                assert!(range.contains(value), "{i}: {value} not in {range:?}");
            }
        }
    }
    // Cut anywhere within its coded data, a picture is truncated and not merely damaged.
    let whole = include_bytes!("data/gradient.jpg");
    let scan = whole.windows(2).rposition(|marker| marker == [0xff, 0xda]).unwrap() + 14;
    for length in scan..whole.len() - 2 {
        let error = read_image(&whole[..length], &ReadOptions::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Truncated, "{length}: {error}");
    }
    let grey = read(include_bytes!("data/grey.jpg"));
    assert!(grey.image.pixels().iter().all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]));
}

#[test]
fn png_keeps_its_codes_and_recipe() {
    let codes: Vec<[u8; 3]> = (0..40_u8).map(|i| [i, 255 - i, 6 * i]).collect();
    let recipe = r#"{"kind":"contact-sheet","größe":1}"#;
    let bytes = write_png(8, 5, &codes, Some(recipe)).unwrap();
    assert_eq!(bytes, write_png(8, 5, &codes, Some(recipe)).unwrap());
    assert_eq!(read_recipe(&bytes).as_deref(), Some(recipe));
    let decoded = read(&bytes);
    let expected: Vec<_> = codes.iter().map(|rgb| rgb.map(|code| linear(f64::from(code) / 255.0))).collect();
    assert_eq!((decoded.image.pixels(), decoded.recipe.as_deref()), (expected.as_slice(), Some(recipe)));
    assert_eq!(write_png(8, 4, &codes, None).unwrap_err().kind(), ErrorKind::Unwritable);
    assert_eq!(write_png(0, 0, &[], None).unwrap_err().kind(), ErrorKind::Unwritable);
}

#[test]
fn what_is_no_picture_is_said_to_be_none() {
    let lfs = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n";
    for (bytes, kind, words) in [
        (&b""[..], ErrorKind::Empty, "the file is empty"),
        (lfs, ErrorKind::GitLfsPointer, "git lfs pull"),
        (b"GIF89a", ErrorKind::UnknownFormat, "47 49 46 38 39 61"),
        (b"#?RADIANCE\n\n-Y 99999999 +X 99999999\n", ErrorKind::TooLarge, "99999999 x 99999999"),
        (b"#?RADIANCE\n\n-Y 0 +X 4\n", ErrorKind::Damaged, "4 x 0"),
        (b"#?RADIANCE\n\n-Y 8 +X 8\n", ErrorKind::Truncated, "scanline 0"),
        (b"#?RADIANCE\nFORMAT=ascii\n\n-Y 8 +X 8\n", ErrorKind::Unsupported, "FORMAT=ascii"),
    ] {
        let error = read_image(bytes, &ReadOptions::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_layer_is_of_no_use_without_layers() {
    let bytes = write_rgbe(&Image::new(1, 1, vec![[1.0; 3]]).unwrap(), None).unwrap().bytes;
    let decoded = read_image(&bytes, &ReadOptions { layer: Some("sky".into()) }).unwrap();
    assert_eq!(decoded.warnings, ["Radiance has no layers; `sky` was ignored"]);
}
