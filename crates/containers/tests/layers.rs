//! Layered OpenEXR against another reader.

#![allow(clippy::unwrap_used)] // as in any test

use std::io::Cursor;

use containers::{
    ErrorKind, Precision, ReadOptions, read_exr_layers, read_image, read_recipe, write_exr_layers,
};
/// Layers whose halves are exact; the names' order in the file is not theirs here.
fn layers() -> Vec<(String, Vec<[f32; 3]>)> {
    let names = ["", "p1qm1", "p1q0", "p1q1", "p10q0"];
    let pixels = |layer: usize| (0..5 * 37).map(|i| [i as f32, layer as f32, -0.5 * i as f32]).collect();
    names.iter().enumerate().map(|(layer, name)| ((*name).to_owned(), pixels(layer))).collect()
}

#[test]
fn every_layer_is_read_again() {
    let metadata = [("specula.view", "local")];
    for precision in [Precision::Half, Precision::Float] {
        let bytes = write_exr_layers(5, 37, &layers(), precision, Some("{}"), &metadata, sh::Stop::NEVER)
            .unwrap()
            .bytes;
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
        let named =
            read_image(&bytes, &ReadOptions { layer: Some("p1qm1".into()), ..ReadOptions::default() })
                .unwrap();
        assert!(named.image.pixels() == layers()[1].1.as_slice());
    }
}

/// The `exr` crate's own high-level reader: one part, whose channels are the layers'.
#[test]
fn the_exr_crate_reads_every_layer() {
    use exr::prelude::*;
    let bytes =
        write_exr_layers(5, 37, &layers(), Precision::Half, None, &[], sh::Stop::NEVER).unwrap().bytes;
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
    let write = || {
        write_exr_layers(5, 37, &layers(), Precision::Half, Some("{}"), &metadata, sh::Stop::NEVER)
            .unwrap()
            .bytes
    };
    let first = write();
    assert!((0..8).all(|_| write() == first));
    assert_eq!(read_exr_layers(&first).unwrap().metadata.len(), 8);
}

#[test]
fn impossible_layers_are_refused() {
    let message = |layers: &[(String, Vec<[f32; 3]>)], metadata: &[(&str, &str)]| {
        let found = write_exr_layers(1, 1, layers, Precision::Half, Some("{}"), metadata, sh::Stop::NEVER)
            .unwrap_err();
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
