//! Files made with the `exr` crate's own writer, and a few with OpenEXR 3.5's, read back through
//! `read_image`.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;

use containers::{
    Decoded, ErrorKind, OpenExrEnvmap, Precision, ReadOptions, read_image, read_recipe, write_exr,
};
use envmap::Image;
use exr::meta::attribute::EnvironmentMap;
use exr::prelude::*;

fn read(bytes: &[u8]) -> Decoded {
    read_image(bytes, &ReadOptions::default()).unwrap()
}

fn layer(name: &str) -> ReadOptions {
    ReadOptions { layer: Some(name.into()), ..ReadOptions::default() }
}

/// Values that a half holds exactly, and that vary in both directions.
fn value(x: usize, y: usize, channel: usize) -> f32 {
    64.0 + (x * 4 + y * 64 + channel * 1024) as f32 / 16.0
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Half,
    Float,
    Uint,
}

fn channel(
    name: &str,
    kind: Kind,
    size: (usize, usize),
    each: impl Fn(usize, usize) -> f32,
) -> AnyChannel<FlatSamples> {
    let values: Vec<f32> = (0..size.0 * size.1).map(|i| each(i % size.0, i / size.0)).collect();
    AnyChannel::new(
        name,
        match kind {
            Kind::Half => FlatSamples::F16(values.into_iter().map(f16::from_f32).collect()),
            Kind::Float => FlatSamples::F32(values),
            Kind::Uint => FlatSamples::U32(values.into_iter().map(|value| (value * 16.0) as u32).collect()),
        },
    )
}

fn rgb(prefix: &str, kind: Kind, size: (usize, usize)) -> Vec<AnyChannel<FlatSamples>> {
    let name = |letter| if prefix.is_empty() { String::from(letter) } else { format!("{prefix}.{letter}") };
    ["R", "G", "B"]
        .iter()
        .enumerate()
        .map(|(c, letter)| channel(&name(*letter), kind, size, move |x, y| value(x, y, c)))
        .collect()
}

fn file(layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let bounds = IntegerBounds::new((0, 0), layers[0].size);
    let mut bytes = Vec::new();
    let image = exr::image::Image::from_layers(ImageAttributes::new(bounds), layers);
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

fn part(
    name: Option<&str>,
    encoding: Encoding,
    size: (usize, usize),
    channels: Vec<AnyChannel<FlatSamples>>,
) -> Layer<AnyChannels<FlatSamples>> {
    let attributes = LayerAttributes { layer_name: name.map(Text::from), ..LayerAttributes::default() };
    Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into()))
}

const SIZE: (usize, usize) = (21, 37);

#[test]
fn every_compression_block_and_sample_type_is_read() {
    let mut cases = 0;
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 8))] {
            for kind in [Kind::Half, Kind::Float, Kind::Uint] {
                let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
                let decoded = read(&file(vec![part(None, encoding, SIZE, rgb("", kind, SIZE))]));
                assert_eq!((decoded.image.width(), decoded.image.height()), SIZE);
                assert_eq!(decoded.warnings, [""; 0]);
                for y in 0..SIZE.1 {
                    for x in 0..SIZE.0 {
                        for c in 0..3 {
                            let expected = value(x, y, c) * if kind == Kind::Uint { 16.0 } else { 1.0 };
                            let found = decoded.image.pixels()[y * SIZE.0 + x][c];
                            // B44 keeps 6 bits of the differences in a block of 4 x 4 halves, here at most 13
                            // at 64.
                            let lossy = matches!(compression, Compression::B44 | Compression::B44A)
                                && kind == Kind::Half;
                            let tolerance = if lossy { 0.01 * expected } else { 0.0 };
                            assert!(
                                (found - expected).abs() <= tolerance,
                                "{compression} {blocks:?} {kind:?} ({x}, {y}): {found} {expected}"
                            );
                        }
                    }
                }
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 48);
}

/// Written by OpenEXR 3.5: R = x / 16, G = y / 16, B = 2 in half, 16 x 16.
#[test]
fn dwa_is_read() {
    for bytes in [&include_bytes!("data/dwaa.exr")[..], include_bytes!("data/dwab.exr")] {
        let decoded = read(bytes);
        assert_eq!((decoded.image.width(), decoded.image.height()), (16, 16));
        for (i, pixel) in decoded.image.pixels().iter().enumerate() {
            let expected = [(i % 16) as f32 / 16.0, (i / 16) as f32 / 16.0, 2.0];
            // At OpenEXR's default level, 45, errors of a gradient stay below a few hundredths.
            assert!(
                pixel.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.04),
                "{i}: {pixel:?} {expected:?}"
            );
        }
    }
}

