use std::f64::consts::PI;

use stages::artifacts::{Environment, Lighting};

use crate::fixture::{Case, case, difference, environment, sky, sky_lighting};

fn project(parameters: &str) -> Case {
    case("project-sh", parameters).input("environment", environment(16, sky))
}

#[test]
fn a_constant_sky_has_one_coefficient() {
    let lighting = case("project-sh", "degree = 4").input("environment", environment(8, |_| [1.0, 2.0, 0.5]));
    let lighting = lighting.artifact::<Lighting>();
    let one = (4.0 * PI).sqrt();
    let mut expected = vec![[0.0; 3]; 25];
    expected[0] = [one, 2.0 * one, 0.5 * one];
    // The error of single precision that the transform states.
    assert!(difference(lighting.0.series.coefficients(), &expected) < 1e-6 * 2.0 * one);
}

#[test]
fn auto_takes_the_least_degree_that_holds_enough() {
    // The sky is of degree 2. Its degree 0 holds 4 pi 3; z, x and y 4 pi / 3 (3 0.25 + 2 0.09), 7 percent of
    // the whole; xy the rest, 4 pi / 15 0.04, less than a thousandth.
    for (tolerance, degree) in [(0.2, 0), (0.01, 1), (1e-5, 2)] {
        let ran = project(&format!("degree = \"auto\"\ntolerance = {tolerance}")).run().unwrap();
        assert_eq!(ran.artifact::<Lighting>().0.series.degree().get(), degree, "{tolerance}");
    }
    let ran = project("tolerance = 0.01").run().unwrap();
    assert!(ran.notes[0].contains("because `tolerance` is set"), "{:?}", ran.notes);
    assert!(ran.notes[1].starts_with("degree 1 holds 99.9"), "{:?}", ran.notes);
    // min of 1 + z / 2 + 0.3 x is 1 - hypot(0.5, 0.3).
    assert!(ran.notes[2].starts_with("minimum 0.4169 (red, at theta 149.0, phi "), "{:?}", ran.notes);
}

#[test]
fn without_degree_and_tolerance_the_series_has_all_degrees_of_the_image_and_lamps_are_beside_it() {
    let ran = project("").run().unwrap();
    assert_eq!(ran.notes[0], "degree 15 holds over 99.999 % of the energy");
    let lighting = &ran.artifact::<Lighting>().0;
    assert!(lighting.series.degree().get() == 15 && lighting.lights.is_empty());

    let sunny = || environment(256, |w| if w.x > 0.9999 { [900.0; 3] } else { [1.0; 3] });
    let run = |parameters: &str| case("project-sh", parameters).input("environment", sunny()).run().unwrap();
    let ran = run("");
    let lighting = &ran.artifact::<Lighting>().0;
    assert_eq!(lighting.lights.len(), 1);
    assert!(
        ran.notes[0].starts_with("1 lamp holds ") && ran.notes[0].ends_with(" of the light, kept as lights")
    );
    // Together they are what one series holds.
    let named = run("degree = 31");
    let told = "suns and lamps are in the series, because `degree` is set; ";
    assert!(named.notes[0].starts_with(told), "{:?}", named.notes);
    assert!(run("degree = 31\nlamps = \"series\"").notes[0].starts_with("degree 31 holds "));
    let whole = named.artifact::<Lighting>();
    let whole = &whole.0;
    assert!(whole.lights.is_empty());
    // Pixels have solid angles, series the weights of a rule of quadrature.
    assert!((lighting.mean() / whole.mean() - 1.0).abs() < 0.02);
}

