//! KTX2 and DDS against other people's parsers, and against the bytes that the specifications name.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;

use containers::{
    ErrorKind, Precision, TexelFormat, Texture, is_texture, read_dds, read_ktx2, read_recipe, read_texture,
    texture_sidecar, write_dds, write_ktx2, write_ktx2_zstd,
};
use half::f16;
use ktx2::dfd::Basic;
use ktx2::{ColorModel, ColorPrimaries, TransferFunction};

/// Values that a half holds exactly, different everywhere.
fn texture(width: usize, height: usize, depth: usize, layers: usize, faces: usize) -> Texture {
    let mut texture = Texture { width, height, depth, layers, faces, ..Texture::default() };
    let count = texture.level_len(0).unwrap();
    texture.pixels = (0..count).map(|i| [i as f32, -0.5 * i as f32, 0.25]).collect();
    texture
}

/// Every type that is written.
fn textures() -> [(&'static str, Texture); 7] {
    [
        ("2D", texture(5, 3, 1, 0, 1)),
        ("2D array", texture(5, 3, 1, 4, 1)),
        ("2D array of one", texture(5, 3, 1, 1, 1)),
        ("cube", texture(3, 3, 1, 0, 6)),
        ("cube array", texture(3, 3, 1, 9, 6)),
        ("volume", texture(5, 3, 4, 0, 1)),
        ("one pixel", texture(1, 1, 1, 0, 1)),
    ]
}

const BOTH: [Precision; 2] = [Precision::Half, Precision::Float];

/// RGBA of packed pixels, little endian.
fn rgba(data: &[u8], precision: Precision) -> Vec<[f32; 4]> {
    let values: Vec<f32> = match precision {
        Precision::Float => {
            data.chunks_exact(4).map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap())).collect()
        }
        Precision::Half => {
            data.chunks_exact(2).map(|bytes| f16::from_le_bytes(bytes.try_into().unwrap()).to_f32()).collect()
        }
    };
    values.chunks_exact(4).map(|rgba| rgba.try_into().unwrap()).collect()
}

fn opaque(texture: &Texture) -> Vec<[f32; 4]> {
    texture.pixels.iter().map(|[r, g, b]| [*r, *g, *b, 1.0]).collect()
}