#[test]
fn the_largest_level_of_a_mip_map_is_read() {
    let (kind, size) = (Kind::Float, (8, 8));
    let channels = rgb("", kind, size).into_iter().map(|largest| AnyChannel {
        sample_data: Levels::Mip {
            rounding_mode: exr::math::RoundingMode::Down,
            level_data: [64, 16, 4, 1]
                .map(|count| match &largest.sample_data {
                    FlatSamples::F32(values) => FlatSamples::F32(values[..count].to_vec()),
                    _ => unreachable!(),
                })
                .to_vec(),
        },
        name: largest.name.clone(),
        quantize_linearly: false,
        sampling: Vec2(1, 1),
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::Tiles(Vec2(4, 4)),
        line_order: LineOrder::Increasing,
    };
    let image =
        exr::image::Image::from_encoded_channels(size, encoding, AnyChannels::sort(channels.collect()));
    let mut bytes = Vec::new();
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    assert_eq!(read(&bytes).image.pixels()[63], [0, 1, 2].map(|c| value(7, 7, c)));
}

#[test]
fn grey_and_alpha() {
    let encoding = Encoding::FAST_LOSSLESS;
    let grey =
        file(vec![part(None, encoding, SIZE, vec![channel("Y", Kind::Float, SIZE, |x, y| value(x, y, 0))])]);
    assert_eq!(read(&grey).image.pixels()[SIZE.0 + 1], [value(1, 1, 0); 3]);
    for (alpha, warnings) in [(1.0, 0), (0.5, 1)] {
        let mut channels = rgb("", Kind::Half, SIZE);
        channels.push(channel("A", Kind::Half, SIZE, |_, _| alpha));
        channels.push(channel("Z", Kind::Float, SIZE, |_, _| 9.0));
        let decoded = read(&file(vec![part(None, encoding, SIZE, channels)]));
        assert_eq!(decoded.image.pixels()[1], [value(1, 0, 0), value(1, 0, 1), value(1, 0, 2)]);
        assert_eq!(decoded.warnings.len(), warnings, "{:?}", decoded.warnings);
    }
}

#[test]
fn layers_are_chosen_by_part_or_prefix() {
    let encoding = Encoding::FAST_LOSSLESS;
    let other = |c: usize| move |_: usize, _: usize| c as f32;
    let mut channels = rgb("", Kind::Float, SIZE);
    channels.extend(
        ["diffuse.R", "diffuse.G", "diffuse.B"].map(|name| channel(name, Kind::Float, SIZE, other(7))),
    );
    channels.push(channel("depth.Z", Kind::Float, SIZE, other(1)));
    let prefixed = file(vec![part(None, encoding, SIZE, channels)]);
    let decoded = read(&prefixed);
    assert_eq!(decoded.image.pixels()[1], [0, 1, 2].map(|c| value(1, 0, c)));
    assert_eq!(
        decoded.warnings,
        [
            "the file has the layers the unnamed one, `diffuse`; the unnamed one was read; `layer` names another"
        ]
    );
    let decoded = read_image(&prefixed, &layer("diffuse")).unwrap();
    assert_eq!((decoded.image.pixels()[1], decoded.warnings.len()), ([7.0; 3], 0));
    let error = read_image(&prefixed, &layer("specular")).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NoSuchLayer);
    assert_eq!(
        error.to_string(),
        "OpenEXR: there is no layer `specular`; the layers are the unnamed one, `diffuse`"
    );

    let parts = file(vec![
        part(Some("sky"), encoding, SIZE, rgb("", Kind::Half, SIZE)),
        part(
            Some("sun"),
            encoding,
            SIZE,
            ["R", "G", "B"].map(|name| channel(name, Kind::Half, SIZE, other(5))).to_vec(),
        ),
    ]);
    assert_eq!(read_image(&parts, &layer("sun")).unwrap().image.pixels()[3], [5.0; 3]);
    let decoded = read(&parts);
    assert_eq!(
        decoded.warnings,
        ["the file has the layers `sky`, `sun`; `sky` was read; `layer` names another"]
    );

    let depth = file(vec![part(None, encoding, SIZE, vec![channel("Z", Kind::Float, SIZE, other(1))])]);
    let error = read_image(&depth, &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "OpenEXR: no layer has R, G and B, or Y; the channels are Z");
}

