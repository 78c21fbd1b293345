use std::collections::HashSet;

use sphere::DVec3;
use taps::TableShape;

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
            if let Some(skybox) = engine.skybox(format) {
                let name = format!("environment{}", skybox.ending);
                assert!(
                    (skybox.readme)(&name).contains(&name) && !names.contains(&format!("/{name}")),
                    "{name}"
                );
            }
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

/// The cube coordinates that the shader of an engine computes for a direction of its world.
fn cube_coordinates(engine: &Engine, d: DVec3) -> DVec3 {
    let value = |expression: &str| match expression.trim_start_matches('-') {
        "d.x" => d.x,
        "d.y" => d.y,
        "d.z" => d.z,
        other => panic!("{other}"),
    };
    let signed = |expression: &str| if expression.starts_with('-') { -1.0 } else { 1.0 } * value(expression);
    DVec3::from_array(engine.cube_coordinates().map(signed))
}

/// Where the centre of a lat-long image, its left quarter and its top look, in each engine's own axes, as its
/// lighting preset or its sky has it; in a cube they are +Z, -X and +Y.
#[test]
fn taps_look_where_the_light_of_the_engine_is() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let frames = [
        ("three", [x, -z, y]),
        ("filament", [z, x, y]),
        ("babylon", [z, -x, y]),
        ("bevy", [x, -z, y]),
        ("godot", [-z, -x, y]),
        ("unity", [x, z, y]),
        ("unreal", [-y, -x, z]),
    ];
    let with_taps = ENGINES.iter().filter(|engine| engine.taps.is_some());
    assert_eq!(with_taps.count(), frames.len());
    for (name, [centre, left, top]) in frames {
        let engine = ENGINES.iter().find(|engine| engine.name == name).unwrap();
        assert_eq!(engine.axes, [centre, left, top], "{name}");
        let found = [centre, left, top].map(|d| cube_coordinates(engine, d));
        assert_eq!(found, [DVec3::Z, -DVec3::X, DVec3::Y], "{name}");
    }
}

#[test]
fn texts_of_taps_have_no_place_left() {
    let names = TapFileNames { levels: "a.x", normals: "b.x", table: "c.x", lights: "d.json" };
    let shapes = [TableShape::Angle, TableShape::Facets { is_quarter: true }];
    for (engine, shape) in ENGINES.iter().flat_map(|engine| shapes.map(|shape| (engine, shape))) {
        let Some(preset) = engine.taps else { continue };
        let widths = taps::Widths::new(32).unwrap();
        assert!([".ktx2", ".exr"].contains(&preset.textures), "{}", engine.name);
        let look_up = engine.look_up(widths, shape, [5, 2]).unwrap();
        let texts = tap_texts(preset, "copper", names, &look_up);
        let [(ending, shader), ("-README.txt", readme)] = &texts[..] else { panic!("{texts:?}") };
        for text in [shader, readme] {
            assert!(!text.contains("__") && text.ends_with('\n') && !text.contains("\n\n\n"), "{text}");
            assert!(text.lines().all(|line| line.trim_end() == line), "{text}");
        }
        let whole = format!("{shader}{readme}");
        for name in ["a.x", "b.x", "c.x", "d.json", &format!("copper{ending}")] {
            assert!(whole.contains(name), "{}: {name}", engine.name);
        }
        assert!(shader.contains("TAP_COUNT") && shader.contains("= 5;"), "{shader}");
        assert!(shader.contains(" tap_reflected("), "{shader}");
        // The look-up, its call and the manual have the tangent, or none of them has.
        let has_tangent = shape != TableShape::Angle;
        let call = whole.rsplit_once("tap_reflected(").map_or("", |(_, rest)| rest);
        let arguments = call.lines().next().unwrap_or("").matches(", ").count();
        assert_eq!(arguments, 1 + usize::from(has_tangent), "{}: {call}", engine.name);
        for text in [shader, readme] {
            assert_eq!(text.to_lowercase().contains("tangent"), has_tangent, "{}: {text}", engine.name);
        }
    }
}
