//! Damaged files: never a panic that escapes, never an allocation that the bytes do not justify.
//!
//! The limit: whatever a header of a file of a few kilobytes says, one request for memory stays below 64 MiB
//! and all of them together below 256 MiB at any moment. Each test runs alone in turn, so that the count is
//! its own.

#![allow(clippy::unwrap_used)] // as in any test

use std::alloc::{GlobalAlloc, Layout, System};
use std::collections::HashSet;
use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use containers::lighting_json::{self, Preset};
use containers::{
    BabylonEnv, Format, ImageBasedLight, MAX_PIXELS, Polynomial, Precision, ReadOptions, TexelFormat,
    Texture, read_babylon_env, read_exr_layers, read_gltf_image_based_light, read_image, read_recipe,
    read_texture, tensors, texture_containers, write_babylon_env, write_dds, write_exr, write_exr_layers,
    write_gltf_image_based_light, write_ktx1, write_ktx2, write_ktx2_zstd, write_png, write_rgbe,
};
use envmap::{Environment, Image};
use exr::prelude::*;
use parking_lot::Mutex;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use sh::{Degree, Expansion};
use shrm::{MapGrid, Shrm, Terms, View};
use sphere::{Cube, LatLong};

const MAX_CLAIM: usize = 64 << 20;
const TOTAL: usize = 256 << 20;

/// The system's allocator, counting.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static BIGGEST: AtomicUsize = AtomicUsize::new(0);

fn took(size: usize) {
    BIGGEST.fetch_max(size, Relaxed);
    PEAK.fetch_max(HELD.fetch_add(size, Relaxed) + size, Relaxed);
}

// SAFETY: every call goes to the system's allocator unchanged; only numbers are kept beside it. There is no
// safe way to see what a decoder asks for.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        took(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        took(size);
        HELD.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

static ALONE: Mutex<()> = Mutex::new(());

/// Runs a decoder and checks what it asked for.
fn within_limits(what: &str, decode: impl FnOnce()) {
    let before = HELD.load(Relaxed);
    PEAK.store(before, Relaxed);
    BIGGEST.store(0, Relaxed);
    decode();
    let (peak, biggest) = (PEAK.load(Relaxed).saturating_sub(before), BIGGEST.load(Relaxed));
    // A lossless WebP of any length can hold the largest picture; its decoder fills memory only as codes
    // come.
    let (largest, total) = match what.starts_with("webp") {
        true => (4 * MAX_PIXELS, 8 * MAX_PIXELS + TOTAL),
        false => (MAX_CLAIM, TOTAL),
    };
    assert!(biggest <= largest && peak <= total, "{what}: one request of {biggest} bytes, {peak} in all");
}

fn picture() -> Image {
    let pixels = (0..20 * 18).map(|i| [i as f32, (i % 7) as f32 * 0.1, 1e-3 * (i / 20) as f32]).collect();
    Image::new(20, 18, pixels).unwrap()
}

fn exr_of(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let size = (12, 10);
    let channel = |name: &str| {
        AnyChannel::new(name, FlatSamples::F16((0..120).map(|i| f16::from_f32(i as f32)).collect()))
    };
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let mut bytes = Vec::new();
    let image = exr::image::Image::from_encoded_channels(size, encoding, channels);
    image.write().non_parallel().to_buffered(Cursor::new(&mut bytes)).unwrap();
    bytes
}

/// A plain layer and two others, as 32-bit floats.
fn layers() -> Vec<u8> {
    let pixels = picture().into_pixels();
    let layers = ["", "p1q0", "p1q1"].map(|name| (name.to_owned(), pixels.clone()));
    write_exr_layers(
        20,
        18,
        &layers,
        Precision::Float,
        Some("{}"),
        &[("specula.view", "local")],
        sh::Stop::NEVER,
    )
    .unwrap()
    .bytes
}

/// A small file of each container for textures, and of each shape.
fn textures() -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for (name, (width, depth, layers, faces)) in
        [("2D", (5, 1, 0, 1)), ("volume", (5, 3, 0, 1)), ("cube array", (3, 1, 2, 6))]
    {
        let mut texture = Texture { width, height: 3, depth, layers, faces, ..Texture::default() };
        texture.pixels = (0..texture.level_len(0).unwrap()).map(|i| [i as f32, 0.5, -1.0]).collect();
        let metadata = [("specula.view", "local")];
        let ktx2 = write_ktx2(&texture, Precision::Half, Some("{}"), &metadata).unwrap().bytes;
        files.push((format!("ktx2 {name}"), ktx2));
        files.push((format!("dds {name}"), write_dds(&texture, Precision::Float).unwrap().bytes));
    }
    let cube = cube();
    for format in [TexelFormat::Rgba16F, TexelFormat::R11G11B10F] {
        let bytes = write_ktx1(&cube, format, Some("{}"), &[("sh", "1 1 1\n")]).unwrap().bytes;
        files.push((format!("ktx {}", format.name()), bytes));
    }
    for format in TexelFormat::ALL {
        let name = format.name();
        files.push((format!("ktx2 {name}"), write_ktx2(&cube, format, None, &[]).unwrap().bytes));
        files.push((format!("ktx2 zstd {name}"), write_ktx2_zstd(&cube, format, None, &[]).unwrap().bytes));
        files.push((format!("dds {name}"), write_dds(&cube, format).unwrap().bytes));
    }
    files
}

