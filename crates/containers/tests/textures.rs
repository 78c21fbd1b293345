//! KTX2, DDS and layered OpenEXR against other people's parsers, and against the bytes that the
//! specifications name.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;

use containers::{
    ErrorKind, Precision, ReadOptions, Texture, is_texture, read_dds, read_exr_layers, read_image, read_ktx2,
    read_recipe, read_texture, texture_sidecar, write_dds, write_exr_layers, write_ktx2,
};
use half::f16;
use ktx2::dfd::Basic;
use ktx2::{ColorModel, ColorPrimaries, TransferFunction};

/// Values that a half holds exactly, different everywhere.
fn texture(width: usize, height: usize, depth: usize, layers: usize, faces: usize) -> Texture {
    let mut texture = Texture { width, height, depth, layers, faces, pixels: Vec::new() };
    let count = texture.len().unwrap();
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
            assert_eq!(file.clamped, 0);
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
            assert_eq!((file.container, file.precision), ("KTX2", precision));
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

#[test]
fn values_past_the_largest_half_are_counted() {
    let mut bright = texture(2, 1, 1, 0, 1);
    bright.pixels = vec![[7e4, -1e9, f32::INFINITY], [65504.0, 1e-9, f32::NAN]];
    for (file, read) in [
        (write_ktx2(&bright, Precision::Half, None, &[]).unwrap(), read_ktx2 as fn(&[u8]) -> _),
        (write_dds(&bright, Precision::Half).unwrap(), read_dds),
    ] {
        assert_eq!(file.clamped, 3);
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
        (&ktx2, 12, 37, ErrorKind::Unsupported, "VkFormat 37 is not read"),
        (&ktx2, 44, 2, ErrorKind::Unsupported, "supercompression scheme 2"),
        (&ktx2, 24, 0, ErrorKind::Unsupported, "one dimension"),
        (&ktx2, 36, 5, ErrorKind::Damaged, "a texture has 1 or 6 faces"),
        (&ktx2, 20, 3, ErrorKind::Damaged, "declares 32 bytes; the sizes make 48"),
        (&ktx2, 20, u32::MAX, ErrorKind::TooLarge, "at most"),
        (&ktx2, 60, 1 << 20, ErrorKind::Damaged, "key/value data"),
        (&dds, 128, 98, ErrorKind::Unsupported, "DXGI format 98"),
        (&dds, 84, u32::from_le_bytes(*b"DXT1"), ErrorKind::Unsupported, "DX10"),
        (&dds, 28, 2, ErrorKind::Unsupported, "levels of detail"),
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

/// Layers whose halves are exact; the names' order in the file is not theirs here.
fn layers() -> Vec<(String, Vec<[f32; 3]>)> {
    let names = ["", "p1qm1", "p1q0", "p1q1", "p10q0"];
    let pixels = |layer: usize| (0..5 * 37).map(|i| [i as f32, layer as f32, -0.5 * i as f32]).collect();
    names.iter().enumerate().map(|(layer, name)| ((*name).to_owned(), pixels(layer))).collect()
}

#[test]
fn every_layer_is_read_again() {
    let metadata = [("specula.view", "local")];
    for precision in BOTH {
        let bytes = write_exr_layers(5, 37, &layers(), precision, Some("{}"), &metadata).unwrap().bytes;
        let found = read_exr_layers(&bytes).unwrap();
        assert_eq!((found.width, found.height, found.warnings.len()), (5, 37, 0));
        let names: Vec<&str> = found.layers.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["", "p10q0", "p1q0", "p1q1", "p1qm1"]);
        for (name, pixels) in layers() {
            let (_, same) = found.layers.iter().find(|(found, _)| *found == name).unwrap();
            assert!(*same == pixels, "{name}");
        }
        assert_eq!(found.metadata["specula.view"], "local");
        assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
        // A reader without layers sees the first; one that asks for a name sees that layer.
        let plain = read_image(&bytes, &ReadOptions::default()).unwrap();
        assert!(plain.image.pixels() == layers()[0].1.as_slice());
        let named = read_image(&bytes, &ReadOptions { layer: Some("p1qm1".into()) }).unwrap();
        assert!(named.image.pixels() == layers()[1].1.as_slice());
    }
}

/// The `exr` crate's own high-level reader: one part, whose channels are the layers'.
#[test]
fn the_exr_crate_reads_every_layer() {
    use exr::prelude::*;
    let bytes = write_exr_layers(5, 37, &layers(), Precision::Half, None, &[]).unwrap().bytes;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(&bytes))
        .unwrap();
    assert_eq!(image.layer_data.len(), 1);
    let channels = &image.layer_data[0].channel_data.list;
    assert_eq!(channels.len(), 15);
    for (name, pixels) in layers() {
        for (component, letter) in ["R", "G", "B"].into_iter().enumerate() {
            let full = if name.is_empty() { letter.to_owned() } else { format!("{name}.{letter}") };
            let channel = channels.iter().find(|channel| channel.name.to_string() == full).unwrap();
            assert_eq!(channel.sampling, Vec2(1, 1));
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            assert!(values.iter().zip(&pixels).all(|(value, pixel)| *value == pixel[component]), "{full}");
        }
    }
}

/// The `exr` crate keeps texts in a hash map, whose order changes from map to map.
#[test]
fn layers_and_their_texts_are_written_the_same_every_time() {
    let metadata = ["a", "b", "c", "d", "e", "f", "g"].map(|key| (key, "text"));
    let write = || write_exr_layers(5, 37, &layers(), Precision::Half, Some("{}"), &metadata).unwrap().bytes;
    let first = write();
    assert!((0..8).all(|_| write() == first));
    assert_eq!(read_exr_layers(&first).unwrap().metadata.len(), 8);
}

#[test]
fn impossible_layers_are_refused() {
    let message = |layers: &[(String, Vec<[f32; 3]>)], metadata: &[(&str, &str)]| {
        let found = write_exr_layers(1, 1, layers, Precision::Half, Some("{}"), metadata).unwrap_err();
        assert_eq!(found.kind(), ErrorKind::Unwritable);
        found.to_string()
    };
    let layer = |name: &str, count: usize| (name.to_owned(), vec![[0.0; 3]; count]);
    assert!(message(&[], &[]).contains("expected a layer"));
    assert!(message(&[layer("a", 2)], &[]).contains("layer `a`: expected 1 x 1 pixels, found 2"));
    assert!(message(&[layer("a", 1), layer("a", 1)], &[]).contains("two layers are named `a`"));
    assert!(message(&[layer("a\n", 1)], &[]).contains("control"));
    assert!(message(&[layer("a", 1)], &[("specula", "x")]).contains("attribute `specula`"));
    let png = containers::write_png(1, 1, &[[0; 3]], None).unwrap();
    assert_eq!(read_exr_layers(&png).unwrap_err().kind(), ErrorKind::Unsupported);
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
