//! The section of a report on degrees: estimates beside what brute force says.

use serde_json::Value;

use crate::fixture::{Case, case, lambert, phong};
use crate::report::{check_page, microfacet, report, with_environment, with_material};

/// A window in a dim room.
fn window(w: sphere::DVec3) -> [f64; 3] {
    let pane = if w.z.abs() < 0.4 && w.y.abs() < 0.5 && w.x < 0.0 { 6.0 } else { 0.0 };
    [0.1 + pane, 0.1 + pane, 0.15 + 0.05 * w.z + 1.2 * pane]
}

fn degrees(parameters: &str) -> Case {
    let text = format!("sphere = 24\nresolution = 8\nsections = [\"degrees\"]\n{parameters}");
    with_environment(case("report", &text), "window", window)
}

fn number(cut: &Value, name: &str) -> f64 {
    cut[name].as_f64().unwrap_or_else(|| panic!("no {name}: {cut}"))
}

/// The truth is that of the coefficients' product, which it does not come from, and no more than the bound;
/// the paper's rule is the least pair of degrees at which the material loses no more than the tolerance.
#[test]
fn truncations_lose_what_coefficients_say_and_less_than_the_bound() {
    let case = with_material(with_material(degrees(""), "satin", microfacet(0.3)), "lobe", phong(32.0));
    let (json, page) = report(&case);
    check_page(&page);
    assert!(page.contains("tolerance 3.0 %") && page.contains(">printed bound<"), "{page:.3000}");
    assert_eq!(json["pairs"].as_array().unwrap().len(), 0);
    let pairs = json["degrees"]["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 2);
    for pair in pairs {
        let of = |name: &str| pair[name].as_array().unwrap().clone();
        for cut in of("by_f").iter().chain(&of("by_p")).chain([&pair["chosen"], &pair["rule"]]) {
            let [truth, product, bound] = ["truth", "product", "bound"].map(|name| number(cut, name));
            assert!((truth - product).abs() < 0.1 * product + 1e-3, "{cut}");
            assert!(truth < 1.1 * bound + 1e-3, "{cut}");
        }
        let rule = &pair["rule"];
        let [f, p] = ["f", "p"].map(|axis| rule[axis].as_u64().unwrap() as usize);
        assert!(number(rule, "material") <= 0.03);
        let before = p.checked_sub(1).map(|p| of("by_p")[p].clone());
        assert!(before.is_none_or(|cut| number(&cut, "material") > 0.03), "{rule}");
        assert_eq!(number(&of("by_f")[f], "f"), f as f64);
        // Blurred light looks less and less like itself.
        let blurred: Vec<f64> = of("blurred").iter().map(|sphere| number(sphere, "p95")).collect();
        assert!(blurred.windows(2).all(|pair| pair[0] < pair[1] + 0.02), "{blurred:?}");
    }
    assert_eq!(
        pairs.iter().filter(|pair| number(&pair["rule"], "p") == 0.0).count(),
        1,
        "the lobe has P = 0"
    );
}

/// A matte surface has its energy at low degrees, and looks the same under light of degree 8; a sharp lobe is
/// past F = 30.
#[test]
fn low_degrees_hold_a_matte_surface() {
    let case =
        with_material(with_material(degrees("accept = 0.1"), "chalk", lambert(0.8)), "sharp", phong(4000.0));
    let json = report(&case).0;
    let materials = json["degrees"]["materials"].as_array().unwrap();
    let held = |index: usize| -> Vec<f64> {
        materials[index]["by_p"].as_array().unwrap().iter().map(|share| share.as_f64().unwrap()).collect()
    };
    assert!(held(0).iter().all(|share| *share > 0.999), "{:?}", held(0));
    assert!(held(1).iter().all(|share| *share < 0.3), "{:?}", held(1));
    let alike = |pair: usize| -> Vec<bool> {
        let spheres = json["degrees"]["pairs"][pair]["blurred"].as_array().unwrap();
        spheres.iter().map(|sphere| sphere["alike"].as_bool().unwrap()).collect()
    };
    assert_eq!(alike(0)[..3], [true; 3], "degrees 64, 32 and 16");
    assert_eq!(alike(1), [false; 6]);
}

/// Lamps beside the series are not truncated; given degrees put them into it. Tolerances are the parameter's.
#[test]
fn given_degrees_have_all_light() {
    let sunny = |parameters: &str| {
        let text = format!("sphere = 24\nresolution = 8\nsections = [\"degrees\"]\n{parameters}");
        let case = case("report", &text).keyed_input(
            "environment",
            &[("environment", "sun")],
            crate::report::sunny(),
        );
        report(&with_material(case, "satin", microfacet(0.4))).0["degrees"]["pairs"][0].clone()
    };
    let [chosen, given] = [sunny(""), sunny("degree = [6, 1]\nenergy-tolerance = 0.1")];
    assert_eq!((&chosen["lamps"], &given["lamps"]), (&1.into(), &0.into()));
    assert_eq!((&chosen["for_light"], &given["for_light"]), (&true.into(), &false.into()));
    assert_eq!((number(&given["chosen"], "f"), number(&given["chosen"], "p")), (6.0, 1.0));
    assert_eq!((number(&chosen, "tolerance"), number(&given, "tolerance")), (0.03, 0.1));
    // The sun has light at all degrees.
    assert!(number(&given["chosen"], "light") > number(&chosen["by_f"][6], "light") + 0.01);
}

#[test]
fn a_black_environment_loses_nothing() {
    let text = "sphere = 24\nresolution = 8\nsections = [\"degrees\"]";
    let case = with_environment(case("report", text), "night", |_| [0.0; 3]);
    let (json, page) = report(&with_material(case, "chalk", lambert(0.8)));
    check_page(&page);
    assert_eq!(number(&json["degrees"]["pairs"][0]["chosen"], "truth"), 0.0);
}
