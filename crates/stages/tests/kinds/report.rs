//! The report: its figures compared with the kernels, and a page without outside references.

use brdf::{Choice, project};
use envmap::Environment as Map;
use serde_json::Value;
use sh::{Degree, Tolerance, Transform};
use shrm::Reflection;
use shrm::reference::{Cull, Reference};
use sphere::{DVec3, Direction};
use stages::artifacts::Material;

use crate::fixture::{Case, case, environment, lambert, phong, sky};

/// Small, because each case runs twice.
const SMALL: &str = "sphere = 32\nresolution = 12\nreference-rows = 32\n";

/// A window in a dim room.
fn window(w: DVec3) -> [f64; 3] {
    let pane = if w.z.abs() < 0.4 && w.y.abs() < 0.5 && w.x < 0.0 { 6.0 } else { 0.0 };
    [0.1 + pane, 0.1 + pane, 0.15 + 0.05 * w.z + 1.2 * pane]
}

pub(crate) fn microfacet(sigma: f64) -> brdf::Material {
    brdf::Material::Microfacet(brdf::Microfacet::new(sigma, [0.9, 0.6, 0.3]).unwrap())
}

fn with_environment(case: Case, name: &str, radiance: fn(DVec3) -> [f64; 3]) -> Case {
    case.keyed_input("environment", &[("environment", name)], environment(32, radiance))
}

fn with_material(case: Case, name: &str, material: brdf::Material) -> Case {
    case.keyed_input("material", &[("material", name)], Material(material))
}

/// The figures and the page.
fn report(case: &Case) -> (Value, String) {
    let files = case.files();
    assert_eq!(files.len(), 2);
    (serde_json::from_slice(&files[0]).unwrap(), String::from_utf8(files[1].clone()).unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect()
}

/// The elements of a page are closed in order, attributes are quoted, and nothing outside is referred to.
fn check_page(page: &str) {
    let mut open: Vec<&str> = Vec::new();
    let body = page.strip_prefix("<!doctype html>").unwrap();
    let mut rest = body;
    while let Some(start) = rest.find('<') {
        assert!(
            !rest[..start].contains('>'),
            "a stray > before {}",
            &rest[start..][..40.min(rest.len() - start)]
        );
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        let name = tag.trim_start_matches('/').split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order");
        } else {
            let bare: Vec<_> = tag.split('"').step_by(2).collect();
            let (last, attributes) = bare.split_last().unwrap();
            assert!(attributes.iter().all(|name| name.ends_with('=')) && !last.contains('='), "{tag:.80}");
            if !tag.ends_with('/') {
                open.push(name);
            }
            assert!(name != "script" && name != "link" && name != "iframe", "{tag}");
            if name == "img" {
                assert!(
                    tag.contains(" src=\"data:image/png;base64,") && tag.contains(" alt=\""),
                    "{tag:.80}"
                );
            }
        }
        if name == "style" && !tag.starts_with('/') {
            rest = &rest[rest.find("</style>").unwrap()..];
        }
    }
    assert!(open.is_empty(), "{open:?} are not closed");
    let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!outside.contains("http:") && !outside.contains("https:"));
    assert!(!outside.contains("url(") && !outside.contains("@import"));
    assert!(!page.contains("NaN") && !page.contains("inf\""));
}