/// The oracle divides the pixel into many: Y_00, Y_1,-1, Y_10 and Y_11 are a constant and y, z and x.
#[test]
fn texels_are_constant_over_their_areas() {
    let one =
        environment(8, |w| if w.x > 0.9 && w.y > 0.0 && w.z > 0.0 { [5.0, 1.0, 0.0] } else { [0.0; 3] });
    let lit: Vec<usize> = (0..128).filter(|pixel| one.0.pixels()[*pixel][0] > 0.0).collect();
    let &[pixel] = lit.as_slice() else { panic!("{lit:?}") };
    let lighting = case("project-sh", "degree = 40\nquadrature = \"texels\"")
        .input("environment", one)
        .artifact::<Lighting>();
    let found = &lighting.0.series.coefficients()[..4];
    let (row, column, parts) = (pixel / 16, pixel % 16, 400);
    let mut sums = [0.0; 4];
    for i in 0..parts * parts {
        let place = |k: usize| (k as f64 + 0.5) / parts as f64;
        let theta = PI * (row as f64 + place(i / parts)) / 8.0;
        let phi = 2.0 * PI * (0.5 - (column as f64 + place(i % parts)) / 16.0);
        let area = theta.sin() * (PI / 8.0 / parts as f64).powi(2);
        let values = [1.0, theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()];
        (0..4).for_each(|k| sums[k] += area * values[k]);
    }
    for (k, (rgb, sum)) in found.iter().zip(sums).enumerate() {
        let expected = (if k == 0 { 1.0 } else { 3f64 } / (4.0 * PI)).sqrt() * sum;
        assert!((rgb[0] - 5.0 * expected).abs() < 1e-5 && (rgb[1] - expected).abs() < 2e-6, "{k}: {rgb:?}");
        assert!(rgb[2].abs() < 1e-15);
    }
    // Smooth light hardly differs.
    let [samples, texels] = ["samples", "texels"].map(|quadrature| {
        let parameters = format!("degree = 2\nquadrature = \"{quadrature}\"");
        let case = case("project-sh", &parameters).input("environment", environment(64, sky));
        case.artifact::<Lighting>().0.series.coefficients().to_vec()
    });
    let apart = difference(&samples, &texels);
    assert!(apart > 1e-6 && apart < 3e-3, "{apart}");
}

#[test]
fn a_light_too_small_for_any_degree_takes_the_highest_and_says_so() {
    let lamp =
        environment(16, |w| if w.z > 0.99 && w.x > 0.0 && w.y.abs() < 0.02 { [9e4; 3] } else { [0.01; 3] });
    let ran = case("project-sh", "tolerance = 0.001").input("environment", lamp).run().unwrap();
    assert_eq!(ran.artifact::<Lighting>().0.series.degree().get(), 15);
    assert!(
        ran.warnings[0]
            .starts_with("tolerance 0.001 is missed: degree 15, the highest of this image, holds "),
        "{:?}",
        ran.warnings
    );
}

#[test]
fn a_degree_too_high_names_the_highest() {
    let failure = project("degree = 16").failure();
    assert!(
        failure.starts_with("degree 16 is too high for an image of 32 x 16: the highest possible is 15"),
        "{failure}"
    );
    assert_eq!(project("degree = 15").artifact::<Lighting>().0.series.degree().get(), 15);
}

#[test]
fn windows_scale_each_degree() {
    let plain = sky_lighting().0.series;
    for (window, factors) in [
        ("window = \"none\"", [1.0, 1.0, 1.0]),
        ("window = \"hanning\"", [1.0, 0.75, 0.25]),
        ("window = \"lanczos\"", [1.0, 0.826_993_343_132, 0.413_496_671_566]),
        ("window = \"laplacian\"\nlambda = 0.25", [1.0, 0.5, 0.1]),
    ] {
        let windowed = project(&format!("degree = 2\n{window}")).artifact::<Lighting>();
        let expected: Vec<_> = (0..9_usize)
            .map(|row| plain.coefficients()[row].map(|value| value * factors[row.isqrt()]))
            .collect();
        assert!(difference(windowed.0.series.coefficients(), &expected) < 1e-12, "{window}");
    }
}

#[test]
fn the_non_negative_window_leaves_nothing_negative() {
    let ran = case("project-sh", "degree = 8\nwindow = \"non-negative\"")
        .input("environment", sunny())
        .run()
        .unwrap();
    let lighting = ran.artifact::<Lighting>();
    assert!(sh::minimum(&lighting.0.series).value >= 0.0);
    let note = ran.notes.last().unwrap();
    assert!(note.contains("minimum -") && note.contains(" before, ") && note.contains(" after"), "{note}");
}