#[test]
fn the_ktx2_crate_reads_every_type() {
    for (name, texture) in textures() {
        for precision in BOTH {
            let metadata = [("specula.view", "local"), ("a", ""), ("größe", "ja")];
            let file = write_ktx2(&texture, precision, Some(r#"{"kind":"x"}"#), &metadata).unwrap();
            let reader = ktx2::Reader::new(&file.bytes[..]).unwrap();
            let header = reader.header();
            let (format, size) = match precision {
                Precision::Half => (ktx2::Format::R16G16B16A16_SFLOAT, 2),
                Precision::Float => (ktx2::Format::R32G32B32A32_SFLOAT, 4),
            };
            assert_eq!((header.format, header.type_size), (Some(format), size), "{name}");
            let volume = texture.depth > 1;
            // The table of texture types: depth 0 but for volumes, layers 0 but for arrays.
            let shape = [
                header.pixel_width,
                header.pixel_height,
                header.pixel_depth,
                header.layer_count,
                header.face_count,
                header.level_count,
            ];
            let depth = if volume { texture.depth } else { 0 };
            let expected = [texture.width, texture.height, depth, texture.layers, texture.faces, 1];
            assert_eq!(shape.map(|size| size as usize), expected, "{name}");
            assert!(header.supercompression_scheme.is_none());
            let levels: Vec<_> = reader.levels().collect();
            assert_eq!(levels.len(), 1);
            assert_eq!(levels[0].uncompressed_byte_length as usize, levels[0].data.len());
            assert_eq!(rgba(levels[0].data, precision), opaque(&texture), "{name}");

            // The descriptor is the one that the crate makes of the format itself.
            let (basic, type_size) = Basic::from_format(format).unwrap();
            assert_eq!((reader.basic_dfd().unwrap(), size), (&basic, type_size), "{name}");
            assert_eq!(reader.dfd_blocks().len(), 1);
            assert_eq!(reader.color_model(), Some(ColorModel::RGBSDA));
            assert_eq!(reader.color_primaries(), Some(ColorPrimaries::BT709));
            assert_eq!(reader.transfer_function(), Some(TransferFunction::Linear));
            assert_eq!(reader.is_alpha_premultiplied(), Some(false));

            let entries: Vec<_> = reader
                .key_value_data()
                .map(|(key, value)| (key, std::str::from_utf8(value).unwrap()))
                .collect();
            let orientation = if volume { "rdi\0" } else { "rd\0" };
            assert_eq!(
                entries,
                [
                    ("KTXorientation", orientation),
                    ("KTXwriter", "specula\0"),
                    ("a", "\0"),
                    ("größe", "ja\0"),
                    ("specula", "{\"kind\":\"x\"}\0"),
                    ("specula.view", "local\0"),
                ],
                "{name}"
            );
            assert_eq!(read_recipe(&file.bytes).as_deref(), Some("{\"kind\":\"x\"}"));
        }
    }
}

/// The places that the specification's sections Index, Key/Value Data and mipPadding fix.
#[test]
fn the_bytes_of_ktx2_are_those_of_the_specification() {
    let bytes = write_ktx2(&texture(3, 3, 1, 2, 6), Precision::Float, None, &[("k", "v")]).unwrap().bytes;
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let long = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    assert_eq!(bytes[..12], [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a]);
    let header: Vec<u32> = (0..9).map(|i| word(12 + 4 * i)).collect();
    assert_eq!(header, [109, 4, 3, 3, 0, 2, 6, 1, 0]);
    // KTXorientation: 15 + 3 bytes, and 2 of padding; KTXwriter: 10 + 8, and 2; k: 2 + 2.
    let key_values = (4 + 18 + 2) + (4 + 18 + 2) + (4 + 4);
    assert_eq!([word(48), word(52), word(56), word(60)], [104, 92, 196, key_values]);
    assert_eq!([long(64), long(72)], [0, 0]);
    assert_eq!(word(104), 92);
    assert_eq!(word(196), 18);
    assert_eq!(&bytes[200..220], b"KTXorientation\0rd\0\0\0");
    assert_eq!(&bytes[224..244], b"KTXwriter\0specula\0\0\0");
    assert_eq!(word(244), 4);
    assert_eq!(&bytes[248..252], b"k\0v\0");
    // lcm(16, 4) = 16: 252 is padded to 256.
    let size = 2 * 6 * 9 * 16;
    assert_eq!([long(80), long(88), long(96)], [256, size, size]);
    assert_eq!(bytes[252..256], [0; 4]);
    assert_eq!(bytes.len() as u64, 256 + size);
}

#[test]
fn the_ddsfile_crate_reads_every_type() {
    use ddsfile::{AlphaMode, Caps, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, MiscFlag};
    for (name, texture) in textures() {
        for precision in BOTH {
            let file = write_dds(&texture, precision).unwrap();
            let dds = Dds::read(Cursor::new(&file.bytes)).unwrap();
            let header10 = dds.header10.as_ref().unwrap();
            let (format, bits) = match precision {
                Precision::Half => (DxgiFormat::R16G16B16A16_Float, 64),
                Precision::Float => (DxgiFormat::R32G32B32A32_Float, 128),
            };
            assert_eq!((dds.get_dxgi_format(), dds.get_bits_per_pixel()), (Some(format), Some(bits)));
            let (volume, cube) = (texture.depth > 1, texture.faces == 6);
            let size = [dds.get_width(), dds.get_height(), dds.get_depth()].map(|size| size as usize);
            assert_eq!(size, [texture.width, texture.height, texture.depth], "{name}");
            assert_eq!(dds.get_pitch().unwrap() as usize, texture.width * bits as usize / 8);
            assert_eq!(dds.header.pitch, dds.get_pitch());
            assert_eq!(dds.get_num_mipmap_levels(), 1);
            // For a cube, the number of cubes.
            assert_eq!(header10.array_size as usize, texture.layers.max(1));
            assert_eq!(header10.alpha_mode, AlphaMode::Opaque);
            assert_eq!(header10.misc_flag.contains(MiscFlag::TEXTURECUBE), cube);
            let dimension =
                if volume { D3D10ResourceDimension::Texture3D } else { D3D10ResourceDimension::Texture2D };
            assert_eq!(header10.resource_dimension, dimension);
            assert!(dds.header.caps.contains(Caps::TEXTURE));
            assert_eq!(dds.header.caps.contains(Caps::COMPLEX), volume || cube || texture.layers > 1);
            assert_eq!(dds.header.caps2.contains(Caps2::VOLUME), volume);
            assert_eq!(dds.header.caps2.contains(Caps2::CUBEMAP | Caps2::CUBEMAP_ALLFACES), cube);
            assert_eq!(rgba(&dds.data, precision), opaque(&texture), "{name}");
        }
    }
}

#[test]
fn what_is_written_is_read() {
    for (name, texture) in textures() {
        for precision in BOTH {
            let ktx2 = write_ktx2(&texture, precision, Some("{}"), &[("k", "v")]).unwrap().bytes;
            assert!(read_ktx2(&ktx2).unwrap() == texture, "{name}");
            let file = read_texture(&ktx2).unwrap();
            assert_eq!((file.container, file.format), ("KTX2", precision.into()));
            assert_eq!((file.metadata["k"].as_str(), file.metadata["KTXwriter"].as_str()), ("v", "specula"));
            let dds = write_dds(&texture, precision).unwrap().bytes;
            let found = read_dds(&dds).unwrap();
            // An array of one looks like no array in DDS.
            let layers = if texture.layers == 1 { 0 } else { texture.layers };
            assert!(found == Texture { layers, ..texture.clone() }, "{name}");
            assert!(is_texture(&dds) && is_texture(&ktx2));
            assert!(read_ktx2(&dds).is_err() && read_dds(&ktx2).is_err() && read_recipe(&dds).is_none());
        }
    }
}

/// A cube with levels of detail down to one texel, smooth enough for blocks.
fn cube_with_levels(edge: usize) -> Texture {
    let level = |edge: usize| -> Vec<[f32; 3]> {
        let texel = |i: usize| {
            let (row, column) = (i / edge % edge, i % edge);
            let share = (row + column) as f32 / (2 * edge) as f32;
            [1.0 + share, 2.0 - share, 0.5 + 0.25 * share]
        };
        (0..6 * edge * edge).map(texel).collect()
    };
    let smaller_levels = (1..=edge.ilog2()).map(|l| level(edge >> l)).collect();
    Texture { width: edge, height: edge, faces: 6, pixels: level(edge), smaller_levels, ..Texture::default() }
}

/// The largest difference in relation to what was given; blue is not kept by two channels.
fn largest_difference(found: &Texture, given: &Texture, format: TexelFormat) -> f32 {
    assert_eq!(found.levels().len(), given.levels().len());
    let channels = if format == TexelFormat::Rg16F { 2 } else { 3 };
    let mut most = 0.0_f32;
    for (found, given) in found.levels().flatten().zip(given.levels().flatten()) {
        for channel in 0..channels {
            most = most.max((found[channel] / given[channel] - 1.0).abs());
        }
    }
    most
}

#[test]
fn every_format_keeps_its_levels() {
    let cube = cube_with_levels(16);
    for format in TexelFormat::ALL {
        // Half of the last of 11, 24, 9, 6 and 5 bits; blocks hold a line of colours.
        let most = match format {
            TexelFormat::Rgba32F => 0.0,
            TexelFormat::Rgba16F | TexelFormat::Rg16F => 0.0005,
            TexelFormat::Rgb9E5 => 0.004,
            TexelFormat::R11G11B10F => 0.016,
            TexelFormat::Bc6h => 0.02,
            other => panic!("{other:?} is not written"),
        };
        let plain = write_ktx2(&cube, format, Some("{}"), &[]).unwrap().bytes;
        let small = write_ktx2_zstd(&cube, format, Some("{}"), &[]).unwrap().bytes;
        let dds = write_dds(&cube, format).unwrap().bytes;
        for bytes in [&plain, &small, &dds] {
            let file = read_texture(bytes).unwrap();
            assert_eq!(file.format, format);
            let difference = largest_difference(&file.texture, &cube, format);
            assert!(difference <= most, "{format:?}: {difference}");
        }
        assert_eq!(read_ktx2(&plain).unwrap(), read_ktx2(&small).unwrap());
        assert!(small.len() < plain.len(), "{format:?}: {} {}", small.len(), plain.len());
        assert_eq!(read_recipe(&small).as_deref(), Some("{}"));
    }
}

/// Of packed formats the crates know the size, the levels and the descriptor, not the texels.
#[test]
fn other_crates_read_every_format() {
    use ddsfile::{Dds, DxgiFormat};
    use ktx2::{Format, SupercompressionScheme};
    let cube = cube_with_levels(16);
    for (format, known, dxgi) in [
        (TexelFormat::Rgba16F, Format::R16G16B16A16_SFLOAT, DxgiFormat::R16G16B16A16_Float),
        (TexelFormat::Rgba32F, Format::R32G32B32A32_SFLOAT, DxgiFormat::R32G32B32A32_Float),
        (TexelFormat::Rg16F, Format::R16G16_SFLOAT, DxgiFormat::R16G16_Float),
        (TexelFormat::Rgb9E5, Format::E5B9G9R9_UFLOAT_PACK32, DxgiFormat::R9G9B9E5_SharedExp),
        (TexelFormat::R11G11B10F, Format::B10G11R11_UFLOAT_PACK32, DxgiFormat::R11G11B10_Float),
        (TexelFormat::Bc6h, Format::BC6H_UFLOAT_BLOCK, DxgiFormat::BC6H_UF16),
    ] {
        for (bytes, scheme) in [
            (write_ktx2(&cube, format, None, &[]).unwrap().bytes, None),
            (
                write_ktx2_zstd(&cube, format, None, &[]).unwrap().bytes,
                Some(SupercompressionScheme::Zstandard),
            ),
        ] {
            let reader = ktx2::Reader::new(&bytes[..]).unwrap();
            let header = reader.header();
            assert_eq!((header.format, header.level_count, header.face_count), (Some(known), 5, 6));
            assert_eq!(header.supercompression_scheme, scheme);
            let (basic, type_size) = Basic::from_format(known).unwrap();
            assert_eq!((reader.basic_dfd().unwrap(), header.type_size), (&basic, type_size), "{format:?}");
            let sizes: Vec<_> = reader.levels().map(|level| level.uncompressed_byte_length).collect();
            assert!(sizes.is_sorted_by(|a, b| a >= b), "{sizes:?}");
        }
        let bytes = write_dds(&cube, format).unwrap().bytes;
        let dds = Dds::read(Cursor::new(&bytes)).unwrap();
        assert_eq!((dds.get_dxgi_format(), dds.get_num_mipmap_levels()), (Some(dxgi), 5));
        // The crate cuts the data into faces, each with all its levels.
        let faces: Vec<_> = (0..6).map(|face| dds.get_data(face).unwrap()).collect();
        assert!(faces.iter().all(|face| face.len() == dds.data.len() / 6));
        assert_eq!(faces[2], faces[5]);
    }
}

#[test]
fn a_texel_that_is_not_finite_is_found() {
    let mut cube = cube_with_levels(4);
    assert_eq!(cube.first_not_finite(), None);
    cube.smaller_levels[0][4 + 2][1] = f32::NAN;
    assert_eq!(cube.first_not_finite().unwrap(), "level 1, face -X, row 1, column 0");
    cube.pixels[3 * 16 + 7][0] = f32::INFINITY;
    assert_eq!(cube.first_not_finite().unwrap(), "level 0, face -Y, row 1, column 3");
}

#[test]
fn what_zstandard_gives_must_be_what_the_sizes_say() {
    let bytes = write_ktx2_zstd(&cube_with_levels(4), TexelFormat::Rgb9E5, None, &[]).unwrap().bytes;
    let error = |at: usize, value: u64| {
        let mut changed = bytes.clone();
        changed[at..at + 8].copy_from_slice(&value.to_le_bytes());
        read_ktx2(&changed).unwrap_err().to_string()
    };
    // The level index: offset, length and uncompressed length of level 0.
    assert!(error(96, 1 << 40).contains("declares 1099511627776 bytes for level 0; the sizes make 384"));
    assert!(error(88, 3).contains("level 0 at byte "), "{}", error(88, 3));
    assert!(error(80, u64::MAX).contains("past the file's"));
    // 4096 x 4096 texels, in a file of some hundred bytes.
    let mut bomb = bytes.clone();
    bomb[20..24].copy_from_slice(&4096_u32.to_le_bytes());
    bomb[24..28].copy_from_slice(&4096_u32.to_le_bytes());
    bomb[40..44].copy_from_slice(&1_u32.to_le_bytes());
    bomb[96..104].copy_from_slice(&(6_u64 << 26).to_le_bytes());
    let found = read_ktx2(&bomb).unwrap_err().to_string();
    assert!(found.contains("more than a file of"), "{found}");
}

#[test]
fn values_past_the_largest_half_are_clamped() {
    let mut bright = texture(2, 1, 1, 0, 1);
    bright.pixels = vec![[7e4, -1e9, f32::INFINITY], [65504.0, 1e-9, f32::NAN]];
    for (file, read) in [
        (write_ktx2(&bright, Precision::Half, None, &[]).unwrap(), read_ktx2 as fn(&[u8]) -> _),
        (write_dds(&bright, Precision::Half).unwrap(), read_dds),
    ] {
        let found = read(&file.bytes).unwrap().pixels;
        assert_eq!(found[0], [65504.0, -65504.0, 65504.0]);
        assert!(found[1][0] == 65504.0 && found[1][1] == 0.0 && found[1][2].is_nan());
    }
}

#[test]
fn impossible_textures_and_texts_are_refused() {
    let message = |texture: &Texture| {
        let found = write_ktx2(texture, Precision::Half, None, &[]).unwrap_err();
        assert_eq!(found.kind(), ErrorKind::Unwritable);
        assert_eq!(write_dds(texture, Precision::Half).unwrap_err().kind(), ErrorKind::Unwritable);
        found.to_string()
    };
    let good = texture(2, 2, 1, 0, 1);
    assert!(message(&Texture { faces: 3, ..good.clone() }).contains("a texture has 1 or 6 faces"));
    assert!(message(&Texture { width: 1, faces: 6, ..good.clone() }).contains("faces of a cube are square"));
    assert!(message(&Texture { depth: 2, layers: 2, ..good.clone() }).contains("neither layers nor faces"));
    assert!(message(&Texture { height: 0, ..good.clone() }).contains("no size may be 0"));
    assert!(message(&Texture { layers: usize::MAX, ..good.clone() }).contains("at most"));
    assert!(
        message(&Texture { layers: 2, ..good.clone() })
            .contains("expected 8 pixels as the sizes say, found 4")
    );
    for metadata in [
        vec![("KTXswizzle", "rgb1")],
        vec![("", "x")],
        vec![("a", "1"), ("a", "2")],
        vec![("a", "line\nbreak")],
        vec![("specula", "{}")],
    ] {
        let found = write_ktx2(&good, Precision::Half, Some("{}"), &metadata).unwrap_err();
        assert_eq!(found.kind(), ErrorKind::Unwritable, "{metadata:?}");
    }
}

#[test]
fn foreign_textures_are_refused_with_what_they_are() {
    let ktx2 = write_ktx2(&texture(2, 2, 1, 0, 1), Precision::Half, None, &[]).unwrap().bytes;
    let dds = write_dds(&texture(2, 2, 1, 0, 1), Precision::Half).unwrap().bytes;
    let changed = |bytes: &[u8], at: usize, value: u32| {
        let mut changed = bytes.to_vec();
        changed[at..at + 4].copy_from_slice(&value.to_le_bytes());
        read_texture(&changed).unwrap_err()
    };
    for (bytes, at, value, kind, message) in [
        (&ktx2, 12, 10, ErrorKind::Unsupported, "VkFormat 10 is not read"),
        (&ktx2, 12, 0, ErrorKind::Unsupported, "VkFormat 0 (Basis Universal (UASTC or ETC1S)) is not read"),
        (&ktx2, 12, 145, ErrorKind::Unsupported, "VkFormat 145 (BC7) is not read"),
        (&ktx2, 12, 157, ErrorKind::Unsupported, "VkFormat 157 (ASTC) is not read"),
        (&ktx2, 44, 1, ErrorKind::Unsupported, "supercompression scheme 1 (BasisLZ) is not read"),
        (&ktx2, 40, 3, ErrorKind::Damaged, "3 levels of detail, but the sizes halve to 1 in 2"),
        (&ktx2, 24, 0, ErrorKind::Unsupported, "one dimension"),
        (&ktx2, 36, 5, ErrorKind::Damaged, "a texture has 1 or 6 faces"),
        (&ktx2, 20, 3, ErrorKind::Damaged, "declares 32 bytes for level 0; the sizes make 48"),
        (&ktx2, 20, u32::MAX, ErrorKind::TooLarge, "at most"),
        (&ktx2, 60, 1 << 20, ErrorKind::Damaged, "key/value data"),
        (&dds, 128, 98, ErrorKind::Unsupported, "DXGI format 98 (BC7) is not read"),
        (&dds, 84, u32::from_le_bytes(*b"DXT1"), ErrorKind::Unsupported, "DX10"),
        (&dds, 28, 2, ErrorKind::Truncated, "expected 40 bytes of pixels, found 32"),
        (&dds, 28, 3, ErrorKind::Damaged, "3 levels of detail, but the sizes halve to 1 in 2"),
        (&dds, 16, 1, ErrorKind::Damaged, "expected 16 bytes of pixels, found 32"),
        (&dds, 16, 3, ErrorKind::Truncated, "expected 48 bytes of pixels, found 32"),
    ] {
        let error = changed(bytes, at, value);
        assert!(error.to_string().contains(message), "{error}");
        assert_eq!(error.kind(), kind, "{error}");
    }
    assert_eq!(read_texture(b"PK").unwrap_err().kind(), ErrorKind::UnknownFormat);
    assert_eq!(read_texture(b"").unwrap_err().kind(), ErrorKind::Empty);
}

/// A picture of 2 x 1 texels in each format that is read only, its bytes by hand.
#[test]
fn formats_of_others_are_read() {
    // A DDS file has one row of two texels of 8 bytes, a KTX2 file the same behind all else.
    let picture = Texture { width: 2, height: 1, pixels: vec![[1.0; 3]; 2], ..Texture::default() };
    let dds = |format: u32, bytes: &[u8]| {
        let mut file = write_dds(&picture, Precision::Half).unwrap().bytes;
        file.truncate(file.len() - 16);
        file[128..132].copy_from_slice(&format.to_le_bytes());
        [file, bytes.to_vec()].concat()
    };
    let ktx2 = |format: u32, bytes: &[u8]| {
        let mut file = write_ktx2(&picture, Precision::Half, None, &[]).unwrap().bytes;
        file.truncate(file.len() - 16);
        file[12..16].copy_from_slice(&format.to_le_bytes());
        for at in [88, 96] {
            file[at..at + 8].copy_from_slice(&(bytes.len() as u64).to_le_bytes());
        }
        [file, bytes.to_vec()].concat()
    };
    let halves: Vec<u8> = [1.0_f32, -2.0, 0.5, 4.0, 8.0, 16.0]
        .iter()
        .flat_map(|value| half::f16::from_f32(*value).to_le_bytes())
        .collect();
    let floats: Vec<u8> =
        [1.0_f32, -2.0, 0.5, 4.0, 8.0, 16.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let numbers = [[1.0, -2.0, 0.5], [4.0, 8.0, 16.0]];
    let bytes = [255, 188, 0, 255, 0, 51, 255, 0];
    // IEC 61966-2-1: ((188 / 255 + 0.055) / 1.055)^2.4 and so on.
    let (grey, dark) = (0.502_886_5, 0.033_104_77);
    let (rgb, bgr) = ([[1.0, grey, 0.0], [0.0, dark, 1.0]], [[0.0, grey, 1.0], [1.0, dark, 0.0]]);
    let linear = [[1.0, 188.0 / 255.0, 0.0], [0.0, 0.2, 1.0]];
    for (file, expected) in [
        (ktx2(90, &halves), numbers),
        (ktx2(106, &floats), numbers),
        (ktx2(37, &bytes), linear),
        (ktx2(43, &bytes), rgb),
        (ktx2(50, &bytes), bgr),
        (ktx2(29, &[255, 188, 0, 0, 51, 255]), rgb),
        (ktx2(9, &[255, 51]), [[1.0, 0.0, 0.0], [0.2, 0.0, 0.0]]),
        (dds(6, &floats), numbers),
        (dds(61, &[255, 51]), [[1.0, 0.0, 0.0], [0.2, 0.0, 0.0]]),
        // Bytes in a DDS are sRGB's, whether it says so or not.
        (dds(28, &bytes), rgb),
        (dds(29, &bytes), rgb),
        (dds(87, &bytes), bgr),
        (dds(91, &bytes), bgr),
    ] {
        let found = read_texture(&file).unwrap();
        for (found, expected) in found.texture.pixels.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-6, "{:?}: {found}, expected {expected}", found);
        }
    }
    // The transfer function of a KTX2 file's descriptor, at byte 14 of it, counts too.
    let mut file = ktx2(37, &bytes);
    let descriptor = u32::from_le_bytes(file[48..52].try_into().unwrap()) as usize;
    file[descriptor + 14] = 2;
    assert!((read_texture(&file).unwrap().texture.pixels[0][1] - grey).abs() < 1e-6);
    // Without the DX10 header, by masks.
    let mut old = dds(29, &bytes);
    old.drain(128..148);
    old[80..104].copy_from_slice(&[0x41_u32, 0, 32, 0xff_0000, 0xff00, 0xff].map(u32::to_le_bytes).concat());
    assert!((read_texture(&old).unwrap().texture.pixels[1][0] - 1.0).abs() < 1e-6);
    let light = containers::read_light_texture(&old, &Default::default()).unwrap();
    assert!(light.warnings[0].contains("DDS of 8 bits holds no high dynamic range"), "{:?}", light.warnings);
    for format in [TexelFormat::Rgb16F, TexelFormat::Bc6hSigned] {
        assert_eq!(write_dds(&picture, format).unwrap_err().kind(), ErrorKind::Unwritable);
    }
}

/// A level that is compressed with zlib (here in a stored block, RFC 1950 and 1951, with its Adler-32).
#[test]
fn zlib_is_read() {
    let picture = Texture { width: 2, height: 1, pixels: vec![[1.0, 2.0, 4.0]; 2], ..Texture::default() };
    let mut file = write_ktx2(&picture, Precision::Half, None, &[]).unwrap().bytes;
    let raw = file.split_off(file.len() - 16);
    let (a, b) = raw.iter().fold((1_u32, 0), |(a, b), byte| {
        let a = (a + u32::from(*byte)) % 65_521;
        (a, (b + a) % 65_521)
    });
    let stored = [&[0x78, 0x01, 0x01, 16, 0, 239, 255][..], &raw, &(b << 16 | a).to_be_bytes()].concat();
    file[44] = 3;
    file[88..96].copy_from_slice(&(stored.len() as u64).to_le_bytes());
    file.extend(stored);
    assert_eq!(read_texture(&file).unwrap().texture, picture);
    let end = file.len() - 8;
    file[end] ^= 1;
    assert!(read_texture(&file).unwrap_err().to_string().contains("zlib"));
}

#[test]
fn a_sidecar_is_json_with_the_recipe() {
    let bytes = texture_sidecar(Some(r#"{"kind":"x","b":1}"#), &[("view", "say \"local\"")]).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!((&json["specula"]["kind"], &json["view"]), (&"x".into(), &"say \"local\"".into()));
    assert_eq!(read_recipe(&bytes).as_deref(), Some(r#"{"kind":"x","b":1}"#));
    assert!(texture_sidecar(Some("no json"), &[]).is_err());
    assert!(texture_sidecar(Some("{}"), &[("specula", "x")]).is_err());
}
