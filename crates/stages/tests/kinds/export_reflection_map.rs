use sh::Stop;
use sphere::{Cube, Face, LatLong};
use stages::artifacts::{Environment, Reflection};

use crate::fixture::{Case, case, difference, environment, lambert, phong, pixels, reflection, sky};

fn export(parameters: &str) -> Case {
    case("export-reflection-map", parameters).input("reflection", reflection(lambert(1.0), 2))
}

/// The reflection of [`sky`] by a white matte surface with the normal w: degree 1 times 2/3, xy times 1/4.
fn irradiance(w: sphere::DVec3) -> [f64; 3] {
    let base = 1.0 + w.z / 3.0;
    [base + 0.2 * w.x, base, base + 0.2 * w.y + 0.05 * w.x * w.y]
}

/// The sky's pixels were f32: 6e-8 of the largest radiance.
const F32: f64 = 4e-7;

#[test]
fn a_map_of_a_white_matte_material_is_the_irradiance_over_pi() {
    let (width, height, found) = pixels(&export("resolution = 12\nprecision = \"float\"").files()[0]);
    assert_eq!((width, height), (24, 12));
    let error = difference(&found, environment(12, irradiance).0.pixels());
    assert!(error < F32, "{error:e}");
}

#[test]
fn cube_faces_look_where_the_cube_looks() {
    let case = export("layout = \"cube\"\nresolution = 5\nprecision = \"float\"");
    let endings = ["/px.exr", "/nx.exr", "/py.exr", "/ny.exr", "/pz.exr", "/nz.exr"];
    assert_eq!(case.endings(), endings);
    let cube = Cube { edge: 5 };
    for (face, file) in Face::ALL.into_iter().zip(case.files()) {
        let (_, _, found) = pixels(&file);
        let expected: Vec<_> =
            (0..25).map(|i| irradiance(cube.direction(face, i / 5, i % 5).vector())).collect();
        let error = difference(&found, &expected);
        assert!(error < F32, "{face:?}: {error:e}");
    }
}

#[test]
fn strip_and_cross_hold_the_faces() {
    let faces = export("layout = \"cube\"\nresolution = 4\nprecision = \"float\"").files();
    let faces: Vec<_> = faces.iter().flat_map(|file| pixels(file).2).collect();
    let (width, height, strip) =
        pixels(&export("layout = \"cube-strip\"\nresolution = 4\nprecision = \"float\"").files()[0]);
    assert_eq!((width, height), (4, 24));
    assert_eq!(strip, faces);
    let (width, height, cross) =
        pixels(&export("layout = \"cube-cross\"\nresolution = 4\nprecision = \"float\"").files()[0]);
    assert_eq!((width, height), (12, 16));
    // The centre of the cross is +Z; the last cell is -Z, turned by half a turn; the corner is black.
    assert_eq!(cross[5 * 12 + 6], faces[4 * 16 + 4 + 2]);
    assert_eq!(cross[12 * 12 + 4], faces[5 * 16 + 15]);
    assert_eq!(cross[0], [0.0; 3]);
}

/// What is written is read back under the same layout; cubes are resampled, and a texel of 2 / 32 blurs by
/// its square.
#[test]
fn every_layout_is_imported_again() {
    let truth = environment(64, irradiance);
    for layout in ["lat-long", "cube", "cube-strip", "cube-cross"] {
        let resolution = if layout == "lat-long" { 64 } else { 32 };
        let files =
            export(&format!("layout = \"{layout}\"\nresolution = {resolution}\nprecision = \"float\""))
                .files();
        let mut import = case("import-environment", &format!("layout = \"{layout}\""));
        if layout == "cube" {
            for (face, file) in Face::ALL.into_iter().zip(files) {
                import = import.file(&format!("map/{}.exr", face.name()), file);
            }
            import = import.source("map");
        } else {
            import = import.file("map.exr", files.into_iter().next().unwrap()).source("map.exr");
        }
        let error = difference(import.artifact::<Environment>().0.pixels(), truth.0.pixels());
        assert!(error < 0.002, "{layout}: {error}");
    }
}

#[test]
fn each_format_holds_the_map() {
    let truth = environment(8, irradiance);
    // 11 bits of a half; 8 bits of RGBE, of the largest channel, which is below 2.
    for (format, ending, error) in [("exr", ".exr", 1.6 / 2048.0), ("rgbe", ".hdr", 2.0 / 256.0)] {
        let case = export(&format!("resolution = 8\nformat = \"{format}\""));
        assert_eq!(case.endings(), [ending]);
        let file = &case.files()[0];
        assert!(difference(&pixels(file).2, truth.0.pixels()) <= error, "{format}");
        assert_eq!(containers::read_recipe(file).as_deref(), Some("{\"kind\":\"export-reflection-map\"}"));
    }
    let brightness = |exposure: f64| {
        let png = &export(&format!("resolution = 8\nformat = \"png\"\nexposure = {exposure:?}")).files()[0];
        pixels(png).2.iter().flatten().sum::<f32>()
    };
    assert!(brightness(-2.0) < brightness(0.0) && brightness(0.0) < brightness(2.0));
}

