//! Pictures that consist of several blocks of rows, against what the `exr` crate's own reader and the formula
//! of RGBE give.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};

use containers::{
    ErrorKind, Precision, ReadOptions, read_image, read_image_until, tensors, write_exr, write_rgbe,
};
use envmap::{Environment, Image, Layout};
use exr::prelude::*;
use sh::Stop;

/// Three blocks of rows, the last of which is short; tiles and chunks end elsewhere.
const SIZE: (usize, usize) = (150, 75);

/// A noisy value that a half holds.
fn value(x: usize, y: usize, channel: usize) -> f16 {
    let noise = ((x * 7919 + y * 104_729 + channel * 1_299_709) as u32).wrapping_mul(2_654_435_761) >> 20;
    f16::from_f32(0.5 + y as f32 / 40.0 + noise as f32 / 20_000.0)
}

fn open_exr(compression: Compression, blocks: Blocks, line_order: LineOrder) -> Vec<u8> {
    let channels = SpecificChannels::rgb(|Vec2(x, y)| (value(x, y, 0), value(x, y, 1), value(x, y, 2)));
    let encoding = Encoding { compression, blocks, line_order };
    let layer = Layer::new(SIZE, LayerAttributes::default(), encoding, channels);
    let mut bytes = Vec::new();
    exr::image::Image::from_layer(layer).write().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

/// The pixels that the `exr` crate's own reader puts together.
fn oracle(bytes: &[u8]) -> Vec<[f32; 3]> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| vec![[0.0; 3]; size.0 * size.1],
            |pixels: &mut Vec<[f32; 3]>, Vec2(x, y), (r, g, b): (f32, f32, f32)| {
                pixels[y * SIZE.0 + x] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .unwrap();
    image.layer_data.channel_data.pixels
}

fn threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(work)
}

fn picture(bytes: &[u8]) -> Image {
    read_image(bytes, &ReadOptions::default()).unwrap().image
}

#[test]
fn open_exr_gives_the_pixels_of_another_reader_for_any_number_of_threads() {
    use Compression::{B44, B44A, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    let mut cases = 0;
    for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44, B44A] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(32, 24)), Blocks::Tiles(Vec2(64, 64))] {
            for order in [LineOrder::Increasing, LineOrder::Decreasing] {
                let bytes = open_exr(compression, blocks, order);
                let [one, four] = [1, 4].map(|count| threads(count, || picture(&bytes)));
                let expected = oracle(&bytes);
                let mut scratch = Vec::new();
                for rows in [0..SIZE.1, 30..40, 74..75] {
                    let expected = &expected[rows.start * SIZE.0..rows.end * SIZE.0];
                    let found = one.rows(rows.clone(), &mut scratch);
                    assert!(found == expected, "{compression} {blocks:?} {order:?} {rows:?}");
                }
                let encoded = [one, four].map(|image| {
                    let grid = sphere::LatLong { width: SIZE.0, height: SIZE.1 };
                    let environment = Environment::from_image(image, Layout::LatLong, Some(grid)).unwrap();
                    tensors::encode_environment_rows(&environment)
                });
                assert!(encoded[0] == encoded[1], "{compression} {blocks:?} {order:?}");
                let decoded = tensors::decode_environment(&encoded[0]).unwrap();
                assert_eq!(decoded.pixels(), expected, "{compression} {blocks:?} {order:?}");
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 48);
}

/// A picture is written from its blocks as from its floats.
#[test]
fn blocks_of_rows_are_written_as_floats_are() {
    let picture = picture(&open_exr(Compression::ZIP16, Blocks::ScanLines, LineOrder::Increasing));
    let decoded = Image::new(SIZE.0, SIZE.1, picture.clone().into_pixels()).unwrap();
    for precision in [Precision::Half, Precision::Float] {
        let [blocks, floats] =
            [&picture, &decoded].map(|image| write_exr(image, precision, Some("{}")).unwrap().bytes);
        assert!(blocks == floats, "{precision:?}");
        assert_eq!(oracle(&blocks), decoded.pixels(), "{precision:?}");
    }
    assert_eq!(write_rgbe(&picture, None).unwrap(), write_rgbe(&decoded, None).unwrap());
}

#[test]
fn radiance_gives_the_pixels_of_the_formula_in_every_order() {
    let pixels: Vec<[f32; 3]> = (0..SIZE.0 * SIZE.1)
        .map(|i| [0, 1, 2].map(|c| value(i % SIZE.0, i / SIZE.0, c).to_f32() * 0.01 * (c + 1) as f32))
        .collect();
    let written = write_rgbe(&Image::new(SIZE.0, SIZE.1, pixels).unwrap(), None).unwrap().bytes;
    let expected = picture(&written);
    // A picture without run lengths has its scanlines from the top, from the bottom, or each from the right.
    let [width, height] = [SIZE.0, SIZE.1];
    let mantissas = |rgb: [f32; 3]| {
        let exponent = rgb.iter().fold(0.0_f32, |a, b| a.max(*b)).log2().floor() as i32 + 1;
        let [r, g, b] = rgb.map(|value| (f64::from(value) * 2.0_f64.powi(8 - exponent)) as u8);
        [r, g, b, (exponent + 128) as u8]
    };
    for (resolution, column, row) in [
        (format!("-Y {height} +X {width}"), false, false),
        (format!("+Y {height} +X {width}"), false, true),
        (format!("-Y {height} -X {width}"), true, false),
    ] {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n").into_bytes();
        for y in 0..height {
            for x in 0..width {
                let x = if column { width - 1 - x } else { x };
                let y = if row { height - 1 - y } else { y };
                bytes.extend(mantissas(expected.pixels()[y * width + x]));
            }
        }
        let [one, four] = [1, 4].map(|count| threads(count, || picture(&bytes)));
        assert_eq!(one.pixels(), expected.pixels(), "{resolution}");
        assert_eq!(four.pixels(), expected.pixels(), "{resolution}");
    }
}

#[test]
fn reading_stops_when_it_is_asked_to() {
    let exr = open_exr(Compression::ZIP16, Blocks::ScanLines, LineOrder::Increasing);
    let hdr = write_rgbe(&picture(&exr), None).unwrap().bytes;
    for bytes in [exr, hdr] {
        let asked = AtomicUsize::new(0);
        let count = || asked.fetch_add(1, Ordering::Relaxed) >= 2;
        let read = read_image_until(&bytes, &ReadOptions::default(), Stop::when(&count));
        assert_eq!(read.unwrap_err().kind(), ErrorKind::Stopped);
    }
}
