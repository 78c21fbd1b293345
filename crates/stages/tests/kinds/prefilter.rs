//! `prefilter`.

use shrm::LevelMethod;
use stages::artifacts::Prefiltered;

use crate::fixture::{Case, case, environment, sky, sky_lighting};

fn prefiltered(parameters: &str) -> Case {
    case("prefilter", parameters).input("environment", environment(32, sky))
}

#[test]
fn a_preset_gives_an_engines_levels() {
    let ran = prefiltered("preset = \"filament\"\nresolution = 64").run().unwrap();
    let cube = &ran.artifact::<Prefiltered>().0;
    let found: Vec<_> = cube.levels.iter().map(|level| (level.map.cube().edge, level.roughness)).collect();
    assert_eq!(found, [(64, 0.0), (32, 1.0 - 0.5_f64.sqrt()), (16, 1.0)]);
    assert_eq!(cube.levels[0].method, LevelMethod::Resampled);
    assert!(
        ran.notes[0].starts_with("level 0, 64 x 64, roughness 0.000: the environment"),
        "{:?}",
        ran.notes
    );
    // 32 rows hold degree 31; at roughness 1 a lobe needs 74, at 0.29 59.
    assert!(ran.notes[2].contains("roughness 1.000: quadrature, estimated error "), "{:?}", ran.notes);
}

/// `sky` has the degrees 0, 1 and 2 only, which a cosine lobe multiplies by 1, 2/3 and 1/4.
#[test]
fn both_methods_give_the_mean_over_the_lobe() {
    for method in ["sh", "quadrature"] {
        let parameters = format!("roughness = [1.0]\nresolution = 8\nmethod = \"{method}\"");
        let case = case("prefilter", &parameters).input("environment", environment(128, sky));
        let level = &case.artifact::<Prefiltered>().0.levels[0];
        let cube = level.map.cube();
        for (index, found) in level.map.pixels().iter().enumerate() {
            let (face, row, column) = (index / 64, index / 8 % 8, index % 8);
            let direction = cube.direction(sphere::Face::ALL[face], row, column);
            let w = direction.vector();
            // Degree 1 is odd in w.
            let (ahead, behind) = (sky(w), sky(-w));
            for channel in 0..3 {
                let [even, odd] = [1.0, -1.0].map(|sign| 0.5 * (ahead[channel] + sign * behind[channel]));
                let expected = 1.0 + odd * 2.0 / 3.0 + (even - 1.0) / 4.0;
                let difference = (f64::from(found[channel]) - expected).abs();
                assert!(difference < 3e-3, "{method}: texel {index}: {found:?} instead of {expected}");
            }
        }
    }
}

#[test]
fn a_lighting_of_too_low_degree_is_noted_or_refused() {
    let with = |method: &str| {
        let parameters = format!("roughness = [0.5]\nresolution = 4\nmethod = \"{method}\"");
        prefiltered(&parameters).input("lighting", sky_lighting())
    };
    let ran = with("auto").run().unwrap();
    assert!(ran.notes[1].ends_with("1 of 1 levels need more and are made by quadrature"), "{:?}", ran.notes);
    let failure = with("sh").failure();
    assert!(failure.starts_with("roughness 0.500 needs degree 20; the light holds "), "{failure}");
}

#[test]
fn levels_that_do_not_fit_are_refused_with_the_size_that_does() {
    for (parameters, expected) in [
        (
            "preset = \"three\"\nroughness = [1.0]",
            "roughness: a list of length 1, but three reads 6 levels of a cube of 256; the nearest resolution that \
             fits is 16",
        ),
        (
            "preset = \"three\"\nroughness = [0.0, 1.0]\nresolution = 16",
            "roughness: the preset already sets the levels",
        ),
        (
            "preset = \"three\"\nresolution = 100",
            "resolution: the faces for three are a power of two from 16",
        ),
        ("preset = \"godot\"", "preset: godot loads a lat-long image"),
        ("preset = \"quake\"", "\"three\" or \"filament\" or \"babylon\""),
        ("roughness = [0.0, 1.5]", "roughness: 1.5 is not from 0 to 1"),
        ("roughness = []", "roughness: expected a number"),
        ("roughness = [0.5]\nresolution = 100", "the nearest size that fits is 128"),
        ("roughness = [0.0, 0.3, 0.6, 1.0]\nresolution = 4", "the nearest resolution that fits is 8"),
    ] {
        let errors = prefiltered(parameters).errors();
        assert!(errors.len() == 1 && errors[0].contains(expected), "{parameters}: {errors:?}");
    }
}