/// A lamp on black, cut at degree 6: the map rings.
fn ringing(parameters: &str) -> Case {
    let grid = LatLong::with_rows(32);
    let lamp = environment(32, |w| if w.x > 0.95 { [70.0, 7.0, 0.7] } else { [0.0; 3] });
    let degree = sh::Degree::new(6).unwrap();
    let lighting = sh::Transform::new(grid, degree).unwrap().analyse(lamp.0.pixels());
    let choice = brdf::Choice::Degree { f: degree, p: sh::Degree::ZERO };
    let brdf = brdf::project(&phong(500.0), choice, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection(shrm::Reflection::convolve(&lighting, &brdf));
    case("export-reflection-map", parameters).input("reflection", reflection)
}

#[test]
fn negative_ringing_is_counted_and_kept_if_the_format_can() {
    let ran = ringing("resolution = 16").run().unwrap();
    let [warning] = ran.warnings.as_slice() else { panic!("{:?}", ran.warnings) };
    assert!(warning.contains(" % of the values are negative, down to -"), "{warning}");
    assert!(warning.ends_with(
        "; leave out `degree` and `tolerance` in project-brdf and project-sh, or set window = \"hanning\" in convolve"
    ));
    assert!(pixels(&ringing("resolution = 16").files()[0]).2.iter().flatten().any(|value| *value < 0.0));
    for format in ["rgbe", "png"] {
        let case = ringing(&format!("resolution = 16\nformat = \"{format}\""));
        assert!(case.run().unwrap().warnings[0].contains("is truncated: written as 0; leave out"));
        assert!(pixels(&case.files()[0]).2.iter().flatten().all(|value| *value >= 0.0));
    }
}

/// A map of values past the largest half.
fn bright(parameters: &str) -> Case {
    let bright = environment(8, |w| sky(w).map(|value| 1e5 * value));
    let lighting = case("project-sh", "degree = 2").input("environment", bright);
    let lighting = lighting.artifact::<stages::artifacts::Lighting>();
    let choice = brdf::Choice::Degree { f: sh::Degree::new(2).unwrap(), p: sh::Degree::ZERO };
    let brdf = brdf::project(&lambert(1.0), choice, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection(shrm::Reflection::convolve(&lighting.0.series, &brdf));
    case("export-reflection-map", parameters).input("reflection", reflection)
}

#[test]
fn values_past_the_largest_half_are_reported() {
    let past = |found: &[[f32; 3]]| found.iter().flatten().filter(|value| **value > 65504.0).count();
    for layout in ["lat-long", "cube"] {
        let shape = format!("layout = \"{layout}\"\nresolution = 4\n");
        let exact = bright(&format!("{shape}precision = \"float\"")).files();
        let count: usize = exact.iter().map(|file| past(&pixels(file).2)).sum();
        assert!(count > 0);
        let message = format!("{count} values exceed 65504, the largest half");
        // Nothing is lost if nobody asked for halves, and all faces have one precision.
        let ran = bright(&shape).run().unwrap();
        assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
        assert!(ran.notes.iter().any(|note| note.starts_with("written in 32-bit floats")), "{:?}", ran.notes);
        let kept: Vec<_> = bright(&shape).files().iter().map(|file| pixels(file).2).collect();
        assert!(kept.iter().zip(&exact).all(|(kept, exact)| *kept == pixels(exact).2), "{layout}");
        // One warning for all the files of an item.
        let half = bright(&format!("{shape}precision = \"half\""));
        let ran = half.run().unwrap();
        let said = ran.warnings[0].starts_with("the brightest light is clamped: ")
            && ran.warnings[0].contains(" % of the red light is lost, ");
        assert!(said && ran.warnings.len() == 1, "{:?}", ran.warnings);
        assert!(half.files().iter().all(|file| past(&pixels(file).2) == 0));
        let failure = bright(&format!("{shape}overflow = \"error\"")).run().err().unwrap();
        assert_eq!((failure.chain, failure.help.is_some()), (vec![message], true));
    }
    assert!(export("overflow = \"error\"").run().unwrap().warnings.is_empty());
}

#[test]
fn parameters_that_would_have_no_effect_are_errors() {
    for (parameters, expected) in [
        ("resolution = 0", "resolution: 0 is not a whole number from 1 to 4096"),
        ("overflow = \"error\"\nprecision = \"float\"", "overflow: only files of half floats use it"),
        ("format = \"png\"\nexposure = 101", "exposure: 101 is not a number from -100 to 100"),
        ("exposure = 1", "exposure: only format = \"png\" uses it"),
        ("format = \"png\"\nprecision = \"float\"", "precision: only format = \"exr\" uses it"),
    ] {
        assert_eq!(case("export-reflection-map", parameters).errors(), [expected]);
    }
}

/// The reflection of a rough surface, with P = 2.
fn rough() -> Reflection {
    let material = brdf::Material::Microfacet(brdf::Microfacet::new(0.4, [0.8; 3]).unwrap());
    let degree = |l| sh::Degree::new(l).unwrap();
    let choice = brdf::Choice::Degree { f: degree(2), p: degree(2) };
    let brdf = brdf::project(&material, choice, Stop::NEVER).unwrap().coefficients;
    Reflection(shrm::Reflection::convolve(&crate::fixture::sky_lighting().0.series, &brdf))
}

#[test]
fn of_a_material_that_changes_with_the_view_one_plain_map_is_written() {
    let field = rough().0;
    let map = |parameters: &str| {
        let text = format!("resolution = 8\nprecision = \"float\"\n{parameters}");
        let ran = case("export-reflection-map", &text).input("reflection", rough()).run().unwrap();
        (pixels(ran.files()[0]).2, ran.warnings)
    };
    // Head on the view is the central direction itself.
    let grid = LatLong::with_rows(8);
    let (found, warnings) = map("view = \"head-on\"");
    for (index, found) in found.iter().enumerate() {
        let central = grid.direction(index / 16, index % 16);
        let expected = field.evaluate(central, central);
        assert!(
            (0..3).all(|c| (f64::from(found[c]) - expected[c]).abs() < F32),
            "{found:?}, not {expected:?}"
        );
    }
    assert!(
        warnings[0].contains("the map holds the surface viewed straight on; export-shrm"),
        "{warnings:?}"
    );
    // The mean is that over the views at the corners of an octahedron, exact to degree 3, and P is 2.
    let (found, warnings) = map("");
    let axes = [(0.0, 0.0), (1.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.5, 1.0), (0.5, 1.5)];
    let views = axes.map(|(theta, phi)| {
        use std::f64::consts::PI;
        sphere::Direction::from_angles(PI * theta, PI * phi)
    });
    for (index, found) in found.iter().enumerate() {
        let central = grid.direction(index / 16, index % 16);
        let seen = views.map(|view| field.evaluate(central, view));
        let expected: [f64; 3] = std::array::from_fn(|c| seen.iter().map(|seen| seen[c]).sum::<f64>() / 6.0);
        assert!(
            (0..3).all(|c| (f64::from(found[c]) - expected[c]).abs() < F32),
            "{found:?}, not {expected:?}"
        );
    }
    let accuracy = shrm::accuracy::Accuracy::of(&field, [0.0; 3], 0.0);
    let lost = 100.0 * accuracy.at(2, 0).truth;
    let said: f64 = warnings[0].split(' ').next().unwrap().parse().unwrap();
    // To a tenth, or to a whole percent from 10 on.
    assert!(lost > 1.0 && (said - lost).abs() <= 0.5, "{warnings:?}, not {lost}");
}

/// A sun beside the lighting is in the map as the closed sum of its light, and with `lamps = "separate"` it
/// is not.
#[test]
fn lamps_are_in_the_map_or_left_to_the_renderer() {
    let sun = sh::Light::from_flux(sphere::Direction::from_angles(0.8, 0.3), 0.005, [4.0, 3.0, 2.0]);
    let material = phong(20.0);
    let field = reflection(phong(20.0), 2).0;
    let lamps = shrm::Lamps { lights: vec![sun], material: material.clone() };
    let lit = Reflection(field.clone().with_lamps(lamps));
    let map = |lamps: &str| {
        let text = format!("resolution = 8\nprecision = \"float\"\nlamps = \"{lamps}\"");
        let ran = case("export-reflection-map", &text).input("reflection", lit.clone()).run().unwrap();
        pixels(ran.files()[0]).2
    };
    let (baked, separate, grid) = (map("baked"), map("separate"), LatLong::with_rows(8));
    for (index, (baked, separate)) in baked.iter().zip(&separate).enumerate() {
        let central = grid.direction(index / 16, index % 16);
        let soft = field.evaluate(central, central);
        let cosine = central.dot(sun.direction).max(0.0);
        let lobe = 21.0 / std::f64::consts::TAU * cosine.powi(20);
        for c in 0..3 {
            let added = [4.0, 3.0, 2.0][c] * lobe;
            assert!((f64::from(separate[c]) - soft[c]).abs() < F32, "{separate:?} {soft:?}");
            assert!(
                (f64::from(baked[c]) - soft[c] - added).abs() < 3e-3 * (1.0 + added),
                "{baked:?} {added}"
            );
        }
    }
}

#[test]
fn a_material_that_does_not_change_with_the_view_has_one_plain_map() {
    let files = ["mean", "head-on"].map(|view| export(&format!("resolution = 8\nview = \"{view}\"")).files());
    assert_eq!(files[0], files[1]);
}