#[test]
fn two_environments_and_two_materials_are_four_pairs() {
    let case = with_environment(case("report", SMALL), "day", sky);
    let case = with_environment(case, "window", window);
    let case = with_material(with_material(case, "chalk", lambert(0.8)), "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    let pairs = json["pairs"].as_array().unwrap();
    let names: Vec<_> = pairs
        .iter()
        .map(|pair| format!("{} {}", pair["material"], pair["environment"]).replace('"', ""))
        .collect();
    assert_eq!(names, ["chalk day", "chalk window", "satin day", "satin window"]);
    assert_eq!(json["materials"].as_array().unwrap().len(), 2);
    // A matte surface looks the same from every side: a plain map is advised, and no worse than an SHRM.
    for pair in &pairs[..2] {
        let rms: Vec<f64> =
            pair["exports"].as_array().unwrap().iter().map(|e| e["rms"].as_f64().unwrap()).collect();
        assert_eq!(pair["advice"]["method"], "reflection-map");
        assert!(rms.iter().all(|one| (one - rms[3]).abs() < 5e-3), "{rms:?}");
    }
    // A rough surface does not: in the window's light a plain map is far off, and a texture without azimuth
    // too.
    let rms: Vec<f64> =
        pairs[3]["exports"].as_array().unwrap().iter().map(|e| e["rms"].as_f64().unwrap()).collect();
    assert!(rms[3] < 0.07 && rms[1] > 1.5 * rms[3] && rms[0] > 2.0 * rms[1], "{rms:?}");
    assert!(page.contains("The highlight changes with the view."));
    // Each pair without a good export says what helps, and degrees that it names were measured.
    for pair in pairs {
        assert_eq!(pair["help"].is_null(), pair["advice"]["good"].as_bool().unwrap(), "{pair}");
        if pair["help"]["by"] == "degrees" {
            assert!(pair["help"]["rms"].as_f64().unwrap() <= 0.05);
        }
    }
}

#[test]
fn the_figures_of_a_material_are_those_of_its_projection() {
    let material = microfacet(0.4);
    let case = with_material(with_environment(case("report", SMALL), "day", sky), "satin", material.clone());
    let (json, _) = report(&case);
    let figures = &json["materials"][0];
    let chosen = project(&material, Choice::Tolerance(Tolerance::new(0.03).unwrap())).unwrap();
    assert_eq!(figures["f"], chosen.coefficients.f().get());
    assert_eq!(figures["p"], chosen.coefficients.p().get());
    // Two projections at different degrees sample rho_hat differently: 1e-6 of the norm.
    assert!((figures["captured"].as_f64().unwrap() - chosen.captured).abs() < 1e-5);
    for (p, captured) in numbers(&figures["captured_per_p"]).into_iter().enumerate() {
        let degree = |l| Degree::new(l).unwrap();
        let expected = project(&material, Choice::Degree { f: degree(30), p: degree(p) }).unwrap().captured;
        assert!((captured - expected).abs() < 1e-5, "P = {p}: {captured}, not {expected}");
    }
    // Accuracies rise to 1, and the guaranteed accuracy is never above the measured one.
    for key in ["accuracy", "accuracy_per_p"] {
        let accuracy = &json["pairs"][0][key];
        let [truth, bound] = ["truth", "bound"].map(|name| numbers(&accuracy[name]));
        assert!(truth.windows(2).all(|pair| pair[0] <= pair[1] + 1e-12), "{key}: {truth:?}");
        assert!(truth.iter().zip(&bound).all(|(truth, bound)| bound <= &(truth + 1e-9)), "{key}");
    }
    // 8 bytes a texel.
    let exports = json["pairs"][0]["exports"].as_array().unwrap();
    let rows = (chosen.coefficients.p().get() + 1).pow(2) as u64;
    let bytes: Vec<_> = exports.iter().map(|export| export["bytes"].as_u64().unwrap() / 8).collect();
    assert_eq!(bytes, [6 * 144, 16 * 24 * 48, 12 * 6 * 144, rows * 6 * 144]);
}

/// The error of the SHRM, computed again from coefficients at each pixel's own direction. The map's
/// resolution adds the error of bilinear texels of 90 / 48 degrees, (F h)^2 / 8 = 0.002 of the detail at
/// degree F = 4.
#[test]
fn the_error_on_the_sphere_is_that_of_the_kernels() {
    let material = microfacet(0.5);
    let parameters = "sphere = 32\nresolution = 48\nreference-rows = 32\ndegree = [4, 1]";
    let case = with_material(
        with_environment(case("report", parameters), "window", window),
        "matt",
        material.clone(),
    );
    let (json, _) = report(&case);
    let found = json["pairs"][0]["exports"][3]["rms"].as_f64().unwrap();
    let [degrees, texels] =
        ["degrees", "texels"].map(|part| json["pairs"][0]["shrm"][part].as_f64().unwrap());

    let light: Map = environment(32, window).0;
    let degree = |l| Degree::new(l).unwrap();
    let lighting = Transform::new(light.grid(), degree(4)).unwrap().analyse(light.pixels());
    let choice = Choice::Degree { f: degree(4), p: degree(1) };
    let reflected = Reflection::convolve(&lighting, &project(&material, choice).unwrap().coefficients);
    let reference = Reference::new(&light, &material, Cull::None);
    let view = Direction::normalised(-DVec3::X);
    let (mut difference, mut energy) = (0.0, 0.0);
    for index in 0..32 * 32 {
        let [x, y] = [index % 32, index / 32].map(|i| (f64::from(i) - 15.5) / 16.0);
        if x.hypot(y) < 1.0 {
            let normal = Direction::normalised(DVec3::new(-(1.0 - x * x - y * y).sqrt(), -x, -y));
            let central = brdf::Centre::Reflection.central(normal, normal, view);
            let (truth, value) = (reference.radiance(central, view), reflected.evaluate(central, view));
            for channel in 0..3 {
                difference += (truth[channel] - value[channel]).powi(2);
                energy += truth[channel].powi(2);
            }
        }
    }
    let expected = (difference / energy).sqrt();
    assert!(expected > 0.01 && (found - expected).abs() < 0.003, "{found}, not {expected}");
    // The parts are sampled at every second pixel.
    assert!((degrees / expected - 1.0).abs() < 0.1 && texels < 0.003, "{degrees} {texels}, not {expected}");
}

#[test]
fn a_black_material_has_no_error() {
    let case = with_material(with_environment(case("report", SMALL), "day", sky), "black", lambert(0.0));
    let (json, page) = report(&case);
    check_page(&page);
    let pair = &json["pairs"][0];
    assert!(pair["exports"].as_array().unwrap().iter().all(|export| export["rms"] == 0.0));
    assert_eq!(
        (&pair["advice"]["method"], &pair["advice"]["good"]),
        (&"reflection-map".into(), &true.into())
    );
    assert_eq!(json["materials"][0]["captured"], 1.0);
}

#[test]
fn connected_coefficients_are_those_that_are_shown() {
    let brdf = project(&phong(8.0), Choice::Degree { f: Degree::new(5).unwrap(), p: Degree::ZERO }).unwrap();
    let base = with_material(with_environment(case("report", SMALL), "day", sky), "gold", phong(8.0));
    let connected = base.keyed_input(
        "brdf",
        &[("material", "gold")],
        stages::artifacts::Brdf::from(brdf.coefficients.clone()),
    );
    let (json, _) = report(&connected);
    assert_eq!((&json["materials"][0]["f"], &json["materials"][0]["p"]), (&5.into(), &0.into()));
    let other = with_material(with_environment(case("report", SMALL), "day", sky), "gold", phong(8.0));
    let other =
        other.keyed_input("brdf", &[("material", "brass")], stages::artifacts::Brdf::from(brdf.coefficients));
    assert_eq!(other.failure(), "gold: the port brdf receives no coefficients of this material");
}

#[test]
fn names_are_shown_as_they_are() {
    let name = "<b>\"R&D\" 'gold' 素材</b>";
    let case = with_material(with_environment(case("report", SMALL), "day", sky), name, lambert(0.5));
    let (json, page) = report(&case);
    check_page(&page);
    assert_eq!(json["materials"][0]["name"], name);
    assert!(
        !page.contains("<b>") && page.contains("&lt;b&gt;&quot;R&amp;D&quot; &#39;gold&#39; 素材&lt;/b&gt;")
    );
}

#[test]
fn the_files_are_the_same_for_any_number_of_threads() {
    let case =
        with_material(with_environment(case("report", SMALL), "window", window), "satin", microfacet(0.4));
    let files = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| case.files())
    };
    assert!(files(1) == files(2));
}

#[test]
fn impossible_parameters_are_errors() {
    for (parameters, expected) in [
        ("accept = 0", "accept: 0 is not a number above 0 and below 1"),
        ("sphere = 31", "sphere: 31 is not a whole number from 32 to 256"),
        ("resolution = 1000", "resolution: 1000 is not a whole number from 4 to 512"),
        ("reference-rows = 8", "reference-rows: 8 is not a whole number from 32 to 512"),
        ("amplify = 0.5", "amplify: 0.5 is not a number from 1 to 100"),
        ("tolerance = 0.1\ndegree = [3, 1]", "tolerance: degree already sets the degrees"),
    ] {
        assert_eq!(case("report", parameters).errors(), [expected]);
    }
}