/// A cube with all its levels.
fn cube() -> Texture {
    let level = |edge: usize| (0..6 * edge * edge).map(|i| [i as f32, 0.5, 2.0]).collect();
    Texture {
        width: 4,
        height: 4,
        faces: 6,
        pixels: level(4),
        smaller_levels: vec![level(2), level(1)],
        ..Texture::default()
    }
}

/// Prefiltered lights of engines.
fn image_based_lights() -> Vec<(String, Vec<u8>)> {
    let [x, y, z, xx, yy, zz, yz, zx, xy] = [[0.5; 3]; 9];
    let irradiance = Polynomial { x, y, z, xx, yy, zz, yz, zx, xy };
    let of_one_level = Texture { smaller_levels: Vec::new(), ..cube() };
    let env = BabylonEnv {
        cube: cube(),
        irradiance: Some(irradiance),
        irradiance_cube: Some(of_one_level),
        lod_generation_scale: 0.8,
    };
    assert_eq!(
        read_babylon_env(&write_babylon_env(&env, None).unwrap().bytes)
            .unwrap()
            .irradiance_cube
            .map(|cube| cube.width),
        Some(4)
    );
    let light = ImageBasedLight { cube: cube(), irradiance: [[0.5; 3]; 9] };
    vec![
        ("env".into(), write_babylon_env(&env, Some("{}")).unwrap().bytes),
        ("gltf light".into(), write_gltf_image_based_light(&light, Some("{}")).unwrap().bytes),
    ]
}

/// The smallest picture of each format in `tests/data`, so that no format can be forgotten.
fn smallest() -> Vec<(String, Vec<u8>)> {
    let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).unwrap();
    let mut files: Vec<Vec<u8>> = folder.map(|entry| std::fs::read(entry.unwrap().path()).unwrap()).collect();
    files.sort_by_key(Vec::len);
    let of = |format: Format| {
        let is_read = |bytes: &&Vec<u8>| {
            read_image(bytes, &ReadOptions::default()).is_ok_and(|read| read.format == format)
        };
        let found = files.iter().find(is_read);
        found.unwrap_or_else(|| panic!("crates/containers/tests/data lacks a file of {}", format.name()))
    };
    let named = |format: &Format| (format!("{} smallest", format.name().to_lowercase()), of(*format).clone());
    Format::ALL.iter().map(named).collect()
}

