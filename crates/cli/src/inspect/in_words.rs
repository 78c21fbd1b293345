//! A material in words: its model and its parameters, as one sentence.

use brdf::{MODELS, Material, ModelText, StandardParameters, Value, Values};

/// What a material is: `a satin metal that reflects 0.93 0.62 0.52 at normal incidence; ...`.
pub(super) fn in_words(material: &Material) -> String {
    match material {
        Material::Standard(material) => standard(&material.parameters()),
        Material::Measured(measured) => {
            let [half, difference, azimuth] = measured.shape();
            format!("a measured table of {half} x {difference} x {azimuth} values")
        }
        Material::MeasuredAnisotropic(measured) => {
            let shape = measured.shape().map(|count| count.to_string()).join(" x ");
            format!("a measured table of {shape} values, which depend on the tangent")
        }
        Material::Layers(layers) => {
            let each =
                layers.iter().zip(1..).map(|(layer, number)| format!("({number}) {}", in_words(layer)));
            format!("the sum of {} layers: {}", layers.len(), each.collect::<Vec<_>>().join("; "))
        }
        other => match MODELS.iter().find(|model| model.name == other.name()) {
            Some(model) => of_model(model, &other.values()),
            None => other.name().to_owned(),
        },
    }
}

/// The model's own summary, and the parameters that have a value.
fn of_model(model: &ModelText, values: &Values) -> String {
    let given = model.parameters.iter().filter_map(|parameter| {
        let value = match values.get(parameter.name)? {
            Value::Number(number) => rounded(*number),
            Value::Colour(rgb) => colour(*rgb),
            Value::Records(records) => records.len().to_string(),
        };
        Some(format!("{} {value}", parameter.name))
    });
    let given = given.collect::<Vec<_>>().join(", ");
    format!("{}: {given} ({})", model.summary, model.name)
}

/// The layers of `standard` from the base up.
fn standard(parameters: &StandardParameters) -> String {
    let &StandardParameters { base_color, metallic, roughness, ior, specular, clearcoat, .. } = parameters;
    let finish = match roughness {
        ..0.05 => "a mirror-like",
        ..0.25 => "a polished",
        ..0.45 => "a satin",
        ..0.7 => "a rough",
        _ => "a matte",
    };
    let base = colour(base_color);
    let dielectric = || {
        let highlight = match specular {
            0.0 => "without a highlight".to_owned(),
            1.0 => format!("of index {}", rounded(ior)),
            _ => format!("of index {} with {} % of its highlight", rounded(ior), rounded(100.0 * specular)),
        };
        let tint = match parameters.specular_color {
            _ if specular == 0.0 => String::new(),
            [1.0, 1.0, 1.0] => String::new(),
            tint => format!(", tinted {}", colour(tint)),
        };
        format!("dielectric {highlight}{tint}")
    };
    let mut text = match metallic {
        1.0 => format!("{finish} metal that reflects {base} at normal incidence"),
        0.0 => format!("{finish} {} over a base of {base}", dielectric()),
        _ => {
            let share = rounded(100.0 * metallic);
            format!("{finish} mixture, {share} % metal, of {base}; the rest is a {}", dielectric())
        }
    };
    text +=
        &format!("; GGX facets of roughness {} (alpha {})", rounded(roughness), rounded(roughness.powi(2)));
    if parameters.sheen.iter().any(|channel| *channel > 0.0) {
        let (sheen, roughness) = (colour(parameters.sheen), rounded(parameters.sheen_roughness));
        text += &format!("; a sheen of {sheen}, roughness {roughness}");
    }
    if clearcoat > 0.0 {
        let roughness = rounded(parameters.clearcoat_roughness);
        text += &format!("; a clear coat of weight {}, roughness {roughness}", rounded(clearcoat));
    }
    text + " (standard)"
}

/// A colour as three numbers, or a grey as one.
fn colour(rgb: [f64; 3]) -> String {
    match rgb {
        [red, green, blue] if red == green && green == blue => rounded(red),
        rgb => rgb.map(rounded).join(" "),
    }
}

/// A number with three significant digits.
fn rounded(number: f64) -> String {
    format!("{number:.2e}").parse().map_or_else(|_| number.to_string(), |number: f64| number.to_string())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[track_caller]
    fn check(text: &str, words: &str) {
        let file = super::super::material::read(Path::new("a.toml"), text.as_bytes()).unwrap().unwrap();
        assert_eq!(in_words(&file.material), words);
    }

    #[test]
    fn materials_are_described_as_people_do() {
        check(
            "material = \"copper\"",
            "a satin metal that reflects 0.932 0.623 0.522 at normal incidence; GGX facets of roughness 0.3 (alpha 0.09) (standard)",
        );
        check(
            "model = \"standard\"\nbase_color = 0.5\nroughness = 0.8\nclearcoat = 0.5\nsheen = [0, 0.25, 0]",
            "a matte dielectric of index 1.5 over a base of 0.5; GGX facets of roughness 0.8 (alpha 0.64); a sheen of \
             0 0.25 0, roughness 0.5; a clear coat of weight 0.5, roughness 0.01 (standard)",
        );
        check(
            "layers = [{ model = \"lambert\", albedo = 0.2 }, { model = \"phong\", exponent = 30 }]",
            "the sum of 2 layers: (1) matte, the same from every view: albedo 0.2 (lambert); (2) a highlight about the \
             reflection vector, of one shape from every view: exponent 30, specular 1 (phong)",
        );
        check(
            "model = \"lafortune\"\nlobes = [{ cx = -1, cz = 1, n = 4 }]",
            "a matte part and generalised cosine lobes, fitted to measurements; not normalised: diffuse 0, lobes 1 \
             (lafortune)",
        );
    }

    #[test]
    fn every_model_has_words() {
        for material in Material::examples().unwrap() {
            let words = in_words(&material);
            assert!(words.ends_with(&format!(" ({})", material.name())), "{words}");
        }
    }
}
