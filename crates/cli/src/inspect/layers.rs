//! How `specula inspect` describes our OpenEXR files with a layer for each coefficient: reflection maps in
//! spherical harmonics.

use std::collections::BTreeMap;

use containers::{Error, ExrLayers, read_exr_layers};
use serde_json::{Value, json};

use super::facts::{Facts, range};
use super::lights;

/// The prefix of the names of texts in files of ours.
const PREFIX: &str = "specula.";

/// The text that a file of coefficients has.
const BASIS: &str = "specula.basis";

/// The header, with its texts, comes first; it lies within this many bytes.
const HEADER: usize = 1 << 20;

/// The facts of a file of coefficients; `None` if the OpenEXR file is another image.
pub(super) fn reflection_map(bytes: &[u8]) -> Option<Result<Facts, Error>> {
    let header = &bytes[..bytes.len().min(HEADER)];
    if !header.windows(BASIS.len()).any(|text| text == BASIS.as_bytes()) {
        return None;
    }
    match read_exr_layers(bytes) {
        Ok(file) => file.metadata.contains_key(BASIS).then(|| Ok(facts(&file))),
        Err(error) => Some(Err(error)),
    }
}

fn facts(file: &ExrLayers) -> Facts {
    let texts: BTreeMap<&str, &str> = file
        .metadata
        .iter()
        .filter_map(|(key, text)| Some((key.strip_prefix(PREFIX)?, text.as_str())))
        .collect();
    let mut warnings = file.warnings.clone();
    let mut facts: Facts = vec![
        ("what", "shrm".into()),
        ("format", "OpenEXR, a layer for each coefficient".into()),
        ("shape", shape(file, &texts, &mut warnings).into()),
    ];
    for label in ["basis", "centre", "degree", "frame", "layout", "terms", "view"] {
        match texts.get(label) {
            Some(text) => facts.push((label, (*text).into())),
            None => warnings.push(format!("the file has no {PREFIX}{label}")),
        }
    }
    check_rows(file, &texts, &mut warnings);
    facts.push(("lamps", texts.get("lamps").copied().unwrap_or("baked").into()));
    if let Some(text) = texts.get("lights") {
        match read_lights(text) {
            Some(found) => facts.extend(lights(&found)),
            None => warnings.push(format!("{PREFIX}lights is not a list of lights of seven numbers")),
        }
    }
    let values = file.layers.iter().flat_map(|(_, pixels)| pixels);
    facts.extend(range("coefficients of radiance", values.map(|pixel| pixel.map(f64::from))));
    if !warnings.is_empty() {
        facts.push(("warnings", json!(warnings)));
    }
    facts
}

/// `cube, faces of 64 x 64, 9 layers, RGB`
fn shape(file: &ExrLayers, texts: &BTreeMap<&str, &str>, warnings: &mut Vec<String>) -> String {
    let ExrLayers { width, height, layers, .. } = file;
    let size = match texts.get("layout") {
        Some(&"cube") if *height == 6 * width => format!("cube, faces of {width} x {width}"),
        Some(&"lat-long") if *width == 2 * height => format!("{width} x {height}"),
        layout => {
            let layout = layout.unwrap_or(&"its layout");
            warnings.push(format!("{width} x {height} pixels do not fit {layout}"));
            format!("{width} x {height}")
        }
    };
    format!("{size}, {} layers, RGB", layers.len())
}

/// Checks that the file has the layers of its degree.
fn check_rows(file: &ExrLayers, texts: &BTreeMap<&str, &str>, warnings: &mut Vec<String>) {
    let rows: Vec<&str> = texts.get("rows").map(|rows| rows.split(' ').collect()).unwrap_or_default();
    let degree = texts.get("degree").and_then(|degree| degree.parse::<usize>().ok());
    let expected = degree.and_then(|degree| degree.checked_add(1)?.checked_pow(2));
    if expected != Some(rows.len()) {
        warnings.push(format!("{PREFIX}rows names {} layers, but its degree has another number", rows.len()));
    }
    for (index, row) in rows.iter().enumerate() {
        // The first is the one that any viewer shows.
        let name = if index == 0 { "" } else { row };
        if !file.layers.iter().any(|(layer, _)| layer == name) {
            warnings.push(format!("the layer {row} is missing"));
        }
    }
}

/// Lights as the manual of `export-shrm` describes them: direction, radius, irradiance.
fn read_lights(text: &str) -> Option<Vec<sh::Light>> {
    let Ok(Value::Array(lights)) = serde_json::from_str(text) else { return None };
    let light = |light: &Value| {
        let numbers = light.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?;
        let [x, y, z, radius, r, g, b] = numbers[..] else { return None };
        let direction = sphere::DVec3::new(x, y, z);
        let is_direction = direction.is_finite() && direction.length_squared() > 0.0;
        is_direction.then(|| sh::Light {
            direction: sphere::Direction::normalised(direction),
            radius,
            irradiance: [r, g, b],
        })
    };
    lights.iter().map(light).collect()
}