/// Small files of each format and, for OpenEXR, of each compression.
fn pictures() -> Vec<(String, Vec<u8>)> {
    let codes: Vec<[u8; 3]> = (0..60_u8).map(|i| [i, 3 * i, 255 - i]).collect();
    let mut files = vec![
        ("exr float".into(), write_exr(&picture(), Precision::Float, Some("{}")).unwrap().bytes),
        ("exr layers".into(), layers()),
        ("rgbe".into(), write_rgbe(&picture(), Some("{}")).unwrap().bytes),
        (
            "rgbe old".into(),
            b"#?RADIANCE\nEXPOSURE=2\n\n+X 3 -Y 40\n"
                .iter()
                .copied()
                .chain((0..3).flat_map(|_| [9, 8, 7, 128, 1, 1, 1, 39]))
                .collect(),
        ),
        ("png".into(), write_png(10, 6, &codes, Some("{}")).unwrap()),
        ("png 16".into(), include_bytes!("data/grey-16.png").to_vec()),
        ("png palette".into(), include_bytes!("data/palette.png").to_vec()),
        ("jpeg".into(), include_bytes!("data/gradient.jpg").to_vec()),
        ("jpeg progressive".into(), include_bytes!("data/gradient-progressive.jpg").to_vec()),
        ("jpeg grey".into(), include_bytes!("data/grey.jpg").to_vec()),
        ("png p3".into(), include_bytes!("data/pillow-p3.png").to_vec()),
        ("jpeg p3".into(), include_bytes!("data/pillow-p3.jpg").to_vec()),
        ("jpeg gain map".into(), include_bytes!("data/libultrahdr-2100.jpg").to_vec()),
        ("jpeg ultra hdr".into(), include_bytes!("data/ultra-hdr.jpg").to_vec()),
        ("tiff lzw".into(), include_bytes!("data/pillow-adobe.tif").to_vec()),
        ("tiff 16".into(), include_bytes!("data/tifffile-16.tif").to_vec()),
        ("tiff float".into(), include_bytes!("data/tifffile-float.tif").to_vec()),
        ("tiff grey".into(), include_bytes!("data/tifffile-float-grey.tif").to_vec()),
        ("tiff tiles".into(), include_bytes!("data/tifffile-float-tiled.tif").to_vec()),
        ("tiff zstd".into(), include_bytes!("data/tifffile-zstd.tif").to_vec()),
        ("tiff lzma".into(), include_bytes!("data/tifffile-lzma.tif").to_vec()),
        ("tiff planes".into(), include_bytes!("data/tifffile-planes-of-tiles.tif").to_vec()),
        ("tiff palette".into(), include_bytes!("data/pillow-palette.tif").to_vec()),
        ("tiff linear".into(), include_bytes!("data/tifffile-linear-rec2020.tif").to_vec()),
        ("tga".into(), include_bytes!("data/pillow.tga").to_vec()),
        ("tga rle".into(), include_bytes!("data/pillow-rle.tga").to_vec()),
        ("webp".into(), include_bytes!("data/pillow-rec2020.webp").to_vec()),
        ("webp alpha".into(), include_bytes!("data/pillow-alpha.webp").to_vec()),
        ("exr dwaa".into(), include_bytes!("data/dwaa.exr").to_vec()),
        ("exr deep".into(), include_bytes!("data/deep.exr").to_vec()),
    ];
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
        files.push((format!("exr {compression}"), exr_of(compression, Blocks::ScanLines)));
    }
    files.push(("exr tiles".into(), exr_of(Compression::ZIP16, Blocks::Tiles(Vec2(8, 4)))));
    files.extend(smallest());
    files
}

fn coefficients() -> Vec<(String, Vec<u8>)> {
    let degree = Degree::new(2).unwrap();
    let lighting =
        Expansion::from_coefficients(degree, (0..9).map(|i| [f64::from(i), 0.1, -2.5]).collect()).unwrap();
    let environment = Environment::new(LatLong { width: 4, height: 2 }, vec![[0.5; 3]; 8]).unwrap();
    let cube = MapGrid::Cube(Cube { edge: 2 });
    let values = (0..24 * 4).map(|i| [i as f32, 0.1, -1.0]).collect();
    let (centre, p) = (brdf::Centre::Reflection, Degree::new(1).unwrap());
    let map = Shrm::new(cube, View::Local, centre, p, Terms::All, values).unwrap();
    vec![
        ("shrm".into(), tensors::encode_shrm(&map, &[], Some("{}")).unwrap()),
        ("lighting".into(), tensors::encode_lighting(&lighting.clone().into(), Some("{}")).unwrap()),
        ("environment".into(), tensors::encode_environment(&environment, None).unwrap()),
        (
            "json".into(),
            lighting_json::encode(&lighting.clone().into(), Preset::Specula, Some("{}")).unwrap(),
        ),
    ]
}

/// Decodes in every way that could apply; what comes of it does not matter.
fn decode_all(bytes: &[u8]) {
    let _ = read_image(bytes, &ReadOptions::default());
    let _ = read_exr_layers(bytes);
    let _ = read_texture(bytes);
    let _ = read_babylon_env(bytes);
    let _ = read_gltf_image_based_light(bytes);
    let _ = read_recipe(bytes);
}

fn decode_coefficients(bytes: &[u8]) {
    let _ = tensors::describe(bytes);
    let _ = tensors::decode_lighting(bytes);
    let _ = tensors::decode_brdf(bytes);
    let _ = tensors::decode_reflection(bytes);
    let _ = tensors::decode_environment(bytes);
    let _ = tensors::decode_shrm(bytes);
    let _ = tensors::decode_lights(bytes);
    let _ = lighting_json::decode(bytes);
    let _ = read_recipe(bytes);
}

