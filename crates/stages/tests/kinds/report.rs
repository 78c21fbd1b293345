//! The report: its figures compared with the kernels, and a page without outside references.

use brdf::{Choice, project};
use engine::ExportedFiles;
use envmap::Environment as Map;
use serde_json::Value;
use sh::{Degree, Stop, Transform};
use shrm::Reflection;
use shrm::reference::{Cull, Reference};
use sphere::{DVec3, Direction, Rotation};
use stages::artifacts::{Environment, Material, Reflection as Reflected};

use crate::fixture::{Case, case, environment, lambert, phong, sky};

/// Small, because each case runs twice.
pub(crate) const SMALL: &str = "sphere = 32\nresolution = 12\ntrade = false\n";

/// A small report with the trade.
pub(crate) const TRADE: &str = "sphere = 32\nresolution = 12\n";

/// A window in a dim room.
fn window(w: DVec3) -> [f64; 3] {
    let pane = if w.z.abs() < 0.4 && w.y.abs() < 0.5 && w.x < 0.0 { 6.0 } else { 0.0 };
    [0.1 + pane, 0.1 + pane, 0.15 + 0.05 * w.z + 1.2 * pane]
}

pub(crate) fn microfacet(sigma: f64) -> brdf::Material {
    brdf::Material::Microfacet(brdf::Microfacet::new(sigma, [0.9, 0.6, 0.3]).unwrap())
}

pub(crate) fn with_environment(case: Case, name: &str, radiance: fn(DVec3) -> [f64; 3]) -> Case {
    case.keyed_input("environment", &[("environment", name)], environment(32, radiance))
}

pub(crate) fn with_material(case: Case, name: &str, material: brdf::Material) -> Case {
    case.keyed_input("material", &[("material", name)], Material(material))
}

/// The figures and the page.
pub(crate) fn report(case: &Case) -> (Value, String) {
    let files = case.files();
    assert_eq!(files.len(), 2);
    (serde_json::from_slice(&files[0]).unwrap(), String::from_utf8(files[1].clone()).unwrap())
}

/// The elements of a page are closed in order, attributes are quoted, and nothing outside is referred to.
pub(crate) fn check_page(page: &str) {
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
    // Base64 may spell anything.
    let words: String =
        outside.split("base64,").map(|text| text.split_once('"').map_or(text, |(_, text)| text)).collect();
    assert!(!words.contains("NaN") && !words.contains("inf"));
}

/// The figures of one export of a pair.
pub(crate) fn export<'a>(pair: &'a Value, method: &str) -> &'a Value {
    let exports = pair["exports"].as_array().unwrap();
    exports.iter().find(|export| export["method"] == method).unwrap_or_else(|| panic!("no {method}: {pair}"))
}

pub(crate) fn stops(figures: &Value) -> [f64; 2] {
    ["p95", "p99"].map(|name| figures[name].as_f64().unwrap())
}

#[test]
fn sizes_are_those_of_connected_files() {
    let pair = |name: &'static str| [("environment", "sky"), ("material", name)];
    let files = |bytes: &[u64]| ExportedFiles { bytes: bytes.to_vec(), ..ExportedFiles::default() };
    let case = case("report", SMALL);
    let case = with_material(with_environment(case, "sky", sky), "gold", microfacet(0.3));
    let without = report(&case).0;
    let case = with_material(case, "chalk", lambert(0.8));
    let case = case.keyed_input("cabral", &pair("gold"), files(&[500, 0, 23]));
    let case = case.keyed_input("cabral", &pair("chalk"), files(&[7]));
    // Once for each environment.
    let case = case.keyed_input("kautz-mccool", &[("environment", "sky")], files(&[321_000]));
    let (figures, page) = report(&case);
    let [gold, chalk] = ["gold", "chalk"].map(|name| {
        let pairs = figures["pairs"].as_array().unwrap();
        pairs.iter().find(|pair| pair["material"] == name).unwrap()
    });
    assert_eq!(export(gold, "cabral")["file"], 523);
    assert_eq!(export(chalk, "cabral")["file"], 7);
    for pair in [gold, chalk] {
        assert_eq!(export(pair, "kautz-mccool")["file"], 321_000);
        assert_eq!(export(pair, "reflection-map")["file"], Value::Null);
    }
    // The texels are counted as before.
    let bytes = |pair: &Value| export(pair, "cabral")["bytes"].as_u64();
    assert_eq!(bytes(gold), bytes(&without["pairs"][0]));
    assert!(
        page.contains(">523 B<") && page.contains(">321.0 kB<") && page.contains(">~6.9 kB<"),
        "{page:.9000}"
    );
    check_page(&page);
}

