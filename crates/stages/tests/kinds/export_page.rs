//! Live pages: what their data say, what they hold, and what they leave out. What they draw is compared with
//! the CPU's pictures in a browser, by tests/readers/page.mjs.

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::Value;
use stages::artifacts::{Material, Reflection, ScaleSpace, Taps};

use crate::fixture::{Case, case, environment, lambert, phong, reflection, sky};
use crate::taps::{fit_taps, scale_space};

const DAY: [(&str, &str); 1] = [("environment", "day")];

/// A material with a name under one environment, in all forms.
pub(crate) fn page(parameters: &str, name: &str) -> Case {
    let pair = [DAY[0], ("material", name)];
    let scales = case("scale-space", "resolution = 16").input("environment", environment(64, sky));
    case("export-page", parameters)
        .keyed_input("environment", &DAY, environment(64, sky))
        .keyed_input("material", &[pair[1]], Material(phong(20.0)))
        .keyed_input("reflection", &pair, reflection(phong(20.0), 4))
        .keyed_input("scale-space", &DAY, (*scales.artifact::<ScaleSpace>()).clone())
        .keyed_input("taps", &[pair[1]], (*fit_taps("taps = 2").artifact::<Taps>()).clone())
}

/// The text and the data of a page.
fn read(case: &Case) -> (String, Value) {
    let files = case.files();
    assert_eq!(files.len(), 1);
    let text = String::from_utf8(files[0].clone()).unwrap();
    let data = text.split("id=\"page-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data = serde_json::from_str(data).unwrap();
    (text, data)
}

fn blob(page: &str, place: &Value) -> Vec<u8> {
    let text = page.split(&format!("id=\"blob-{place}\">")).nth(1).unwrap().split('<').next().unwrap();
    miniz_oxide::inflate::decompress_to_vec_zlib(&BASE64_STANDARD.decode(text).unwrap()).unwrap()
}

fn forms(data: &Value) -> Vec<&str> {
    let views = data["pairs"][0]["views"].as_array().unwrap();
    let form =
        |view: &Value| data["modes"][view["mode"].as_u64().unwrap() as usize]["name"].as_str().unwrap();
    views.iter().map(form).collect()
}

#[test]
fn a_page_has_every_form_and_all_that_it_refers_to() {
    let (page, data) = read(&page("resolution = 8\nslices = 4", "copper"));
    let all = ["taps", "local-shrm", "cabral", "kautz-mccool", "prefiltered", "irradiance", "mirror"];
    assert_eq!(forms(&data), all);
    assert_eq!(data["left_out"], Value::Array(Vec::new()));
    for view in data["pairs"][0]["views"].as_array().unwrap() {
        let shader = String::from_utf8(blob(&page, &view["fragment"])).unwrap();
        assert!(shader.starts_with("#version 300 es") && shader.contains("void main()"));
        for (name, texture) in view["textures"].as_object().unwrap() {
            assert!(shader.contains(&format!(" {name};")), "{name}");
            let texels: u64 =
                texture["size"].as_array().unwrap().iter().map(|side| side.as_u64().unwrap()).product();
            let bytes = match texture["format"].as_str().unwrap() {
                "rgb9e5" | "r32ui" => 4,
                "rgb16f" => 6,
                "rgba16f" => 8,
                _ => 16,
            };
            assert_eq!(blob(&page, &texture["blob"]).len() as u64, texels * bytes, "{name}");
        }
        for (name, block) in view["blocks"].as_object().unwrap() {
            let vectors = blob(&page, &block["blob"]).len() / 16;
            assert!(shader.contains(&format!(" {name}[{vectors}]; }};")), "{name} of {vectors} vectors");
        }
    }
    // Nothing outside is asked for.
    let text = page.replace("http-equiv", "").replace("http://www.w3.org/2000/svg", "");
    assert!(!text.contains("http") && !text.contains("src=\"/") && page.contains("default-src 'none'"));
}

#[test]
fn errors_are_those_of_a_comparison_with_brute_force() {
    let (page_text, data) = read(&page("resolution = 16\nslices = 8", "copper"));
    let of = |form: &str| {
        let place = forms(&data).iter().position(|name| *name == form).unwrap();
        data["pairs"][0]["views"][place]["error"]["p95"].as_f64()
    };
    assert!(
        of("local-shrm").unwrap() < 0.1 && of("taps").unwrap() < 0.3,
        "{:?} {:?}",
        of("local-shrm"),
        of("taps")
    );
    assert!(of("prefiltered").unwrap() > of("local-shrm").unwrap());
    assert_eq!(of("mirror"), None);
    assert_eq!(page_text.matches("<img").count(), 1);
    let (page, data) = read(&page("resolution = 8\nslices = 4\nmeasure = false", "copper"));
    assert!(data["pairs"][0]["views"].as_array().unwrap().iter().all(|view| view["error"].is_null()));
    assert_eq!(page.matches("<img").count(), 0);
}

#[test]
fn a_page_that_would_be_too_large_says_what_it_leaves_out() {
    let case = page("resolution = 64\nslices = 16\nsize-limit = 0.44\nmeasure = false", "copper");
    let (text, data) = read(&case);
    assert!(text.len() < 440_000, "{}", text.len());
    let left = data["left_out"].as_array().unwrap();
    assert!(forms(&data).starts_with(&["taps"]) && !left.is_empty(), "{:?} {left:?}", forms(&data));
    assert!(left.iter().all(|line| line.as_str().unwrap().starts_with("copper under day as ")), "{left:?}");
    let warnings = case.run().unwrap().warnings;
    assert!(warnings.iter().any(|line| line.contains("larger than 0.44 MB")), "{warnings:?}");
}

/// Twenty photographs and one material: the skies are small, and the material is there.
#[test]
fn skies_leave_room_for_materials() {
    let noise =
        |w: sphere::DVec3| [w.x, w.y, w.z].map(|x| (x * 12_345.678).sin().mul_add(43_758.545, 1e5) % 1.0);
    let taps = fit_taps("taps = 2").artifact::<Taps>();
    let mut case = case("export-page", "size-limit = 1.6\nmeasure = false").keyed_input(
        "taps",
        &[("material", "copper")],
        (*taps).clone(),
    );
    for name in
        ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p", "q", "r", "s", "t"]
    {
        let key = [("environment", name)];
        let scales =
            self::case("scale-space", "resolution = 16").input("environment", environment(64, noise));
        case = case.keyed_input("environment", &key, environment(64, noise)).keyed_input(
            "scale-space",
            &key,
            (*scales.artifact::<ScaleSpace>()).clone(),
        );
    }
    let (_, data) = read(&case);
    assert!(data["skies"][0]["textures"]["map"]["size"][1].as_u64().unwrap() <= 64);
    assert_eq!(forms(&data)[0], "taps");
}

#[test]
fn a_hostile_name_is_text() {
    let name = "</script><script>alert(1)</script>";
    let (text, data) = read(&page("resolution = 8\nslices = 4", name));
    assert_eq!(data["materials"][0], name);
    assert!(!text.contains("<script>alert"));
}

#[test]
fn what_is_missing_is_named() {
    let day = || case("export-page", "").keyed_input("environment", &DAY, environment(16, sky));
    assert_eq!(day().failure(), "no material is connected under an environment");
    let scales = scale_space("resolution = 16").artifact::<ScaleSpace>();
    let alone = day().keyed_input("scale-space", &DAY, (*scales).clone());
    assert_eq!(alone.failure(), "scale-space is connected, but taps is not");
    // A reflection under another light is no pair of this one.
    let other = [("environment", "night"), ("material", "chalk")];
    let other = day().keyed_input("reflection", &other, reflection(lambert(0.8), 2));
    assert_eq!(other.failure(), "no material is connected under an environment");
}

/// Without a material there is nothing to compare with, and maps are shown all the same.
#[test]
fn a_reflection_is_enough() {
    let pair = [DAY[0], ("material", "chalk")];
    let case = case("export-page", "resolution = 8\nslices = 4")
        .keyed_input("environment", &DAY, environment(32, sky))
        .keyed_input::<Reflection>("reflection", &pair, reflection(lambert(0.8), 2));
    let (_, data) = read(&case);
    assert_eq!(forms(&data)[0], "local-shrm");
    assert!(data["pairs"][0]["views"][0]["error"].is_null());
}