#[test]
fn the_display_window_is_the_picture() {
    let mut inner = part(None, Encoding::FAST_LOSSLESS, (4, 3), rgb("", Kind::Float, (4, 3)));
    inner.attributes.layer_position = Vec2(-1, 2);
    let mut bytes = Vec::new();
    let bounds = IntegerBounds::new((0, 1), (5, 3));
    let image = exr::image::Image::from_layers(ImageAttributes::new(bounds), vec![inner]);
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    let decoded = read(&bytes);
    assert_eq!(decoded.warnings.len(), 1);
    for y in 0..3 {
        for x in 0..5 {
            // Display (x, y) is (x, y + 1) of the plane, and the data begin at (-1, 2) there.
            let expected = if y >= 1 && x < 3 { [0, 1, 2].map(|c| value(x + 1, y - 1, c)) } else { [0.0; 3] };
            assert_eq!(decoded.image.pixels()[y * 5 + x], expected, "({x}, {y})");
        }
    }
}

#[test]
fn the_envmap_attribute_is_told() {
    for (attribute, expected) in [
        (None, None),
        (Some(EnvironmentMap::LatitudeLongitude), Some(OpenExrEnvmap::LatLong)),
        (Some(EnvironmentMap::Cube), Some(OpenExrEnvmap::Cube)),
    ] {
        let mut only = part(None, Encoding::FAST_LOSSLESS, SIZE, rgb("", Kind::Half, SIZE));
        only.attributes.environment_map = attribute;
        assert_eq!(read(&file(vec![only])).openexr_envmap, expected);
    }
}

/// Rec. 2020's green (0, 1, 0) in Rec. 709, from the matrix of ITU-R BT.2087 (four decimals).
#[test]
fn chromaticities_are_converted_to_rec709() {
    let with = |chromaticities: Option<[(f32, f32); 4]>| {
        let green =
            ["R", "G", "B"].map(|name| channel(name, Kind::Float, SIZE, move |_, _| f32::from(name == "G")));
        let bounds = IntegerBounds::new((0, 0), SIZE);
        let chromaticities =
            chromaticities.map(|[red, green, blue, white]| exr::meta::attribute::Chromaticities {
                red: red.into(),
                green: green.into(),
                blue: blue.into(),
                white: white.into(),
            });
        let attributes = ImageAttributes { chromaticities, ..ImageAttributes::new(bounds) };
        let only = part(None, Encoding::FAST_LOSSLESS, SIZE, green.to_vec());
        let mut bytes = Vec::new();
        let image = exr::image::Image::from_layers(attributes, vec![only]);
        image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
        read(&bytes)
    };
    let d65 = (0.3127, 0.3290);
    assert_eq!(with(None).image.pixels()[5], [0.0, 1.0, 0.0], "absent means Rec. 709");
    assert_eq!(
        with(Some([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), d65])).image.pixels()[5],
        [0.0, 1.0, 0.0]
    );
    let wide = with(Some([(0.708, 0.292), (0.170, 0.797), (0.131, 0.046), d65])).image.pixels()[5];
    // (-0.5876, 1.1329, -0.1006), moved toward its luminance, 0.6780, until red is 0.
    assert!(wide.iter().zip([0.0, 0.9217, 0.2609]).all(|(a, b)| (a - b).abs() < 2e-4), "{wide:?}");
    let nonsense = with(Some([(0.0, 0.0); 4]));
    assert_eq!((nonsense.image.pixels()[5], nonsense.warnings.len()), ([0.0, 1.0, 0.0], 1));
}

#[test]
fn deep_data_and_subsampled_colours_are_refused_in_words() {
    let refused = |bytes: &[u8]| read_image(bytes, &ReadOptions::default()).unwrap_err();
    let deep = refused(include_bytes!("data/deep.exr"));
    assert_eq!(
        (deep.kind(), deep.to_string().contains("deep data")),
        (ErrorKind::Unsupported, true),
        "{deep}"
    );
    // The first channel, `B`: its name, type and linearity, then the sampling in x.
    let mut bytes = file(vec![part(None, Encoding::FAST_LOSSLESS, (4, 4), rgb("", Kind::Half, (4, 4)))]);
    let list = b"channels\0chlist\0";
    let start = bytes.windows(list.len()).position(|window| window == list).unwrap() + list.len() + 4;
    assert_eq!((bytes[start], bytes[start + 10]), (b'B', 1));
    bytes[start + 10] = 2;
    assert!(refused(&bytes).to_string().contains("channel B is subsampled"), "{}", refused(&bytes));
}