fn is_good(figures: &Value) -> bool {
    let [p95, p99] = stops(figures);
    p95 <= 0.15 && p99 <= 0.5
}

/// A dim sky with a sun of one texel that gives several times as much light.
pub(crate) fn sunny() -> Environment {
    let map = environment(32, |w| [0.5 + 0.2 * w.z, 0.6 + 0.2 * w.z, 0.8 + 0.3 * w.z]).0;
    let (grid, mut pixels) = (map.grid(), map.pixels().to_vec());
    pixels[10 * grid.width + 30] = [4000.0, 3500.0, 2500.0];
    Environment(Map::new(grid, pixels).unwrap())
}

fn with_sun(case: Case) -> Case {
    case.keyed_input("environment", &[("environment", "sun")], sunny())
}

#[test]
fn two_environments_and_two_materials_are_four_pairs() {
    let case = with_environment(case("report", SMALL), "day", sky);
    let case = with_environment(case, "window", window);
    let case = with_material(with_material(case, "chalk", lambert(0.8)), "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    assert_eq!(json["schema"], 4);
    let pairs = json["pairs"].as_array().unwrap();
    let names: Vec<_> = pairs
        .iter()
        .map(|pair| format!("{} {}", pair["material"], pair["environment"]).replace('"', ""))
        .collect();
    assert_eq!(names, ["chalk day", "chalk window", "satin day", "satin window"]);
    assert_eq!(json["materials"].as_array().unwrap().len(), 2);
    // A matte surface looks the same from every side: a plain map is advised, and no worse than an SHRM.
    for pair in &pairs[..2] {
        let [plain, shrm] = ["reflection-map", "shrm"].map(|method| stops(export(pair, method))[0]);
        assert_eq!(pair["advice"]["method"], "reflection-map");
        assert!((plain - shrm).abs() < 5e-3, "{plain} {shrm}");
    }
    // A rough surface does not: in the window's light a plain map is far off.
    let [plain, shrm] = ["reflection-map", "shrm"].map(|method| stops(export(&pairs[3], method))[0]);
    assert!(plain > 0.5 && shrm < 0.15, "{plain} {shrm}");
    // What is advised is good, and where nothing is, the report says what it tried.
    for pair in pairs {
        let method = pair["advice"]["method"].as_str().unwrap();
        assert_eq!(pair["advice"]["good"], is_good(export(pair, method)), "{pair}");
        assert_eq!(pair["tried"].as_array().unwrap().is_empty(), pair["advice"]["good"] == true, "{pair}");
    }
    // The advice for a material is that of an export's worst environment, with the figures of that one.
    for material in json["materials"].as_array().unwrap() {
        let advice = &material["advice"];
        let own = |pair: &&Value| {
            pair["material"] == material["name"] && pair["environment"] == advice["environment"]
        };
        let worst = export(pairs.iter().find(own).unwrap(), advice["method"].as_str().unwrap());
        let said = format!("within {:.2} stops and 99 % within {:.2}", stops(worst)[0], stops(worst)[1]);
        assert!(advice["why"].as_str().unwrap().contains(&said), "{advice}, not {said}");
    }
}

/// With degrees chosen for the light and lamps beside the map, a sun is right; a map of 25 coefficients that
/// holds it comes within 0.6 stops, and no other form comes near.
#[test]
fn under_a_sun_lights_beside_the_map_are_advised() {
    let case = with_material(with_sun(case("report", SMALL)), "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    let pair = &json["pairs"][0];
    assert_eq!((&pair["lamps"], &pair["for_light"]), (&1.into(), &true.into()));
    assert_eq!(
        (&pair["advice"]["method"], &pair["advice"]["good"]),
        (&"shrm-separate".into(), &true.into()),
        "{}",
        pair["advice"]["why"]
    );
    let [separate, baked, plain] =
        ["shrm-separate", "shrm", "reflection-map"].map(|method| stops(export(pair, method))[0]);
    assert!(separate < 0.1 && baked < 0.6 && plain > 1.0, "{separate} {baked} {plain}");
    assert!(export(pair, "shrm-separate")["bytes"].as_u64() < export(pair, "shrm")["bytes"].as_u64());
    assert!(pair["advice"]["why"].as_str().unwrap().contains("For one that only looks maps up, "));
}

/// A plain map about R shows the light of the mirror direction on the matte base; a map of each part is exact
/// here, because phong and lambert are the same from every view about their own centres.
#[test]
fn a_map_of_each_part_is_right_where_one_map_is_not() {
    let lacquer = brdf::Material::layers(vec![lambert(0.6), phong(20.0)]).unwrap();
    let case = with_material(with_sun(case("report", SMALL)), "lacquer", lacquer);
    let case = with_material(case, "chalk", lambert(0.6));
    let (json, page) = report(&case);
    check_page(&page);
    let [lacquer, chalk] = [0, 1].map(|index| &json["pairs"][index]);
    let [one, each] = ["reflection-map", "part-maps"].map(|method| stops(export(lacquer, method))[0]);
    assert!(each < 0.2 && one > 1.0, "{each} {one}");
    assert_eq!(export(lacquer, "part-maps")["bytes"].as_u64(), Some(2 * 8 * 6 * 12 * 12));
    assert!(chalk["exports"].as_array().unwrap().iter().all(|export| export["method"] != "part-maps"));
}

/// Low degrees ring around a sun. RMS hardly shows it, stops and the share of negative samples do, and what
/// the report then advises it has measured.
#[test]
fn given_degrees_that_ring_are_not_good_and_the_remedy_is_measured() {
    let parameters = format!("{SMALL}degree = [12, 4]");
    let case = with_material(with_sun(case("report", &parameters)), "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    let pair = &json["pairs"][0];
    let shrm = export(pair, "shrm");
    assert!(!is_good(shrm) && shrm["negative"].as_f64().unwrap() > 0.01, "{shrm}");
    assert_eq!((&pair["f"], &pair["p"], &pair["for_light"]), (&12.into(), &4.into(), &false.into()));
    let tried = pair["tried"].as_array().unwrap();
    let good = tried.iter().find(|trial| trial["change"]["no_degree"] == true && is_good(&trial["export"]));
    assert!(good.is_some(), "{tried:?}");
    let why = pair["advice"]["why"].as_str().unwrap();
    assert!(why.contains("The cut at the given degrees, F = 12 and P = 4, shows. With no degree"), "{why}");
}

#[test]
fn sizes_are_those_of_half_floats() {
    let parameters = format!("{SMALL}degree = [4, 2]");
    let case =
        with_material(with_environment(case("report", &parameters), "day", sky), "satin", microfacet(0.4));
    let (json, _) = report(&case);
    let exports = json["pairs"][0]["exports"].as_array().unwrap();
    let bytes: Vec<_> = exports.iter().map(|export| export["bytes"].as_u64().unwrap() / 8).collect();
    // The first is the compact map, whose texels have four bytes.
    assert_eq!(exports[0]["method"], "taps");
    assert_eq!(bytes[1..], [6 * 144, 16 * 24 * 48, 12 * 6 * 144, 9 * 6 * 144]);
    let p: Vec<_> = exports.iter().map(|export| export["p"].as_u64().unwrap()).collect();
    assert_eq!(p, [0, 0, 2, 2, 2]);
}

/// The errors of the SHRM, computed again from coefficients at each pixel's own direction. The map's
/// resolution adds the error of bilinear texels of 90 / 48 degrees, (F h)^2 / 8 = 0.002 of the detail at
/// degree F = 4.
#[test]
fn the_error_on_the_sphere_is_that_of_the_kernels() {
    let material = microfacet(0.5);
    let parameters = "sphere = 32\nresolution = 48\ndegree = [4, 1]\ntrade = false";
    let case = with_material(
        with_environment(case("report", parameters), "window", window),
        "matt",
        material.clone(),
    );
    let (json, _) = report(&case);
    let found = export(&json["pairs"][0], "shrm");

    let light: Map = environment(32, window).0;
    let degree = |l| Degree::new(l).unwrap();
    let lighting = Transform::new(light.grid(), degree(4)).unwrap().analyse(light.pixels());
    let choice = Choice::Degree { f: degree(4), p: degree(1) };
    let reflected =
        Reflection::convolve(&lighting, &project(&material, choice, Stop::NEVER).unwrap().coefficients);
    let reference = Reference::new(&light, &material, Cull::None);
    let dark = 0.01 * light.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
    let view = Direction::normalised(-DVec3::X);
    let (mut difference, mut energy, mut stops) = (0.0, 0.0, Vec::new());
    for index in 0..32 * 32 {
        let [x, y] = [index % 32, index / 32].map(|i| (f64::from(i) - 15.5) / 16.0);
        if x.hypot(y) < 1.0 {
            let normal = Direction::normalised(DVec3::new(-(1.0 - x * x - y * y).sqrt(), -x, -y));
            let central = brdf::Centre::Reflection.central(normal, normal, view);
            let (truth, value) = (reference.radiance(central, view), reflected.evaluate(central, view));
            for channel in 0..3 {
                difference += (truth[channel] - value[channel]).powi(2);
                energy += truth[channel].powi(2);
                stops.push(((value[channel].max(0.0) + dark) / (truth[channel] + dark)).log2().abs());
            }
        }
    }
    stops.sort_by(f64::total_cmp);
    let expected =
        [(difference / energy).sqrt(), stops[stops.len() * 95 / 100], stops[stops.len() * 99 / 100]];
    for (name, expected) in ["rms", "p95", "p99"].into_iter().zip(expected) {
        let found = found[name].as_f64().unwrap();
        assert!(
            expected > 0.01 && (found - expected).abs() < 0.003 + 0.02 * expected,
            "{name}: {found}, not {expected}"
        );
    }
}

#[test]
fn figures_of_pictures_of_different_sizes_agree_within_their_uncertainty() {
    let figures = |sphere: usize| {
        let parameters = format!("sphere = {sphere}\nresolution = 12\ntrade = false");
        let case = with_environment(case("report", &parameters), "window", window);
        let (json, page) = report(&with_material(case, "satin", microfacet(0.4)));
        check_page(&page);
        ["reflection-map", "kautz-mccool", "cabral", "shrm"].map(|method| {
            let export = export(&json["pairs"][0], method).clone();
            let number = |name: &str| export[name].as_f64().unwrap();
            ([number("p95"), number("p95_uncertainty")], export["one_of"].as_u64().unwrap())
        })
    };
    let (coarse, fine) = (figures(64), figures(160));
    for (([a, a_error], one_of), ([b, b_error], _)) in coarse.into_iter().zip(fine) {
        assert!((a - b).abs() < 4.0 * (a_error + b_error) + 0.01 * a, "{a} +- {a_error}, {b} +- {b_error}");
        assert!(one_of == 1 || a_error <= 0.02 * a.max(0.15), "{a} +- {a_error}");
    }
}

#[test]
fn a_black_material_has_no_error() {
    let case = with_material(with_environment(case("report", TRADE), "day", sky), "black", lambert(0.0));
    let (json, page) = report(&case);
    check_page(&page);
    let pair = &json["pairs"][0];
    for export in pair["exports"].as_array().unwrap() {
        assert_eq!((&export["rms"], &export["p99"]), (&0.0.into(), &0.0.into()));
    }
    assert_eq!(
        (&pair["advice"]["method"], &pair["advice"]["good"]),
        (&"reflection-map".into(), &true.into())
    );
    for point in series(pair).iter().flat_map(points) {
        assert_eq!((&point["rms"], &point["p99"]), (&0.0.into(), &0.0.into()));
    }
}

/// The series of a pair's trade.
pub(crate) fn series(pair: &Value) -> &[Value] {
    pair["trade"]["series"].as_array().unwrap()
}

pub(crate) fn points(series: &Value) -> &[Value] {
    series["points"].as_array().unwrap()
}

/// A reflection of a turned light, of the pair "gold" under "day".
fn reflected(f: usize, degrees: f64) -> Reflected {
    let degree = Degree::new(f).unwrap();
    let brdf = project(&phong(8.0), Choice::Degree { f: degree, p: Degree::ZERO }, Stop::NEVER)
        .unwrap()
        .coefficients;
    let light = environment(32, window).0;
    let lighting = Transform::new(light.grid(), degree).unwrap().analyse(light.pixels());
    let turn = Rotation::from_yaw_pitch_roll(degrees.to_radians(), 0.0, 0.0);
    Reflected(Reflection::convolve(&sh::rotate(&lighting, turn), &brdf))
}

#[test]
fn a_connected_reflection_is_the_one_that_is_shown() {
    let base = |parameters: &str| {
        with_material(with_environment(case("report", parameters), "day", window), "gold", phong(8.0))
    };
    let pair = [("environment", "day"), ("material", "gold")];
    let connected = base(SMALL).keyed_input("reflection", &pair, reflected(5, 0.0));
    let ran = connected.run().unwrap();
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
    let (json, _) = report(&connected);
    assert_eq!((&json["pairs"][0]["f"], &json["pairs"][0]["p"]), (&5.into(), &0.into()));
    // A light that was turned is another one.
    let turned = base(SMALL).keyed_input("reflection", &pair, reflected(5, 60.0)).run().unwrap();
    assert!(turned.warnings[0].contains("gold under day: the reflection was not made from this environment"));
    let other = [("environment", "day"), ("material", "brass")];
    assert_eq!(
        base(SMALL).keyed_input("reflection", &other, reflected(5, 0.0)).failure(),
        "the port reflection receives no reflection of gold under day"
    );
    let both = format!("{SMALL}degree = [5, 0]");
    assert_eq!(
        base(&both).keyed_input("reflection", &pair, reflected(5, 0.0)).failure(),
        "`degree` and `tolerance` have no effect on a connected reflection"
    );
}

#[test]
fn names_are_shown_as_they_are() {
    let name = "<b>\"R&D\" 'gold' 素材</b>";
    let case = with_material(with_environment(case("report", TRADE), "day", sky), name, lambert(0.5));
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
        with_material(with_environment(case("report", TRADE), "window", window), "satin", microfacet(0.7));
    let files = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| case.files())
    };
    assert!(files(1) == files(2));
}

#[test]
fn impossible_parameters_are_errors() {
    for (parameters, expected) in [
        ("accept = 0", "accept: 0 is not a number above 0 and at most 3"),
        ("sphere = 23", "sphere: 23 is not a whole number from 24 to 256"),
        ("resolution = 1000", "resolution: 1000 is not a whole number from 4 to 512"),
        ("amplify = 0.5", "amplify: 0.5 is not a number from 1 to 100"),
        ("tolerance = 0.1\ndegree = [3, 1]", "tolerance: degree already sets the degrees"),
    ] {
        assert_eq!(case("report", parameters).errors(), [expected]);
    }
}

fn ashikhmin_shirley(exponents: [f64; 2]) -> brdf::Material {
    let model = brdf::AshikhminShirley::new(exponents, [0.0; 3], [1.0; 3]).unwrap();
    brdf::Material::AshikhminShirley(model)
}

/// The errors of `prt-energy.json`, over the same pixels: with others, those of degree 4 differ by up to a
/// tenth. Its sphere is seen along +X, that of a report along -X: the light is turned by half a turn about
/// +Z, along which both are brushed.
#[test]
fn spheres_of_a_table_are_as_far_off_as_the_degrees_make_them() {
    const TEST: &str = "spheres_of_a_table_are_as_far_off_as_the_degrees_make_them";
    let Some(reference) = test_data::reference(TEST, "prt-energy.json") else { return };
    let light = test_data::reference(TEST, "lighting.json").unwrap();
    let rgb = |value: &Value| [0, 1, 2].map(|channel| value[channel].as_f64().unwrap());
    let constant = rgb(&light["constant"]);
    let lobes: Vec<(DVec3, f64, [f64; 3])> = light["lobes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|lobe| {
            let axis = DVec3::from_array(rgb(&lobe["direction"])).normalize();
            (axis, lobe["sharpness"].as_f64().unwrap(), rgb(&lobe["amplitude"]))
        })
        .collect();
    let turned = environment(128, |w| {
        let w = DVec3::new(-w.x, -w.y, w.z);
        let mut sum = constant;
        for (axis, sharpness, amplitude) in &lobes {
            let value = (sharpness * (axis.dot(w) - 1.0)).exp();
            (0..3).for_each(|channel| sum[channel] += amplitude[channel] * value);
        }
        sum
    });
    let case = case("report", "sphere = 24\nsections = [\"tables\"]\ntable-error = 0.03");
    let mut case = case.keyed_input("environment", &[("environment", "lobes")], turned);
    let cases = reference["cases"].as_array().unwrap();
    let cases = [&cases[0], &cases[2]];
    for of in &cases {
        let exponents = ["exponent_x", "exponent_y"].map(|name| of["parameters"][name].as_f64().unwrap());
        assert_eq!(of["model"], "ashikhmin-shirley");
        case = with_material(case, &format!("as-{:03}", exponents[0]), ashikhmin_shirley(exponents));
    }
    let (json, page) = report(&case);
    check_page(&page);
    assert!(
        page.contains("n = 225") && page.contains("degree 14, windowed") && !page.contains("Kautz-McCool")
    );
    let tables = json["tables"].as_array().unwrap();
    assert_eq!((tables.len(), json["pairs"].as_array().unwrap().len()), (2, 0));
    for (table, of) in tables.iter().zip(cases) {
        for (l, share) in table["captured"].as_array().unwrap().iter().enumerate() {
            let expected = of["captured_over_views"][l].as_f64().unwrap();
            assert!((share.as_f64().unwrap() - expected).abs() < 1e-3, "l = {l}: {share} {expected}");
        }
        let pair = &table["pairs"][0];
        let cuts = pair["cuts"].as_array().unwrap();
        assert_eq!((cuts.len(), &cuts[15]["windowed"], &cuts[4]["rows"]), (16, &true.into(), &25.into()));
        let rms = |cut: usize| cuts[cut]["rms"].as_f64().unwrap();
        // The report's brute force is good to half a percent, which the errors of a cut add to or take from.
        for (cut, name) in [(2, "degree_2"), (4, "degree_4"), (15, "degree_14_hanning")] {
            let expected = of["sphere_rms"][name].as_f64().unwrap();
            assert!((rms(cut) / expected - 1.0).abs() < 0.05, "{name}: {} {expected}", rms(cut));
        }
        assert!(rms(14) < 0.007, "{}", rms(14));
        let least = (0..=14).find(|degree| rms(*degree) <= 0.03).unwrap();
        assert_eq!(
            (pair["advised"].as_u64(), table["advised"].as_u64()),
            (Some(least as u64), Some(least as u64))
        );
    }
    assert!(tables[0]["advised"].as_u64() < tables[1]["advised"].as_u64(), "sharper needs more");
}

