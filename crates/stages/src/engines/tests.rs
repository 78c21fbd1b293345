use std::collections::HashSet;

use super::*;

/// The engines that load a cube.
fn cubes() -> impl Iterator<Item = &'static Engine> {
    let cubes = ENGINES.iter().copied().filter(|engine| engine.loads_cube());
    assert!(cubes.clone().count() >= 5);
    cubes
}

#[test]
fn names_and_formats_are_there_and_are_unique() {
    let names: HashSet<_> = ENGINES.iter().map(|engine| engine.name).collect();
    assert_eq!(names.len(), ENGINES.len());
    for engine in ENGINES {
        let is_word =
            |name: &str| name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
        assert!(is_word(engine.name) && engine.meaning.ends_with('.'), "{}", engine.name);
        let formats = engine.formats();
        assert!(!formats.is_empty(), "{}", engine.name);
        for (index, format) in formats.iter().enumerate() {
            assert!(!formats[..index].contains(format), "{}: {}", engine.name, format.name());
            let is_image = format.image_ending().is_some();
            assert_eq!(is_image, !engine.loads_cube(), "{}: {}", engine.name, format.name());
        }
    }
}

#[test]
fn levels_rise_from_a_mirror_to_roughness_1() {
    for engine in cubes() {
        let least = engine.size_with(1).unwrap();
        for size in [32, 64, 256, 1024].into_iter().filter(|size| *size >= least) {
            let roughness = engine.roughness(size).unwrap();
            assert_eq!((roughness[0], *roughness.last().unwrap()), (0.0, 1.0), "{} {size}", engine.name);
            assert!(roughness.is_sorted(), "{} {roughness:?}", engine.name);
            assert_eq!(engine.size_with(roughness.len()), Some(size));
        }
    }
}

/// The level that each engine's shader looks up for a roughness.
#[test]
fn an_engine_finds_the_roughness_at_its_level() {
    for engine in cubes() {
        let least = engine.size_with(1).unwrap();
        for size in [64, 256].map(|size: usize| size.max(least)) {
            let roughness = engine.roughness(size).unwrap();
            let n = (roughness.len() - 1) as f64;
            // A shader may leave out the last levels.
            let last = engine.level(1.0, size).unwrap();
            assert!((0.8 * n - 1e-9..=n + 1e-9).contains(&last), "{} {size}: {last} of {n}", engine.name);
            for (l, &r) in roughness.iter().enumerate().skip(1) {
                let (level, expected) = (engine.level(r, size).unwrap(), (l as f64).min(last));
                let name = engine.name;
                assert!((level - expected).abs() < 1e-9, "{name} {size}: level {l} is found at {level}");
            }
        }
    }
}

#[test]
fn the_nearest_size_is_named() {
    let message = |engine: &Engine, size| engine.roughness(size).unwrap_err();
    assert!(message(&three::ENGINE, 200).ends_with("256"));
    assert!(message(&three::ENGINE, 180).ends_with("128"));
    assert!(message(&filament::ENGINE, 8).ends_with("32"));
    assert!(message(&blender::ENGINE, 256).contains("export-engine"));
}

#[test]
fn every_file_of_an_engine_is_named() {
    for engine in ENGINES {
        for format in engine.formats() {
            let (names, text) = (engine.names(format, "environment"), engine.readme(format, "environment"));
            assert!(
                !names.is_empty() && names.iter().collect::<HashSet<_>>().len() == names.len(),
                "{names:?}"
            );
            for name in names {
                let named = text.contains(name.trim_start_matches('/'));
                assert!(named, "{} {}: {name}", engine.name, format.name());
            }
        }
    }
}

#[test]
fn the_manual_has_every_ending_of_a_cubes_files() {
    for engine in cubes() {
        let cube = engine.cube().unwrap();
        for ending in cube.files.iter().flat_map(|files| files.endings) {
            assert!(cube.endings.contains(&format!("`{ending}`")), "{}: {ending}", engine.name);
        }
    }
}