#[test]
fn every_truncated_length_is_an_error() {
    let _alone = ALONE.lock();
    for (name, bytes) in pictures() {
        let whole = read_image(&bytes, &ReadOptions::default());
        assert!(whole.is_ok() || name == "exr deep", "{name}: {whole:?}");
        for length in 0..bytes.len() {
            within_limits(&format!("{name}, {length} bytes"), || {
                let Ok(cut) = read_image(&bytes[..length], &ReadOptions::default()) else { return };
                // A file may end in what no reader needs: the checksum of PNG's last chunk or of deflated
                // data, TGA's footer, or padding.
                let needless = match name.split(' ').next() {
                    Some("png") => 16,
                    Some("tga") => 26,
                    Some("tiff") => 5,
                    Some("webp") => 1,
                    _ => 0,
                };
                let same = whole.as_ref().is_ok_and(|whole| whole.image == cut.image);
                let (total, enough) = (bytes.len(), length + needless >= bytes.len());
                assert!(enough && same, "{name}: {length} of {total} bytes were read");
            });
        }
    }
    let mut read = HashSet::new();
    for (name, bytes) in textures() {
        read.insert(read_texture(&bytes).unwrap_or_else(|error| panic!("{name}: {error}")).container);
        for length in 0..bytes.len() {
            within_limits(&format!("{name}, {length} bytes"), || {
                assert!(read_texture(&bytes[..length]).is_err(), "{name}: {length} bytes were read");
                let _ = read_recipe(&bytes[..length]);
            });
        }
    }
    assert_eq!(read, texture_containers().into());
    for (name, bytes) in image_based_lights() {
        assert!(read_babylon_env(&bytes).is_ok() || read_gltf_image_based_light(&bytes).is_ok(), "{name}");
        assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"), "{name}");
        // The document's last byte is a line end.
        for length in 0..bytes.len() - 1 {
            within_limits(&format!("{name}, {length} bytes"), || {
                let cut = &bytes[..length];
                assert!(
                    read_babylon_env(cut).is_err() && read_gltf_image_based_light(cut).is_err(),
                    "{name}"
                );
            });
        }
    }
    let bytes = layers();
    assert_eq!(read_exr_layers(&bytes).unwrap().layers.len(), 3);
    for length in 0..bytes.len() {
        within_limits(&format!("exr layers, {length} bytes"), || {
            assert!(
                read_exr_layers(&bytes[..length]).is_err(),
                "{length} of {} bytes were read",
                bytes.len()
            );
        });
    }
    for (name, bytes) in coefficients() {
        for length in 0..bytes.len() - 1 {
            within_limits(&format!("{name}, {length} bytes"), || {
                let cut = &bytes[..length];
                // The JSON's last byte is a line end.
                assert!(tensors::decode_lighting(cut).is_err() && tensors::decode_environment(cut).is_err());
                assert!(tensors::decode_shrm(cut).is_err() && tensors::decode_lights(cut).is_err());
                assert!(
                    lighting_json::decode(cut).is_err(),
                    "{name}: {length} of {} bytes were read",
                    bytes.len()
                );
                decode_coefficients(cut);
            });
        }
    }
}

#[test]
fn changed_bytes_never_panic_nor_allocate_wildly() {
    let _alone = ALONE.lock();
    // Silence the panics that are caught inside.
    std::panic::set_hook(Box::new(|_| {}));
    let files = [pictures(), textures(), image_based_lights(), coefficients()].concat();
    let flips = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6);
    let config = Config { cases: 4000, failure_persistence: None, ..Config::default() };
    let result = TestRunner::new_with_rng(
        config,
        prop::test_runner::TestRng::deterministic_rng(prop::test_runner::RngAlgorithm::XorShift),
    )
    .run(&(any::<prop::sample::Index>(), flips), |(file, flips)| {
        let (name, bytes) = file.get(&files);
        let mut damaged = bytes.clone();
        for (position, value) in &flips {
            damaged[position.index(bytes.len())] = *value;
        }
        within_limits(name, || {
            decode_all(&damaged);
            decode_coefficients(&damaged);
        });
        Ok(())
    });
    let _ = std::panic::take_hook();
    result.unwrap();
}

/// Every byte of every header set to the values that numbers break at.
#[test]
fn hostile_headers_never_panic_nor_allocate_wildly() {
    let _alone = ALONE.lock();
    std::panic::set_hook(Box::new(|_| {}));
    let files = [pictures(), textures(), image_based_lights(), coefficients()].concat();
    let outcome = std::panic::catch_unwind(|| {
        for (name, bytes) in &files {
            for position in 0..bytes.len().min(420) {
                for value in [0x00, 0x7f, 0x80, 0xff] {
                    let mut damaged = bytes.clone();
                    damaged[position] = value;
                    within_limits(&format!("{name}, byte {position} = {value:#x}"), || {
                        decode_all(&damaged);
                        decode_coefficients(&damaged);
                    });
                }
            }
        }
    });
    let _ = std::panic::take_hook();
    // The hook said nothing of it.
    if let Err(panic) = outcome {
        panic!("{:?}", panic.downcast_ref::<String>());
    }
}
