//! The kind `reference`.

use shrm::reference::{Cull, Reference};
use sphere::{Direction, LatLong};
use stages::artifacts::{Brdf, Material, Reflection};

use crate::fixture::{
    Case, case, difference, environment, lambert, phong, pixels, reflection, sky, sky_lighting,
};

fn truth(parameters: &str) -> Case {
    let rough = brdf::Material::Microfacet(brdf::Microfacet::new(0.4, [1.0; 3]).unwrap());
    case("reference", &format!("precision = \"float\"\nresolution = 4\n{parameters}"))
        .input("environment", environment(32, sky))
        .input("material", Material(rough))
}

#[test]
fn a_map_holds_the_integral_of_the_environment_that_it_names() {
    let ran = truth("view = [90, 0]\nenvironment-resolution = 16").run().unwrap();
    assert_eq!(
        ran.notes,
        ["32 texels of the map, 512 lit ones of 32 x 16 of the environment, averaged from 64 x 32"]
    );
    let (width, height, found) = pixels(&truth("view = [90, 0]\nenvironment-resolution = 16").files()[0]);
    assert_eq!((width, height), (8, 4));
    let coarse = environment(32, sky).0.downsampled(LatLong::with_rows(16)).unwrap();
    let rough = brdf::Material::Microfacet(brdf::Microfacet::new(0.4, [1.0; 3]).unwrap());
    let reference = Reference::new(&coarse, &rough, Cull::None);
    let grid = LatLong::with_rows(4);
    let expected: Vec<[f64; 3]> = (0..grid.len())
        .map(|texel| reference.radiance(grid.direction(texel / 8, texel % 8), Direction::Y))
        .collect();
    // f32 sums, and +X turned by 90 degrees is +Y to rounding.
    assert!(difference(&found, &expected) < 1e-5);
}

/// Head-on, a lobe about N = R = V; its map is rounder than one toward a far viewer, and they are not the
/// same.
#[test]
fn the_view_matters_for_a_microfacet_surface_and_not_for_phong() {
    let maps = ["", "view = [0, 0]", "view = [10, 80]"].map(|view| pixels(&truth(view).files()[0]).2);
    assert!(difference(&maps[0], &maps[1]) > 0.01 && difference(&maps[1], &maps[2]) > 0.01);
    let of_phong = |view: &str| {
        let case = case("reference", view).input("environment", environment(16, sky));
        pixels(&case.input("material", Material(phong(9.0))).files()[0]).2
    };
    // Each is integrated to 5e-4 of itself.
    let [one, other] = ["resolution = 4", "resolution = 4\nview = [10, 80]"].map(of_phong);
    assert!(difference(&one, &other) < 2e-3);
}

/// The sky is of degree 2, so nothing is cut off; the midpoint rule at 64 rows is good to h^2 / 2 = 1.2e-3.
#[test]
fn it_agrees_with_harmonics_on_every_layout() {
    for layout in ["lat-long", "cube", "cube-cross", "cube-strip"] {
        let parameters = format!("layout = \"{layout}\"\nresolution = 6\nprecision = \"float\"");
        let found = case("reference", &parameters)
            .input("environment", environment(64, sky))
            .input("material", Material(lambert(0.8)))
            .files();
        let expected = case("export-reflection-map", &parameters)
            .input("reflection", reflection(lambert(0.8), 2))
            .files();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert!(difference(&pixels(found).2, &pixels(expected).2) < 1.2e-3, "{layout}");
        }
    }
}

/// Head-on, a strand is seen from its side by both kinds. F = 2 holds all of this sky; with P = 16 the maps
/// differ by the 1.3e-3 of the midpoint rule, with P = 8 by 5e-3.
#[test]
fn a_tangent_is_seen_from_its_side() {
    let strand = || brdf::Material::KajiyaKay(brdf::KajiyaKay::new(4.0, [0.5; 3]).unwrap());
    let parameters = "resolution = 6\nprecision = \"float\"\nview = \"head-on\"";
    let found = case("reference", parameters)
        .input("environment", environment(64, sky))
        .input("material", Material(strand()))
        .files();
    let brdf = case("project-brdf", "degree = [2, 8]").input("material", Material(strand()));
    let reflection = case("convolve", "")
        .input("lighting", sky_lighting())
        .input("brdf", (*brdf.artifact::<Brdf>()).clone());
    let expected = case("export-reflection-map", parameters)
        .input("reflection", (*reflection.artifact::<Reflection>()).clone())
        .files();
    let (found, expected) = (pixels(&found[0]).2, pixels(&expected[0]).2);
    assert!(expected.iter().all(|pixel| pixel[0] > 0.1), "{expected:?}");
    let error = difference(&found, &expected);
    assert!(error < 0.01, "{error:e}");
}