/// A sun is not in reach of degree 14, and the report says so beside the maps.
#[test]
fn under_a_sun_no_degree_of_a_table_is_good() {
    let parameters = "sphere = 32\nresolution = 12\nsections = [\"maps\", \"tables\"]";
    let case = with_material(with_sun(case("report", parameters)), "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    assert!(page.contains("SHRM") && page.contains("id=\"tables\""));
    let table = &json["tables"][0];
    assert_eq!((&table["advised"], &table["pairs"][0]["advised"]), (&Value::Null, &Value::Null));
    assert_eq!(json["pairs"].as_array().unwrap().len(), 1);
    let notes = case.run().unwrap().notes;
    let expected = "satin: no table up to degree 14 is within 2.0 % RMS";
    assert!(notes.iter().any(|note| note == expected), "{notes:?}");
}

/// The error of a density by a set of points, of 4, 16, 64 and 256 samples.
fn noise(pair: &Value, follows: &str, points: &str) -> Vec<f64> {
    let of = pair["noise"].as_array().unwrap();
    let found = of.iter().find(|noise| noise["follows"] == follows && noise["points"] == points).unwrap();
    found["rms"].as_array().unwrap().iter().map(|rms| rms.as_f64().unwrap()).collect()
}

#[test]
fn the_product_of_light_and_material_has_the_least_noise() {
    let case = with_environment(case("report", "sections = [\"sampling\"]"), "window", window);
    let case = with_material(with_material(case, "satin", microfacet(0.3)), "chalk", lambert(0.8));
    let (json, page) = report(&case);
    check_page(&page);
    let pairs = json["sampling"].as_array().unwrap();
    assert_eq!((pairs.len(), json["pairs"].as_array().unwrap().len()), (2, 0));
    for pair in pairs {
        let product = noise(pair, "product", "random");
        for other in ["light", "lobe", "both"] {
            assert!(product[2] < noise(pair, other, "random")[2], "{other}: {pair}");
        }
        // Independent samples: a quarter of the variance with four times as many.
        for follows in ["light", "lobe", "both", "product"] {
            let rms = noise(pair, follows, "random");
            let slope = (rms[3] / rms[0]).log2() / 6.0;
            assert!((-0.65..-0.35).contains(&slope), "{follows}: {slope}, {rms:?}");
        }
        // Stratified points of a smooth weight are better than that.
        assert!(noise(pair, "product", "stratified")[3] < 0.7 * product[3], "{pair}");
    }
    let ran = case.run().unwrap();
    let said = "at 64 samples, the product of light and material has the least noise in 2 of 2 pairs";
    assert_eq!(ran.notes, [said]);
}