#[cfg(test)]
mod tests {
    use containers::{Precision, write_exr_layers};

    use super::*;

    const LIGHTS: &str = "[[0.0, 0.0, 1.0, 0.01, 3.0, 2.0, 1.0]]";

    fn texts() -> Vec<(&'static str, &'static str)> {
        vec![
            ("specula.basis", "real"),
            ("specula.centre", "reflection"),
            ("specula.degree", "1"),
            ("specula.frame", "right-handed, +Z up"),
            ("specula.layout", "cube"),
            ("specula.terms", "all"),
            ("specula.view", "local"),
            ("specula.rows", "p0q0 p1qm1 p1q0 p1q1"),
            ("specula.lamps", "separate"),
            ("specula.lights", LIGHTS),
        ]
    }

    /// A cube with an edge of 2 of degree 1, without some layers.
    fn file(texts: &[(&str, &str)], layers: &[&str]) -> Vec<u8> {
        let layer = |name: &&str| ((*name).to_owned(), vec![[0.5, 1.0, -2.0]; 24]);
        let layers: Vec<_> = layers.iter().map(layer).collect();
        write_exr_layers(2, 12, &layers, Precision::Float, Some("{}"), texts, sh::Stop::NEVER).unwrap().bytes
    }

    const ALL: [&str; 4] = ["", "p1qm1", "p1q0", "p1q1"];

    fn described(bytes: &[u8]) -> BTreeMap<&'static str, Value> {
        super::super::describe(bytes).unwrap().into_iter().collect()
    }

    #[test]
    fn a_file_of_layers_has_the_facts_of_its_map() {
        let facts = described(&file(&texts(), &ALL));
        assert_eq!((&facts["what"], &facts["degree"]), (&json!("shrm"), &json!("1")));
        assert_eq!(facts["shape"], "cube, faces of 2 x 2, 4 layers, RGB");
        assert_eq!((&facts["view"], &facts["centre"]), (&json!("local"), &json!("reflection")));
        assert_eq!(facts["lamps"], "separate");
        let light = "toward (0.000, 0.000, 1.000), radius 0.57 degrees, irradiance 3.0000 2.0000 1.0000";
        assert_eq!(facts["lights"], json!([light]));
        assert_eq!(facts["greatest"], "[0.500000, 1.000000, -2.000000]");
        assert_eq!((&facts["recipe"], facts.get("warnings")), (&json!({}), None));
        let baked: Vec<_> =
            texts().into_iter().filter(|(_, text)| ![LIGHTS, "separate"].contains(text)).collect();
        let facts = described(&file(&baked, &ALL));
        assert_eq!(
            (&facts["lamps"], facts.get("lights"), facts.get("warnings")),
            (&json!("baked"), None, None)
        );
    }

    #[test]
    fn another_file_of_layers_is_an_image() {
        let facts = described(&file(&[("comment", "about specula.basis")], &ALL));
        assert_eq!(facts["what"], "image");
    }

    #[test]
    fn what_does_not_fit_together_is_said() {
        let with = |key: &'static str, text: &'static str| {
            let mut all = texts();
            all.retain(|(known, _)| *known != key);
            if !text.is_empty() {
                all.push((key, text));
            }
            described(&file(&all, &ALL))
                .get("warnings")
                .map(|warnings| warnings.to_string())
                .unwrap_or_default()
        };
        for (key, text, words) in [
            ("specula.view", "", "the file has no specula.view"),
            ("specula.layout", "lat-long", "2 x 12 pixels do not fit lat-long"),
            ("specula.degree", "99999999999999999999", "specula.rows names 4 layers, but its degree"),
            ("specula.degree", "18446744073709551615", "specula.rows names 4 layers, but its degree"),
            ("specula.rows", "p0q0", "specula.rows names 1 layers"),
            ("specula.rows", "p0q0 p1qm1 p1q0 p9q1", "the layer p9q1 is missing"),
            ("specula.lights", "[[1, 2]]", "specula.lights is not a list"),
            ("specula.lights", "[[0, 0, 0, 0, 0, 0, 0]]", "specula.lights is not a list"),
            ("specula.lights", "[", "specula.lights is not a list"),
        ] {
            let found = with(key, text);
            assert!(found.contains(words), "{key} = {text}: {found}");
        }
        let missing = described(&file(&texts(), &ALL[..3]));
        assert_eq!(missing["warnings"], json!(["the layer p1q1 is missing"]));
    }

    #[test]
    fn a_truncated_file_is_an_error_and_damage_never_panics() {
        let whole = file(&texts(), &ALL);
        for length in 0..whole.len() {
            assert!(super::super::describe(&whole[..length]).is_err(), "{length} bytes");
        }
        for place in (0..whole.len()).step_by(3) {
            let mut damaged = whole.clone();
            damaged[place] ^= 0x41;
            let _ = super::super::describe(&damaged);
        }
    }
}
