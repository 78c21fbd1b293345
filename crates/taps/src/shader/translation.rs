//! From WGSL with a type at every declaration to other languages, line by line.

use super::language::Language;

/// The words of WGSL that other languages have another word for: GLSL's and HLSL's.
const WORDS: [(&str, &str, &str); 8] = [
    ("f32", "float", "float"),
    ("i32", "int", "int"),
    ("vec2f", "vec2", "float2"),
    ("vec3f", "vec3", "float3"),
    ("vec4f", "vec4", "float4"),
    ("mix", "mix", "lerp"),
    ("inverseSqrt", "inversesqrt", "rsqrt"),
    ("fract", "fract", "frac"),
];

/// The text in a language. Where rows are counted from the bottom, places in pictures are turned over.
pub(super) fn translate(text: &str, language: Language, rows_from_bottom: bool) -> String {
    let lines = text.lines().map(|line| {
        let (code, comment) = line.find("//").map_or((line, ""), |at| line.split_at(at));
        let code = sampled(code, language, rows_from_bottom);
        let code = match language {
            Language::Wgsl => code,
            Language::Glsl | Language::Hlsl => words(&turned_round(&code, language), language),
        };
        code + comment + "\n"
    });
    lines.collect()
}

/// The line with its look-ups in textures, whose arguments are names.
fn sampled(line: &str, language: Language, rows_from_bottom: bool) -> String {
    for function in ["sample_2d", "sample_layer", "sample_cube"] {
        let Some((before, rest)) = line.split_once(&format!("{function}(")) else { continue };
        let Some((arguments, after)) = rest.split_once(')') else { continue };
        let place = if rows_from_bottom { "vec2f(place.x, 1.0 - place.y)" } else { "place" };
        let look_up = match (arguments.split(", ").collect::<Vec<_>>().as_slice(), language) {
            ([texture, _], Language::Wgsl) => {
                format!("textureSampleLevel({texture}, tap_sampler, {place}, 0.0)")
            }
            ([texture, _], Language::Glsl) => format!("textureLod({texture}, {place}, 0.0)"),
            ([texture, _], Language::Hlsl) => format!("{texture}.SampleLevel(tap_sampler, {place}, 0.0)"),
            ([texture, _, layer], Language::Wgsl) => {
                format!("textureSampleLevel({texture}, tap_sampler, {place}, {layer}, 0.0)")
            }
            ([texture, _, layer], Language::Glsl) => {
                format!("textureLod({texture}, vec3f({place}, {layer}), 0.0)")
            }
            ([texture, _, layer], Language::Hlsl) => {
                format!("{texture}.SampleLevel(tap_sampler, vec3f({place}, {layer}), 0.0)")
            }
            ([texture, c, layer, mip], Language::Wgsl) => {
                format!("textureSampleLevel({texture}, tap_sampler, {c}, i32({layer}), {mip})")
            }
            ([texture, c, layer, mip], Language::Glsl) => {
                format!("textureLod({texture}, vec4f({c}, {layer}), {mip})")
            }
            ([texture, c, layer, mip], Language::Hlsl) => {
                format!("{texture}.SampleLevel(tap_sampler, vec4f({c}, {layer}), {mip})")
            }
            _ => continue,
        };
        return format!("{before}{look_up}{after}");
    }
    line.to_owned()
}

/// The line with types before names.
fn turned_round(line: &str, language: Language) -> String {
    let indent = &line[..line.len() - line.trim_start().len()];
    let code = line.trim_start();
    let pair = |declaration: &str| {
        let (name, kind) = declaration.split_once(": ").unwrap_or((declaration, ""));
        format!("{kind} {name}")
    };
    if let Some(rest) = code.strip_prefix("fn ") {
        let parts = rest.split_once('(').and_then(|(name, rest)| {
            let (parameters, result) = rest.split_once(") -> ")?;
            Some((name, parameters, result))
        });
        if let Some((name, parameters, result)) = parts {
            let parameters = parameters.split(", ").map(pair).collect::<Vec<_>>().join(", ");
            let result = result.trim_end_matches(" {");
            return format!("{indent}{result} {name}({parameters}) {{");
        }
    }
    if let Some(rest) = code.strip_prefix("for (var ")
        && let Some((declaration, rest)) = rest.split_once(" = ")
    {
        return format!("{indent}for ({} = {rest}", pair(declaration));
    }
    let constant = if language == Language::Hlsl { "static const " } else { "const " };
    for (word, replacement) in [("let ", ""), ("var ", ""), ("const ", constant)] {
        if let Some(rest) = code.strip_prefix(word)
            && let Some((declaration, value)) = rest.split_once(" = ")
        {
            return format!("{indent}{replacement}{} = {value}", pair(declaration));
        }
    }
    line.to_owned()
}

/// The line with the language's own words.
fn words(line: &str, language: Language) -> String {
    let mut text = String::with_capacity(line.len());
    let mut rest = line;
    while let Some(start) = rest.find(|c: char| c.is_ascii_alphabetic() || c == '_') {
        let end = rest[start..].find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let end = end.map_or(rest.len(), |length| start + length);
        let word = &rest[start..end];
        let found = WORDS.iter().find(|(wgsl, ..)| *wgsl == word);
        text += &rest[..start];
        text += found.map_or(word, |(_, glsl, hlsl)| if language == Language::Hlsl { hlsl } else { glsl });
        rest = &rest[end..];
    }
    text + rest
}
