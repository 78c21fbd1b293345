//! Real files: every `.hdr` of the corpus.

#![allow(clippy::unwrap_used)] // as in any test

use std::path::{Path, PathBuf};

use containers::{Format, ReadOptions, read_image};

fn hdr_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            hdr_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "hdr") {
            found.push(path);
        }
    }
}

#[test]
fn every_hdr_file_of_the_corpus_is_read() {
    let Some(corpus) = test_data::folder("every_hdr_file_of_the_corpus_is_read", "SPECULA_CORPUS") else {
        return;
    };
    let mut files = Vec::new();
    hdr_files(&corpus.join("env"), &mut files);
    files.sort();
    assert_eq!(files.len(), 13);
    for path in files {
        let decoded = read_image(&std::fs::read(&path).unwrap(), &ReadOptions::default()).unwrap();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let maximum = decoded.image.pixels().as_flattened().iter().fold(0.0_f32, |a, b| a.max(*b));
        println!(
            "{name}: {} x {}, maximum {maximum}, {:?}",
            decoded.image.width(),
            decoded.image.height(),
            decoded.warnings
        );
        let (size, known) = match name {
            "studio" => ((1024, 512), Some(3.6e3)),
            "apartment" => ((1024, 512), Some(41.0)),
            "forest" => ((1024, 512), Some(75.0)),
            "night" => ((1024, 512), Some(115.0)),
            "sunrise" => ((1024, 512), Some(2.2e5)),
            "grace_probe" => ((1000, 1000), None),
            "rnl_probe" => ((900, 900), None),
            _ => ((256, 256), None),
        };
        assert_eq!(
            (decoded.format, decoded.image.width(), decoded.image.height()),
            (Format::Radiance, size.0, size.1)
        );
        // The corpus' README gives two digits.
        assert!(known.is_none_or(|known: f32| (maximum / known - 1.0).abs() < 0.05), "{name}: {maximum}");
        assert!(decoded.image.pixels().as_flattened().iter().all(|value| value.is_finite() && *value >= 0.0));
    }
}