#[test]
fn a_culled_map_says_so_and_is_darker_by_its_share() {
    let soft = || Material(phong(2.0));
    let of_soft = |parameters: &str| {
        case("reference", &format!("precision = \"float\"\nresolution = 4\n{parameters}"))
            .input("environment", environment(128, sky))
            .input("material", soft())
    };
    let ran = of_soft("cull = 0.05\nview = \"head-on\"").run().unwrap();
    assert!(ran.notes[0].ends_with("% of the sphere"), "{:?}", ran.notes);
    let [culled, whole] = ["cull = 0.1", ""].map(|cull| pixels(&of_soft(cull).files()[0]).2);
    for (culled, whole) in culled.iter().zip(&whole) {
        let kept = culled[1] / whole[1];
        assert!(kept > 0.85 && kept < 1.0, "{kept}");
    }
}

/// The number after some words of a note, over 100.
fn percent_after(note: &str, words: &str) -> f64 {
    let rest = note.split(words).nth(1).unwrap_or_else(|| panic!("{note}"));
    rest.trim_start().split(' ').next().unwrap().parse::<f64>().unwrap() / 100.0
}

/// The lobe of the microfacets, of sigma 0.4, is wider than the rows: the midpoint rule of the sum errs by
/// h^2 / 24 times its curvature, about 1/sigma^2, 6e-4 of the value.
#[test]
fn a_sampled_map_is_the_sum_within_the_error_that_it_notes() {
    for view in ["view = \"head-on\"", "view = [60, 20]"] {
        let summed = pixels(&truth(view).files()[0]).2;
        let sampled = |more: &str| truth(&format!("{view}\nmethod = \"sampled\"\n{more}"));
        let ran = sampled("samples = 1000\nseed = 3").run().unwrap();
        let start =
            "32 texels of the map, 1024 directions at each to 64 x 32 of the environment; standard error ";
        assert!(ran.notes.len() == 1 && ran.notes[0].starts_with(start), "{:?}", ran.notes);
        let told = percent_after(&ran.notes[0], "standard error");
        let largest = percent_after(&ran.notes[0], "at most");
        assert!(0.0 < told && told < largest && largest < 0.02, "{:?}", ran.notes);
        let found = pixels(&sampled("samples = 1000\nseed = 3").files()[0]).2;
        let size = rms(summed.as_flattened().iter().copied().map(f64::from));
        let differences =
            found.as_flattened().iter().zip(summed.as_flattened()).map(|(a, b)| f64::from(a - b));
        let error = rms(differences) / size;
        assert!(error < 1.3 * told + 1e-3 && error > 0.5 * told, "{view}: {error} {:?}", ran.notes);
        let other = pixels(&sampled("samples = 1000\nseed = 4").files()[0]).2;
        assert!(other != found, "another seed");
        let few = &sampled("samples = 64").run().unwrap().notes[0];
        assert!(percent_after(few, "standard error") > 2.0 * told, "{few}");
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, squares) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value * value));
    f64::sqrt(squares / count)
}

#[test]
fn a_black_sky_is_sampled_without_an_error() {
    let case = case("reference", "method = \"sampled\"\nresolution = 2\nprecision = \"float\"")
        .input("environment", environment(8, |_| [0.0; 3]))
        .input("material", Material(lambert(0.8)));
    let note = &case.run().unwrap().notes[0];
    assert!(note.ends_with("standard error 0 % of the map's root mean square, at most 0 %"), "{note}");
    assert!(pixels(&case.files()[0]).2.iter().all(|pixel| *pixel == [0.0; 3]));
}

#[test]
fn impossible_parameters_are_errors() {
    for (parameters, expected) in [
        ("method = \"guessed\"", "method: \"guessed\" is not \"summed\" or \"sampled\""),
        ("samples = 128", "samples: only method = \"sampled\" uses it"),
        ("seed = 1", "seed: only method = \"sampled\" uses it"),
        ("method = \"sampled\"\ncull = 0.1", "cull: only method = \"summed\" uses it"),
        ("method = \"sampled\"\nsamples = 0", "samples: 0 is not a whole number from 64 to 1048576"),
        ("method = \"sampled\"\nseed = -1", "seed: -1 is not a whole number from 0 to 4294967295"),
        ("cull = 1", "cull: 1 is not a number, 0 or more and below 1"),
        ("environment-resolution = 0", "environment-resolution: 0 is not a whole number from 1 to 4096"),
        ("resolution = 9999", "resolution: 9999 is not a whole number from 1 to 4096"),
        ("view = [1, 2, 3]", "view: 3 numbers are not [yaw, pitch]"),
        ("view = \"above\"", "view: \"above\" is not \"head-on\" or [yaw, pitch] in degrees"),
    ] {
        assert_eq!(case("reference", parameters).errors(), [expected]);
    }
}
