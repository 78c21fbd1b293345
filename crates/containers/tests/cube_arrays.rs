//! Arrays of cubes with levels of detail, and small tables of four channels, as a graphics device takes them:
//! read again, and by other people's parsers.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;

use containers::{
    Precision, TexelFormat, Texture, read_dds, read_image, read_ktx2, read_recipe, read_texture, write_dds,
    write_dds_rgba, write_exr_rgba, write_ktx2, write_ktx2_rgba, write_ktx2_zstd,
};
use half::f16;

const LAYERS: usize = 4;
const EDGE: usize = 64;
const LEVELS: usize = 6;

const FORMATS: [TexelFormat; 4] =
    [TexelFormat::Rgb9E5, TexelFormat::Bc6h, TexelFormat::Rgba16F, TexelFormat::Rgba32F];

/// The texel of a face of a layer of a level, which no other place has: a gradient across a face.
fn texel(level: usize, image: usize, row: usize, column: usize) -> [f32; 3] {
    let edge = (EDGE >> level) as f32;
    let across = (row as f32 + 2.0 * column as f32) / (3.0 * edge);
    let bright = f32::powi(1.5, (4 * image / 24 + level) as i32) * (1.0 + (image % 6) as f32);
    [bright * (1.0 + across), bright, bright * (2.0 - across)]
}

/// Four cubes of 64^2 texels with levels down to 2^2.
fn cubes() -> Texture {
    let level = |level: usize| -> Vec<[f32; 3]> {
        let edge = EDGE >> level;
        let at = |index: usize| texel(level, index / (edge * edge), index / edge % edge, index % edge);
        (0..LAYERS * 6 * edge * edge).map(at).collect()
    };
    Texture {
        width: EDGE,
        height: EDGE,
        layers: LAYERS,
        faces: 6,
        pixels: level(0),
        smaller_levels: (1..LEVELS).map(level).collect(),
        ..Texture::default()
    }
}

/// Whether a texel is as near as a format allows.
#[track_caller]
fn check_texel(format: TexelFormat, found: [f32; 3], given: [f32; 3]) {
    let largest = given[0].max(given[2]);
    for (found, given) in found.iter().zip(given) {
        let is_near = match format {
            TexelFormat::Rgba32F => *found == given,
            TexelFormat::Rgba16F => (found / given - 1.0).abs() <= 1.0 / 2048.0,
            // Half a step of the largest, whose mantissa is 256 at least.
            TexelFormat::Rgb9E5 => (found - given).abs() <= largest / 512.0 * 1.0001,
            // A block of the last levels spans the whole gradient, of a stop in red and in blue.
            TexelFormat::Bc6h => (found / given).log2().abs() < 0.08,
            other => panic!("how exact is {other:?}?"),
        };
        assert!(is_near, "{format:?}: {found} instead of {given}");
    }
}

/// The colour of texels without blocks, by the specifications' formulas.
fn decoded(format: TexelFormat, bytes: &[u8]) -> [f32; 3] {
    let half = |at: usize| f16::from_le_bytes([bytes[at], bytes[at + 1]]).to_f32();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    match format {
        TexelFormat::Rgba32F => [0, 4, 8].map(|at| f32::from_bits(word(at))),
        TexelFormat::Rgba16F => [0, 2, 4].map(half),
        // EXT_texture_shared_exponent: mantissa 2^(exponent - bias - mantissa bits).
        TexelFormat::Rgb9E5 => {
            let scale = f32::powi(2.0, (word(0) >> 27) as i32 - 15 - 9);
            [0, 9, 18].map(|shift| (word(0) >> shift & 511) as f32 * scale)
        }
        other => panic!("{other:?} has blocks"),
    }
}

/// The colours of one face of `edge`^2 texels, by a decoder of blocks or by [`decoded`].
fn face(format: TexelFormat, edge: usize, bytes: &[u8]) -> Vec<[f32; 3]> {
    if format != TexelFormat::Bc6h {
        return bytes.chunks_exact(bytes.len() / (edge * edge)).map(|texel| decoded(format, texel)).collect();
    }
    let columns = edge.div_ceil(4);
    let mut texels = vec![[0.0; 3]; edge * edge];
    for (index, block) in bytes.chunks_exact(16).enumerate() {
        let mut colours = [0.0; 48];
        bcdec_rs::bc6h_float(block, &mut colours, 12, false);
        for (at, colour) in colours.as_chunks::<3>().0.iter().enumerate() {
            let (row, column) = (index / columns * 4 + at / 4, index % columns * 4 + at % 4);
            if row < edge && column < edge {
                texels[row * edge + column] = *colour;
            }
        }
    }
    texels
}