#[test]
fn a_black_environment_has_no_noise_and_no_lights() {
    let case = case("report", "sphere = 24\nsections = [\"sampling\", \"rigs\"]");
    let case = with_material(with_environment(case, "night", |_| [0.0; 3]), "chalk", lambert(0.8));
    let (json, page) = report(&case);
    check_page(&page);
    assert_eq!(json["sampling"].as_array().unwrap().len(), 0);
    for sphere in json["rigs"][0]["materials"][0]["spheres"].as_array().unwrap() {
        assert_eq!((&sphere["lights"], &sphere["rms"]), (&0.into(), &0.0.into()));
    }
}

#[test]
fn more_lights_of_a_rig_are_nearer_to_brute_force() {
    let case = with_environment(case("report", "sphere = 32\nsections = [\"rigs\"]"), "window", window);
    let case = with_material(with_material(case, "satin", microfacet(0.4)), "chalk", lambert(0.8));
    let (json, page) = report(&case);
    check_page(&page);
    let materials = json["rigs"][0]["materials"].as_array().unwrap();
    assert_eq!(materials.len(), 2);
    for method in ["median-cut", "warped"] {
        let rms = |material: usize| -> Vec<f64> {
            let spheres = materials[material]["spheres"].as_array().unwrap();
            let own = spheres.iter().filter(|sphere| sphere["method"] == method);
            own.map(|sphere| sphere["rms"].as_f64().unwrap()).collect()
        };
        let [satin, chalk] = [rms(0), rms(1)];
        assert_eq!(satin.len(), 5);
        for of in [&satin, &chalk] {
            assert!(of[2] < 0.7 * of[0] && of[4] < 0.7 * of[2], "{method}: {of:?}");
        }
        // A matte surface hardly shows lights one by one, a glossy one does.
        assert!(chalk[4] < 0.02 && chalk[2] < satin[2], "{method}: {chalk:?} {satin:?}");
    }
}