/// OpenEXR's luminance and chroma of Rec. 709: RY = (R - Y) / Y, BY = (B - Y) / Y.
#[test]
fn luminance_and_chroma_are_read() {
    let of = |[r, g, b]: [f32; 3]| {
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        [y, (r - y) / y, (b - y) / y]
    };
    let planes = ["Y", "RY", "BY"]
        .iter()
        .enumerate()
        .map(|(c, name)| channel(name, Kind::Float, SIZE, move |_, _| of([4.0, 2.0, 1.0])[c]));
    let bytes = file(vec![part(None, Encoding::FAST_LOSSLESS, SIZE, planes.collect())]);
    for pixel in read(&bytes).image.pixels() {
        let near = pixel.iter().zip([4.0, 2.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near, "{pixel:?}");
    }
}

/// Chroma of 2 x 2 pixels as OpenEXR's `RgbaInputFile` reconstructs it, in halves (`data/README.md`); two
/// lamps of one colour, so that the filter overshoots and saturation is limited.
#[test]
fn subsampled_chroma_is_read() {
    let expected: Vec<f32> = include_str!("data/openexr-chroma.txt")
        .split_ascii_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    for (bytes, most) in [
        (&include_bytes!("data/openexr-chroma-none.exr")[..], 2e-3),
        (include_bytes!("data/openexr-chroma-zip.exr"), 2e-3),
        (include_bytes!("data/openexr-chroma-piz.exr"), 2e-3),
        // Which loses more.
        (include_bytes!("data/openexr-chroma-dwaa.exr"), 0.1),
    ] {
        let found = read(bytes).image;
        assert_eq!((found.width(), found.height()), (16, 8));
        for (i, (found, expected)) in found.pixels().iter().zip(expected.chunks_exact(3)).enumerate() {
            let largest = expected.iter().fold(0.0_f32, |a, b| a.max(*b));
            let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < most * largest);
            assert!(near, "{i}: {found:?}, expected {expected:?}");
        }
        let layers = containers::read_exr_layers(bytes).unwrap();
        assert_eq!(layers.layers[0].1, found.pixels());
    }
    let bytes = include_bytes!("data/openexr-chroma-b44.exr");
    let error = read_image(bytes, &ReadOptions::default()).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("subsampled channels with b44 compression are not read"), "{error}");
    // Every truncated length is an error.
    let bytes = include_bytes!("data/openexr-chroma-piz.exr");
    for length in 8..bytes.len() {
        assert!(read_image(&bytes[..length], &ReadOptions::default()).is_err(), "{length}");
    }
}

#[test]
fn colour_wins_over_grey_and_data_and_beauty_over_other_layers() {
    let encoding = Encoding::FAST_LOSSLESS;
    let level = |name: &str, level: f32| channel(name, Kind::Float, SIZE, move |_, _| level);
    let layer = |prefix: &str, names: [&str; 3], value: f32| {
        names.map(|name| level(&format!("{prefix}{name}"), value)).to_vec()
    };
    let first = |channels: Vec<AnyChannel<FlatSamples>>| {
        read(&file(vec![part(None, encoding, SIZE, channels)])).image.pixels()[0]
    };
    let rgb = ["R", "G", "B"];
    for others in [
        layer("N.", ["X", "Y", "Z"], 9.0),
        layer("N.", rgb, 9.0),
        vec![level("AO.Y", 9.0)],
        layer("albedo.", rgb, 9.0),
    ] {
        for beauty in ["beauty.", "rgba.", "View Layer.Combined."] {
            assert_eq!(first([others.clone(), layer(beauty, rgb, 2.0)].concat()), [2.0; 3], "{beauty}");
        }
    }
    assert_eq!(first([vec![level("AO.Y", 9.0)], layer("sky.", rgb, 2.0)].concat()), [2.0; 3]);
    // Light in grey or in luminance and chroma is light still.
    for data in [layer("N.", rgb, 9.0), layer("CryptoAsset00.", ["r", "g", "b"], 9.0)] {
        assert_eq!(first([data.clone(), layer("sky.", rgb, 2.0)].concat()), [2.0; 3]);
        assert_eq!(first([data.clone(), vec![level("Y", 2.0)]].concat()), [2.0; 3]);
        let chroma = vec![level("Y", 2.0), level("RY", 0.0), level("BY", 0.0)];
        assert!(first([data, chroma].concat()).iter().all(|value| (value - 2.0).abs() < 1e-5));
    }
    for names in [["r", "g", "b"], ["red", "green", "blue"]] {
        assert_eq!(first(layer("", names, 2.0)), [2.0; 3]);
        assert_eq!(first(layer("env.", names, 2.0)), [2.0; 3]);
    }
    let position = file(vec![part(None, encoding, SIZE, layer("P.", ["X", "Y", "Z"], 9.0))]);
    let error = read_image(&position, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("P.X, P.Y, P.Z; X, Y and Z are a position or a direction"), "{error}");
}