/// The bytes of a face. Blocks past the edge of a small face are padded.
fn face_bytes(format: TexelFormat, level: usize) -> usize {
    let edge = EDGE >> level;
    match format {
        TexelFormat::Bc6h => edge.div_ceil(4).pow(2) * 16,
        TexelFormat::Rgba32F => edge * edge * 16,
        TexelFormat::Rgba16F => edge * edge * 8,
        _ => edge * edge * 4,
    }
}

#[test]
fn cube_arrays_with_levels_come_back_from_every_container() {
    let cubes = cubes();
    let std = "[0.0375, 0.0446, 0.053, 0.0631]";
    let metadata = [("specula.std", std), ("specula.per-octave", "4")];
    for format in FORMATS {
        let plain = write_ktx2(&cubes, format.nearest(), Some("{}"), &metadata).unwrap().bytes;
        let small = write_ktx2_zstd(&cubes, format.nearest(), Some("{}"), &metadata).unwrap().bytes;
        let dds = write_dds(&cubes, format.nearest()).unwrap().bytes;
        for bytes in [&plain, &small, &dds] {
            let file = read_texture(bytes).unwrap();
            assert_eq!(file.format, format);
            let found = &file.texture;
            assert_eq!((found.layers, found.faces, found.levels().len()), (LAYERS, 6, LEVELS));
            for (found, given) in found.levels().zip(cubes.levels()) {
                assert_eq!(found.len(), given.len());
                found.iter().zip(given).for_each(|(found, given)| check_texel(format, *found, *given));
            }
            if file.container == "KTX2" {
                assert_eq!(file.metadata["specula.std"], std);
                assert_eq!(
                    serde_json::from_str::<Vec<f64>>(&file.metadata["specula.std"]).unwrap()[1],
                    0.0446
                );
                assert_eq!(read_recipe(bytes).as_deref(), Some("{}"));
            }
        }
        assert!(read_ktx2(&plain).unwrap() == read_ktx2(&small).unwrap());
        assert!(read_ktx2(&plain).unwrap() == read_dds(&dds).unwrap(), "{format:?}");
        assert!(small.len() < plain.len());
    }
}

/// Each level holds layer after layer, each layer its faces.
#[test]
fn the_ktx2_crate_reads_every_face_of_every_layer() {
    let cubes = cubes();
    for format in FORMATS {
        let bytes = write_ktx2(&cubes, format.nearest(), None, &[("specula.std", "[1]")]).unwrap().bytes;
        let reader = ktx2::Reader::new(&bytes[..]).unwrap();
        let header = reader.header();
        let shape = [header.layer_count, header.face_count, header.level_count, header.pixel_depth];
        assert_eq!(shape, [4, 6, 6, 0]);
        assert_eq!(reader.levels().len(), LEVELS);
        for (level, stored) in reader.levels().enumerate() {
            let (edge, length) = (EDGE >> level, face_bytes(format, level));
            assert_eq!(stored.data.len(), LAYERS * 6 * length, "{format:?} level {level}");
            for (image, bytes) in stored.data.chunks_exact(length).enumerate() {
                for (index, found) in face(format, edge, bytes).into_iter().enumerate() {
                    check_texel(format, found, texel(level, image, index / edge, index % edge));
                }
            }
        }
        assert!(reader.key_value_data().any(|(key, value)| (key, value) == ("specula.std", b"[1]\0")));
    }
}

