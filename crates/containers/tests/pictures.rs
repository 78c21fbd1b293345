//! PNG, JPEG, TIFF, TGA and WebP, and what all formats have in common. Most files are by other programs:
//! `data/README.md`.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // as in any test

use std::collections::HashSet;

use containers::{
    ColourSpace, Decoded, ErrorKind, Format, ReadOptions, read_image, read_recipe, write_png, write_rgbe,
};
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
fn png_is_decoded_from_srgb_and_reported_as_no_hdr() {
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
fn jpeg_is_decoded_from_srgb_and_reported_as_no_hdr() {
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

/// What `gen.py` of Pillow and tifffile wrote: 3 x 2 pixels.
const CODES: [[u8; 3]; 6] =
    [[10, 128, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [200, 150, 100], [255, 255, 255]];

#[test]
fn tiff_tga_and_webp_of_integers_are_decoded_from_srgb() {
    let expected = CODES.map(|rgb| rgb.map(|code| linear(f64::from(code) / 255.0)));
    for (bytes, format, warnings) in [
        (&include_bytes!("data/pillow-lzw.tif")[..], Format::Tiff, 1),
        (include_bytes!("data/tifffile-16.tif"), Format::Tiff, 1),
        (include_bytes!("data/pillow.tga"), Format::Tga, 1),
        (include_bytes!("data/pillow-rle.tga"), Format::Tga, 1),
        (include_bytes!("data/pillow-lossless.webp"), Format::WebP, 1),
        (include_bytes!("data/pillow-alpha.webp"), Format::WebP, 2),
    ] {
        let decoded = read(bytes);
        assert_eq!((decoded.format, decoded.high_dynamic_range), (format, false));
        assert_eq!((decoded.image.width(), decoded.image.height()), (3, 2));
        assert_eq!(decoded.image.pixels(), expected, "{format:?}");
        assert_eq!(decoded.warnings.len(), warnings, "{:?}", decoded.warnings);
    }
}

#[test]
fn tiff_of_floats_is_linear() {
    let expected = [
        [0.25, 1.5, 1000.0],
        [0.5, 0.5, 0.5],
        [0.0, 0.0, 1e-3],
        [4.0, 5.0, 6.0],
        [7.0, 8.0, 9.0],
        [65536.0, 2.0, 3.0],
    ];
    let decoded = read(include_bytes!("data/tifffile-float.tif"));
    assert_eq!((decoded.image.pixels(), decoded.high_dynamic_range), (&expected[..], true));
    assert!(decoded.warnings.is_empty(), "{:?}", decoded.warnings);
    let tiles = read(include_bytes!("data/tifffile-float-tiled.tif")).image;
    assert_eq!((tiles.width(), tiles.height()), (18, 16));
    for (i, pixel) in tiles.pixels().iter().enumerate() {
        assert_eq!(*pixel, expected[i / 18 % 2 * 3 + i % 18 % 3], "{i}");
    }
    let grey = read(include_bytes!("data/tifffile-float-grey.tif"));
    assert_eq!(grey.image.pixels(), expected.map(|[red, _, _]| [red; 3]));
}

/// What tifffile and Pillow wrote (`data/README.md`): 3 x 2 pixels in other numbers and compressions.
#[test]
fn tiff_of_every_number_and_compression_is_read() {
    let floats = [
        [0.25, 1.5, 1000.0],
        [0.5, 0.5, 0.5],
        [0.0, 0.0, 1e-3],
        [4.0, 5.0, 6.0],
        [7.0, 8.0, 9.0],
        [65504.0, 2.0, 3.0],
    ];
    for (bytes, columns) in [
        (&include_bytes!("data/tifffile-half.tif")[..], 3),
        (include_bytes!("data/tifffile-double.tif"), 3),
        (include_bytes!("data/tifffile-zstd.tif"), 3),
        (include_bytes!("data/tifffile-lzma.tif"), 3),
        (include_bytes!("data/tifffile-thumbnail.tif"), 3),
        (include_bytes!("data/tifffile-planes-of-tiles.tif"), 20),
        (include_bytes!("data/tifffile-planes-of-tiles-lzw.tif"), 20),
    ] {
        let decoded = read(bytes);
        assert_eq!((decoded.image.width(), decoded.high_dynamic_range), (columns, true));
        for (i, pixel) in decoded.image.pixels().iter().enumerate() {
            let expected = floats[i / columns % 2 * 3 + i % columns % 3];
            // A half holds 0.001 with an error of 2e-7.
            assert!(pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{i}: {pixel:?}");
        }
    }
    let expected = CODES.map(|rgb| rgb.map(|code| linear(f64::from(code) / 255.0)));
    for (bytes, columns) in [
        (&include_bytes!("data/tifffile-32.tif")[..], 3),
        (include_bytes!("data/tifffile-64.tif"), 3),
        (include_bytes!("data/tifffile-webp.tif"), 16),
        (include_bytes!("data/pillow-palette.tif"), 3),
    ] {
        let decoded = read(bytes);
        assert_eq!((decoded.image.width(), decoded.high_dynamic_range), (columns, false));
        for (i, pixel) in decoded.image.pixels().iter().enumerate() {
            let expected = expected[i / columns % 2 * 3 + i % columns % 3];
            assert!(pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{i}: {pixel:?}");
        }
    }
    let error = read_image(include_bytes!("data/tifffile-logluv.tif"), &ReadOptions::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "TIFF: the colours are SGI LogLuv, which is not read; save the image as RGB"
    );
}

/// The picture is stored 3 wide and 2 high, and a camera turned it by a quarter.
#[test]
fn pictures_are_turned_upright() {
    let expected = CODES.map(|rgb| rgb.map(|code| linear(f64::from(code) / 255.0)));
    // Orientation 8: the first row is the left side, the first column the bottom.
    let turned = [2, 5, 1, 4, 0, 3].map(|i| expected[i]);
    for bytes in [
        &include_bytes!("data/pillow-orientation-8.png")[..],
        include_bytes!("data/pillow-orientation-8.webp"),
    ] {
        let image = read(bytes).image;
        assert_eq!((image.width(), image.height(), image.pixels()), (2, 3, &turned[..]));
    }
    let jpeg = read(include_bytes!("data/pillow-orientation-8.jpg")).image;
    assert_eq!((jpeg.width(), jpeg.height()), (32, 48));
    for (i, expected) in turned.iter().enumerate() {
        let pixel = jpeg.pixels()[(i / 2 * 16 + 8) * 32 + i % 2 * 16 + 8];
        assert!(pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02), "{i}: {pixel:?} {expected:?}");
    }
    // Orientation 6: the first row is the right side, the first column the top.
    let tiff = read(include_bytes!("data/tifffile-orientation-6.tif")).image;
    assert_eq!((tiff.width(), tiff.height()), (2, 3));
    assert_eq!(tiff.pixels()[..2], [[4.0, 5.0, 6.0], [0.25, 1.5, 1000.0]]);
}

/// PNG, third edition, section 11.3.2.6: primaries, transfer, matrix 0, full range.
#[test]
fn cicp_gives_primaries_and_transfer() {
    let file = |code_points: [u8; 4], codes: [u16; 3]| {
        let data: Vec<u8> = codes.iter().flat_map(|code| code.to_be_bytes()).collect();
        let mut bytes = png(png::ColorType::Rgb, png::BitDepth::Sixteen, (1, 1), &data);
        let body = [&b"cICP"[..], &code_points].concat();
        let crc = body.iter().fold(u32::MAX, |crc, byte| {
            (0..8)
                .fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 })
        });
        let chunk = [&4_u32.to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat();
        // The header chunk ends at byte 33.
        bytes.splice(33..33, chunk);
        bytes
    };
    let with = |code_points, codes| read(&file(code_points, codes));
    // 203 cd/m2 is 58.07 % of PQ (ITU-R BT.2408).
    let white = with([9, 16, 0, 1], [38057; 3]);
    assert!(white.image.pixels()[0].iter().all(|value| (value - 1.0).abs() < 2e-3), "{white:?}");
    assert_eq!((white.high_dynamic_range, white.warnings.len()), (true, 0));
    let linear = with([1, 8, 0, 1], [65535, 32768, 0]);
    assert!((linear.image.pixels()[0][1] - 0.5).abs() < 1e-4, "{linear:?}");
    // Display P3's red is (1.2249, -0.0420, -0.0196) in Rec. 709, moved toward its luminance, 0.2290.
    let red = with([12, 13, 0, 1], [65535, 0, 0]);
    assert!((red.image.pixels()[0][0] - 1.0705).abs() < 1e-3, "{red:?}");
    let narrow = with([9, 16, 0, 0], [32768; 3]);
    assert!(narrow.warnings[0].contains("cICP was ignored: it declares the narrow range"), "{narrow:?}");
    // Rec. 2020's green lies outside Rec. 709, unless other primaries are asked for.
    let green = with([9, 8, 0, 1], [0, 65535, 0]);
    assert!(green.image.pixels()[0].iter().all(|value| *value >= 0.0), "{green:?}");
    assert!(green.warnings[0].starts_with("1 pixel (100 % of the image"), "{green:?}");
    let options = ReadOptions { colour_space: Some(ColourSpace::Rec709), ..ReadOptions::default() };
    let asked = read_image(&file([9, 8, 0, 1], [0, 65535, 0]), &options).unwrap();
    assert_eq!(asked.image.pixels(), [[0.0, 1.0, 0.0]]);
    assert!(
        asked.warnings[0].starts_with("the chunk cICP 9/8 names other primaries than `rec709`"),
        "{asked:?}"
    );
}

/// ICC.1:2022, 9.2.17: a profile says PQ by its tag cicp, as ISO 22028-5 asks of pictures.
#[test]
fn code_points_in_a_profile_are_read() {
    use image::ImageEncoder;
    let mut profile = moxcms::ColorProfile::new_bt2020();
    profile.cicp = Some(moxcms::CicpProfile {
        color_primaries: moxcms::CicpColorPrimaries::Bt2020,
        transfer_characteristics: moxcms::TransferCharacteristics::Smpte2084,
        matrix_coefficients: moxcms::MatrixCoefficients::Identity,
        full_range: true,
    });
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    encoder.set_icc_profile(profile.encode().unwrap()).unwrap();
    let codes: Vec<u8> = [38057_u16; 3].iter().flat_map(|code| code.to_ne_bytes()).collect();
    encoder.write_image(&codes, 1, 1, image::ExtendedColorType::Rgb16).unwrap();
    let white = read(&bytes);
    assert!(white.image.pixels()[0].iter().all(|value| (value - 1.0).abs() < 2e-3), "{white:?}");
    assert!(white.high_dynamic_range && white.warnings.is_empty(), "{white:?}");
}

/// 4096 x 2048 pixels of one colour in some hundred bytes.
#[test]
fn a_smooth_lossless_webp_is_read() {
    let bytes = include_bytes!("data/pillow-flat.webp");
    let image = read(bytes).image;
    assert_eq!((image.width(), image.height()), (4096, 2048));
    assert_eq!(image.pixels()[0], [20.0, 40.0, 220.0].map(|code| linear(code / 255.0)));
}

/// What littlecms (in Pillow's ImageCms, relative colorimetric) makes of the same pixels and profiles in
/// sRGB. It clips the colours outside of sRGB, which have a channel of 0 or 255 there; ours move to their
/// grey until the least channel is 0.
#[test]
fn icc_profiles_are_applied() {
    let clipped = [[255, 0, 0], [0, 255, 0]];
    let with = |first: [u8; 3], second: [u8; 3], grey: u8| {
        vec![first, second, [255; 3], clipped[0], clipped[1], [grey; 3]]
    };
    let codes = |pixel: &[f32; 3]| {
        pixel.map(|value| {
            let value = value.clamp(0.0, 1.0);
            let srgb =
                if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
            255.0 * srgb
        })
    };
    let source = vec![[200, 100, 50], [60, 120, 180], [255; 3], [255, 0, 0], [0, 255, 0], [128; 3]];
    for (bytes, profile, expected, clips) in [
        (
            &include_bytes!("data/pillow-p3.png")[..],
            "Display P3",
            with([215, 93, 31], [30, 122, 185], 128),
            true,
        ),
        (
            include_bytes!("data/pillow-adobe.tif"),
            "Adobe RGB (1998)",
            with([227, 100, 42], [0, 121, 184], 129),
            true,
        ),
        (
            include_bytes!("data/pillow-rec2020.webp"),
            "Rec. 2020",
            with([239, 63, 6], [0, 117, 182], 121),
            true,
        ),
        (include_bytes!("data/pillow-srgb.png"), "sRGB", source, false),
    ] {
        let decoded = read(bytes);
        assert_eq!(decoded.profile.as_deref(), Some(profile));
        for (pixel, expected) in decoded.image.pixels().iter().zip(&expected) {
            if clips && expected.contains(&0) {
                assert!(pixel.iter().any(|&value| value.abs() < 2e-3), "{profile}: {pixel:?}");
                continue;
            }
            for (found, expected) in codes(pixel).into_iter().zip(expected) {
                assert!((found - f32::from(*expected)).abs() < 1.0, "{profile}: {found}, {expected}");
            }
            assert!(pixel.iter().all(|&value| value >= 0.0), "{pixel:?}");
        }
        let found = decoded.warnings.iter().any(|warning| warning.contains("outside Rec. 709 moved"));
        assert_eq!(found, clips, "{:?}", decoded.warnings);
        let last = decoded.warnings.last().unwrap();
        assert!(last.ends_with(&format!("it was decoded by its ICC profile, {profile}")), "{last}");
    }
    // ITU-R BT.709 and SMPTE EG 432-1 give (1.22494, -0.04206, -0.01964) for a P3 red, of luminance 0.22897.
    let red = read(include_bytes!("data/pillow-p3.png")).image.pixels()[3];
    for (found, expected) in red.iter().zip([1.07039, 0.0, 0.01894]) {
        assert!((found - expected).abs() < 1e-3, "{red:?}");
    }
    let jpeg = read(include_bytes!("data/pillow-p3.jpg"));
    for (found, expected) in codes(&jpeg.image.pixels()[27]).into_iter().zip([215.0, 93.0, 31.0]) {
        assert!((found - expected).abs() < 4.0, "{found}, {expected}");
    }
    let grey = read(include_bytes!("data/pillow-grey.png"));
    for (pixel, code) in grey.image.pixels().iter().zip([200, 60, 255, 255, 0, 128]) {
        // 1.8 in 8 bits after the point.
        let expected = (f64::from(code) / 255.0).powf(461.0 / 256.0) as f32;
        assert!(pixel.iter().all(|value| (value - expected).abs() < 1e-6), "{pixel:?}, {expected}");
    }
}

#[test]
fn linear_profiles_keep_high_dynamic_range() {
    let decoded = read(include_bytes!("data/tifffile-linear-rec2020.tif"));
    assert_eq!((decoded.high_dynamic_range, decoded.warnings.len()), (true, 0));
    // ITU-R BT.2087: Rec. 2020 in Rec. 709.
    let matrix = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
    let source = [[0.5, 0.25, 8.0], [1.0, 1.0, 1.0], [100.0, 50.0, 25.0], [0.0, 0.0, 0.0]];
    for (pixel, source) in decoded.image.pixels().iter().zip(source) {
        for (value, row) in pixel.iter().zip(matrix) {
            let expected: f64 = row.iter().zip(source).map(|(a, b)| a * b).sum();
            let scale = source.iter().fold(1e-3, |most: f64, value| most.max(*value));
            assert!((f64::from(*value) - expected).abs() < 1e-3 * scale, "{value}, {expected}");
        }
    }
    let integers = read(include_bytes!("data/tifffile-16-linear.tif"));
    let first = integers.image.pixels()[0];
    for (value, code) in first.iter().zip([200.0, 100.0, 50.0]) {
        assert!((value - code / 255.0).abs() < 1e-6, "{first:?}");
    }
}

/// Primaries that were asked for leave the profile its curve, and both messages name it.
#[test]
fn an_overridden_profile_is_named() {
    let bytes = include_bytes!("data/pillow-p3.png");
    let profile = read(bytes).profile.unwrap();
    let options = ReadOptions { colour_space: Some(ColourSpace::Rec709), ..ReadOptions::default() };
    let asked = read_image(bytes, &options).unwrap();
    let overridden = format!("the ICC profile {profile} names other primaries than `rec709`");
    let decoded = format!("it was decoded with the curve of its ICC profile, {profile}");
    for text in [overridden, decoded] {
        assert!(asked.warnings.iter().any(|warning| warning.contains(&text)), "{:?}", asked.warnings);
    }
    assert_ne!(asked.image, read(bytes).image);
}

#[test]
fn a_profile_that_cannot_be_applied_is_reported() {
    let mut bytes = include_bytes!("data/tifffile-16-linear.tif").to_vec();
    let space = bytes.windows(4).position(|four| four == b"RGB ").unwrap();
    bytes[space..space + 4].copy_from_slice(b"CMYK");
    let decoded = read(&bytes);
    assert_eq!((decoded.profile, decoded.image.pixels()[0][0]), (None, linear(200.0 / 255.0)));
    assert!(decoded.warnings[0].starts_with("the ICC profile was ignored: "), "{:?}", decoded.warnings);
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
fn what_is_not_a_picture_is_an_error() {
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
    let decoded =
        read_image(&bytes, &ReadOptions { layer: Some("sky".into()), ..ReadOptions::default() }).unwrap();
    assert_eq!(decoded.warnings, ["Radiance has no layers; `sky` was ignored"]);
}

#[test]
fn a_header_has_the_size_of_its_picture_and_refuses_only_what_is_refused() {
    let (mut pictures, mut formats) = (0, HashSet::new());
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).unwrap() {
        let path = entry.unwrap().path();
        let whole = std::fs::read(&path).unwrap();
        let header = |bytes: &[u8]| {
            containers::read_image_header(&mut std::io::Cursor::new(bytes), &ReadOptions::default())
        };
        let mut compare = |bytes: &[u8]| match (header(bytes), read_image(bytes, &ReadOptions::default())) {
            (Ok(header), Ok(read)) => {
                let (width, height) = (read.image.width(), read.image.height());
                assert_eq!((header.width, header.height, header.format), (width, height, read.format));
                assert_eq!(header.openexr_envmap, read.openexr_envmap);
                formats.insert(read.format);
                true
            }
            (Ok(_), Err(_)) => false,
            (Err(error), Ok(_)) => panic!("{}: the header is refused: {error}", path.display()),
            (Err(error), Err(read)) => {
                assert_eq!(error.to_string(), read.to_string(), "{}", path.display());
                false
            }
        };
        pictures += usize::from(compare(&whole));
        for cut in (0..whole.len()).step_by(1 + whole.len() / 40) {
            compare(&whole[..cut]);
        }
    }
    assert!(pictures >= 20, "{pictures} pictures");
    assert_eq!(formats, Format::ALL.iter().copied().collect());
}