/// A sun far too small for degree 8.
fn sunny() -> Environment {
    environment(32, |w| if w.x > 0.97 { [50.0, 40.0, 30.0] } else { [0.1, 0.1, 0.2] })
}

#[test]
fn the_nearest_non_negative_function_is_nearer_than_the_window() {
    let run = |parameters: &str| case("project-sh", parameters).input("environment", sunny()).run().unwrap();
    let coefficients = |parameters: &str| {
        run(&format!("degree = 8\n{parameters}")).artifact::<Lighting>().0.series.coefficients().to_vec()
    };
    let ran = run("degree = 8\nnon-negative = \"nearest\"");
    let series = &ran.artifact::<Lighting>().0.series;
    assert!(sh::minimum(series).value >= 0.0);
    let plain = coefficients("");
    let norm = |rows: &[[f64; 3]]| rows.as_flattened().iter().map(|value| value * value).sum::<f64>().sqrt();
    let change = |rows: &[[f64; 3]]| {
        let difference = rows.iter().zip(&plain).map(|(a, b)| [0, 1, 2].map(|i| a[i] - b[i]));
        norm(&difference.collect::<Vec<_>>()) / norm(&plain)
    };
    let nearest = change(series.coefficients());
    let window = change(&coefficients("window = \"non-negative\""));
    assert!(nearest > 0.01 && nearest < window / 2.0, "{nearest}, {window}");
    let told =
        format!("nearest non-negative function: a change of {:.3} % in L2; minimum -", 100.0 * nearest);
    let note = ran.notes.last().unwrap();
    assert!(note.starts_with(&told) && note.ends_with(" after"), "{:?}", ran.notes);
    // After a window there is less to change; and what is positive is left alone.
    let windowed = run("degree = 8\nwindow = \"lanczos\"\nnon-negative = \"nearest\"");
    assert!(sh::minimum(&windowed.artifact::<Lighting>().0.series).value >= 0.0);
    let sky = project("tolerance = 0.01\nnon-negative = \"nearest\"").run().unwrap();
    assert!(sky.notes[2].contains(" a change of 0.000 % in L2; "), "{:?}", sky.notes);
}

#[test]
fn no_non_negative_function_is_near_an_image_without_mass() {
    let negative = environment(16, |_| [1.0, -1.0, 0.0]);
    let failure =
        case("project-sh", "degree = 2\nnon-negative = \"nearest\"").input("environment", negative).failure();
    assert_eq!(failure, "channel 1 has no mass: black is the nearest non-negative function");
    let failure = case("project-sh", "tolerance = 0.001\nnon-negative = \"nearest\"")
        .input("environment", environment(128, |w| if w.x > 0.999 { [900.0; 3] } else { [0.0; 3] }))
        .failure();
    assert!(
        failure.starts_with("the tolerance needs degree ")
            && failure.ends_with("which is above 32, the highest degree for non-negative"),
        "{failure}"
    );
}

#[test]
fn parameters_that_would_have_no_effect_are_errors() {
    for (parameters, expected) in [
        ("degree = 3\ntolerance = 0.1", "tolerance: only degree = \"auto\" uses it"),
        ("tolerance = 1.0", "tolerance: 1.0 is not a number above 0 and below 1"),
        ("lambda = 0.1", "lambda: only window = \"laplacian\" uses it"),
        ("window = \"laplacian\"", "window: \"laplacian\" needs lambda, the weight of its penalty"),
        ("window = \"laplacian\"\nlambda = -1", "lambda: -1 is not a number, 0 or more"),
        ("non-negative = \"nearest\"", "non-negative: needs a degree, at most 32, or a tolerance"),
        (
            "degree = 33\nnon-negative = \"nearest\"",
            "degree: 33 is above 32, the highest degree for non-negative",
        ),
        (
            "degree = 8\nwindow = \"non-negative\"\nnon-negative = \"nearest\"",
            "non-negative: window = \"non-negative\" already prevents negative values",
        ),
        ("degree = \"all\"", "degree: \"all\" is not a whole number from 0 to 2048 or \"auto\""),
    ] {
        assert_eq!(project(parameters).errors(), [expected]);
    }
}
