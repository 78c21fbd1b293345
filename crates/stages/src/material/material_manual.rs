//! The models and presets in the manual of `import-material`, made from their own texts.

use brdf::{Absent, MODELS, ModelText, Parameter, ValueType};

use super::material_messages::looks_like;
use super::material_schema::capital;
use super::presets::PRESETS;

/// Fills the section of each model and the rows of presets into a manual, which has a place for them, a name
/// in braces.
pub(crate) fn fill_in(manual: &str) -> String {
    let presets = PRESETS.iter().map(|preset| format!("| `{}` | {} |", preset.name, preset.summary()));
    manual
        .replace("{list: models}", &MODELS.iter().map(section).collect::<Vec<_>>().join("\n\n"))
        .replace("{list: presets}", &presets.collect::<Vec<_>>().join("\n"))
}

fn section(model: &ModelText) -> String {
    let mut lines = vec![format!("### `{}`\n\n{}.\n", model.name, capital(model.summary))];
    if !model.details.is_empty() {
        lines.push(format!("{}\n", model.details));
    }
    lines.push("| key | value | meaning |\n| --- | --- | --- |".to_owned());
    lines.extend(rows(model.parameters, ""));
    lines.join("\n")
}

/// A row for each parameter, and for those of its tables.
fn rows(parameters: &[Parameter], within: &str) -> Vec<String> {
    let row = |parameter: &Parameter| {
        let looks_like = match parameter.value_type {
            ValueType::Number(range) => range.words.to_owned(),
            ValueType::Colour(range) => format!("a colour, each {}", range.words),
            ValueType::Records(_) => looks_like(&parameter.value_type),
        };
        let absent = match parameter.absent {
            Absent::Required => "required".to_owned(),
            Absent::RequiredUnless([x, y]) => format!("required unless `{x}` and `{y}` are given"),
            Absent::Optional => "optional".to_owned(),
            Absent::Default(value) => format!("default {value}"),
        };
        let (name, meaning) = (parameter.name, parameter.meaning);
        let mut rows = vec![format!("| `{within}{name}` | {looks_like}; {absent} | {meaning} |")];
        if let ValueType::Records(inner) = parameter.value_type {
            rows.extend(self::rows(inner, &format!("{within}{name}.")));
        }
        rows
    };
    parameters.iter().flat_map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_has_its_texts_and_a_row_for_each_parameter() {
        let of = |name: &str| MODELS.iter().find(|model| model.name == name).map(section).unwrap();
        let cylinders = "\
### `poulin-fournier`

Parallel cylinders along the tangent, as of brushed metal or satin.

Each point of the cylinders, and of the floor between them, is matte with a highlight; what one cylinder
hides of the next does not count (Poulin and Fournier 1990). The highlight is drawn out across the
cylinders; higher or closer cylinders draw it out more.

| key | value | meaning |
| --- | --- | --- |
| `exponent` | a number from 0 to 1e9; required | the sharpness of a point's highlight: the power of the half vector's cosine |
| `diffuse` | a colour, each a number from 0 to 1e6; default 0 | the share of light that a point's matte part reflects |
| `specular` | a colour, each a number from 0 to 1e6; default 1 | the weight of the highlight |
| `distance` | a number from 2 to 100; default 2 | the distance between the axes of cylinders, in radii; 2 if they touch |
| `height` | a number from 0 to 2; default 1 | how far cylinders rise above the floor, in radii; 0 is flat, 1 half a cylinder |";
        assert_eq!(of("poulin-fournier"), cylinders);
        let lobes = "\
### `lafortune`

A matte part and generalised cosine lobes, fitted to measurements; not normalised.

| key | value | meaning |
| --- | --- | --- |
| `diffuse` | a colour, each a number from 0 to 1e6; default 0 | the share of light that the matte part reflects |
| `lobes` | an array of tables { cx, cz, n, weight }; required | the lobes |
| `lobes.cx` | a number from -10 to 10; required | the factor of L_x V_x + L_y V_y; -1 for Phong's lobe |
| `lobes.cz` | a number from -10 to 10; required | the factor of L_z V_z; 1 for Phong's lobe |
| `lobes.n` | a number from 0 to 1e6; required | the power |
| `lobes.weight` | a colour, each a number from 0 to 1e6; default 1 | the weight of the lobe |";
        assert_eq!(of("lafortune"), lobes);
        let rows = [
            "| `roughness` | a number from 0.01 to 1; required unless `roughness_x` and `roughness_y` are given | \
             the width of the highlight: alpha is its square |",
            "| `k` | a colour, each a number from 0 to 50; optional | the extinction of a conductor, with `n` |",
        ];
        assert!(rows.iter().all(|row| of("ggx").lines().any(|line| line == *row)), "{}", of("ggx"));
    }

    #[test]
    fn the_manual_has_every_model() {
        let manual = crate::kinds().get("import-material").map(|kind| kind.manual()).unwrap();
        for model in MODELS {
            assert!(manual.contains(&format!("\n\n{}\n\n", section(model))), "{}", model.name);
        }
    }
}
