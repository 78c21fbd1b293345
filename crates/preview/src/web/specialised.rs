//! A fragment shader for some models of materials alone.
//!
//! A device that draws many pixels at once goes through each formula that a shader names, for each look at a
//! material, whichever it is: with all models, a browser without a graphics device took more than a minute
//! for a picture. And every device compiles less.

use std::collections::{BTreeMap, BTreeSet};

/// The shader without the choices of other models, and without the functions that nothing calls then.
pub(super) fn specialised(shader: &str, models: &BTreeSet<u32>) -> String {
    let mut text = String::new();
    let (mut is_choice, mut is_left_out) = (false, false);
    for line in shader.lines() {
        is_choice |= line.starts_with("vec3 material_layer(");
        let case = line.strip_prefix("        case ").and_then(|rest| rest.strip_suffix("u: {"));
        if let Some(model) = case.filter(|_| is_choice) {
            is_left_out = model.parse().is_ok_and(|model| !models.contains(&model));
        }
        if !is_left_out {
            text += line;
            text += "\n";
        }
        is_left_out &= line != "        }";
        is_choice &= line != "}";
    }
    read(&called(&text))
}

/// The text without the uniforms that nothing reads: a program has their blocks, even so.
fn read(text: &str) -> String {
    let mut mentions: BTreeMap<&str, usize> = BTreeMap::new();
    for word in words(text) {
        *mentions.entry(word).or_default() += 1;
    }
    let is_read = |line: &&str| {
        let is_uniform = line.starts_with("uniform ") || line.starts_with("layout(std140) uniform ");
        let declared = line.trim_end().trim_end_matches([';', '}', ' ']).rsplit(' ').next();
        let name = declared.and_then(|name| name.split('[').next()).unwrap_or_default();
        !is_uniform || mentions.get(name).is_none_or(|count| *count > 1)
    };
    text.split_inclusive('\n').filter(is_read).collect()
}

/// The names, keywords and numbers of a text.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
}

/// The text without the functions that `main` does not call, not even through others.
fn called(text: &str) -> String {
    let mut functions = BTreeMap::new();
    let mut parts = Vec::new();
    for part in text.split_inclusive("\n}\n") {
        // A function begins at the last line that ends with a parenthesis and a brace and is not indented.
        let head = part.lines().find(|line| line.ends_with(") {") && !line.starts_with(' '));
        let name = head.and_then(|head| head.split('(').next()?.rsplit(' ').next());
        let start = head.and_then(|head| part.find(head)).unwrap_or(part.len());
        let (before, function) = part.split_at(start);
        functions.extend(name.map(|name| (name, function)));
        parts.push((before, name, function));
    }
    let mut used = BTreeSet::from(["main"]);
    let mut left = vec!["main"];
    while let Some(name) = left.pop() {
        let body = functions.get(name).copied().unwrap_or_default();
        for word in words(body) {
            if functions.contains_key(word) && used.insert(word) {
                left.push(word);
            }
        }
    }
    let kept = |name: &str| used.contains(name);
    parts
        .into_iter()
        .flat_map(|(before, name, function)| [before, if name.is_none_or(kept) { function } else { "" }])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::material::all_models;

    const TAPS: &str = include_str!("taps.frag.glsl");

    #[test]
    fn a_shader_has_the_models_that_it_is_asked_for() {
        for model in all_models() {
            let text = specialised(TAPS, &BTreeSet::from([model]));
            let cases: Vec<_> = text.lines().filter(|line| line.starts_with("        case ")).collect();
            let of_material = format!("        case {model}u: {{");
            assert!(cases.contains(&of_material.as_str()), "{model}");
            let body = text.split("vec3 material_layer(").nth(1).unwrap().split("\n}\n").next().unwrap();
            assert_eq!(body.matches("return material_").count() + body.matches("= material_").count(), 1);
            assert!(text.contains("void main() {") && text.len() < TAPS.len(), "{model}: {}", text.len());
        }
    }

    #[test]
    fn every_function_that_is_called_is_there() {
        assert_eq!(called("float a() {\n    return b();\n}\n\nfloat b() {\n    return 1.0;\n}\n\nfloat c() {\n    return a();\n}\n\nvoid main() {\n    x = a();\n}\n").matches(") {").count(), 3);
        let whole = specialised(TAPS, &all_models());
        for name in ["material_standard", "taps_radiance", "lamps_level"] {
            assert!(whole.contains(&format!(" {name}(")), "{name}");
        }
        assert!(!specialised(TAPS, &BTreeSet::new()).contains("material_standard"));
    }
    #[test]
    fn uniforms_that_nothing_reads_are_left_out() {
        let text = "uniform highp sampler2D map;\nuniform highp sampler2D other;\n\
                    layout(std140) uniform page_block { PageUniforms page; };\n\
                    layout(std140) uniform lamps_block { vec4 lamps[3]; };\n\
                    void main() {\n    x = page.gain + texelFetch(map, ivec2(0), 0).x;\n}\n";
        let found = read(text);
        assert!(
            found.contains(" map;") && found.contains(" page;") && found.contains("void main"),
            "{found}"
        );
        assert!(!found.contains("other") && !found.contains("lamps"), "{found}");
    }
}