#[test]
fn windows_that_do_not_overlap_are_an_error() {
    let bounds = IntegerBounds::new((1000, 1000), (4, 3));
    let inner = part(None, Encoding::FAST_LOSSLESS, (4, 3), rgb("", Kind::Float, (4, 3)));
    let mut bytes = Vec::new();
    let image = exr::image::Image::from_layers(ImageAttributes::new(bounds), vec![inner]);
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    let error = read_image(&bytes, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("lies outside the display window"), "{error}");
}

/// Written by OpenEXR 3.5: chunks that DWA would not have made smaller are stored as they are.
#[test]
fn dwa_chunks_that_are_stored_raw_are_read() {
    let decoded = read(include_bytes!("data/dwaa-stored.exr"));
    assert_eq!((decoded.image.width(), decoded.image.height()), (10, 5));
    // R = x / 16, G = y / 16, B = 2 in half.
    for (i, pixel) in decoded.image.pixels().iter().enumerate() {
        assert_eq!(*pixel, [(i % 10) as f32 / 16.0, (i / 10) as f32 / 16.0, 2.0]);
    }
}

#[test]
fn compressions_that_are_not_read_are_named() {
    for (bytes, name) in [
        (&include_bytes!("data/zstd.exr")[..], "ZSTD"),
        (include_bytes!("data/htj2k.exr"), "HTJ2K (High-Throughput JPEG 2000)"),
    ] {
        let error = read_image(bytes, &ReadOptions::default()).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("OpenEXR: the compression {name} is not read; save the image with ZIP or PIZ")
        );
    }
}

#[test]
fn what_is_written_comes_back() {
    let pixels: Vec<[f32; 3]> =
        (0..50 * 40).map(|i| [i as f32 * 0.1, -1e-30, f32::MAX / (i + 1) as f32]).collect();
    let image = Image::new(50, 40, pixels).unwrap();
    let recipe = r#"{"kind":"export","name":"größe"}"#;
    let encoded = write_exr(&image, Precision::Float, Some(recipe)).unwrap();
    assert_eq!(read_recipe(&encoded.bytes).as_deref(), Some(recipe));
    let decoded = read(&encoded.bytes);
    assert_eq!((decoded.image, decoded.recipe.as_deref()), (image.clone(), Some(recipe)));
    assert_eq!(write_exr(&image, Precision::Float, Some(recipe)).unwrap(), encoded);
    assert_eq!(read_recipe(&write_exr(&image, Precision::Float, None).unwrap().bytes), None);
    let lines = write_exr(&image, Precision::Float, Some("a\nb")).unwrap_err();
    assert_eq!(lines.kind(), ErrorKind::Unwritable);
}

#[test]
fn half_overflow_is_clamped() {
    let values = [65504.0, 65505.0, 1e9, -65504.0, -7e4, f32::INFINITY, f32::NEG_INFINITY, 65519.9, 0.1];
    let pixels: Vec<[f32; 3]> = values.chunks(3).map(|v| [v[0], v[1], v[2]]).collect();
    let encoded = write_exr(&Image::new(3, 1, pixels).unwrap(), Precision::Half, None).unwrap();
    let kept = read(&encoded.bytes).image.pixels().as_flattened().to_vec();
    let tenth = f16::from_f32(0.1).to_f32();
    assert_eq!(kept, [65504.0, 65504.0, 65504.0, -65504.0, -65504.0, 65504.0, -65504.0, 65504.0, tenth]);
}

#[test]
fn a_layer_is_warned_of_its_own_alpha_only() {
    let size = (4, 4);
    let mut channels = [rgb("", Kind::Float, size), rgb("diffuse", Kind::Float, size)].concat();
    channels.push(channel("diffuse.A", Kind::Float, size, |_, _| 0.5));
    let bytes = file(vec![part(None, Encoding::UNCOMPRESSED, size, channels)]);
    let warned = |name: Option<&str>| {
        let options = ReadOptions { layer: name.map(Into::into), ..ReadOptions::default() };
        read_image(&bytes, &options).unwrap().warnings.iter().any(|warning| warning.starts_with("alpha"))
    };
    assert!(warned(Some("diffuse")));
    assert!(!warned(None));
}