/// Each face of a layer holds all its levels.
#[test]
fn the_ddsfile_crate_reads_every_face_of_every_layer() {
    let cubes = cubes();
    for format in FORMATS {
        let bytes = write_dds(&cubes, format.nearest()).unwrap().bytes;
        let dds = ddsfile::Dds::read(Cursor::new(&bytes)).unwrap();
        let header = dds.header10.as_ref().unwrap();
        // The number of cubes.
        assert_eq!((header.array_size as usize, dds.get_num_mipmap_levels() as usize), (LAYERS, LEVELS));
        assert!(header.misc_flag.contains(ddsfile::MiscFlag::TEXTURECUBE));
        let mut rest = &dds.data[..];
        for image in 0..LAYERS * 6 {
            for level in 0..LEVELS {
                let (bytes, after) = rest.split_at(face_bytes(format, level));
                let edge = EDGE >> level;
                for (index, found) in face(format, edge, bytes).into_iter().enumerate() {
                    check_texel(format, found, texel(level, image, index / edge, index % edge));
                }
                rest = after;
            }
        }
        assert!(rest.is_empty());
    }
}

/// Numbers of which every fourth is no opacity, exact in halves.
fn table(width: usize, height: usize) -> Vec<[f32; 4]> {
    let row = |index: usize| [index as f32, -0.25 * index as f32, 0.5, -1.0 - (index % 7) as f32];
    (0..width * height).map(row).collect()
}

#[test]
fn tables_of_four_channels_keep_every_number() {
    let (width, height) = (65, 12);
    let table = table(width, height);
    let sizes = Texture { width, height, ..Texture::default() };
    let colours: Vec<[f32; 3]> = table.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let numbers = |bytes: &[u8], precision: Precision| -> Vec<f32> {
        match precision {
            Precision::Float => bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
            Precision::Half => {
                bytes.as_chunks().0.iter().map(|bytes| f16::from_le_bytes(*bytes).to_f32()).collect()
            }
        }
    };
    for precision in [Precision::Half, Precision::Float] {
        let metadata = [("specula.taps", "6")];
        let ktx2 = write_ktx2_rgba(&sizes, &table, precision, Some("{}"), &metadata).unwrap().bytes;
        let reader = ktx2::Reader::new(&ktx2[..]).unwrap();
        let stored = reader.levels().next().unwrap();
        assert_eq!(numbers(stored.data, precision), table.as_flattened());
        assert_eq!(read_texture(&ktx2).unwrap().metadata["specula.taps"], "6");

        let dds = write_dds_rgba(&sizes, &table, precision).unwrap().bytes;
        let reader = ddsfile::Dds::read(Cursor::new(&dds)).unwrap();
        assert_eq!(numbers(&reader.data, precision), table.as_flattened());
        assert_eq!(reader.header10.unwrap().alpha_mode, ddsfile::AlphaMode::Custom);
        for bytes in [&ktx2, &dds] {
            let found = read_texture(bytes).unwrap().texture;
            assert_eq!((found.width, found.height), (width, height));
            assert!(found.pixels == colours);
        }

        let exr = write_exr_rgba(width, height, &table, precision, Some("{}"), &metadata).unwrap().bytes;
        assert_eq!(read_recipe(&exr).as_deref(), Some("{}"));
        assert!(read_image(&exr, &Default::default()).unwrap().image.pixels() == colours);
        check_exr(&exr, &table);
    }
    let few = write_exr_rgba(width, height, &table[1..], Precision::Half, None, &[]).unwrap_err();
    assert!(few.to_string().contains("expected 65 x 12 pixels, found 779"), "{few}");
    let few = write_dds_rgba(&sizes, &table[1..], Precision::Half).unwrap_err();
    assert!(few.to_string().contains("DDS: expected 780 pixels"), "{few}");
}

/// The `exr` crate's own reader finds the channels R, G, B and A.
#[track_caller]
fn check_exr(bytes: &[u8], table: &[[f32; 4]]) {
    use exr::prelude::*;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .unwrap();
    let channels = &image.layer_data.channel_data.list;
    assert_eq!(channels.len(), 4);
    for (place, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let channel = channels.iter().find(|channel| channel.name.to_string() == name).unwrap();
        let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
        assert!(values.iter().zip(table).all(|(value, texel)| *value == texel[place]), "{name}");
    }
    assert!(image.attributes.other.is_empty());
    assert!(image.layer_data.attributes.other.contains_key(&Text::new_or_panic("specula.taps")));
}
